// The pictures of a pair: one is shown large, and print and relief can blink. Arrow keys lead to the neighbours.

const BLINK_MS = 600;
const stage = document.getElementById("stage");
const blink = document.getElementById("blink");
const layers = [...document.querySelectorAll("[data-layer]")];
let timer = 0;

function show(layer) {
  for (const button of layers) button.setAttribute("aria-pressed", String(button === layer));
  stage.src = layer.dataset.src;
  stage.alt = layer.textContent.trim();
}

function layerNamed(name) {
  return layers.find((button) => button.dataset.layer === name);
}

function stopBlinking() {
  clearInterval(timer);
  timer = 0;
  blink?.setAttribute("aria-pressed", "false");
}

function toggleBlinking() {
  if (timer) {
    stopBlinking();
    return;
  }
  blink.setAttribute("aria-pressed", "true");
  let isPrint = true;
  const turn = () => {
    show(layerNamed(isPrint ? "print" : "relief"));
    isPrint = !isPrint;
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
