// The boxes of a page while a person changes them: what is shown, what was changed, and the steps back.

import { smallestAround } from "./block-shapes.js";

/** Smallest side of a box in pixels. */
const SMALLEST = 2;
/** Most steps that can be undone. */
const MAX_STEPS = 500;

/** Returns left, top, right and bottom of an outline. */
export function boundsOf(outline) {
  const [xs, ys] = [0, 1].map((axis) => outline.map((corner) => corner[axis]));
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** Returns the outline of a rectangle. */
function rectangle([left, top, right, bottom]) {
  return [[left, top], [right, top], [right, bottom], [left, bottom]];
}

function median(numbers) {
  return numbers.toSorted((a, b) => a - b)[Math.floor(numbers.length / 2)];
}

export class BoxEdits {
  /** Begins with the boxes of a page of `size` pixels. */
  constructor(boxes, size) {
    this.size = size;
    // The id of a box that was shown is its index.
    this.shown = boxes.map(({ name, text, outline }, id) => ({ id, name: name ?? "", text: text ?? "", outline }));
    this.nextId = boxes.length;
    this.list = this.shown;
    [this.past, this.future, this.lastKind] = [[], [], null];
  }

  find(id) {
    return this.list.find((box) => box.id === id);
  }

  /** Replaces the boxes. Changes of the same `kind`, one after another, are one step. */
  become(list, kind = null) {
    if (kind === null || kind !== this.lastKind) this.past = [...this.past.slice(1 - MAX_STEPS), this.list];
    [this.list, this.future, this.lastKind] = [list, [], kind];
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  step(from, to) {
    if (from.length === 0) return;
    to.push(this.list);
    this.list = from.pop();
    this.lastKind = null;
  }

  change(id, values, kind) {
    this.become(this.list.map((box) => (box.id === id ? { ...box, ...values } : box)), kind);
  }

  /** Gives a box other edges. It becomes a rectangle. */
  place(id, bounds, kind) {
    this.change(id, { outline: rectangle(bounds) }, kind);
  }

  /** Adds a box, and returns its id. */
  add(bounds) {
    const id = this.nextId++;
    this.become([...this.list, { id, name: "", text: "", outline: rectangle(bounds) }]);
    return id;
  }

  remove(id) {
    this.become(this.list.filter((box) => box.id !== id));
  }

  /** Returns the edges of a box after a move, within the page. */
  moved([left, top, right, bottom], [dx, dy]) {
    const within = (from, to, shift, side) => Math.min(side - 0.5 - to, Math.max(-0.5 - from, shift));
    const [x, y] = [within(left, right, dx, this.size[0]), within(top, bottom, dy, this.size[1])];
    return [left + x, top + y, right + x, bottom + y];
  }

  /** Returns the edges of a box after some of them (left, top, right, bottom: 0 or 1) have moved, within the page. */
  resized([left, top, right, bottom], [dx, dy], edges) {
    const at = (edge, shift, side) => Math.min(side - 0.5, Math.max(-0.5, edge + shift));
    const [x, y] = [(edge) => at(edge, dx, this.size[0]), (edge) => at(edge, dy, this.size[1])];
    return [
      edges[0] ? Math.min(x(left), right - SMALLEST) : left,
      edges[1] ? Math.min(y(top), bottom - SMALLEST) : top,
      edges[2] ? Math.max(x(right), left + SMALLEST) : right,
      edges[3] ? Math.max(y(bottom), top + SMALLEST) : bottom,
    ];
  }

  /** Returns the edges between two places, in whole pixels within the page; null if they are too near to each other. */
  between(a, b) {
    const edge = (at, side) => Math.min(side, Math.max(0, Math.round(at + 0.5))) - 0.5;
    const [xs, ys] = [0, 1].map((axis) => [a[axis], b[axis]].map((at) => edge(at, this.size[axis])));
    const bounds = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    return bounds[2] - bounds[0] < SMALLEST || bounds[3] - bounds[1] < SMALLEST ? null : bounds;
  }

  /** Returns the edges of a box of the usual size around a place. */
  usual([x, y]) {
    const all = this.list.map((box) => boundsOf(box.outline));
    const sides = [0, 1].map((axis) => {
      const usual = all.length > 0 ? median(all.map((one) => one[axis + 2] - one[axis])) : this.size[axis] / 20;
      return Math.min(this.size[axis], Math.max(SMALLEST, Math.round(usual)));
    });
    const corner = [x - sides[0] / 2, y - sides[1] / 2].map((at) => Math.round(at) - 0.5);
    return this.moved([...corner, corner[0] + sides[0], corner[1] + sides[1]], [0, 0]);
  }

  /** Returns the box at a place; the smallest one counts. */
  at(place) {
    const index = smallestAround(place, this.list.map((box) => boundsOf(box.outline)));
    return this.list[index] ?? null;
  }

  isChanged(box) {
    const before = this.shown[box.id];
    return !before || ["name", "text", "outline"].some((key) => box[key] !== before[key]);
  }

  /** Returns what the server stores: which of the shown boxes are gone, and the new or changed ones. */
  toJson() {
    const kept = new Set(this.list.map((box) => box.id));
    const removed = this.shown.map((box) => box.id).filter((id) => !kept.has(id));
    const edited = this.list.filter((box) => this.isChanged(box));
    const change = ({ id, name, text, outline }) => {
      const before = this.shown[id];
      return { was: before ? id : null, name, text, bounds: outline === before?.outline ? null : boundsOf(outline) };
    };
    return { removed, edited: edited.map(change) };
  }

  /** Returns how many boxes are gone, new or changed. */
  count() {
    const { removed, edited } = this.toJson();
    return removed.length + edited.length;
  }
}
