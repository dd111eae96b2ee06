// The correction of a block's alignment: the relief and the page beside each other, on which the same places are chosen.

import { followPage, PageCamera } from "./block-camera.js";
import { blockText } from "./block-messages.js";
import { request, send } from "./block-request.js";
import { preferredLanguage } from "./scan-messages.js";
import { element } from "./scan-panel.js";

const language = preferredLanguage();
const text = (key, values) => blockText(language, key, values);

/** A picture that can be moved and zoomed, with numbered marks. */
class MarkedPicture {
  /** Calls `chosen` with a pixel of the picture, and `removed` with the index of a mark. */
  constructor(title, chosen, removed) {
    this.marks = [];
    [this.turns, this.original] = [0, [1, 1]];
    this.removed = removed;
    this.image = element("img", { class: "block-overview", alt: title, draggable: "false" });
    this.image.addEventListener("load", () => this.image.classList.remove("block-loading"));
    this.stage = element("div", { class: "block-stage" }, this.image);
    this.cross = element("div", { class: "block-cross", "aria-hidden": "true" });
    this.canvas = element("div", { class: "block-canvas", tabindex: "0", role: "application", "aria-label": title }, this.stage, this.cross);
    this.root = element("section", { class: "block-side" }, element("h2", {}, title), this.canvas);
    this.camera = new PageCamera(this.canvas, [1, 1], () => this.moved());
    followPage(this.camera, (x, y) => {
      const { left, top } = this.canvas.getBoundingClientRect();
      this.canvas.focus({ preventScroll: true });
      this.choose(x - left, y - top, chosen);
    });
    this.canvas.addEventListener("keydown", (event) => this.press(event, chosen));
    new ResizeObserver(() => this.camera.resized()).observe(this.canvas);
  }

  /**
   * Shows a picture of a page of `size` pixels, turned by `turns` quarter turns (clockwise); the picture itself may have
   * fewer pixels. Keeps the position if `keeps`.
   */
  show(src, original, { keeps = false, turns = 0 } = {}) {
    const size = turns % 2 ? original.toReversed() : original;
    [this.turns, this.original] = [turns, original];
    // Until it has loaded, a browser shows the picture before it.
    if (this.image.getAttribute("src") !== src) this.image.classList.add("block-loading");
    this.image.src = src;
    this.camera.size = size;
    for (const part of [this.stage, this.image]) {
      part.style.width = `${size[0]}px`;
      part.style.height = `${size[1]}px`;
    }
    if (keeps) this.camera.settle();
    else this.camera.reset();
  }

  /** Returns where a pixel lies in the turned picture. */
  shown([x, y]) {
    const [width, height] = this.original.map((side) => side - 1);
    return [[x, y], [height - y, x], [width - x, height - y], [y, width - x]][this.turns];
  }

  /** Returns the pixel that lies at a place in the turned picture. */
  originalPlace([x, y]) {
    const [width, height] = this.original.map((side) => side - 1);
    return [[x, y], [y, height - x], [width - x, height - y], [width - y, x]][this.turns];
  }

  /** Replaces the marks: pixels of the picture, or null for a place that is not chosen yet. */
  mark(places) {
    const hadFocus = this.marks.some(({ button }) => button === document.activeElement);
    for (const { button } of this.marks) button.remove();
    this.marks = places.flatMap((place, index) => {
      if (!place) return [];
      const label = text("remove_point", { n: index + 1 });
      const button = element("button", { type: "button", class: "block-point", "aria-label": label, title: label }, `${index + 1}`);
      let isPressed = false;
      // The click of the tap that chose the place falls on the mark, too. A key clicks without a pointer.
      button.addEventListener("click", (event) => (isPressed || event.detail === 0) && this.removed(index));
      button.addEventListener("pointerdown", (event) => {
        isPressed = true;
        // The canvas would capture the pointer.
        event.stopPropagation();
      });
      this.canvas.append(button);
      return [{ button, place }];
    });
    if (hadFocus) this.canvas.focus({ preventScroll: true });
    this.moved();
  }

  moved() {
    const { x, y, zoom } = this.camera;
    this.stage.style.transform = `translate(${x}px, ${y}px) scale(${zoom})`;
    for (const { button, place } of this.marks) {
      const [across, down] = this.shown(place);
      button.style.left = `${x + (across + 0.5) * zoom}px`;
      button.style.top = `${y + (down + 0.5) * zoom}px`;
    }
  }

  /** Chooses the pixel at a point of the element, if there is one. */
  choose(left, top, chosen) {
    const { x, y, zoom, size } = this.camera;
    const place = [(left - x) / zoom - 0.5, (top - y) / zoom - 0.5];
    if (place.every((at, k) => at >= -0.5 && at < size[k] - 0.5)) chosen(this.originalPlace(place));
  }

  press(event, chosen) {
    if (event.target !== this.canvas || event.ctrlKey || event.metaKey || event.altKey) return;
    const { clientWidth, clientHeight } = this.canvas;
    if (event.key === "Enter") this.choose(clientWidth / 2, clientHeight / 2, chosen);
    else if (!this.camera.press(event)) return;
    event.preventDefault();
  }
}

class CorrectionPage {
  constructor(container, block) {
    this.block = block;
    this.side = block.side;
    this.turns = 0;
    this.points = block.points.map(({ face, page }) => ({ face, page }));
    this.face = new MarkedPicture(text("relief"), (place) => this.choose("face", place), (index) => this.removeAt(index));
    this.page = new MarkedPicture(text("page"), (place) => this.choose("page", place), (index) => this.removeAt(index));
    this.status = element("p", { class: "block-status", role: "status" });
    const pictures = element("div", { class: "block-sides" }, this.face.root, this.page.root);
    container.classList.add("block-view");
    container.replaceChildren(this.bar(), pictures);
    document.addEventListener("keydown", (event) => this.press(event));
    this.showSide(this.side);
    this.showPage("page");
    this.update();
    const hint = block.points.length ? "correct_saved_points" : block.is_saved ? "correct_other_files" : "correct_how";
    // The search has refused the page; points that are saved count in the next run.
    const isRefused = block.failure && block.points.length === 0;
    this.tell(isRefused ? `${block.failure}. ${text(hint)}` : text(hint), Boolean(isRefused));
  }

  bar() {
    const button = (key, work) => {
      const made = element("button", { type: "button" }, text(key));
      made.addEventListener("click", work);
      return made;
    };
    this.sides = this.block.sides.map(({ side }) => {
      const made = button(side, () => this.chooseSide(side));
      made.dataset.side = side;
      return made;
    });
    this.layers = ["page", "overlay"].map((layer) => {
      const made = button(layer, () => this.showPage(layer));
      made.dataset.layer = layer;
      return made;
    });
    this.turnButton = button("turn_relief", () => this.turn());
    this.turnButton.setAttribute("aria-keyshortcuts", "T");
    this.tryButton = button("try_points", () => this.run(() => this.try()));
    this.saveButton = button("save_points", () => this.run(() => this.save()));
    this.clearButton = button("clear_points", () => this.clear());
    this.removeButton = button("remove_saved", () => this.run(() => this.removeSaved()));
    const group = (key, buttons) => element("div", { class: "block-group", role: "group", "aria-label": text(key) }, ...buttons);
    const back = element("a", { href: "./" }, text("back_to_page"));
    return element("header", { class: "block-bar" },
      element("h1", {}, this.block.block), ...(this.block.is_aligned ? [back] : []),
      ...(this.sides.length > 1 ? [group("side", this.sides)] : []), this.turnButton, group("layers", this.layers),
      this.tryButton, this.saveButton, this.clearButton, this.removeButton, this.status,
      element("span", { class: "block-keys" }, text("correct_keys")));
  }

  tell(message, isProblem = false) {
    this.status.textContent = message;
    this.status.classList.toggle("block-problem", isProblem);
  }

  complete() {
    return this.points.filter((point) => point.face && point.page);
  }

  /** Adds a place to the point that has only the other one, or begins a new point. */
  choose(part, place) {
    const open = this.points.findIndex((point) => !point.face || !point.page);
    if (open < 0) this.points.push({ face: null, page: null });
    const index = open < 0 ? this.points.length - 1 : open;
    this.points[index][part] = place;
    this.changed();
    const other = this.points[index].face ? (this.points[index].page ? null : "page") : "face";
    const missing = this.block.min_points - this.complete().length;
    if (other) this.tell(text(other === "page" ? "choose_on_page" : "choose_on_relief", { n: index + 1 }));
    else this.tell(missing > 0 ? text("choose_more", { n: missing }) : text("ready_to_try"));
  }

  removeAt(index) {
    this.points.splice(index, 1);
    this.changed();
    this.tell(text("points_chosen", { n: this.complete().length }));
  }

  clear() {
    this.points = [];
    this.changed();
    this.tell(text("correct_how"));
  }

  chooseSide(side) {
    if (side === this.side) return;
    this.points = [];
    this.changed();
    this.showSide(side);
    this.tell(text("correct_how"));
  }

  /** Forgets the alignment of other points. */
  changed() {
    this.isTried = false;
    if (this.layer === "overlay") this.showPage("page");
    this.update();
  }

  update() {
    this.status.classList.toggle("block-busy", this.isBusy === true);
    this.face.mark(this.points.map((point) => point.face));
    this.page.mark(this.points.map((point) => point.page));
    this.tryButton.disabled = this.isBusy || this.complete().length < this.block.min_points;
    this.saveButton.disabled = this.isBusy || !this.isTried;
    this.clearButton.disabled = this.isBusy || this.points.length === 0;
    this.removeButton.hidden = !this.block.is_saved;
    this.removeButton.disabled = this.isBusy;
    for (const button of this.layers) {
      button.setAttribute("aria-pressed", button.dataset.layer === this.layer);
      button.disabled = button.dataset.layer === "overlay" && !this.isTried;
    }
    for (const button of this.sides) button.setAttribute("aria-pressed", button.dataset.side === this.side);
  }

  showSide(side) {
    this.side = side;
    const { size } = this.block.sides.find((one) => one.side === side);
    this.face.show(`correct/face/${side}/${this.turns}`, size, { turns: this.turns });
    this.update();
  }

  turn() {
    this.turns = (this.turns + 1) % 4;
    this.showSide(this.side);
  }

  showPage(layer) {
    const isFirst = !this.layer;
    this.layer = layer;
    this.page.show(layer === "page" ? "correct/page" : `correct/overlay/${this.tried}`, this.block.page_size, { keeps: !isFirst });
    this.update();
  }

  /** Runs a request; meanwhile the buttons are disabled. */
  async run(work) {
    this.isBusy = true;
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

  async try() {
    this.isTried = false;
    const points = this.complete();
    this.tell(text("trying"));
    const { agreement, id } = await this.send("correct/try", { side: this.side, points });
    // Points may have changed meanwhile.
    if (JSON.stringify(points) !== JSON.stringify(this.complete())) return;
    [this.isTried, this.tried] = [true, id];
    this.showPage("overlay");
    this.tell(text("tried", { agreement: (100 * agreement).toFixed(0) }));
  }

  async save() {
    const { next, saved_hash: hash } = await this.send("correct/save", { id: this.tried, saved_hash: this.block.saved_hash });
    [this.block.is_saved, this.block.saved_hash] = [true, hash];
    this.tell(next ? text("saved", { command: next }) : text("saved_run"));
  }

  async removeSaved() {
    const { next } = await this.send("correct/remove", { saved_hash: this.block.saved_hash });
    [this.block.is_saved, this.block.saved_hash] = [false, null];
    this.points = [];
    this.changed();
    this.tell(next ? text("removed", { command: next }) : text("removed_run"));
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || this.isBusy) return;
    if (event.code === "KeyT") this.turn();
    else if (event.key === "Backspace" && this.points.length > 0) this.removeAt(this.points.length - 1);
    else return;
    event.preventDefault();
  }
}

document.documentElement.lang = language;
const container = document.getElementById("block-view");
try {
  window.mocbanCorrection = new CorrectionPage(container, await request(language, "correct/block.json"));
} catch (error) {
  container.textContent = text("no_data", { why: error.message });
}
