// Chooses pairs in a list: with a click, with Shift a range, and with the arrow keys. This tab keeps the choice, so it stays
// while the list is paged through.

import { noAnswer, showProblem } from "./action.js";
import { withValues } from "./scan-messages.js";

const bar = document.getElementById("choice");
const status = document.getElementById("chosen");
const problem = document.getElementById("choice-problem");
const none = document.getElementById("choose-none");
const boxes = [...document.querySelectorAll("[data-pair]")];
const most = Number(bar.dataset.max);
const chosen = new Set(JSON.parse(sessionStorage.getItem(bar.dataset.kept) ?? "[]"));
const keptOpen = `${bar.dataset.kept}:open`;
/** Pairs that wait or have failed, as far as this tab has seen them. */
const open = new Set(JSON.parse(sessionStorage.getItem(keptOpen) ?? "[]"));
for (const box of boxes) {
  if ("open" in box.dataset) open.add(box.dataset.pair);
  else open.delete(box.dataset.pair);
}
/** Where a range begins. */
let anchor = -1;

function show() {
  for (const box of boxes) {
    box.checked = chosen.has(box.dataset.pair);
    box.closest(".pick-card, tr").classList.toggle("is-chosen", box.checked);
  }
  const here = boxes.filter((box) => box.checked).length;
  status.textContent = chosen.size ? withValues(status.dataset.text, { n: chosen.size, here }) : status.dataset.none;
  none.hidden = document.getElementById("choice-actions").hidden = chosen.size === 0;
  for (const button of bar.querySelectorAll("button[data-text]")) {
    const number = button.dataset.counts === "open" ? [...chosen].filter((name) => open.has(name)).length : chosen.size;
    button.textContent = withValues(button.dataset.text, { n: number });
    button.hidden = number === 0;
    if (button.dataset.ask) button.dataset.confirm = withValues(button.dataset.ask, { n: chosen.size });
  }
}

/** Adds and removes pairs, unless there are then too many. */
function change(added, removed = []) {
  const next = new Set(chosen);
  for (const name of removed) next.delete(name);
  for (const name of added) next.add(name);
  const isTooMuch = next.size > most && next.size > chosen.size;
  // Who chooses by keyboard goes on at the same pair.
  showProblem(problem, isTooMuch ? problem.dataset.most : "", !boxes.includes(document.activeElement));
  if (!isTooMuch) {
    chosen.clear();
    for (const name of next) chosen.add(name);
    sessionStorage.setItem(bar.dataset.kept, JSON.stringify([...chosen]));
    sessionStorage.setItem(keptOpen, JSON.stringify([...chosen].filter((name) => open.has(name))));
  }
  show();
}

/** Returns the pairs from one place to another. */
function between(from, to) {
  const [first, last] = [Math.min(from, to), Math.max(from, to)];
  return boxes.slice(first, last + 1).map((box) => box.dataset.pair);
}

/** Returns how many boxes are beside each other. */
function columns() {
  const top = boxes[0].getBoundingClientRect().top;
  const next = boxes.findIndex((box) => box.getBoundingClientRect().top > top);
  return next < 0 ? boxes.length : next;
}

for (const [index, box] of boxes.entries()) {
  box.addEventListener("click", (event) => {
    const names = event.shiftKey && anchor >= 0 ? between(anchor, index) : [box.dataset.pair];
    anchor = index;
    if (box.checked) change(names);
    else change([], names);
  });
  box.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns(), ArrowDown: columns() }[event.code];
    const next = index + (step ?? 0);
    if (step === undefined) return;
    event.preventDefault();
    if (!boxes[next]) return;
    if (event.shiftKey) {
      if (anchor < 0) anchor = index;
      const range = between(anchor, next);
      change(range, between(anchor, index));
    } else {
      anchor = next;
    }
    boxes[next].focus();
  });
}

document.getElementById("choose-page").addEventListener("click", () => change(between(0, boxes.length - 1)));
none.addEventListener("click", () => {
  change([], [...chosen]);
  document.getElementById("choose-page").focus();
});

const all = document.getElementById("choose-all");
all.addEventListener("click", async () => {
  if (all.getAttribute("aria-busy") === "true") return;
  all.setAttribute("aria-busy", "true");
  try {
    const response = await fetch(all.dataset.from).catch(() => {
      throw noAnswer();
    });
    const reply = await response.json();
    if (response.ok) {
      for (const name of reply.open) open.add(name);
      change(reply.pairs);
    } else {
      showProblem(problem, reply.error);
    }
  } catch (error) {
    showProblem(problem, error.message);
  } finally {
    all.removeAttribute("aria-busy");
  }
});

// In a narrow window the bar is one line, and what can be done is folded.
const more = document.getElementById("choice-more");
const narrow = matchMedia("(max-width: 760px)");
const fold = () => {
  more.open = !narrow.matches;
};
narrow.addEventListener("change", fold);
fold();

// Pairs that were retired meanwhile are not in the list any more, so the user cannot remove them from the choice.
document.addEventListener("refused", ({ detail }) => change([], detail));

// A page that the browser kept shows the choice as it was.
addEventListener("pageshow", (event) => {
  if (event.persisted) location.reload();
});

show();
bar.dataset.ready = "true";
