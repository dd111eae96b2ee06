// Pictures of cards, fetched and decoded ahead of time and kept for a while.

import { derive } from "./masks.js";

const LAYERS = ["print", "print-mask", "relief", "depth-mask"];
/** Cards whose pictures are kept decoded. */
const KEPT = 18;

const kept = new Map();

async function bitmap(id, layer) {
  const answer = await fetch(`/picture/${id}/${layer}`);
  if (!answer.ok) {
    const told = await answer.json().catch(() => ({}));
    throw new Error(told.error ?? String(answer.status));
  }
  return createImageBitmap(await answer.blob());
}

async function load(id) {
  const [print, printMask, relief, depthMask] = await Promise.all(LAYERS.map((layer) => bitmap(id, layer)));
  return derive({ print, printMask, relief, depthMask });
}

/** The pictures of a card with all that is drawn from them; asked for once however often it is wanted. */
export function pictures(id) {
  let found = kept.get(id);
  if (!found) {
    const loading = load(id);
    found = { loading, ready: null };
    loading.then((layers) => (found.ready = layers), () => kept.delete(id));
  }
  // The one asked for last is forgotten last.
  kept.delete(id);
  kept.set(id, found);
  for (const old of kept.keys()) {
    if (kept.size <= KEPT) break;
    kept.delete(old);
  }
  return found;
}

/** The relief and its strokes in the depth map's own frame. */
export async function ownPictures(id) {
  const [relief, mask] = await Promise.all([bitmap(id, "own-relief"), bitmap(id, "own-mask")]);
  return { relief, mask };
}
