// Which part of a picture the stage shows: zoom and pan, shared by everything drawn on it.

const STEPS = [1, 2, 4];

export class Lens {
  constructor() {
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.x = 0;
    this.y = 0;
  }

  /** The next zoom, about a point of the picture. */
  step(point, size) {
    this.zoom = STEPS[(STEPS.indexOf(this.zoom) + 1) % STEPS.length];
    this.x = point.x - size.width / 2;
    this.y = point.y - size.height / 2;
    this.hold(size);
  }

  /** Moves the picture by pixels of the picture. */
  pan(dx, dy, size) {
    this.x -= dx;
    this.y -= dy;
    this.hold(size);
  }

  /** Keeps the picture under the lens. */
  hold({ width, height }) {
    const room = (side) => (side / 2) * (1 - 1 / this.zoom);
    this.x = Math.min(Math.max(this.x, -room(width)), room(width));
    this.y = Math.min(Math.max(this.y, -room(height)), room(height));
  }

  /** How a picture of a size lies in a box of the screen. */
  frame(size, box) {
    const fit = Math.min(box.width / size.width, box.height / size.height);
    const scale = fit * this.zoom;
    return {
      scale,
      left: box.left + box.width / 2 - scale * (size.width / 2 + this.x),
      top: box.top + box.height / 2 - scale * (size.height / 2 + this.y),
      box,
      fit: {
        left: box.left + (box.width - fit * size.width) / 2,
        top: box.top + (box.height - fit * size.height) / 2,
        width: fit * size.width,
        height: fit * size.height,
      },
    };
  }
}

/** The point of the picture under a point of the screen. */
export function under(frame, { x, y }) {
  return { x: (x - frame.left) / frame.scale, y: (y - frame.top) / frame.scale };
}
