// The large picture: the ways to look at a print and a relief, drawn from layers of one size.

import { say } from "./boot.js";
import { INK, RELIEF } from "./masks.js";
import { Lens, under } from "./lens.js";

/** Flicker by itself shows each picture this long: 1 Hz, far below what may harm. */
const ROCK_MS = 500;
const LENS_SHARE = 0.16;
const CHECKS = [4, 6, 8, 12, 16];
const css = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.brush = canvas.getContext("2d");
    this.lens = new Lens();
    this.mode = "edges";
    this.share = 0.5;
    this.checks = 2;
    this.layers = null;
    this.mouse = null;
    this.flicker = false;
    this.rocking = null;
    this.overlays = { protractor: false, strokes: false };
    this.turn = 0;
    /** Draws in the place of all else, as a correction by hand does. */
    this.guest = null;
    new ResizeObserver(() => this.fit()).observe(canvas.parentElement);
    this.follow();
  }

  /** Another card: the way to look stays, what was done to the last one does not. */
  show(layers) {
    this.layers = layers;
    this.turn = 0;
    this.overlays = { protractor: false, strokes: false };
    this.lens.reset();
    this.draw();
  }

  clear() {
    this.layers = null;
    this.draw();
  }

  fit() {
    const { width, height } = this.canvas.parentElement.getBoundingClientRect();
    const dots = devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.round(width * dots));
    this.canvas.height = Math.max(1, Math.round(height * dots));
    this.draw();
  }

  follow() {
    const place = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const dots = this.canvas.width / box.width;
      return { x: (event.clientX - box.left) * dots, y: (event.clientY - box.top) * dots };
    };
    this.canvas.addEventListener("pointermove", (event) => {
      const before = this.mouse;
      this.mouse = place(event);
      if (!this.layers || this.guest) return;
      if (event.buttons === 1 && before && this.lens.zoom > 1) {
        const { scale } = this.frames()[0];
        this.lens.pan((this.mouse.x - before.x) / scale, (this.mouse.y - before.y) / scale, this.layers);
        this.draw();
      } else if (this.mode === "reveal") this.draw();
    });
    this.canvas.addEventListener("pointerleave", () => {
      this.mouse = null;
      if (this.mode === "reveal") this.draw();
    });
  }

  /** Where pictures lie: one, or two side by side that move together. */
  frames() {
    const { width, height } = this.canvas;
    const box = (left, share) => ({ left, top: 0, width: width * share, height });
    if (this.mode === "two_up" && !this.guest) {
      const gap = Math.round(width / 80);
      const half = (width - gap) / 2 / width;
      return [box(0, half), box(width * half + gap, half)].map((box) => this.lens.frame(this.layers, box));
    }
    return [this.lens.frame(this.layers, box(0, 1))];
  }

  setMode(mode) {
    this.mode = mode;
    this.draw();
  }

  zoom() {
    const frame = this.frames()[0];
    const { width, height } = this.layers;
    const point = this.mouse ? under(frame, this.mouse) : { x: width / 2, y: height / 2 };
    this.lens.step(point, this.layers);
    this.draw();
  }

  /** Flickers by itself until it is stopped; never where less motion is asked for. */
  rock() {
    if (this.rocking || matchMedia("(prefers-reduced-motion: reduce)").matches) {
      clearInterval(this.rocking);
      this.rocking = null;
      this.flicker = false;
    } else {
      this.rocking = setInterval(() => this.hold(!this.flicker), ROCK_MS);
    }
    this.draw();
    return this.rocking !== null;
  }

  hold(on) {
    if (this.flicker === on) return;
    this.flicker = on;
    this.draw();
  }

  toggle(overlay) {
    this.overlays[overlay] = !this.overlays[overlay];
    this.draw();
    return this.overlays[overlay];
  }

  turnBy(degrees) {
    this.turn = Math.min(45, Math.max(-45, this.turn + degrees));
    this.draw();
  }

  /** Less or more of what the way to look has. */
  adjust(by) {
    if (this.mode === "onion") this.share = Math.min(1, Math.max(0, this.share + 0.1 * by));
    else this.checks = Math.min(CHECKS.length - 1, Math.max(0, this.checks + by));
    this.draw();
  }

  draw() {
    const { brush, canvas } = this;
    brush.resetTransform();
    brush.clearRect(0, 0, canvas.width, canvas.height);
    if (!this.layers) return;
    const frames = this.frames();
    if (this.guest) {
      this.within(frames[0], () => this.guest.draw(brush, this.layers));
      return;
    }
    if (this.mode === "two_up") {
      const relief = this.flicker ? this.layers.print : this.layers.relief;
      [this.layers.print, relief].forEach((picture, i) => this.within(frames[i], () => this.lay(picture)));
    } else {
      this.within(frames[0], () => (this.flicker ? this.lay(this.layers.relief) : this[this.mode]()));
    }
    for (const frame of frames) this.within(frame, () => this.lines());
  }

  /** Draws in the picture's own pixels, cut to its frame. */
  within(frame, paint) {
    const { brush } = this;
    brush.save();
    brush.beginPath();
    const { left, top, width, height } = this.lens.zoom > 1 ? frame.box : frame.fit;
    brush.rect(left, top, width, height);
    brush.clip();
    brush.setTransform(frame.scale, 0, 0, frame.scale, frame.left, frame.top);
    brush.imageSmoothingEnabled = frame.scale < 3;
    paint();
    brush.restore();
  }

  lay(picture, alpha = 1) {
    this.brush.globalAlpha = alpha;
    this.brush.drawImage(picture, 0, 0);
    this.brush.globalAlpha = 1;
  }

  /** Draws turned about the middle of the strokes. */
  turned(degrees, paint) {
    const { brush, layers } = this;
    brush.save();
    brush.translate(layers.middle.x, layers.middle.y);
    brush.rotate((degrees * Math.PI) / 180);
    brush.translate(-layers.middle.x, -layers.middle.y);
    paint();
    brush.restore();
  }

  edges() {
    this.lay(this.layers.print);
    this.turned(this.turn, () => this.lay(this.layers.edges));
  }

  overlay() {
    this.lay(this.layers.overlay);
  }

  onion() {
    this.lay(this.layers.print);
    this.turned(this.turn, () => this.lay(this.layers.relief, this.share));
  }

  checker() {
    const { brush, layers } = this;
    this.lay(layers.print);
    const side = Math.max(layers.width, layers.height) / CHECKS[this.checks];
    brush.save();
    brush.beginPath();
    for (let y = 0; y * side < layers.height; y++) {
      for (let x = y % 2; x * side < layers.width; x += 2) brush.rect(x * side, y * side, side, side);
    }
    brush.clip();
    this.lay(layers.relief);
    brush.restore();
  }

  difference() {
    this.lay(this.layers.difference);
  }

  reveal() {
    const { brush, layers } = this;
    this.lay(layers.print);
    const frame = this.frames()[0];
    const at = this.mouse ? under(frame, this.mouse) : layers.middle;
    const radius = (LENS_SHARE * Math.max(layers.width, layers.height)) / this.lens.zoom;
    brush.save();
    brush.beginPath();
    brush.arc(at.x, at.y, radius, 0, 2 * Math.PI);
    brush.clip();
    this.lay(layers.relief);
    brush.restore();
    brush.strokeStyle = css(RELIEF);
    brush.lineWidth = 2 / frame.scale;
    brush.stroke();
  }

  /** What lies over every way to look. */
  lines() {
    const { brush, layers } = this;
    if (this.overlays.strokes) {
      brush.fillStyle = "rgb(255 255 255 / 45%)";
      brush.fillRect(0, 0, layers.width, layers.height);
      this.lay(layers.missing.map);
      if (layers.missing.ring) this.ring(layers.missing.ring);
    }
    if (this.overlays.protractor) this.protractor();
    else if (this.turn !== 0 && this.mode !== "edges") this.turned(this.turn, () => this.lay(layers.edges));
  }

  ring({ x, y, radius }) {
    const { brush } = this;
    brush.beginPath();
    brush.arc(x, y, radius, 0, 2 * Math.PI);
    brush.strokeStyle = css(INK);
    brush.lineWidth = 3;
    brush.setLineDash([8, 5]);
    brush.stroke();
    brush.setLineDash([]);
  }

  /** The edges also at -5 and +5 degrees, and the wedge between them. */
  protractor() {
    const { brush, layers } = this;
    this.turned(this.turn - 5, () => this.lay(layers.ghosts[0], 0.75));
    this.turned(this.turn + 5, () => this.lay(layers.ghosts[1], 0.75));
    this.turned(this.turn, () => this.lay(layers.edges));
    const { x, y } = layers.middle;
    const reach = Math.max(layers.width, layers.height) * 0.48;
    const at = ((this.turn - 90) * Math.PI) / 180;
    const five = (5 * Math.PI) / 180;
    brush.beginPath();
    brush.moveTo(x, y);
    brush.arc(x, y, reach, at - five, at + five);
    brush.closePath();
    brush.fillStyle = "rgb(0 82 155 / 14%)";
    brush.fill();
  }

  /** What the colours mean, in words; nothing where there are none. */
  legend() {
    const spot = (colour, key) => [css(colour), say(key)];
    if (this.overlays.strokes) return [spot(INK, "lost_strokes"), spot(RELIEF, "extra_strokes")];
    if (this.overlays.protractor) return [[css(INK), "−5°"], [css(RELIEF), "0°"], ["rgb(130 60 150)", "+5°"]];
    if (this.mode === "overlay") return [spot(INK, "print_only"), spot(RELIEF, "depth_only"), spot([38, 38, 38], "both")];
    return [];
  }
}
