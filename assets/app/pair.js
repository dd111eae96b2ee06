// The pictures of a pair: one is shown large, under one metric or two. Print and relief, or the two metrics, can blink. Arrow
// keys lead to the neighbours.

const BLINK_MS = 600;
const stage = document.getElementById("stage");
const other = document.getElementById("other-stage");
const blink = document.getElementById("blink");
const layers = [...document.querySelectorAll("[data-layer]")];
const captions = [...document.querySelectorAll("figcaption")].map((caption) => caption.textContent);
let timer = 0;

function show(layer) {
  for (const button of layers) button.setAttribute("aria-pressed", String(button === layer));
  stage.src = layer.dataset.src;
  stage.alt = layer.textContent.trim();
  if (!other) return;
  other.src = layer.dataset.other;
  other.alt = stage.alt;
  caption(0);
}

function caption(metric) {
  stage.parentElement.querySelector("figcaption").textContent = captions[metric];
}

function layerNamed(name) {
  return layers.find((button) => button.dataset.layer === name);
}

function pressed() {
  return layers.find((button) => button.getAttribute("aria-pressed") === "true");
}

function stopBlinking() {
  clearInterval(timer);
  timer = 0;
  blink?.setAttribute("aria-pressed", "false");
  if (other) show(pressed());
}

function toggleBlinking() {
  if (timer) {
    stopBlinking();
    return;
  }
  blink.setAttribute("aria-pressed", "true");
  let isFirst = true;
  const turn = () => {
    if (other) {
      // The first picture changes; the second one stays beside it.
      stage.src = isFirst ? pressed().dataset.other : pressed().dataset.src;
      caption(Number(isFirst));
    } else {
      show(layerNamed(isFirst ? "print" : "relief"));
    }
    isFirst = !isFirst;
  };
  turn();
  timer = setInterval(turn, BLINK_MS);
}

for (const button of layers) {
  button.addEventListener("click", () => {
    stopBlinking();
    show(button);
  });
}
blink?.addEventListener("click", toggleBlinking);

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches("input, select, textarea")) return;
  if (event.code === "KeyB" && blink) toggleBlinking();
  const rel = { ArrowLeft: "prev", ArrowRight: "next" }[event.code];
  const link = rel && document.querySelector(`a[rel="${rel}"]`);
  if (link && !event.shiftKey) location.assign(link.href);
});

stage.dataset.ready = "true";
