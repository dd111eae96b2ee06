// The controls beside the scan: sliders, switches, and a disc that moves the light.

import { localNumber } from "./scan-messages.js";

/** Settings at the start. The light comes from the upper left. */
export function initialSettings({ threshold, writing_is_mirrored: isMirrored }) {
  return {
    ink: 0.7, lightDirection: 135, lightHeight: 30, shading: 1, exaggeration: 1, threshold,
    showsThreshold: false, showsStrokes: false, showsInkOutline: false, showsPlane: false, asPrinted: isMirrored,
  };
}

/** Creates an element with attributes and children. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

export class ScanPanel {
  /** Creates the controls of `settings`, which they change. Calls `changed` after each change. */
  constructor(header, settings, text, changed) {
    this.settings = settings;
    this.changed = changed;
    this.rows = [];
    this.root = element("div", { class: "scan-controls", role: "group", "aria-label": text("controls") });
    const unit = header.unit ?? "";
    const [low, high] = header.height_range;
    const fine = 10 ** Math.floor(Math.log10(Math.max(high - low, 1e-9) / 100));
    const digits = Math.max(0, Math.ceil(-Math.log10(fine)));
    this.heightText = (value) => `${localNumber(value, digits)} ${unit}`.trim();
    const isAlone = header.is_alone === true;
    if (!isAlone) this.slider("ink", text("colour"), 0, 1, 0.01, (value) => `${Math.round(100 * value)} %`);
    this.lightPad();
    this.slider("lightDirection", text("light_direction"), 0, 360, 5, (value) => `${value}°`);
    this.slider("lightHeight", text("light_height"), 2, 90, 1, (value) => `${value}°`);
    this.slider("shading", text("shading"), 0, 1, 0.05, (value) => `${Math.round(100 * value)} %`);
    if (!isAlone) this.resultControls(header, text, fine);
    this.refresh();
  }

  /** Adds the controls that need heights or a print. `fine` is a small difference of heights. */
  resultControls(header, text, fine) {
    const [low, high] = header.height_range;
    this.slider("exaggeration", text("exaggeration"), 1, 5, 0.25, (value) => `×${localNumber(value)}`);
    this.toggle("showsThreshold", text("threshold"), "T", "above");
    const ends = [Math.min(low, header.threshold), Math.max(high, header.threshold)];
    this.slider("threshold", text("threshold_height"), ...ends, fine, this.heightText);
    this.toggle("showsStrokes", text("strokes"), "S", "strokes");
    this.toggle("showsInkOutline", text("ink_outline"), "O", "ink");
    this.toggle("showsPlane", text("plane"), "G");
    if (header.writing_is_mirrored) this.toggle("asPrinted", text("as_printed"), "M");
  }

  /** Changes settings, updates the controls and draws. */
  set(changes) {
    Object.assign(this.settings, changes);
    this.refresh();
    this.changed();
  }

  refresh() {
    for (const row of this.rows) row();
  }

  slider(name, label, min, max, step, format) {
    const input = element("input", { type: "range", min, max, step: "any", "data-setting": name });
    const output = element("output");
    // A label belongs to its first control, and an output is one, so the slider comes first.
    const row = element("label", { class: "scan-slider" }, element("span", {}, label), input, output);
    input.step = step;
    input.addEventListener("input", () => this.set({ [name]: Number(input.value) }));
    this.rows.push(() => {
      const value = this.settings[name];
      if (Number(input.value) !== value) input.value = value;
      output.textContent = format(value);
      input.setAttribute("aria-valuetext", output.textContent);
    });
    this.root.append(row);
  }

  toggle(name, label, key, colour) {
    const input = element("input", { type: "checkbox", "data-setting": name, "aria-keyshortcuts": key });
    const text = element("span", colour ? { class: `scan-colour-${colour}` } : {}, label);
    input.addEventListener("change", () => this.set({ [name]: input.checked }));
    this.rows.push(() => (input.checked = this.settings[name]));
    this.root.append(element("label", { class: "scan-toggle" }, input, text, element("kbd", {}, key)));
  }

  /** Adds a disc: the light comes from the direction of the knob, lower the farther it is from the centre. */
  lightPad() {
    const knob = element("i");
    // The two sliders of the light do the same for keyboards and screen readers.
    const pad = element("div", { class: "scan-light", "aria-hidden": "true" }, knob);
    const follow = ({ clientX, clientY }) => {
      const { left, top, width, height } = pad.getBoundingClientRect();
      const [x, y] = [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
      const direction = (Math.round((Math.atan2(y, x) * 180) / Math.PI) + 360) % 360;
      this.set({ lightDirection: direction, lightHeight: Math.round(Math.max(2, 90 * (1 - Math.min(1, Math.hypot(x, y))))) });
    };
    pad.addEventListener("pointerdown", (event) => {
      pad.setPointerCapture(event.pointerId);
      follow(event);
    });
    pad.addEventListener("pointermove", (event) => event.buttons === 1 && follow(event));
    this.rows.push(() => {
      const distance = 1 - this.settings.lightHeight / 90;
      const angle = (this.settings.lightDirection * Math.PI) / 180;
      knob.style.setProperty("left", `${50 + 50 * distance * Math.cos(angle)}%`);
      knob.style.setProperty("top", `${50 - 50 * distance * Math.sin(angle)}%`);
    });
    this.root.append(pad);
  }
}
