// Zoom and position of a page in an element, moved by wheel, pointers and fingers.

/** Pixels per press of an arrow key, and zoom per press of + or -. */
const MOVE_PX = 80;
const ZOOM_STEP = 1.4;
const ARROWS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
/** Closest view, screen pixels per page pixel. */
const CLOSEST = 16;
/** Pointers that move less between down and up are clicks, in pixels. */
const CLICK_PX = 5;

export class PageCamera {
  /** Shows a page of `size` pixels in an element. Calls `changed` after each change. */
  constructor(element, size, changed) {
    this.element = element;
    this.size = size;
    this.changed = changed;
    [this.zoom, this.x, this.y, this.wholeZoom] = [1, 0, 0, 1];
  }

  /** Returns the zoom at which the whole page is visible. */
  farthest() {
    const { clientWidth, clientHeight } = this.element;
    return Math.min(clientWidth / this.size[0], clientHeight / this.size[1]) || 1;
  }

  /** Shows the whole page in the middle. */
  reset() {
    this.zoom = this.wholeZoom = this.farthest();
    this.centre(this.size[0] / 2, this.size[1] / 2);
  }

  closer() {
    this.zoomBy(ZOOM_STEP);
  }

  away() {
    this.zoomBy(1 / ZOOM_STEP);
  }

  /** Moves or zooms by a key. Returns whether the key does that. */
  press(event) {
    if (ARROWS[event.code]) this.move(...ARROWS[event.code].map((way) => MOVE_PX * way));
    else if (event.key === "+" || ["Equal", "NumpadAdd"].includes(event.code)) this.closer();
    else if (event.key === "-" || ["Minus", "NumpadSubtract"].includes(event.code)) this.away();
    else if (["Digit0", "Numpad0"].includes(event.code)) this.reset();
    else return false;
    return true;
  }

  /** Follows a change of the element's size: a whole page stays whole, a closer view stays where it is. */
  resized() {
    const isWhole = this.zoom <= this.wholeZoom * 1.001;
    this.wholeZoom = this.farthest();
    if (isWhole || this.zoom < this.wholeZoom) this.reset();
    else this.settle();
  }

  /** Moves a point of the page to the middle. */
  centre(x, y) {
    this.x = this.element.clientWidth / 2 - x * this.zoom;
    this.y = this.element.clientHeight / 2 - y * this.zoom;
    this.settle();
  }

  move(dx, dy) {
    this.x += dx;
    this.y += dy;
    this.settle();
  }

  /** Zooms by a factor; the point of the page at (x, y) of the element stays there. */
  zoomBy(factor, x = this.element.clientWidth / 2, y = this.element.clientHeight / 2) {
    const zoom = Math.min(CLOSEST, Math.max(this.farthest(), this.zoom * factor));
    const ratio = zoom / this.zoom;
    [this.zoom, this.x, this.y] = [zoom, x - (x - this.x) * ratio, y - (y - this.y) * ratio];
    this.settle();
  }

  /** Keeps a part of the page visible: it fills the element, or is centred in it. */
  settle() {
    const { clientWidth, clientHeight } = this.element;
    const kept = (at, length, space) => (length <= space ? (space - length) / 2 : Math.min(0, Math.max(space - length, at)));
    this.x = kept(this.x, this.size[0] * this.zoom, clientWidth);
    this.y = kept(this.y, this.size[1] * this.zoom, clientHeight);
    this.changed();
  }

  /** Returns the visible part of the page with a margin, in whole pixels: x, y, width, height. */
  visible(margin = 0.15) {
    const { clientWidth, clientHeight } = this.element;
    const span = (at, space, count) => {
      const from = Math.max(0, Math.floor((-at - margin * space) / this.zoom));
      const to = Math.min(count, Math.ceil((space * (1 + margin) - at) / this.zoom));
      return [from, Math.max(1, to - from)];
    };
    const [x, width] = span(this.x, clientWidth, this.size[0]);
    const [y, height] = span(this.y, clientHeight, this.size[1]);
    return { x, y, width, height };
  }
}

/** Lets wheel, mouse and fingers move a camera. Calls `clicked` with screen coordinates. */
export function followPage(camera, clicked) {
  const { element } = camera;
  const pointers = new Map();
  let travelled = 0;
  const inside = (x, y) => {
    const { left, top } = element.getBoundingClientRect();
    return [x - left, y - top];
  };
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    camera.zoomBy(Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0018)), ...inside(event.clientX, event.clientY));
  }, { passive: false });
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    if (pointers.size === 0) travelled = 0;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    travelled += Math.hypot(dx, dy);
    if (!other) return camera.move(dx, dy);
    // Two fingers: each moves the middle between them by half of its own way.
    const distance = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
    camera.move(dx / 2, dy / 2);
    camera.zoomBy(distance(now) / distance(before), ...inside((now[0] + other[0]) / 2, (now[1] + other[1]) / 2));
  });
  const ended = (event) => {
    const isLast = pointers.delete(event.pointerId) && pointers.size === 0;
    if (pointers.size > 0) travelled = Infinity;
    if (isLast && event.type === "pointerup" && travelled < CLICK_PX) clicked(event.clientX, event.clientY);
  };
  element.addEventListener("pointerup", ended);
  element.addEventListener("pointercancel", ended);
  // The click of a tap comes after the lifted finger, and would fall on what `clicked` has put there. Buttons on the page
  // need theirs.
  element.addEventListener("touchend", (event) => event.target.closest("button") || event.preventDefault(), { passive: false });
}
