// The 3D view of a scan: canvas, controls and keys. `view`, the review page and exported pages show it.

import { localNumber, preferredLanguage, scanText } from "./scan-messages.js";
import { decodeScan } from "./scan-data.js";
import { followPointers } from "./scan-orbit.js";
import { ScanScene } from "./scan-scene.js";
import { element, initialSettings, ScanPanel } from "./scan-panel.js";

/** Degrees per press of an arrow key. */
const TURN_STEP = 5;
const SWITCH_KEYS = {
  KeyS: "showsStrokes", KeyO: "showsInkOutline", KeyT: "showsThreshold", KeyG: "showsPlane", KeyM: "asPrinted",
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Shows a scan in an element. `data` is an ArrayBuffer; `close`, if given, is called by Escape and a button. */
export async function mountScanViewer(container, data, { language = preferredLanguage(), close = null } = {}) {
  const text = (key, values) => scanText(language, key, values);
  try {
    const scan = await decodeScan(data);
    return new MountedScan(container, scan, text, close);
  } catch (error) {
    const why = document.createElement("canvas").getContext("webgl2") ? text("no_data", { why: error.message }) : text("no_webgl");
    const message = element("p", { class: "scan-message", role: "alert" }, why);
    const button = element("button", { type: "button" }, text("close"));
    button.addEventListener("click", () => close?.());
    container.replaceChildren(message, ...(close ? [button] : []));
    return { unmount: () => container.replaceChildren() };
  }
}

class MountedScan {
  constructor(container, scan, text, close) {
    this.container = container;
    this.scan = scan;
    /** Whether the scan has no plane, no heights and no print. */
    this.isAlone = scan.header.is_alone === true;
    this.text = text;
    this.close = close;
    this.frame = null;
    this.canvas = element("canvas", { tabindex: "0", role: "application", "aria-label": text("view"), "aria-describedby": "scan-keys" });
    this.scene = new ScanScene(this.canvas, scan);
    this.settings = initialSettings(scan.header);
    this.panel = new ScanPanel(scan.header, this.settings, text, () => this.draw());
    this.status = element("p", { class: "scan-status", role: "status" }, this.summary());
    container.classList.add("scan-viewer");
    container.replaceChildren(element("div", { class: "scan-canvas" }, this.canvas), this.side());
    followPointers(this.canvas, this.scene.orbit, () => this.draw(), (x, y) => this.showPicked(x, y));
    this.resizing = new ResizeObserver(() => this.drawNow());
    this.resizing.observe(this.canvas);
    this.onKey = (event) => this.press(event);
    document.addEventListener("keydown", this.onKey);
    this.canvas.focus({ preventScroll: true });
    this.drawNow();
    window.mocbanViewer = this.hook();
  }

  /** Returns title, controls and buttons. */
  side() {
    const { text } = this;
    const button = (key, action) => {
      const made = element("button", { type: "button", "data-scan-action": key }, text(key));
      made.addEventListener("click", action);
      return made;
    };
    const buttons = [button("reset", () => this.reset()), ...(this.close ? [button("close", () => this.close())] : [])];
    // Over a page, whose heading is the first, it is a part.
    const level = this.container.closest("dialog") ? "h2" : "h1";
    return element("div", { class: "scan-side" },
      element(level, { class: "scan-title" }, this.scan.header.pair ?? text("view")),
      ...(this.isAlone ? [element("p", { class: "scan-note" }, text("alone"))] : []),
      this.panel.root,
      element("div", { class: "scan-buttons" }, ...buttons),
      this.status,
      element("details", {}, element("summary", {}, text("keys")), element("p", { id: "scan-keys" }, text(this.isAlone ? "alone_key_list" : "key_list"))));
  }

  /** Returns the size of the scan as text. */
  summary() {
    const { triangles, vertices, source_elements: source, unit } = this.scan.header;
    const count = triangles || vertices;
    const shown = this.text(triangles ? "triangles" : "points", { n: count });
    const step = `${localNumber(this.scene.gridStep)} ${unit ?? ""}`.trim();
    const grid = this.isAlone ? [] : [this.text("grid_step", { step })];
    const from = count < source ? [this.text("simplified", { n: source })] : [];
    return [shown, ...from, ...grid].join(" · ");
  }

  /** Draws before the next frame of the screen, once for several changes. */
  draw() {
    this.frame ??= requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    if (this.frame !== null) cancelAnimationFrame(this.frame);
    this.frame = null;
    this.scene.apply(this.settings);
    this.scene.render();
  }

  reset() {
    this.scene.orbit.reset();
    this.panel.set(initialSettings(this.scan.header));
  }

  showPicked(x, y) {
    const found = this.isAlone ? null : this.scene.pick(x, y);
    if (!found) return;
    const height = this.panel.heightText(found.height);
    const [px, py] = found.pixel?.map(Math.round) ?? [];
    this.status.textContent = found.pixel ? this.text("picked", { height, x: px, y: py }) : this.text("picked_beside", { height });
  }

  /** Handles a key. Sliders keep their arrow keys, and keys of the browser are left alone. */
  press(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
    const isSlider = event.target.matches?.("input[type=range]");
    if (isSlider && event.code in ARROWS) return event.stopPropagation();
    const action = this.actionOf(event);
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
    this.draw();
  }

  /** Returns what a key does. */
  actionOf({ code, key, shiftKey }) {
    const { orbit } = this.scene;
    const { ink, exaggeration } = this.settings;
    if (code in ARROWS) {
      const [right, up] = ARROWS[code];
      return shiftKey ? () => orbit.move(right * 0.05, up * 0.05) : () => orbit.turn(right * TURN_STEP, up * TURN_STEP);
    }
    if (code in SWITCH_KEYS && !this.isAlone) {
      const name = SWITCH_KEYS[code];
      if (name === "asPrinted" && !this.scan.header.writing_is_mirrored) return null;
      return () => this.panel.set({ [name]: !this.settings[name] });
    }
    const relief = (by) => () => this.panel.set({ exaggeration: Math.min(5, Math.max(1, exaggeration + by)) });
    if (key === "+" || code === "Equal" || code === "NumpadAdd") return () => orbit.zoomBy(1.15);
    if (key === "-" || code === "Minus" || code === "NumpadSubtract") return () => orbit.zoomBy(1 / 1.15);
    if (code === "Digit0" || code === "Numpad0") return () => this.reset();
    if (key === "?") return () => this.container.querySelector("details").toggleAttribute("open");
    if (code === "Escape" && this.close) return () => this.close();
    if (this.isAlone) return null;
    if (code === "KeyW") return () => this.panel.set({ ink: ink < 0.5 ? 1 : 0 });
    if (code === "BracketLeft") return relief(-0.5);
    if (code === "BracketRight") return relief(0.5);
    return null;
  }

  /** Returns functions for tests and for the console of the browser. */
  hook() {
    const now = () => this.drawNow();
    return {
      header: this.scan.header,
      settings: this.settings,
      orbit: this.scene.orbit,
      set: (changes) => (this.panel.set(changes), now()),
      draw: now,
      project: (vertex) => this.scene.project(vertex),
      pick: (x, y) => this.scene.pick(x, y),
      pixel: (x, y) => this.scene.pixel(x, y),
      position: (vertex) => [...this.scan.positions.subarray(3 * vertex, 3 * vertex + 3)],
      height: (vertex) => this.scan.heights[vertex],
      textureCoordinate: (vertex) => [...this.scan.textureCoordinates.subarray(2 * vertex, 2 * vertex + 2)],
    };
  }

  /** Removes the view and frees its memory. */
  unmount() {
    document.removeEventListener("keydown", this.onKey);
    this.resizing.disconnect();
    if (this.frame !== null) cancelAnimationFrame(this.frame);
    this.scene.dispose();
    this.container.replaceChildren();
    delete window.mocbanViewer;
  }
}
