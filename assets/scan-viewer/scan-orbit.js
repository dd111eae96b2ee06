// The camera around the scan, and how pointers move it.

const FIELD_OF_VIEW = 28;
const MAX_TILT = 89;
const DEGREES = Math.PI / 180;

/** Camera angles in degrees, shift in units of the scan, and zoom relative to a view that holds the whole scan. */
export class ScanOrbit {
  constructor({ low, high }) {
    const half = (k) => (high[k] - low[k]) / 2;
    this.halfSize = [half(0), half(1), half(2)];
    // The tops of strokes are near z = 0, at any exaggeration.
    this.centre = [low[0] + half(0), low[1] + half(1), Math.min(high[2], Math.max(low[2], 0))];
    this.isMirrored = false;
    this.reset();
  }

  reset() {
    this.azimuth = 0;
    this.tilt = 0;
    this.zoom = 1;
    this.shift = [0, 0];
  }

  turn(degreesRight, degreesUp) {
    this.azimuth = ((this.azimuth + degreesRight + 540) % 360) - 180;
    this.tilt = Math.min(MAX_TILT, Math.max(-MAX_TILT, this.tilt + degreesUp));
  }

  zoomBy(factor) {
    this.zoom = Math.min(60, Math.max(0.3, this.zoom * factor));
  }

  /** Moves the scan on the screen, by shares of the height of the canvas. */
  move(right, up) {
    const height = 2 * this.distance(1) * Math.tan((FIELD_OF_VIEW / 2) * DEGREES);
    this.shift[0] -= right * height;
    this.shift[1] -= up * height;
  }

  /** Returns the distance from the camera to the centre for a canvas of the given width per height. */
  distance(aspect) {
    const [x, y, z] = this.halfSize;
    const slope = Math.tan((FIELD_OF_VIEW / 2) * DEGREES);
    return (1.06 * Math.max(y / slope, x / (slope * aspect)) + z) / this.zoom;
  }

  /** Places a camera. */
  apply(camera, aspect) {
    const distance = this.distance(aspect);
    const [azimuth, tilt] = [this.azimuth * DEGREES, this.tilt * DEGREES];
    const right = [Math.cos(azimuth), 0, -Math.sin(azimuth)];
    const up = [-Math.sin(azimuth) * Math.sin(tilt), Math.cos(tilt), -Math.cos(azimuth) * Math.sin(tilt)];
    const back = [Math.sin(azimuth) * Math.cos(tilt), Math.sin(tilt), Math.cos(azimuth) * Math.cos(tilt)];
    const mirror = this.isMirrored ? [-1, 1, 1] : [1, 1, 1];
    const target = this.centre.map((c, k) => c * mirror[k] + right[k] * this.shift[0] + up[k] * this.shift[1]);
    camera.fov = FIELD_OF_VIEW;
    camera.aspect = aspect;
    camera.near = distance / 100;
    camera.far = distance + 20 * Math.hypot(...this.halfSize);
    camera.position.set(...target.map((c, k) => c + distance * back[k]));
    camera.lookAt(...target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }
}

/**
 * Lets pointers move the camera: one turns, two or the right button move and zoom, the wheel zooms. Calls `changed` after
 * each change, and `clicked(x, y)` for a press without movement.
 */
export function followPointers(canvas, orbit, changed, clicked) {
  const pointers = new Map();
  let travelled = 0;
  const centreAndSpread = () => {
    const all = [...pointers.values()];
    const x = all.reduce((sum, point) => sum + point.x, 0) / all.length;
    const y = all.reduce((sum, point) => sum + point.y, 0) / all.length;
    return { x, y, spread: all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0 };
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (pointers.size === 0) travelled = 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) return;
    const before = centreAndSpread();
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = centreAndSpread();
    const [dx, dy] = [after.x - before.x, after.y - before.y];
    travelled += Math.abs(dx) + Math.abs(dy);
    const height = canvas.clientHeight || 1;
    const moves = pointers.size > 1 || event.shiftKey || (event.buttons & 6) !== 0;
    if (moves) orbit.move(dx / height, -dy / height);
    else orbit.turn((-dx / height) * 180, (dy / height) * 180);
    if (before.spread > 0 && after.spread > 0) orbit.zoomBy(after.spread / before.spread);
    changed();
  });
  const end = (event) => {
    if (!pointers.delete(event.pointerId) || event.type === "pointercancel") return;
    const box = canvas.getBoundingClientRect();
    if (travelled < 4 && pointers.size === 0) clicked(event.clientX - box.left, event.clientY - box.top);
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    orbit.zoomBy(Math.exp(-Math.max(-100, Math.min(100, event.deltaY)) / 500));
    changed();
  }, { passive: false });
}
