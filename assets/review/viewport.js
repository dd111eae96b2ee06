// The visible part of the image: zoom and pan, shared by everything the viewer draws.

const ZOOM_STEPS = [1, 2, 4];

export class Viewport {
  constructor() {
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.x = 0;
    this.y = 0;
  }

  /** Switches to the next zoom step, centred on a point of the image. */
  zoomAt(point, size) {
    this.zoom = ZOOM_STEPS[(ZOOM_STEPS.indexOf(this.zoom) + 1) % ZOOM_STEPS.length];
    this.x = point.x - size.width / 2;
    this.y = point.y - size.height / 2;
    this.clamp(size);
  }

  /** Pans by image pixels. */
  pan(dx, dy, size) {
    this.x -= dx;
    this.y -= dy;
    this.clamp(size);
  }

  /** Keeps the view inside the image. */
  clamp({ width, height }) {
    const limit = (side) => (side / 2) * (1 - 1 / this.zoom);
    this.x = Math.min(Math.max(this.x, -limit(width)), limit(width));
    this.y = Math.min(Math.max(this.y, -limit(height)), limit(height));
  }

  /** Returns how an image of a size is placed in a box of the screen. */
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

/** Converts a point of the screen to a point of the image. */
export function imagePoint(frame, { x, y }) {
  return { x: (x - frame.left) / frame.scale, y: (y - frame.top) / frame.scale };
}
