// The boxes of a page, which a person moves, resizes, names, adds and deletes.

import { followPage, PageCamera } from "./block-camera.js";
import { request, send } from "./block-request.js";
import { STROKE_PX, svg } from "./block-shapes.js";
import { BoxEdits, boundsOf } from "./box-edits.js";
import { boxText } from "./box-messages.js";
import { preferredLanguage } from "./scan-messages.js";
import { element } from "./scan-panel.js";

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Which of left, top, right and bottom a corner moves. */
const CORNERS = [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1]];
/** The edges that the arrow keys move with Shift. */
const KEY_EDGES = [0, 0, 1, 1];
const LONG_STEP = 10;

const language = preferredLanguage();
const text = (key, values) => boxText(language, key, values);

class BoxesPage {
  constructor(container) {
    [this.block, this.selected, this.shapes, this.drag, this.start, this.isBusy] = [null, null, new Map(), null, null, false];
    this.edits = new BoxEdits([], [1, 1]);
    this.image = element("img", { class: "block-overview", alt: text("page"), draggable: "false" });
    this.layer = svg("svg", { class: "block-boxes" });
    this.stage = element("div", { class: "block-stage" }, this.image, this.layer);
    this.grip = element("div", { class: "box-grip", hidden: "" });
    this.grip.append(...CORNERS.map((edges, index) => this.dragged(element("div", { class: `box-corner box-corner-${index}` }), edges)));
    this.dragged(this.grip, null);
    this.ghost = element("div", { class: "box-ghost", hidden: "" });
    this.cover = element("div", { class: "box-cover", hidden: "" }, this.ghost);
    this.canvas = element("div", { class: "block-canvas", tabindex: "0", role: "application", "aria-label": text("boxes_view") }, this.stage, this.grip, this.cover);
    this.status = element("p", { class: "block-status", role: "status" });
    container.classList.add("block-view", "box-view");
    container.replaceChildren(this.bar(), this.canvas, this.dialog());
    this.camera = new PageCamera(this.canvas, [1, 1], () => this.moved());
    followPage(this.camera, (x, y) => this.chooseAt(x, y));
    this.drawNew();
    this.canvas.addEventListener("keydown", (event) => this.press(event));
    document.addEventListener("keydown", (event) => this.pressAnywhere(event));
    addEventListener("beforeunload", (event) => {
      if (this.edits.count() > 0) event.preventDefault();
    });
    new ResizeObserver(() => this.camera.resized()).observe(this.canvas);
  }

  /** Reads the boxes, and shows them. */
  async load() {
    const block = await request(language, "boxes/block.json");
    const isFirst = !this.block;
    this.block = block;
    this.edits = new BoxEdits(block.boxes, block.page_size);
    this.shapes.clear();
    this.layer.replaceChildren();
    this.selected = null;
    const [width, height] = block.page_size;
    for (const part of [this.stage, this.image, this.layer]) {
      part.style.width = `${width}px`;
      part.style.height = `${height}px`;
    }
    // The centre of the first pixel is (0, 0).
    this.layer.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    this.title.textContent = block.block;
    this.back.hidden = !block.is_aligned;
    this.camera.size = block.page_size;
    if (isFirst) {
      this.image.src = "boxes/page";
      this.camera.reset();
    }
    this.update();
    const hint = block.is_unread ? "unread" : block.boxes.length === 0 ? "no_boxes" : block.has_labels ? "how" : "found";
    const warnings = block[`warnings_${language}`] ?? block.warnings;
    this.tell([...warnings, text(hint)].join(" "), warnings.length > 0);
  }

  bar() {
    const button = (key, work, shown = text(key)) => {
      const made = element("button", { type: "button", "aria-label": text(key), title: text(key) }, shown);
      made.addEventListener("click", work);
      return made;
    };
    const group = (key, ...buttons) => element("div", { class: "block-group", role: "group", "aria-label": text(key) }, ...buttons);
    const field = (key) => {
      const input = element("input", { type: "text", autocomplete: "off", spellcheck: "false" });
      input.addEventListener("input", () => this.edit({ [key]: input.value.trim() }, `${key} ${this.selected}`));
      return [input, element("label", { class: "box-field" }, element("span", {}, text(key)), input)];
    };
    // The name of the block and the counts are known once the boxes are read.
    this.title = element("h1", {}, "…");
    this.back = element("a", { href: "./" }, text("back_to_page"));
    this.choices = [["previous", -1, "←"], ["next", 1, "→"]].map(([key, way, shown]) => button(key, () => this.chooseNext(way), shown));
    // A key that presses the button has no place on the page.
    this.addButton = button("add", (event) => (event.detail === 0 ? this.addUsual() : this.drawing(this.cover.hidden)));
    this.removeButton = button("remove", () => this.remove());
    this.undoButton = button("undo", () => this.undoOrRedo("undo"));
    this.redoButton = button("redo", () => this.undoOrRedo("redo"));
    this.stepButton = button("step", () => this.stepButton.setAttribute("aria-pressed", this.stepButton.getAttribute("aria-pressed") === "false"));
    this.stepButton.setAttribute("aria-pressed", "false");
    const zooms = [["closer", "closer", "+"], ["farther", "away", "−"], ["whole", "reset", text("whole")]];
    const zoom = ([key, work, shown]) => button(key, () => this.camera[work](), shown);
    this.saveButton = button("save", () => this.run(() => this.save()));
    this.earlierButton = button("use_earlier", () => this.question.showModal());
    [this.name, this.nameField] = field("name");
    [this.character, this.characterField] = field("text");
    this.counts = element("span", { class: "block-summary" }, text("loading"));
    return element("header", { class: "block-bar" },
      this.title, this.back, group("choose", ...this.choices), group("change", this.addButton, this.removeButton),
      group("steps", this.undoButton, this.redoButton), this.stepButton, group("view", ...zooms.map(zoom)),
      this.nameField, this.characterField, this.saveButton, this.earlierButton, this.counts, this.status,
      element("span", { class: "block-keys" }, text("keys")));
  }

  /** Creates the question whether the earlier labels are used. */
  dialog() {
    const button = (key, work) => {
      const made = element("button", { type: "button" }, text(key));
      made.addEventListener("click", work);
      return made;
    };
    this.question = element("dialog", { class: "box-question", "aria-label": text("use_earlier") });
    const use = () => {
      this.question.close();
      this.run(() => this.useEarlier());
    };
    this.question.append(element("p", {}, text("ask_earlier")),
      element("div", { class: "block-head" }, button("use_earlier", use), button("cancel", () => this.question.close())));
    return this.question;
  }

  tell(message, isProblem = false) {
    this.status.replaceChildren(message);
    this.status.classList.toggle("block-problem", isProblem);
  }

  /** Shows the boxes and the state of the controls. */
  update() {
    const box = this.box();
    if (!box) this.selected = null;
    for (const one of this.edits.list) this.drawBox(one);
    const ids = new Set(this.edits.list.map((one) => one.id));
    for (const [id, shape] of this.shapes) {
      if (ids.has(id)) continue;
      shape.node.remove();
      this.shapes.delete(id);
    }
    for (const [input, value] of [[this.name, box?.name], [this.character, box?.text]]) {
      input.disabled = !box || this.isBusy;
      if (input.value.trim() !== (value ?? "")) input.value = value ?? "";
    }
    const counts = this.block?.is_unread ? "counts_unread" : "counts";
    this.counts.textContent = text(counts, { n: this.edits.list.length, changed: this.edits.count() });
    for (const one of this.choices) one.disabled = this.edits.list.length === 0;
    this.removeButton.disabled = !box;
    this.undoButton.disabled = this.edits.past.length === 0;
    this.redoButton.disabled = this.edits.future.length === 0;
    this.addButton.setAttribute("aria-pressed", !this.cover.hidden);
    this.saveButton.disabled = this.earlierButton.disabled = this.isBusy;
    this.earlierButton.hidden = !this.block?.has_earlier;
    this.status.classList.toggle("block-busy", this.isBusy);
    this.moved();
  }

  drawBox(box) {
    let shape = this.shapes.get(box.id);
    if (!shape) {
      shape = { node: svg("polygon", {}), box: null };
      this.shapes.set(box.id, shape);
      this.layer.append(shape.node);
    }
    if (shape.box !== box) shape.node.setAttribute("points", box.outline.map((corner) => corner.join(",")).join(" "));
    shape.box = box;
    shape.node.setAttribute("class", this.edits.isChanged(box) ? "box-outline box-changed" : "box-outline");
  }

  moved() {
    const { x, y, zoom } = this.camera;
    this.stage.style.transform = `translate(${x}px, ${y}px) scale(${zoom})`;
    this.stage.style.setProperty("--block-stroke", `${STROKE_PX / zoom}px`);
    const box = this.box();
    this.grip.hidden = !box;
    if (box) this.frame(this.grip, this.drag?.now ?? boundsOf(box.outline));
  }

  /** Lays a part over edges of the page. */
  frame(part, [left, top, right, bottom]) {
    const { x, y, zoom } = this.camera;
    const sides = { left: x + (left + 0.5) * zoom, top: y + (top + 0.5) * zoom, width: (right - left) * zoom, height: (bottom - top) * zoom };
    for (const [name, value] of Object.entries(sides)) part.style.setProperty(name, `${value}px`);
  }

  /** Returns the place on the page at a point of the screen. */
  place({ clientX, clientY }) {
    const { left, top } = this.canvas.getBoundingClientRect();
    const { x, y, zoom } = this.camera;
    return [(clientX - left - x) / zoom - 0.5, (clientY - top - y) / zoom - 0.5];
  }

  box() {
    return this.edits.find(this.selected);
  }

  chooseAt(clientX, clientY) {
    this.canvas.focus({ preventScroll: true });
    this.choose(this.edits.at(this.place({ clientX, clientY }))?.id ?? null);
  }

  choose(id) {
    this.selected = id;
    this.edits.lastKind = null;
    this.update();
    this.describe();
  }

  describe() {
    const box = this.box();
    if (!box) return this.tell(text("how"));
    const [left, top, right, bottom] = boundsOf(box.outline);
    const name = [box.name || text("unnamed"), box.text].filter(Boolean).join(" ");
    this.tell(text("selected", { name, width: Math.round(right - left), height: Math.round(bottom - top) }));
  }

  /** Chooses the box after or before the chosen one, and shows it. */
  chooseNext(way) {
    const { list } = this.edits;
    if (list.length === 0) return;
    const index = list.findIndex((box) => box.id === this.selected);
    const next = index < 0 ? (way > 0 ? 0 : list.length - 1) : (index + way + list.length) % list.length;
    const [left, top, right, bottom] = boundsOf(list[next].outline);
    this.camera.centre((left + right) / 2, (top + bottom) / 2);
    this.choose(list[next].id);
  }

  edit(values, kind) {
    if (!this.box()) return;
    this.edits.change(this.selected, values, kind);
    this.update();
    this.describe();
  }

  remove() {
    const box = this.box();
    if (!box) return;
    const { list } = this.edits;
    const index = list.indexOf(box);
    const next = list[index + 1] ?? list[index - 1];
    this.edits.remove(box.id);
    this.choose(next?.id ?? null);
    this.canvas.focus({ preventScroll: true });
  }

  undoOrRedo(way) {
    this.edits[way]();
    this.update();
    this.describe();
  }

  addUsual() {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.addBox(this.edits.usual(this.place({ clientX: left + width / 2, clientY: top + height / 2 })));
  }

  addBox(bounds) {
    this.drawing(false);
    this.choose(this.edits.add(bounds));
    this.canvas.focus({ preventScroll: true });
  }

  /** Begins or ends the drawing of a new box. */
  drawing(isOn) {
    [this.cover.hidden, this.ghost.hidden, this.start] = [!isOn, true, null];
    this.update();
    if (isOn) this.tell(text("draw"));
  }

  /** Lets a pointer draw a new box on the cover of the page. */
  drawNew() {
    const { cover, ghost } = this;
    cover.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      if (event.button !== 0 || this.start) return;
      cover.setPointerCapture(event.pointerId);
      this.start = { pointer: event.pointerId, at: this.place(event) };
    });
    const isOwn = (event) => this.start?.pointer === event.pointerId;
    cover.addEventListener("pointermove", (event) => {
      if (!isOwn(event)) return;
      const bounds = this.edits.between(this.start.at, this.place(event));
      ghost.hidden = !bounds;
      if (bounds) this.frame(ghost, bounds);
    });
    cover.addEventListener("pointerup", (event) => {
      if (!isOwn(event)) return;
      const { at } = this.start;
      this.addBox(this.edits.between(at, this.place(event)) ?? this.edits.usual(at));
    });
    cover.addEventListener("pointercancel", (event) => isOwn(event) && this.drawing(true));
  }

  /** Lets a pointer on a part move the chosen box, or some of its edges. */
  dragged(part, edges) {
    part.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      if (event.button !== 0 || this.drag) return;
      part.setPointerCapture(event.pointerId);
      this.drag = { pointer: event.pointerId, from: [event.clientX, event.clientY], now: null };
    });
    const isOwn = (event) => this.drag?.pointer === event.pointerId;
    part.addEventListener("pointermove", (event) => {
      const box = this.box();
      if (!isOwn(event) || !box) return;
      event.stopPropagation();
      const shift = [event.clientX, event.clientY].map((at, axis) => Math.round((at - this.drag.from[axis]) / this.camera.zoom));
      const bounds = boundsOf(box.outline);
      if (!this.drag.now && shift.every((pixels) => pixels === 0)) return;
      this.drag.now = edges ? this.edits.resized(bounds, shift, edges) : this.edits.moved(bounds, shift);
      this.moved();
    });
    const ended = (event) => {
      if (!isOwn(event)) return;
      event.stopPropagation();
      const { now } = this.drag;
      this.drag = null;
      this.canvas.focus({ preventScroll: true });
      if (event.type === "pointerup" && now) this.edits.place(this.selected, now);
      if (event.type === "pointerup" && !now) return this.chooseAt(event.clientX, event.clientY);
      this.update();
      this.describe();
    };
    part.addEventListener("pointerup", ended);
    part.addEventListener("pointercancel", ended);
    return part;
  }

  /** Runs a request; meanwhile nothing is saved. */
  async run(work) {
    this.isBusy = true;
    this.tell(text("saving"));
    this.update();
    try {
      await work();
    } catch (error) {
      this.tell(error.message, true);
    }
    this.isBusy = false;
    this.update();
  }

  send(path, body) {
    return send(language, path, this.block.csrf_token, body);
  }

  async save() {
    const { list } = this.edits;
    const answer = await this.send("boxes/save", { shown: this.block.shown, edits: this.edits.toJson() });
    if (!answer.is_saved) return this.tell(text("nothing_changed"));
    // What was changed meanwhile stays until it is saved, too, or is given up.
    if (list !== this.edits.list) throw new Error(text("changed_meanwhile"));
    await this.showSaved(answer);
  }

  async useEarlier() {
    await this.showSaved(await this.send("boxes/earlier", { shown: this.block.shown }));
  }

  async showSaved({ next }) {
    await this.load();
    if (next) return this.tell(text("saved", { command: next }));
    const link = element("a", { href: "../../../" }, text("to_run"));
    this.tell("");
    this.status.append(text("saved_run"), " ", link);
  }

  /** Undoes and repeats changes. The fields have their own steps. */
  pressAnywhere(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.matches?.("input") || this.question.open) return;
    const isRedo = event.code === "KeyY" || (event.code === "KeyZ" && event.shiftKey);
    if (!isRedo && event.code !== "KeyZ") return;
    this.undoOrRedo(isRedo ? "redo" : "undo");
    event.preventDefault();
  }

  press(event) {
    if (event.target !== this.canvas || event.ctrlKey || event.metaKey) return;
    const [box, arrow] = [this.box(), ARROWS[event.code]];
    if (box && arrow) this.shift(box, arrow, event);
    else if (event.altKey) return;
    else if (["PageUp", "PageDown"].includes(event.code)) this.chooseNext(event.code === "PageUp" ? -1 : 1);
    else if (["Delete", "Backspace"].includes(event.code)) this.remove();
    else if (["KeyA", "Enter", "NumpadEnter"].includes(event.code)) this.addUsual();
    else if (event.code === "Escape") this.escape();
    else if (!this.camera.press(event)) return;
    event.preventDefault();
  }

  escape() {
    if (this.cover.hidden) this.choose(null);
    else this.drawing(false);
  }

  /** Moves the chosen box by an arrow key, or its right and lower edges. */
  shift(box, arrow, { shiftKey, altKey }) {
    const isLong = altKey || this.stepButton.getAttribute("aria-pressed") === "true";
    const way = arrow.map((pixels) => pixels * (isLong ? LONG_STEP : 1));
    const bounds = boundsOf(box.outline);
    const now = shiftKey ? this.edits.resized(bounds, way, KEY_EDGES) : this.edits.moved(bounds, way);
    this.edits.place(box.id, now, `${shiftKey ? "resize" : "move"} ${box.id}`);
    this.update();
    this.describe();
  }
}

document.documentElement.lang = language;
const container = document.getElementById("block-view");
try {
  const page = new BoxesPage(container);
  await page.load();
  window.mocbanBoxes = page;
} catch (error) {
  container.textContent = text("no_data", { why: error.message });
}
