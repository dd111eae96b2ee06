// The page of a block: its layers, the boxes of its characters, and the 3D views of their pairs.

import { followPage, PageCamera } from "./block-camera.js";
import { blockText } from "./block-messages.js";
import { smallestAround, STROKE_PX, svg } from "./block-shapes.js";
import { refusalIn } from "./reply.js";
import { localNumber, preferredLanguage } from "./scan-messages.js";
import { element } from "./scan-panel.js";
import { mountScanViewer } from "./scan-viewer.js";

const LAYERS = { page: "KeyP", relief: "KeyR", overlay: "KeyO" };
const STATUSES = ["done", "low_confidence", "failed", "waiting"];
const OVERLAY_COLOURS = ["both", "stroke_only", "ink_only"];
/** The wait before a region is loaded, ms. */
const REGION_WAIT = 120;

const language = preferredLanguage();
const text = (key, values) => blockText(language, key, values);

/** Returns the words that describe a character, its pair and its result. */
function description(one) {
  const shown = (key, value) => (value === null ? [] : [text(key, { value: localNumber(value, 2) })]);
  return [
    one.character && one.character !== one.label ? `${one.label} ${one.character}` : one.label,
    text(one.status), ...shown("confidence", one.confidence), ...shown("iou", one.iou),
    ...shown("position", one.position_confidence), ...(one.reason ? [one.reason] : []),
  ].join(" · ");
}

class BlockPage {
  constructor(container, block) {
    this.block = block;
    this.layer = "page";
    this.dialog = document.getElementById("scan");
    this.overview = element("img", { class: "block-overview", alt: "", draggable: "false" });
    this.region = element("img", { class: "block-region", alt: "", draggable: "false", hidden: "" });
    this.boxes = this.makeBoxes();
    this.work = element("p", { class: "block-work", role: "status", hidden: "" });
    this.stage = element("div", { class: "block-stage" }, this.overview, this.region, this.boxes);
    this.canvas = element("div", { class: "block-canvas", tabindex: "0", role: "application", "aria-label": text("page_view") }, this.stage, this.work);
    this.tip = element("div", { class: "block-tip", role: "status", hidden: "" });
    for (const name of ["load", "error"]) this.overview.addEventListener(name, () => this.endWork(name === "error"));
    container.classList.add("block-view");
    container.replaceChildren(this.bar(), this.canvas, this.tip);
    for (const part of [this.stage, this.overview]) this.place(part, { x: 0, y: 0, width: block.page_size[0], height: block.page_size[1] });
    this.camera = new PageCamera(this.canvas, block.page_size, () => this.moved());
    followPage(this.camera, (x, y) => this.openAt(x, y));
    this.canvas.addEventListener("pointermove", (event) => this.showTip(event));
    this.canvas.addEventListener("pointerleave", () => (this.tip.hidden = true));
    document.addEventListener("keydown", (event) => this.press(event));
    this.dialog.addEventListener("close", () => this.unmount());
    new ResizeObserver(() => this.camera.resized()).observe(this.canvas);
    this.show("page");
    this.camera.reset();
  }

  /** Creates the controls and the legend. */
  bar() {
    this.buttons = Object.entries(LAYERS).map(([layer, key]) => {
      const button = element("button", { type: "button", "data-layer": layer, "aria-keyshortcuts": key.at(-1) }, text(layer));
      button.addEventListener("click", () => this.show(layer));
      return button;
    });
    this.switch = element("button", { type: "button", "aria-pressed": "true", "aria-keyshortcuts": "B" }, text("boxes"));
    this.switch.addEventListener("click", () => this.toggleBoxes());
    const zooms = [["closer", "+"], ["farther", "−"], ["whole", text("whole")]].map(([key, label]) => {
      const button = element("button", { type: "button", "aria-label": text(key), title: text(key) }, label);
      button.addEventListener("click", () => this.zoom(key));
      return button;
    });
    const layers = element("div", { class: "block-group", role: "group", "aria-label": text("layers") }, ...this.buttons);
    this.legend = element("div", { class: "block-legend" });
    const agreement = (100 * this.block.agreement).toFixed(0);
    const summary = text("characters", { n: this.block.characters.length, agreement });
    return element("header", { class: "block-bar" },
      element("h1", {}, this.block.block), layers, element("a", { href: "correct" }, text("correct")), element("a", { href: "boxes" }, text("edit_boxes")), this.switch, element("div", { class: "block-group" }, ...zooms),
      element("span", { class: "block-summary" }, summary), this.legend, element("span", { class: "block-keys" }, text("keys")));
  }

  /** Draws one box per character. Each is a button for keyboards and screen readers. */
  makeBoxes() {
    const [width, height] = this.block.page_size;
    const boxes = svg("svg", { class: "block-boxes", viewBox: `0 0 ${width} ${height}`, width, height });
    this.block.characters.forEach((one, index) => {
      const [left, top, right, bottom] = one.box;
      const box = svg("rect", {
        x: left, y: top, width: Math.max(1, right - left), height: Math.max(1, bottom - top), tabindex: "0", role: "button",
        class: `block-box block-${one.status}`, "data-index": index, "aria-label": description(one),
      });
      box.addEventListener("focus", () => box.matches(":focus-visible") && this.camera.centre((left + right) / 2, (top + bottom) / 2));
      boxes.append(box);
    });
    return boxes;
  }

  place(part, { x, y, width, height }) {
    for (const [name, value] of Object.entries({ left: x, top: y, width, height })) part.style.setProperty(name, `${value}px`);
  }

  /** Shows a layer of the page. */
  show(layer) {
    this.layer = layer;
    this.beginWork(layer);
    this.overview.src = `layer/${layer}`;
    this.overview.alt = text(layer);
    this.region.hidden = true;
    for (const button of this.buttons) button.setAttribute("aria-pressed", button.dataset.layer === layer);
    const entries = layer === "overlay" ? [...OVERLAY_COLOURS, ...STATUSES] : STATUSES;
    const occurs = (key) => !STATUSES.includes(key) || this.block.characters.some((one) => one.status === key);
    this.legend.replaceChildren(...entries.filter(occurs).map((key) => this.mark(key)));
    if (this.camera) this.moved();
  }

  /** Says that a layer is drawn, which takes seconds the first time. Until it has loaded, a browser shows the layer before it. */
  beginWork(layer) {
    if (this.overview.getAttribute("src") === `layer/${layer}`) return;
    this.overview.classList.add("block-loading");
    this.tell(text("drawing", { layer: text(layer).toLowerCase() }), true);
  }

  endWork(hasFailed) {
    this.overview.classList.remove("block-loading");
    this.tell(hasFailed ? text("no_layer") : "");
    // The images of the layers have different numbers of pixels, so this one may need a region.
    if (!hasFailed) this.moved();
    else this.tellReason(this.layer);
  }

  /** Says why a layer could not be drawn, unless another one was chosen meanwhile, or it is drawn again. */
  async tellReason(layer) {
    const response = await fetch(`layer/${layer}`).catch(() => null);
    if (!response || response.ok) return;
    const why = refusalIn(language, await response.text(), response.status);
    if (layer === this.layer && this.work.textContent === text("no_layer")) this.tell(text("no_layer_why", { why }));
  }

  /** Shows a line over the page; an empty one hides it. */
  tell(line, isBusy = false) {
    this.work.textContent = line;
    this.work.hidden = !line;
    this.work.classList.toggle("block-busy", isBusy);
  }

  /** Returns an entry of the legend: an outline for a status, a colour for the overlay. */
  mark(key) {
    const kind = STATUSES.includes(key) ? "block-outline" : "block-mark";
    return element("span", { class: `${kind} block-${key}` }, text(key));
  }

  toggleBoxes() {
    const isShown = this.boxes.classList.toggle("block-hidden");
    this.switch.setAttribute("aria-pressed", !isShown);
    this.tip.hidden = true;
  }

  zoom(key) {
    if (key === "whole") this.camera.reset();
    else if (key === "closer") this.camera.closer();
    else this.camera.away();
  }

  moved() {
    const { x, y, zoom } = this.camera;
    this.stage.style.transform = `translate(${x}px, ${y}px) scale(${zoom})`;
    this.stage.style.setProperty("--block-stroke", `${STROKE_PX / zoom}px`);
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.loadRegion(), REGION_WAIT);
  }

  /** Says that nothing more is needed now, so that the program reads the files of the other layers. A region says it, too. */
  prepareLayers() {
    if (this.hasPrepared) return;
    this.hasPrepared = true;
    fetch("layers").catch(() => null);
  }

  /** Loads the visible part with the pixels of the page if the image of the whole layer has fewer. */
  async loadRegion() {
    const { complete, naturalWidth } = this.overview;
    // Only then its number of pixels is known. It is looked at again when the image has loaded.
    if (!complete) return;
    const [layer, sharp] = [this.layer, naturalWidth / this.block.page_size[0]];
    if (naturalWidth > 0 && (sharp > 0.99 || this.camera.zoom * devicePixelRatio < 1.05 * sharp)) {
      this.region.hidden = true;
      if (naturalWidth > 0) this.prepareLayers();
      return;
    }
    const part = this.camera.visible();
    const path = `region/${layer}/${part.x}/${part.y}/${part.width}/${part.height}`;
    if (this.region.getAttribute("src") === path && !this.region.hidden) return;
    this.requested = path;
    const loaded = new Image();
    loaded.src = path;
    try {
      await loaded.decode();
    } catch {
      return;
    }
    // The user may have moved on, or changed the layer.
    if (layer !== this.layer || this.requested !== path) return;
    this.region.src = path;
    this.place(this.region, part);
    this.region.hidden = false;
  }

  /** Returns the index of the character at a point of the screen; the smallest box counts. */
  characterAt(clientX, clientY) {
    if (this.boxes.classList.contains("block-hidden")) return -1;
    const { left, top } = this.canvas.getBoundingClientRect();
    const place = [(clientX - left - this.camera.x) / this.camera.zoom, (clientY - top - this.camera.y) / this.camera.zoom];
    return smallestAround(place, this.block.characters.map(({ box }) => box));
  }

  showTip({ clientX, clientY, buttons }) {
    const index = buttons ? -1 : this.characterAt(clientX, clientY);
    this.canvas.classList.toggle("block-pointed", index >= 0);
    this.tip.hidden = index < 0;
    if (index < 0) return;
    this.tip.textContent = description(this.block.characters[index]);
    this.tip.style.left = `${Math.max(4, Math.min(clientX + 14, innerWidth - this.tip.offsetWidth - 8))}px`;
    this.tip.style.top = `${Math.max(4, Math.min(clientY + 16, innerHeight - this.tip.offsetHeight - 8))}px`;
  }

  openAt(clientX, clientY) {
    const index = this.characterAt(clientX, clientY);
    if (index >= 0) this.open(index);
    else this.canvas.focus({ preventScroll: true });
  }

  /** Opens the 3D view of a character's pair, or its part of each layer if the pair has no result. */
  async open(index) {
    const one = this.block.characters[index];
    const container = element("div", { class: "scan-frame" }, text("loading"));
    const close = element("button", { type: "button" }, text("close"));
    close.addEventListener("click", () => this.dialog.close());
    const line = element("p", { class: "block-line" }, description(one));
    this.tip.hidden = true;
    this.dialog.replaceChildren(element("div", { class: "block-head" }, line, close), container);
    this.dialog.showModal();
    if (!one.has_scan) return this.showParts(container, one, text("no_result"));
    try {
      const response = await fetch(`scan/${index}`);
      if (!response.ok) throw new Error(refusalIn(language, await response.text(), response.status));
      const data = await response.arrayBuffer();
      // The dialog may have been closed while the data arrived.
      if (!container.isConnected) return;
      // The dialog has its own button, and closes on Escape.
      const mounted = await mountScanViewer(container, data, { language });
      if (container.isConnected) this.mounted = mounted;
      else mounted.unmount();
    } catch (error) {
      if (container.isConnected) this.showParts(container, one, error.message);
    }
  }

  showParts(container, { box }, why) {
    const margin = 0.3 * Math.max(box[2] - box[0], box[3] - box[1]);
    const [x, y] = [box[0], box[1]].map((at) => Math.max(0, Math.floor(at - margin)));
    const [width, height] = [Math.ceil(box[2] + margin) - x, Math.ceil(box[3] + margin) - y];
    const figures = Object.keys(LAYERS).map((layer) => element("figure", {},
      element("img", { src: `region/${layer}/${x}/${y}/${width}/${height}`, alt: text(layer) }), element("figcaption", {}, text(layer))));
    container.replaceChildren(element("p", { class: "block-line", role: "alert" }, why), element("div", { class: "block-parts" }, ...figures));
  }

  unmount() {
    this.mounted?.unmount();
    this.mounted = null;
    this.dialog.replaceChildren();
  }

  press(event) {
    if (this.dialog.open || event.ctrlKey || event.metaKey || event.altKey) return;
    const layer = Object.keys(LAYERS).find((name) => LAYERS[name] === event.code);
    const box = event.target.dataset?.index;
    if (layer) this.show(layer);
    else if (event.code === "KeyB") this.toggleBoxes();
    else if (box !== undefined && ["Enter", "Space"].includes(event.code)) this.open(Number(box));
    else if (!this.camera.press(event)) return;
    event.preventDefault();
  }
}

document.documentElement.lang = language;
const container = document.getElementById("block-view");
try {
  const response = await fetch("block.json");
  if (!response.ok) throw new Error(refusalIn(language, await response.text(), response.status));
  window.mocbanBlock = new BlockPage(container, await response.json());
} catch (error) {
  container.textContent = text("no_data", { why: error.message });
}
