// Images derived from masks: edges, overlay of two masks, map of missing strokes.

export const INK = [0, 82, 155];
export const RELIEF = [196, 78, 0];
/** Colours of the edges at -5 and +5 degrees. */
const GUIDES = [INK, [130, 60, 150]];

export function newCanvas(width, height) {
  const canvas = new OffscreenCanvas(width, height);
  return { canvas, context: canvas.getContext("2d", { willReadFrequently: true }) };
}

/** Returns the pixels of a bitmap. */
export function pixels(bitmap) {
  const { context } = newCanvas(bitmap.width, bitmap.height);
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** Converts a mask image to one byte per pixel, 0 or 1. */
export function bits(bitmap) {
  const { data } = pixels(bitmap);
  const set = new Uint8Array(data.length / 4);
  for (let i = 0; i < set.length; i++) set[i] = data[4 * i] > 127 ? 1 : 0;
  return set;
}

/** Packs a colour into the 32 bits of a pixel. */
const pixel = ([r, g, b], a = 255) => new Uint32Array(Uint8Array.of(r, g, b, a).buffer)[0];
const HALO = pixel([255, 255, 255], 190);
const GAP = pixel([255, 255, 255], 230);
const BOTH = pixel([38, 38, 38]);
const BACKGROUND = pixel([247, 245, 240]);
const FAINT = pixel([120, 120, 120], 70);
const GREYS = Uint32Array.from({ length: 256 }, (_, grey) => pixel([grey, grey, grey]));

/** Returns a canvas with pixel `i` set to the packed colour `colour(i)`; 0 is transparent. */
export function paint(width, height, colour) {
  const { canvas, context } = newCanvas(width, height);
  const image = context.createImageData(width, height);
  const pixelData = new Uint32Array(image.data.buffer);
  for (let i = 0; i < pixelData.length; i++) pixelData[i] = colour(i);
  context.putImageData(image, 0, 0);
  return canvas;
}

/** Dilates a mask by a square of the given radius, in two separable passes. */
function dilate(set, width, height, radius) {
  const horizontal = dilateLines(set, width, height, radius, 1, width);
  return dilateLines(horizontal, height, width, radius, width, 1);
}

function dilateLines(set, length, lines, radius, step, line) {
  const out = new Uint8Array(set.length);
  for (let l = 0; l < lines; l++) {
    let remaining = 0;
    for (let i = -radius; i < length; i++) {
      const ahead = i + radius;
      if (ahead < length && set[l * line + ahead * step]) remaining = 2 * radius + 1;
      if (i >= 0 && remaining > 0) out[l * line + i * step] = 1;
      if (remaining > 0) remaining--;
    }
  }
  return out;
}

/** Returns the inner border of a mask: set pixels close to an unset one. */
function border(set, width, height) {
  const radius = Math.max(1, Math.round(Math.max(width, height) / 400));
  const unset = new Uint8Array(set.length);
  for (let i = 0; i < set.length; i++) unset[i] = 1 - set[i];
  const near = dilate(unset, width, height, radius);
  for (let i = 0; i < set.length; i++) near[i] &= set[i];
  return near;
}

/** Returns the edges of a mask in a colour, with a light halo so that they are visible on ink and background. */
export function edges(set, width, height, colour) {
  return haloed(border(set, width, height), width, height, colour);
}

function haloed(line, width, height, colour) {
  const halo = dilate(line, width, height, 1);
  const drawn = pixel(colour);
  return paint(width, height, (i) => (line[i] ? drawn : halo[i] ? HALO : 0));
}

function plain(line, width, height, colour) {
  const drawn = pixel(colour);
  return paint(width, height, (i) => (line[i] ? drawn : 0));
}

/** Returns the 4-connected components of a mask, largest first. */
function components(set, width, height) {
  const seen = new Uint8Array(set.length);
  const found = [];
  for (let start = 0; start < set.length; start++) {
    if (!set[start] || seen[start]) continue;
    const component = [start];
    seen[start] = 1;
    for (let k = 0; k < component.length; k++) {
      const at = component[k];
      const x = at % width;
      const near = [x > 0 ? at - 1 : -1, x < width - 1 ? at + 1 : -1, at - width, at + width];
      for (const next of near) {
        if (next >= 0 && next < set.length && set[next] && !seen[next]) {
          seen[next] = 1;
          component.push(next);
        }
      }
    }
    found.push(component);
  }
  return found.sort((a, b) => b.length - a.length);
}

/** Returns a circle around a component. */
function enclosingCircle(component, width) {
  const xs = component.map((at) => at % width);
  const ys = component.map((at) => Math.floor(at / width));
  const span = (values) => values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  const [[x0, x1], [y0, y1]] = [span(xs), span(ys)];
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, radius: Math.hypot(x1 - x0, y1 - y0) / 2 + 8 };
}

/**
 * Returns the map of strokes that only one mask has, hatched, and a ring around the largest one missing in the relief.
 * The pixels of `disagreement` are 255 where only the print has a stroke, and 128 where only the relief has one.
 */
function strokeMap(disagreement, ink, strokes, width, height) {
  const { data } = pixels(disagreement);
  const kindAt = (i) => (data[4 * i] > 191 ? 1 : data[4 * i] > 63 ? 2 : 0);
  const kind = Uint8Array.from({ length: width * height }, (_, i) => kindAt(i));
  const lost = components(kind.map((value) => (value === 1 ? 1 : 0)), width, height);
  const [lostColour, extraColour] = [pixel(INK), pixel(RELIEF)];
  const map = paint(width, height, (i) => {
    const x = i % width;
    const y = Math.floor(i / width);
    // Two hatching directions, so that they are distinguishable without colour.
    if (kind[i] === 1) return (x + y) % 6 < 3 ? lostColour : GAP;
    if (kind[i] === 2) return (x - y + height) % 6 < 3 ? extraColour : GAP;
    return ink[i] || strokes[i] ? FAINT : 0;
  });
  return { map: map.transferToImageBitmap(), ring: lost.length > 0 ? enclosingCircle(lost[0], width) : null };
}

/** Returns the centroid of the set pixels. */
function centroid(set, width, height) {
  let [n, x, y] = [0, 0, 0];
  for (let i = 0; i < set.length; i++) {
    if (set[i]) {
      n += 1;
      x += i % width;
      y += Math.floor(i / width);
    }
  }
  return n > 0 ? { x: x / n, y: y / n } : { x: width / 2, y: height / 2 };
}

/** Returns an overlay of two masks, coloured by which of them is set. */
function overlay(ink, strokes, width, height) {
  const [print, relief] = [pixel(INK), pixel(RELIEF)];
  return paint(width, height, (i) => {
    if (ink[i]) return strokes[i] ? BOTH : print;
    return strokes[i] ? relief : BACKGROUND;
  });
}

/** Returns the difference of the print from black on strokes and from white elsewhere, as grey values. */
function difference(print, strokes) {
  const { data, width, height } = pixels(print);
  const luminance = (i) => (data[4 * i] * 3 + data[4 * i + 1] * 6 + data[4 * i + 2]) / 10;
  return paint(width, height, (i) => GREYS[Math.round(Math.abs(255 - luminance(i) - 255 * strokes[i]))]);
}

/** Derives everything that the viewer draws from the images of an item. */
export function derive({ print, printMask, relief, depthMask, disagreement }) {
  const { width, height } = print;
  const [ink, strokes] = [bits(printMask), bits(depthMask)];
  const line = border(strokes, width, height);
  return {
    print, printMask, relief, depthMask, width, height,
    edges: haloed(line, width, height, RELIEF).transferToImageBitmap(),
    guides: GUIDES.map((colour) => plain(line, width, height, colour).transferToImageBitmap()),
    overlay: overlay(ink, strokes, width, height).transferToImageBitmap(),
    difference: difference(print, strokes).transferToImageBitmap(),
    strokeMap: strokeMap(disagreement, ink, strokes, width, height),
    centroid: centroid(strokes, width, height),
  };
}

/** Maximum number of samples along a pixel side, and their maximum distance in source pixels. */
const [MAX_SAMPLES, SAMPLE_DISTANCE] = [8, 1.5];

/**
 * Warps a mask: a pixel is set if at least half of its square is covered. The map is as in canvases, but between pixel
 * centres with integer coordinates. Samples like the server, so that both compute the same scores.
 */
export function warpMask(set, width, height, [a, b, c, d, e, f], size) {
  const out = new Uint8Array(size.width * size.height);
  const det = a * d - b * c;
  const [ia, ib, ic, id] = [d / det, -b / det, -c / det, a / det];
  const samples = Math.min(MAX_SAMPLES, Math.max(1, Math.ceil(1 / Math.sqrt(Math.abs(det)) / SAMPLE_DISTANCE)));
  const offsets = Array.from({ length: samples }, (_, i) => (i + 0.5) / samples - 0.5);
  const at = (x, y) => (x >= 0 && y >= 0 && x < width && y < height ? set[y * width + x] : 0);
  const cover = (x, y) => {
    const [x0, y0] = [Math.floor(x), Math.floor(y)];
    if (x0 < -1 || y0 < -1 || x0 >= width || y0 >= height) return 0;
    const [fx, fy] = [x - x0, y - y0];
    const above = at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx;
    const below = at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx;
    return above * (1 - fy) + below * fy;
  };
  for (let i = 0; i < out.length; i++) {
    let sum = 0;
    for (const down of offsets) {
      for (const across of offsets) {
        const x = (i % size.width) + across - e;
        const y = Math.floor(i / size.width) + down - f;
        sum += cover(ia * x + ic * y, ib * x + id * y);
      }
    }
    out[i] = sum >= samples * samples * 0.5 ? 1 : 0;
  }
  return out;
}

/** Returns IoU and Dice coefficient of two masks. */
export function overlap(a, b) {
  let [both, sum] = [0, 0];
  for (let i = 0; i < a.length; i++) {
    both += a[i] & b[i];
    sum += a[i] + b[i];
  }
  return { iou: sum > both ? both / (sum - both) : 0, dice: sum > 0 ? (2 * both) / sum : 0 };
}
