// Pictures made from masks: edges, the overlay of two masks, what one has and the other lacks.

export const INK = [0, 82, 155];
export const RELIEF = [196, 78, 0];
/** Of the relief turned one way and the other. */
const GHOSTS = [INK, [130, 60, 150]];
/** A stroke counts as missing only past this share of the picture's side: edges never agree to the pixel. */
const SLACK = 1 / 90;
/** Pieces smaller than this share of the picture are no strokes. */
const LEAST_PIECE = 1 / 4000;

export function sheet(width, height) {
  const canvas = new OffscreenCanvas(width, height);
  return { canvas, brush: canvas.getContext("2d", { willReadFrequently: true }) };
}

/** The pixels of a bitmap. */
export function pixels(bitmap) {
  const { brush } = sheet(bitmap.width, bitmap.height);
  brush.drawImage(bitmap, 0, 0);
  return brush.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** Which pixels of a mask are set. */
export function bits(bitmap) {
  const { data } = pixels(bitmap);
  const set = new Uint8Array(data.length / 4);
  for (let i = 0; i < set.length; i++) set[i] = data[4 * i] > 127 ? 1 : 0;
  return set;
}

/** A colour as the one number that a pixel is in memory. */
const dot = ([r, g, b], a = 255) => new Uint32Array(Uint8Array.of(r, g, b, a).buffer)[0];
export const WHITE = dot([255, 255, 255]);
const RIM = dot([255, 255, 255], 190);
const GAP = dot([255, 255, 255], 230);
const BOTH = dot([38, 38, 38]);
const PAPER = dot([247, 245, 240]);
const FAINT = dot([120, 120, 120], 70);
const GREYS = Uint32Array.from({ length: 256 }, (_, grey) => dot([grey, grey, grey]));

/** A canvas painted pixel by pixel; `colour(i)` gives the number of a colour, or 0 for nothing. */
export function painted(width, height, colour) {
  const { canvas, brush } = sheet(width, height);
  const image = brush.createImageData(width, height);
  const dots = new Uint32Array(image.data.buffer);
  for (let i = 0; i < dots.length; i++) dots[i] = colour(i);
  brush.putImageData(image, 0, 0);
  return canvas;
}

/** All set pixels grown by a radius, as a square brush does, in two passes. */
function grown(set, width, height, radius) {
  const across = spread(set, width, height, radius, 1, width);
  return spread(across, height, width, radius, width, 1);
}

function spread(set, length, lines, radius, step, line) {
  const out = new Uint8Array(set.length);
  for (let l = 0; l < lines; l++) {
    let left = 0;
    for (let i = -radius; i < length; i++) {
      const ahead = i + radius;
      if (ahead < length && set[l * line + ahead * step]) left = 2 * radius + 1;
      if (i >= 0 && left > 0) out[l * line + i * step] = 1;
      if (left > 0) left--;
    }
  }
  return out;
}

/** The border of a mask: set pixels that have an unset one within reach. */
function border(set, width, height) {
  const reach = Math.max(1, Math.round(Math.max(width, height) / 400));
  const unset = new Uint8Array(set.length);
  for (let i = 0; i < set.length; i++) unset[i] = 1 - set[i];
  const near = grown(unset, width, height, reach);
  for (let i = 0; i < set.length; i++) near[i] &= set[i];
  return near;
}

/** The edges of a mask in a colour, with a light rim so that they show on ink and on paper. */
export function edges(set, width, height, colour) {
  return rimmed(border(set, width, height), width, height, colour);
}

function rimmed(line, width, height, colour) {
  const rim = grown(line, width, height, 1);
  const drawn = dot(colour);
  return painted(width, height, (i) => (line[i] ? drawn : rim[i] ? RIM : 0));
}

function plain(line, width, height, colour) {
  const drawn = dot(colour);
  return painted(width, height, (i) => (line[i] ? drawn : 0));
}

/** Pieces of a mask that are joined, the largest first; the smallest are left out. */
function pieces(set, width, height) {
  const seen = new Uint8Array(set.length);
  const least = set.length * LEAST_PIECE;
  const found = [];
  for (let start = 0; start < set.length; start++) {
    if (!set[start] || seen[start]) continue;
    const piece = [start];
    seen[start] = 1;
    for (let k = 0; k < piece.length; k++) {
      const at = piece[k];
      const x = at % width;
      const near = [x > 0 ? at - 1 : -1, x < width - 1 ? at + 1 : -1, at - width, at + width];
      for (const next of near) {
        if (next >= 0 && next < set.length && set[next] && !seen[next]) {
          seen[next] = 1;
          piece.push(next);
        }
      }
    }
    if (piece.length >= least) found.push(piece);
  }
  return found.sort((a, b) => b.length - a.length);
}

/** Centre and radius of a piece. */
function ring(piece, width) {
  const xs = piece.map((at) => at % width);
  const ys = piece.map((at) => Math.floor(at / width));
  const span = (values) => values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  const [[x0, x1], [y0, y1]] = [span(xs), span(ys)];
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, radius: Math.hypot(x1 - x0, y1 - y0) / 2 + 8 };
}

/** What ink has no relief and what relief has no ink, hatched, the largest lost piece with a ring. */
function strokeMap(ink, strokes, width, height) {
  const slack = Math.max(2, Math.round(Math.max(width, height) * SLACK));
  const lacking = (set, other) => {
    const covered = grown(other, width, height, slack);
    return pieces(set.map((value, i) => value & (1 - covered[i])), width, height);
  };
  const [lost, extra] = [lacking(ink, strokes), lacking(strokes, ink)];
  const kind = new Uint8Array(width * height);
  for (const piece of lost) for (const at of piece) kind[at] = 1;
  for (const piece of extra) for (const at of piece) kind[at] = 2;
  const [lacks, surplus] = [dot(INK), dot(RELIEF)];
  const map = painted(width, height, (i) => {
    const x = i % width;
    const y = Math.floor(i / width);
    // Hatched one way and the other: told apart without colour.
    if (kind[i] === 1) return (x + y) % 6 < 3 ? lacks : GAP;
    if (kind[i] === 2) return (x - y + height) % 6 < 3 ? surplus : GAP;
    return ink[i] || strokes[i] ? FAINT : 0;
  });
  return { map: map.transferToImageBitmap(), ring: lost.length > 0 ? ring(lost[0], width) : null };
}

/** Mean position of the set pixels. */
function middle(set, width, height) {
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

/** Two masks in the colours of what each has alone and what both have. */
function overlay(ink, strokes, width, height) {
  const [print, relief] = [dot(INK), dot(RELIEF)];
  return painted(width, height, (i) => {
    if (ink[i]) return strokes[i] ? BOTH : print;
    return strokes[i] ? relief : PAPER;
  });
}

/** How far the print is from black where the strokes are, and from white elsewhere. */
function difference(print, strokes) {
  const { data, width, height } = pixels(print);
  const luminance = (i) => (data[4 * i] * 3 + data[4 * i + 1] * 6 + data[4 * i + 2]) / 10;
  return painted(width, height, (i) => GREYS[Math.round(Math.abs(255 - luminance(i) - 255 * strokes[i]))]);
}

/** Everything that the stage draws, made once a card and ready to be laid. */
export function derive({ print, printMask, relief, depthMask }) {
  const { width, height } = print;
  const [ink, strokes] = [bits(printMask), bits(depthMask)];
  const line = border(strokes, width, height);
  return {
    print, printMask, relief, depthMask, width, height,
    edges: rimmed(line, width, height, RELIEF).transferToImageBitmap(),
    ghosts: GHOSTS.map((colour) => plain(line, width, height, colour).transferToImageBitmap()),
    overlay: overlay(ink, strokes, width, height).transferToImageBitmap(),
    difference: difference(print, strokes).transferToImageBitmap(),
    missing: strokeMap(ink, strokes, width, height),
    middle: middle(strokes, width, height),
  };
}

/** Most looks along a side of a pixel, and how far apart they may lie in the source. */
const [MOST_LOOKS, APART] = [8, 1.5];

/**
 * A mask laid on a picture of a size: a pixel is set when at least half of its square is covered. Maps are as in
 * canvases, between pixel centres. It counts as the server does, so that both tell the same agreement.
 */
export function warped(set, width, height, [a, b, c, d, e, f], size) {
  const out = new Uint8Array(size.width * size.height);
  const det = a * d - b * c;
  const [ia, ib, ic, id] = [d / det, -b / det, -c / det, a / det];
  const looks = Math.min(MOST_LOOKS, Math.max(1, Math.ceil(1 / Math.sqrt(Math.abs(det)) / APART)));
  const offsets = Array.from({ length: looks }, (_, i) => (i + 0.5) / looks - 0.5);
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
    out[i] = sum >= looks * looks * 0.5 ? 1 : 0;
  }
  return out;
}

/** How far two masks cover each other. */
export function overlap(a, b) {
  let [both, sum] = [0, 0];
  for (let i = 0; i < a.length; i++) {
    both += a[i] & b[i];
    sum += a[i] + b[i];
  }
  return { iou: sum > both ? both / (sum - both) : 0, dice: sum > 0 ? (2 * both) / sum : 0 };
}
