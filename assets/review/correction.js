// Laying the relief on the print by hand: turn, shift and scale, with the agreement of the masks as it goes.

import { say } from "./boot.js";
import { bits, edges, overlap, warped, RELIEF } from "./masks.js";
import { ownPictures } from "./pictures.js";
import { fixed } from "./screen.js";
import { under } from "./lens.js";

/** Maps as in canvases: [a, b, c, d, e, f] takes (x, y) to (a x + c y + e, b x + d y + f). */
const after = (m, n) => [
  m[0] * n[0] + m[2] * n[1], m[1] * n[0] + m[3] * n[1],
  m[0] * n[2] + m[2] * n[3], m[1] * n[2] + m[3] * n[3],
  m[0] * n[4] + m[2] * n[5] + m[4], m[1] * n[4] + m[3] * n[5] + m[5],
];
/** Pixel centres of our maps are whole numbers, those of a canvas lie half a pixel on. */
const HALF = [1, 0, 0, 1, 0.5, 0.5];
const BACK = [1, 0, 0, 1, -0.5, -0.5];

/** A map of ours, rows of three between pixel centres, as a canvas has it. */
const onCanvas = ([[a, c, e], [b, d, f]]) => after(after(HALF, [a, b, c, d, e, f]), BACK);
/** The way back. */
const ours = (map) => after(after(BACK, map), HALF);

export class Correction {
  static async begin(item, layers, stage, changed) {
    const answer = await fetch(`/api/correction/${item.id}`);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const [start, own] = await Promise.all([answer.json(), ownPictures(item.id)]);
    return new Correction(item, layers, stage, changed, start, own);
  }

  constructor(item, layers, stage, changed, start, own) {
    Object.assign(this, { item, layers, stage, changed, own });
    this.start = onCanvas(start.view_from_depth);
    this.canvas = onCanvas(start.canvas_from_view);
    this.strokes = bits(own.mask);
    this.ink = bits(own.ink);
    this.lines = edges(this.strokes, own.mask.width, own.mask.height, RELIEF);
    // Where the reviewer left it before, if ever.
    this.map = item.corrected?.map ?? (start.laid ? onCanvas(start.laid) : this.start);
    this.grab();
    this.moved();
  }

  /** The middle of the relief on the picture. */
  get centre() {
    const [a, b, c, d, e, f] = this.map;
    const [x, y] = [this.own.mask.width / 2, this.own.mask.height / 2];
    return [a * x + c * y + e, b * x + d * y + f];
  }

  apply(map) {
    this.map = after(map, this.map);
    this.moved();
  }

  shift(dx, dy) {
    this.apply([1, 0, 0, 1, dx, dy]);
  }

  about([x, y], map) {
    this.apply(after(after([1, 0, 0, 1, x, y], map), [1, 0, 0, 1, -x, -y]));
  }

  turn(degrees) {
    const angle = (degrees * Math.PI) / 180;
    const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
    this.about(this.centre, [cos, sin, -sin, cos, 0, 0]);
  }

  scale(by) {
    this.about(this.centre, [by, 0, 0, by, 0, 0]);
  }

  /** Left and right of the relief itself, so that it stays turned as it was. */
  mirror() {
    this.map = after(this.map, this.mirrored);
    this.moved();
  }

  get mirrored() {
    return [-1, 0, 0, 1, this.own.mask.width, 0];
  }

  reset() {
    this.map = this.start;
    this.moved();
  }

  /** Takes a key; says whether it was one of ours. */
  key(action, event) {
    const fine = event.shiftKey;
    const step = fine ? 0.25 : 2;
    const deeds = {
      ArrowLeft: () => this.shift(-step, 0),
      ArrowRight: () => this.shift(step, 0),
      ArrowUp: () => this.shift(0, -step),
      ArrowDown: () => this.shift(0, step),
    };
    const actions = {
      turn_left: () => this.turn(fine ? -0.1 : -1),
      turn_right: () => this.turn(fine ? 0.1 : 1),
      larger: () => this.scale(fine ? 1.002 : 1.01),
      smaller: () => this.scale(fine ? 1 / 1.002 : 1 / 1.01),
      mirror: () => this.mirror(),
      reset: () => this.reset(),
    };
    const deed = deeds[event.code] ?? actions[action];
    deed?.();
    return Boolean(deed);
  }

  /** Drag shifts, with the wheel it grows, with Shift and the wheel it turns. */
  grab() {
    const { canvas } = this.stage;
    this.let = new AbortController();
    const { signal } = this.let;
    const point = (event) => {
      const box = canvas.getBoundingClientRect();
      const dots = canvas.width / box.width;
      const at = { x: (event.clientX - box.left) * dots, y: (event.clientY - box.top) * dots };
      return under(this.stage.frames()[0], at);
    };
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      last = point(event);
      canvas.setPointerCapture(event.pointerId);
    }, { signal });
    canvas.addEventListener("pointermove", (event) => {
      if (!last || event.buttons !== 1) return;
      const now = point(event);
      this.shift(now.x - last.x, now.y - last.y);
      last = now;
    }, { signal });
    canvas.addEventListener("pointerup", () => (last = null), { signal });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const up = (event.deltaY || event.deltaX) < 0;
      if (event.shiftKey) this.turn(up ? -0.25 : 0.25);
      else this.scale(up ? 1.005 : 1 / 1.005);
    }, { signal, passive: false });
  }

  leave() {
    this.let.abort();
  }

  /** Counts the agreement as the scores of results are counted. */
  moved() {
    const { width, height } = this.own.mask;
    const laid = warped(this.strokes, width, height, ours(after(this.canvas, this.map)), this.own.ink);
    this.agreement = overlap(this.ink, laid);
    this.stage.draw();
    this.changed(this);
  }

  draw(brush, layers) {
    brush.drawImage(layers.print, 0, 0);
    brush.save();
    brush.transform(...this.map);
    if (this.stage.flicker) brush.drawImage(this.own.relief, 0, 0);
    else brush.drawImage(this.lines, 0, 0);
    brush.restore();
  }

  /** What is sent: pixels of the depth map to pixels of the pictures, rows of three. */
  body(event, note) {
    const [a, b, c, d, e, f] = ours(this.map);
    return { event, item: this.item.id, view_from_depth: [[a, c, e], [b, d, f]], note };
  }

  /** How far the relief is turned from where it was, degrees. */
  get turned() {
    const angle = ([a, b]) => (Math.atan2(b, a) * 180) / Math.PI;
    const sign = ([a, b, c, d]) => Math.sign(a * d - b * c);
    const map = sign(this.map) === sign(this.start) ? this.map : after(this.map, this.mirrored);
    return ((angle(map) - angle(this.start) + 540) % 360) - 180;
  }

  words() {
    const { iou, dice } = this.agreement;
    return [
      `${say("iou")} ${iou.toFixed(3)}`,
      `${say("dice")} ${dice.toFixed(3)}`,
      say("turned_by", { deg: fixed(this.turned, 2) }),
    ].join(" · ");
  }
}
