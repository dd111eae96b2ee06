// The large image: display modes for print and relief, drawn from layers of the same size.

import { translate } from "./config.js";
import { INK, RELIEF } from "./masks.js";
import { imagePoint, Viewport } from "./viewport.js";

/** Time per image of the automatic flicker: 1 Hz, well below the limit of 3 Hz (WCAG 2.3.1). */
const FLICKER_MS = 500;
/** Radius of the reveal lens relative to the longer side of the image. */
const LENS_RADIUS = 0.16;
/** Squares of the checkerboard along the longer side. */
const CHECKS = [4, 6, 8, 12, 16];
const css = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

export class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.viewport = new Viewport();
    this.mode = "edges";
    this.opacity = 0.5;
    this.checkIndex = 2;
    this.layers = null;
    this.pointer = null;
    this.flicker = false;
    this.flickerTimer = null;
    this.overlays = { angle_guides: false, stroke_map: false };
    this.rotation = 0;
    /** The alignment editor draws instead of the display mode while it is open. */
    this.editor = null;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.addPointerListeners();
  }

  /** Shows another item. The mode is kept; rotation, overlays and zoom are reset. */
  show(layers) {
    this.layers = layers;
    this.rotation = 0;
    this.overlays = { angle_guides: false, stroke_map: false };
    this.viewport.reset();
    this.draw();
  }

  clear() {
    this.layers = null;
    this.draw();
  }

  resize() {
    const { width, height } = this.canvas.parentElement.getBoundingClientRect();
    const ratio = devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    this.draw();
  }

  addPointerListeners() {
    const position = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const ratio = this.canvas.width / box.width;
      return { x: (event.clientX - box.left) * ratio, y: (event.clientY - box.top) * ratio };
    };
    this.canvas.addEventListener("pointermove", (event) => {
      const previous = this.pointer;
      this.pointer = position(event);
      if (!this.layers || this.editor) return;
      if (event.buttons === 1 && previous && this.viewport.zoom > 1) {
        const { scale } = this.frames()[0];
        this.viewport.pan((this.pointer.x - previous.x) / scale, (this.pointer.y - previous.y) / scale, this.layers);
        this.draw();
      } else if (this.mode === "reveal") this.draw();
    });
    this.canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      if (this.mode === "reveal") this.draw();
    });
  }

  /** Returns the placement of the images: one, or two side by side that pan and zoom together. */
  frames() {
    const { width, height } = this.canvas;
    const box = (left, share) => ({ left, top: 0, width: width * share, height });
    if (this.mode === "two_up" && !this.editor) {
      const gap = Math.round(width / 80);
      const half = (width - gap) / 2 / width;
      return [box(0, half), box(width * half + gap, half)].map((box) => this.viewport.frame(this.layers, box));
    }
    return [this.viewport.frame(this.layers, box(0, 1))];
  }

  setMode(mode) {
    this.mode = mode;
    this.draw();
  }

  zoom() {
    const frame = this.frames()[0];
    const { width, height } = this.layers;
    const point = this.pointer ? imagePoint(frame, this.pointer) : { x: width / 2, y: height / 2 };
    this.viewport.zoomAt(point, this.layers);
    this.draw();
  }

  /** Starts or stops the automatic flicker; never starts it if the user prefers reduced motion. */
  toggleAutoFlicker() {
    if (this.flickerTimer || matchMedia("(prefers-reduced-motion: reduce)").matches) {
      clearInterval(this.flickerTimer);
      this.flickerTimer = null;
      this.flicker = false;
    } else {
      this.flickerTimer = setInterval(() => this.setFlicker(!this.flicker), FLICKER_MS);
    }
    this.draw();
    return this.flickerTimer !== null;
  }

  /** Shows the other image while `on`. */
  setFlicker(on) {
    if (this.flicker === on) return;
    this.flicker = on;
    this.draw();
  }

  toggle(overlay) {
    this.overlays[overlay] = !this.overlays[overlay];
    this.draw();
    return this.overlays[overlay];
  }

  /** Rotates the relief; limited to 45 degrees either way. */
  rotateBy(degrees) {
    this.rotation = Math.min(45, Math.max(-45, this.rotation + degrees));
    this.draw();
  }

  /** Changes the opacity of the onion skin or the number of squares. */
  adjust(by) {
    if (this.mode === "onion") this.opacity = Math.min(1, Math.max(0, this.opacity + 0.1 * by));
    else this.checkIndex = Math.min(CHECKS.length - 1, Math.max(0, this.checkIndex + by));
    this.draw();
  }

  draw() {
    const { context, canvas } = this;
    context.resetTransform();
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (!this.layers) return;
    const frames = this.frames();
    if (this.editor) {
      this.drawInFrame(frames[0], () => this.editor.draw(context, this.layers));
      return;
    }
    if (this.mode === "two_up") {
      const relief = this.flicker ? this.layers.print : this.layers.relief;
      [this.layers.print, relief].forEach((image, i) => this.drawInFrame(frames[i], () => this.drawLayer(image)));
    } else {
      this.drawInFrame(frames[0], () => (this.flicker ? this.drawLayer(this.layers.relief) : this[this.mode]()));
    }
    for (const frame of frames) this.drawInFrame(frame, () => this.drawOverlays());
  }

  /** Draws in image coordinates, clipped to the frame. */
  drawInFrame(frame, paint) {
    const { context } = this;
    context.save();
    context.beginPath();
    const { left, top, width, height } = this.viewport.zoom > 1 ? frame.box : frame.fit;
    context.rect(left, top, width, height);
    context.clip();
    context.setTransform(frame.scale, 0, 0, frame.scale, frame.left, frame.top);
    context.imageSmoothingEnabled = frame.scale < 3;
    paint();
    context.restore();
  }

  drawLayer(image, alpha = 1) {
    this.context.globalAlpha = alpha;
    this.context.drawImage(image, 0, 0);
    this.context.globalAlpha = 1;
  }

  /** Draws rotated about the centroid of the strokes. */
  rotated(degrees, paint) {
    const { context, layers } = this;
    context.save();
    context.translate(layers.centroid.x, layers.centroid.y);
    context.rotate((degrees * Math.PI) / 180);
    context.translate(-layers.centroid.x, -layers.centroid.y);
    paint();
    context.restore();
  }

  edges() {
    this.drawLayer(this.layers.print);
    this.rotated(this.rotation, () => this.drawLayer(this.layers.edges));
  }

  overlay() {
    this.drawLayer(this.layers.overlay);
  }

  onion() {
    this.drawLayer(this.layers.print);
    this.rotated(this.rotation, () => this.drawLayer(this.layers.relief, this.opacity));
  }

  checker() {
    const { context, layers } = this;
    this.drawLayer(layers.print);
    const side = Math.max(layers.width, layers.height) / CHECKS[this.checkIndex];
    context.save();
    context.beginPath();
    for (let y = 0; y * side < layers.height; y++) {
      for (let x = y % 2; x * side < layers.width; x += 2) context.rect(x * side, y * side, side, side);
    }
    context.clip();
    this.drawLayer(layers.relief);
    context.restore();
  }

  difference() {
    this.drawLayer(this.layers.difference);
  }

  reveal() {
    const { context, layers } = this;
    this.drawLayer(layers.print);
    const frame = this.frames()[0];
    const at = this.pointer ? imagePoint(frame, this.pointer) : layers.centroid;
    const radius = (LENS_RADIUS * Math.max(layers.width, layers.height)) / this.viewport.zoom;
    context.save();
    context.beginPath();
    context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
    context.clip();
    this.drawLayer(layers.relief);
    context.restore();
    context.strokeStyle = css(RELIEF);
    context.lineWidth = 2 / frame.scale;
    context.stroke();
  }

  /** Draws the overlays that work in every mode. */
  drawOverlays() {
    const { context, layers } = this;
    if (this.overlays.stroke_map) {
      context.fillStyle = "rgb(255 255 255 / 45%)";
      context.fillRect(0, 0, layers.width, layers.height);
      this.drawLayer(layers.strokeMap.map);
      if (layers.strokeMap.ring) this.drawRing(layers.strokeMap.ring);
    }
    if (this.overlays.angle_guides) this.drawAngleGuides();
    else if (this.rotation !== 0 && this.mode !== "edges") this.rotated(this.rotation, () => this.drawLayer(layers.edges));
  }

  drawRing({ x, y, radius }) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = css(INK);
    context.lineWidth = 3;
    context.setLineDash([8, 5]);
    context.stroke();
    context.setLineDash([]);
  }

  /** Draws the edges at -5, 0 and +5 degrees, and the sector between them. */
  drawAngleGuides() {
    const { context, layers } = this;
    this.rotated(this.rotation - 5, () => this.drawLayer(layers.guides[0], 0.75));
    this.rotated(this.rotation + 5, () => this.drawLayer(layers.guides[1], 0.75));
    this.rotated(this.rotation, () => this.drawLayer(layers.edges));
    const { x, y } = layers.centroid;
    const radius = Math.max(layers.width, layers.height) * 0.48;
    const at = ((this.rotation - 90) * Math.PI) / 180;
    const five = (5 * Math.PI) / 180;
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, radius, at - five, at + five);
    context.closePath();
    context.fillStyle = "rgb(0 82 155 / 14%)";
    context.fill();
  }

  /** Returns colours with their meaning; empty if the mode has none. */
  legend() {
    const entry = (colour, key) => [css(colour), translate(key)];
    if (this.overlays.stroke_map) return [entry(INK, "lost_strokes"), entry(RELIEF, "extra_strokes")];
    if (this.overlays.angle_guides) return [[css(INK), "−5°"], [css(RELIEF), "0°"], ["rgb(130 60 150)", "+5°"]];
    if (this.mode === "edges") return [entry(RELIEF, "outline")];
    if (this.mode === "overlay") return [entry(INK, "print_only"), entry(RELIEF, "depth_only"), entry([38, 38, 38], "both")];
    return [];
  }
}
