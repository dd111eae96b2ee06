// Off the page's thread: fetches the pictures of a card and draws all that is made of them, so that no key waits for it.

import { derive } from "./masks.js";

const LAYERS = ["print", "print-mask", "relief", "depth-mask"];

async function bitmap(id, layer) {
  const answer = await fetch(`/picture/${id}/${layer}`);
  if (!answer.ok) {
    const told = await answer.json().catch(() => ({}));
    throw new Error(told.error ?? String(answer.status));
  }
  return createImageBitmap(await answer.blob());
}

async function bitmaps(id, layers) {
  return Promise.all(layers.map((layer) => bitmap(id, layer)));
}

/** What is asked for, by name. */
const deeds = {
  async card(id) {
    const [print, printMask, relief, depthMask] = await bitmaps(id, LAYERS);
    return derive({ print, printMask, relief, depthMask });
  },
  /** The relief and its strokes in the depth map's own frame, and the ink where the agreement is counted. */
  async own(id) {
    const [relief, mask, ink] = await bitmaps(id, ["own-relief", "own-mask", "canvas-ink"]);
    return { relief, mask, ink };
  },
};

/** Everything in an answer that changes hands and is not copied. */
function handed(value) {
  if (value instanceof ImageBitmap) return [value];
  if (ArrayBuffer.isView(value)) return [value.buffer];
  return value && typeof value === "object" ? Object.values(value).flatMap(handed) : [];
}

addEventListener("message", async ({ data: { number, deed, id } }) => {
  try {
    const made = await deeds[deed](id);
    postMessage({ number, made }, handed(made));
  } catch (error) {
    postMessage({ number, why: error.message });
  }
});
