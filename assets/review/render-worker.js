// Web worker: fetches the images of an item and renders everything derived from them, so that keys are never delayed.

import { derive } from "./masks.js";

const LAYERS = ["print", "print-mask", "relief", "depth-mask", "stroke-map"];

async function bitmap(id, layer) {
  const response = await fetch(`../image/${id}/${layer}`);
  if (!response.ok) {
    const { error } = await response.json().catch(() => ({}));
    throw new Error(error ?? String(response.status));
  }
  return createImageBitmap(await response.blob());
}

async function bitmaps(id, layers) {
  return Promise.all(layers.map((layer) => bitmap(id, layer)));
}

/** Renderers by kind of request. */
const renderers = {
  async item(id) {
    const [print, printMask, relief, depthMask, disagreement] = await bitmaps(id, LAYERS);
    return derive({ print, printMask, relief, depthMask, disagreement });
  },
  /** Relief and strokes in the depth map's frame, and the ink on the canvas on which scores are computed. */
  async alignment(id) {
    const [relief, mask, ink] = await bitmaps(id, ["depth-frame-relief", "depth-frame-mask", "canvas-mask"]);
    return { relief, mask, ink };
  },
};

/** Returns the transferable parts of a value. They are moved to the page, not copied. */
function transferables(value) {
  if (value instanceof ImageBitmap) return [value];
  if (ArrayBuffer.isView(value)) return [value.buffer];
  return value && typeof value === "object" ? Object.values(value).flatMap(transferables) : [];
}

addEventListener("message", async ({ data: { request, kind, id } }) => {
  try {
    const images = await renderers[kind](id);
    postMessage({ request, images }, transferables(images));
  } catch (error) {
    postMessage({ request, error: error.message });
  }
});
