// Shapes over the image of a page, which the page of a block and that of its boxes share.

const SVG = "http://www.w3.org/2000/svg";
/** Width of the outline of a box on the screen. */
export const STROKE_PX = 2;

/** Creates an element of SVG. */
export function svg(tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** Returns the index of the smallest box around a place, or -1. `boxes` has left, top, right and bottom of each. */
export function smallestAround([x, y], boxes) {
  let [found, area] = [-1, Infinity];
  for (const [index, [left, top, right, bottom]] of boxes.entries()) {
    const size = (right - left) * (bottom - top);
    if (x >= left && x <= right && y >= top && y <= bottom && size < area) [found, area] = [index, size];
  }
  return found;
}
