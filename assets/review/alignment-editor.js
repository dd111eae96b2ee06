// Manual alignment: move, rotate and scale the relief on the print, with live scores of the masks.

import { refusalOf, translate } from "./config.js";
import { alignmentImages } from "./image-cache.js";
import { bits, edges, overlap, warpMask, RELIEF } from "./masks.js";
import { localNumber } from "./scan-messages.js";
import { imagePoint } from "./viewport.js";

/** Composes two maps, n first. As in canvases, [a, b, c, d, e, f] maps (x, y) to (a x + c y + e, b x + d y + f). */
const after = (m, n) => [
  m[0] * n[0] + m[2] * n[1], m[1] * n[0] + m[3] * n[1],
  m[0] * n[2] + m[2] * n[3], m[1] * n[2] + m[3] * n[3],
  m[0] * n[4] + m[2] * n[5] + m[4], m[1] * n[4] + m[3] * n[5] + m[5],
];
/** Pixel centres have integer coordinates on the server and half-integer coordinates on a canvas. */
const PLUS_HALF = [1, 0, 0, 1, 0.5, 0.5];
const MINUS_HALF = [1, 0, 0, 1, -0.5, -0.5];

/** Converts a map of the server, two rows of three, to a map of a canvas. */
const toCanvas = ([[a, c, e], [b, d, f]]) => after(after(PLUS_HALF, [a, b, c, d, e, f]), MINUS_HALF);
/** Converts a map of a canvas to one between pixel centres with integer coordinates. */
const fromCanvas = (map) => after(after(MINUS_HALF, map), PLUS_HALF);

export class AlignmentEditor {
  /** Loads the additional images and opens the editor. `onChange` is called after each change. */
  static async open(item, layers, viewer, onChange) {
    const response = await fetch(`api/alignment/${item.id}`);
    if (!response.ok) throw new Error(await refusalOf(response));
    const [start, extra] = await Promise.all([response.json(), alignmentImages(item.id)]);
    return new AlignmentEditor(item, layers, viewer, onChange, start, extra);
  }

  constructor(item, layers, viewer, onChange, start, extra) {
    Object.assign(this, { item, layers, viewer, onChange, extra });
    this.start = toCanvas(start.view_from_depth);
    this.canvasFromView = toCanvas(start.canvas_from_view);
    this.strokes = bits(extra.mask);
    this.ink = bits(extra.ink);
    this.outline = edges(this.strokes, extra.mask.width, extra.mask.height, RELIEF);
    // Continue from the alignment that the reviewer saved before, if any.
    this.map = item.manual_alignment?.map ?? (start.previous ? toCanvas(start.previous) : this.start);
    /** Scores of the computed alignment. */
    this.startScores = this.scoresOf(this.start);
    this.addPointerListeners();
    this.update();
  }

  /** Centre of the relief in image pixels. */
  get centre() {
    const [a, b, c, d, e, f] = this.map;
    const [x, y] = [this.extra.mask.width / 2, this.extra.mask.height / 2];
    return [a * x + c * y + e, b * x + d * y + f];
  }

  apply(map) {
    this.map = after(map, this.map);
    this.update();
  }

  shift(dx, dy) {
    this.apply([1, 0, 0, 1, dx, dy]);
  }

  applyAbout([x, y], map) {
    this.apply(after(after([1, 0, 0, 1, x, y], map), [1, 0, 0, 1, -x, -y]));
  }

  rotate(degrees) {
    const angle = (degrees * Math.PI) / 180;
    const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
    this.applyAbout(this.centre, [cos, sin, -sin, cos, 0, 0]);
  }

  scale(by) {
    this.applyAbout(this.centre, [by, 0, 0, by, 0, 0]);
  }

  /** Mirrors the relief in its own frame, so that its rotation stays the same. */
  mirror() {
    this.map = after(this.map, this.mirrorMap);
    this.update();
  }

  get mirrorMap() {
    return [-1, 0, 0, 1, this.extra.mask.width, 0];
  }

  reset() {
    this.map = this.start;
    this.update();
  }

  /** Handles a key; returns whether the editor uses it. */
  handleKey(action, event) {
    const arrows = { ArrowLeft: "move_left", ArrowRight: "move_right", ArrowUp: "move_up", ArrowDown: "move_down" };
    return this.step(arrows[event.code] ?? action, event.shiftKey);
  }

  /** Changes the alignment by one step, a small one if `fine`. Returns whether there is such a step. */
  step(action, fine) {
    const step = fine ? 0.25 : 2;
    const actions = {
      move_left: () => this.shift(-step, 0),
      move_right: () => this.shift(step, 0),
      move_up: () => this.shift(0, -step),
      move_down: () => this.shift(0, step),
      rotate_left: () => this.rotate(fine ? -0.1 : -1),
      rotate_right: () => this.rotate(fine ? 0.1 : 1),
      larger: () => this.scale(fine ? 1.002 : 1.01),
      smaller: () => this.scale(fine ? 1 / 1.002 : 1 / 1.01),
      mirror: () => this.mirror(),
      reset: () => this.reset(),
    };
    const handler = actions[action];
    handler?.();
    return Boolean(handler);
  }

  /** Drag moves, the wheel scales, Shift + wheel rotates. */
  addPointerListeners() {
    const { canvas } = this.viewer;
    this.listeners = new AbortController();
    const { signal } = this.listeners;
    const point = (event) => {
      const box = canvas.getBoundingClientRect();
      const ratio = canvas.width / box.width;
      const at = { x: (event.clientX - box.left) * ratio, y: (event.clientY - box.top) * ratio };
      return imagePoint(this.viewer.frames()[0], at);
    };
    // A second finger moves nothing.
    let held = null;
    const isHeld = (event) => held?.pointer === event.pointerId;
    canvas.addEventListener("pointerdown", (event) => {
      if (held && !isHeld(event)) return;
      held = { pointer: event.pointerId, last: point(event) };
      canvas.setPointerCapture(event.pointerId);
    }, { signal });
    canvas.addEventListener("pointermove", (event) => {
      if (!isHeld(event) || event.buttons !== 1) return;
      const now = point(event);
      this.shift(now.x - held.last.x, now.y - held.last.y);
      held.last = now;
    }, { signal });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => isHeld(event) && (held = null), { signal });
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const up = (event.deltaY || event.deltaX) < 0;
      if (event.shiftKey) this.rotate(up ? -0.25 : 0.25);
      else this.scale(up ? 1.005 : 1 / 1.005);
    }, { signal, passive: false });
  }

  close() {
    this.listeners.abort();
  }

  /** Computes the scores of a map as the server does. */
  scoresOf(viewFromDepth) {
    const { width, height } = this.extra.mask;
    const map = fromCanvas(after(this.canvasFromView, viewFromDepth));
    return overlap(this.ink, warpMask(this.strokes, width, height, map, this.extra.ink));
  }

  /** Updates the scores, and redraws. */
  update() {
    this.scores = this.scoresOf(this.map);
    this.viewer.draw();
    this.onChange(this);
  }

  draw(context, layers) {
    context.drawImage(layers.print, 0, 0);
    context.save();
    context.transform(...this.map);
    if (this.viewer.flicker) context.drawImage(this.extra.relief, 0, 0);
    else context.drawImage(this.outline, 0, 0);
    context.restore();
  }

  /** Returns the request body; the map goes from depth-map pixels to image pixels, two rows of three. */
  body(event, note) {
    const [a, b, c, d, e, f] = fromCanvas(this.map);
    return { event, item: this.item.id, view_from_depth: [[a, c, e], [b, d, f]], note };
  }

  /** Rotation against the result, degrees. */
  get rotation() {
    const angle = ([a, b]) => (Math.atan2(b, a) * 180) / Math.PI;
    const sign = ([a, b, c, d]) => Math.sign(a * d - b * c);
    const map = sign(this.map) === sign(this.start) ? this.map : after(this.map, this.mirrorMap);
    return ((angle(map) - angle(this.start) + 540) % 360) - 180;
  }

  summary() {
    const { iou, dice } = this.scores;
    return [
      `${translate("iou")} ${localNumber(iou, 3)}`,
      `${translate("dice")} ${localNumber(dice, 3)}`,
      translate("rotated_by", { deg: localNumber(this.rotation, 2) }),
    ].join(" · ");
  }
}
