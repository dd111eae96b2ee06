// Everything on the page around the stage: names, numbers, history, words for the ear.

import { language, queue, say } from "./boot.js";

const at = (id) => document.getElementById(id);
const SIGNS = { pass: "✓", fail: "✗", unsure: "?" };
const SIDES = ["print", "print_mask", "relief", "depth_mask"];
const LAYERS = { print: "print", print_mask: "printMask", relief: "relief", depth_mask: "depthMask" };

export function head(item, deck, waiting) {
  at("pair").textContent = item ? deck.name(item) : ended(deck, waiting);
  const [done, all] = [deck.done, deck.items.length];
  at("progress").textContent = say("progress", { done, all });
  at("bar").max = Math.max(all, 1);
  at("bar").value = done;
}

/** What stands where no card is left. */
function ended(deck, waiting) {
  if (deck.items.length === 0) return queue === "adjudicate" ? say("empty_adjudicate") : say("empty");
  return waiting > 0 ? say("done_not_saved", { n: waiting }) : say("done");
}

/** The four small pictures. */
export function sides(layers) {
  for (const side of SIDES) {
    const canvas = at(`side-${side}`);
    canvas.width = layers?.width ?? 1;
    canvas.height = layers?.height ?? 1;
    if (layers) canvas.getContext("2d").drawImage(layers[LAYERS[side]], 0, 0);
  }
}

export function saved(waiting, trouble) {
  const place = at("saved");
  place.textContent = waiting === 0 ? `${say("saved")} ✓` : say("not_saved", { n: waiting });
  place.classList.toggle("waiting", waiting > 0);
  if (trouble) alert(say(trouble));
  else if (waiting === 0) calm();
}

export function pace(times) {
  if (times.length === 0) return;
  const sorted = [...times].sort((a, b) => a - b);
  const median = sorted[Math.floor(sorted.length / 2)] / 1000;
  const s = median.toLocaleString(language, { maximumFractionDigits: 1, minimumFractionDigits: 1 });
  at("pace").textContent = say("median", { s });
}

/** What was answered to a card, in words. */
export function words(answer) {
  const reason = answer.reason ? `: ${say(answer.reason)}` : "";
  return `${say(answer.verdict)}${reason}`;
}

/** A number with so many digits, and no sign on a zero. */
export const fixed = (value, digits) => value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");

/** How a relief was laid by hand, in words. */
export function laid({ reviewer, turned_deg: deg, shifted_px: [x, y], scaled, mirrored, iou }) {
  return say("corrected_by", {
    reviewer, deg: fixed(deg, 1), px: Math.hypot(x, y).toFixed(1), scale: scaled.toFixed(3),
    mirrored: mirrored ? say("and_mirrored") : "", iou: iou.toFixed(3),
  });
}

/** The last answers, newest first; a click goes there. */
export function history(deck, count, go) {
  const rows = deck.behind(count).map((item) => {
    const row = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.className = item.answer.verdict;
    button.textContent = `${SIGNS[item.answer.verdict]} ${deck.name(item)}`;
    button.title = words(item.answer);
    button.setAttribute("aria-label", `${deck.name(item)}, ${words(item.answer)}`);
    if (item === deck.current) button.setAttribute("aria-current", "true");
    button.addEventListener("click", () => go(item));
    row.append(button);
    return row;
  });
  at("history").replaceChildren(...rows);
}

/** Marks the buttons of what the card was answered with, and of what is switched on. */
export function pressed(names) {
  for (const button of document.querySelectorAll("[data-do]")) {
    const on = names.has(button.dataset.do);
    button.classList.toggle("on", on);
    if (button.hasAttribute("aria-pressed")) button.setAttribute("aria-pressed", String(on));
  }
}

export function legend(spots, extra) {
  const marks = spots.map(([colour, text]) => {
    const mark = document.createElement("span");
    const spot = document.createElement("i");
    spot.className = "spot";
    spot.style.setProperty("background", colour);
    mark.append(spot, text);
    return mark;
  });
  at("legend").replaceChildren(...marks, extra);
}

export const measure = (text) => (at("measure").textContent = text);

/** For the ear, and for whoever looks away from the keys. */
export const tell = (text) => (at("live").textContent = text);

export function alert(text) {
  const place = at("alert");
  if (place.textContent !== text) place.textContent = text;
  place.hidden = false;
}

export const calm = () => (at("alert").hidden = true);

/** Asks for a note; resolves with the text, or null when it was dropped. */
export function askNote(before) {
  const [row, field] = [at("note-row"), at("note")];
  row.hidden = false;
  field.value = before ?? "";
  field.focus();
  return new Promise((resolve) => {
    const end = (text) => {
      row.hidden = true;
      field.onkeydown = null;
      field.onblur = null;
      field.blur();
      resolve(text);
    };
    field.onkeydown = (event) => {
      if (event.isComposing) return;
      if (event.key === "Enter") end(field.value.trim());
      if (event.key === "Escape") end(null);
    };
    field.onblur = () => end(field.value.trim());
  });
}

/** Asks for a card by the id of its pair or by its number. */
export function askPair(names, go) {
  const [dialog, field] = [at("jump"), at("jump-to")];
  at("jump-error").textContent = "";
  at("pairs").replaceChildren(...names.slice(0, 2000).map((name) => new Option(name, name)));
  field.value = "";
  dialog.onsubmit = async (event) => {
    if (event.submitter?.value !== "go") return;
    event.preventDefault();
    if (await go(field.value.trim())) dialog.close();
    else at("jump-error").textContent = say("no_such_pair");
  };
  dialog.showModal();
}

export const help = () => at("help").showModal();
