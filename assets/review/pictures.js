// Pictures of cards, fetched, decoded and drawn ahead of time by a thread of their own, and kept for a while.

/** Cards whose pictures are kept: what comes next, and some to go back to. */
const KEPT = 12;

const painter = new Worker("/assets/painter.js", { type: "module" });
const asked = new Map();
let numbers = 0;

painter.addEventListener("message", ({ data: { number, made, why } }) => {
  const { resolve, reject } = asked.get(number);
  asked.delete(number);
  if (made) resolve(made);
  else reject(new Error(why));
});
painter.addEventListener("error", ({ message }) => {
  for (const { reject } of asked.values()) reject(new Error(message ?? "painter.js"));
  asked.clear();
});

function ask(deed, id) {
  return new Promise((resolve, reject) => {
    asked.set(++numbers, { resolve, reject });
    painter.postMessage({ number: numbers, deed, id });
  });
}

const kept = new Map();

/** The pictures of a card with all that is drawn from them; asked for once however often it is wanted. */
export function pictures(id) {
  let found = kept.get(id);
  if (!found) {
    const loading = ask("card", id);
    found = { loading, ready: null };
    loading.then((layers) => (found.ready = layers), () => kept.delete(id));
  }
  // The one asked for last is forgotten last.
  kept.delete(id);
  kept.set(id, found);
  for (const old of kept.keys()) {
    if (kept.size <= KEPT) break;
    shut(kept.get(old).ready);
    kept.delete(old);
  }
  return found;
}

/** Gives the memory of pictures back at once. */
function shut(made) {
  if (made instanceof ImageBitmap) made.close();
  else if (made && typeof made === "object") Object.values(made).forEach(shut);
}

/** What a correction by hand needs besides. */
export const ownPictures = (id) => ask("own", id);
