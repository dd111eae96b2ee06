// Images of items: fetched, decoded and rendered ahead of time in a worker, and cached.

/** Number of items whose images are cached: the next ones, and some to go back to. */
const CACHED_ITEMS = 12;

const worker = new Worker("assets/render-worker.js", { type: "module" });
const pending = new Map();
let requestCount = 0;

worker.addEventListener("message", ({ data: { request, images, error } }) => {
  const { resolve, reject } = pending.get(request);
  pending.delete(request);
  if (images) resolve(images);
  else reject(new Error(error));
});
worker.addEventListener("error", ({ message }) => {
  for (const { reject } of pending.values()) reject(new Error(message ?? "render-worker.js"));
  pending.clear();
});

function render(kind, id) {
  return new Promise((resolve, reject) => {
    pending.set(++requestCount, { resolve, reject });
    worker.postMessage({ request: requestCount, kind, id });
  });
}

const cache = new Map();

/** Returns the images of an item as `{ loading, ready }`; they are requested once. */
export function images(id) {
  let entry = cache.get(id);
  if (!entry) {
    const loading = render("item", id);
    entry = { loading, ready: null };
    loading.then((layers) => (entry.ready = layers), () => cache.delete(id));
  }
  // Least recently used: move the entry to the end, evict from the start.
  cache.delete(id);
  cache.set(id, entry);
  for (const old of cache.keys()) {
    if (cache.size <= CACHED_ITEMS) break;
    close(cache.get(old).ready);
    cache.delete(old);
  }
  return entry;
}

const exampleCache = new Map();

/**
 * Returns a promise of the images of an example; they are requested once. All of them stay in memory, because they are few,
 * and because the guide shows them all at once while the image behind it must not be freed.
 */
export function exampleImages(name) {
  if (!exampleCache.has(name)) {
    const loading = render("item", `example-${name}`);
    exampleCache.set(name, loading);
    loading.catch(() => exampleCache.delete(name));
  }
  return exampleCache.get(name);
}

/** Frees the memory of bitmaps at once instead of at the next garbage collection. */
function close(value) {
  if (value instanceof ImageBitmap) value.close();
  else if (value && typeof value === "object") Object.values(value).forEach(close);
}

/** Returns the additional images for a manual alignment. */
export const alignmentImages = (id) => render("alignment", id);
