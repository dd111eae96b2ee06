// Everything on the page around the viewer: heading, counts, history, announcements, dialogs.

import { reviewOrder, translate } from "./config.js";
import { localNumber } from "./scan-messages.js";

const byId = (id) => document.getElementById(id);
const SIGNS = { pass: "✓", fail: "✗", unsure: "?" };
const SIDES = ["print", "print_mask", "relief", "depth_mask"];
const LAYERS = { print: "print", print_mask: "printMask", relief: "relief", depth_mask: "depthMask" };

export function heading(item, queue, pendingCount) {
  byId("pair").textContent = item ? queue.label(item) : endText(queue, pendingCount);
  const [done, all] = [queue.answeredCount, queue.items.length];
  byId("progress").textContent = translate("progress", { done, all });
  byId("bar").max = Math.max(all, 1);
  byId("bar").value = done;
}

/** Returns the heading when no item is left. */
function endText(queue, pendingCount) {
  if (queue.items.length === 0) return reviewOrder === "adjudicate" ? translate("empty_adjudicate") : translate("empty");
  return pendingCount > 0 ? translate("done_not_saved", { n: pendingCount }) : translate("done");
}

/** Draws the four small images. */
export function sideImages(layers) {
  for (const side of SIDES) {
    const canvas = byId(`side-${side}`);
    canvas.width = layers?.width ?? 1;
    canvas.height = layers?.height ?? 1;
    if (layers) canvas.getContext("2d").drawImage(layers[LAYERS[side]], 0, 0);
  }
}

export function saveState(pendingCount, problem) {
  const element = byId("saved");
  element.textContent = pendingCount === 0 ? `${translate("saved")} ✓` : translate("not_saved", { n: pendingCount });
  element.classList.toggle("waiting", pendingCount > 0);
  if (problem) alert(translate(problem));
  else if (pendingCount === 0) hideAlert();
}

export function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}

/** Formats milliseconds as seconds with one decimal. */
export const seconds = (ms) => localNumber(ms / 1000, 1);

/** Shows the median time per answer. */
export function pace(times) {
  if (times.length > 0) byId("pace").textContent = translate("median", { s: seconds(median(times)) });
}

/** Marks the viewer while its image is loading. */
export const busy = (isBusy) => byId("canvas").parentElement.setAttribute("aria-busy", String(isBusy));

/** Shows the bar of the practice round with the question, or with the answer to the current example. */
export function practice(index, count, text, isAnswered) {
  byId("practice").hidden = false;
  byId("pair").textContent = translate("practice_progress", { n: index + 1, all: count });
  byId("practice-text").textContent = text;
  byId("practice-next").disabled = !isAnswered;
}

export const endPractice = () => (byId("practice").hidden = true);

/** Returns an answer as text. */
export function answerText(answer) {
  const reason = answer.reason ? `: ${translate(answer.reason)}` : "";
  return `${translate(answer.verdict)}${reason}`;
}

/** Shows the buttons of the alignment editor. */
export function alignmentBar(isOpen) {
  byId("alignment").hidden = !isOpen;
}

/** Returns whether the buttons of the alignment editor make small steps. */
export const isFine = () => byId("alignment-fine").checked;

/** Returns a manual alignment as text. */
export function alignmentText({ reviewer, rotation_deg: deg, shift_px: [x, y], scale, mirrored, iou }) {
  return translate("aligned_by", {
    reviewer, deg: localNumber(deg, 1), px: localNumber(Math.hypot(x, y), 1), scale: localNumber(scale, 3),
    mirrored: mirrored ? translate("and_mirrored") : "", iou: localNumber(iou, 3),
  });
}

/** Lists the latest answers, newest first; a click goes to the item. */
export function history(queue, count, go) {
  const rows = queue.latest(count).map((item) => {
    const row = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.className = item.answer.verdict;
    button.textContent = `${SIGNS[item.answer.verdict]} ${queue.label(item)}`;
    button.title = answerText(item.answer);
    button.setAttribute("aria-label", `${queue.label(item)}, ${answerText(item.answer)}`);
    if (item === queue.current) button.setAttribute("aria-current", "true");
    button.addEventListener("click", () => go(item));
    row.append(button);
    return row;
  });
  byId("history").replaceChildren(...rows);
}

/** Marks the buttons of the current answer and of active modes. */
export function markActive(names) {
  for (const button of document.querySelectorAll("[data-action]")) {
    const on = names.has(button.dataset.action);
    button.classList.toggle("on", on);
    if (button.hasAttribute("aria-pressed")) button.setAttribute("aria-pressed", String(on));
  }
}

export function legend(entries, extra) {
  const marks = entries.map(([colour, text]) => {
    const mark = document.createElement("span");
    const swatch = document.createElement("i");
    swatch.className = "swatch";
    swatch.style.setProperty("--colour", colour);
    mark.append(swatch, text);
    return mark;
  });
  byId("legend").replaceChildren(...marks, extra);
}

/** Shows a hint below the verdicts, in place of the reasons, so that the image stays whole and in its place. */
export function hint(text) {
  byId("hint").textContent = text;
  byId("hint").hidden = text === "";
  byId("reasons").hidden = text !== "";
}

/** Shows that fewer attention checks could be made than wanted. */
export function faultShortage(shortage) {
  byId("fault-shortage").hidden = !shortage;
  if (shortage) byId("fault-shortage").textContent = translate("fault_shortage", shortage);
}

let ending = null;

/** Announces a text in the live region, for screen readers too. It is removed after `seconds`, if given. */
export function announce(text, seconds) {
  clearTimeout(ending);
  byId("live").textContent = text;
  if (seconds) ending = setTimeout(() => (byId("live").textContent = ""), 1000 * seconds);
}

export function alert(text) {
  const element = byId("alert");
  if (element.textContent !== text) element.textContent = text;
  element.hidden = false;
}

export const hideAlert = () => (byId("alert").hidden = true);

/** Asks for a note; resolves with the text, or null if it is discarded. */
export function askNote(previous) {
  const [row, field] = [byId("note-row"), byId("note")];
  row.hidden = false;
  field.value = previous ?? "";
  field.focus();
  return new Promise((resolve) => {
    const close = (text) => {
      row.hidden = true;
      field.onkeydown = null;
      field.onblur = null;
      field.blur();
      resolve(text);
    };
    field.onkeydown = (event) => {
      if (event.isComposing) return;
      if (event.key === "Enter") close(field.value.trim());
      if (event.key === "Escape") close(null);
    };
    field.onblur = () => close(field.value.trim());
  });
}

/** Asks for an item by the id of its pair or by its number. */
export function askPair(names, go) {
  const [dialog, field] = [byId("jump"), byId("jump-to")];
  byId("jump-error").textContent = "";
  byId("pairs").replaceChildren(...names.slice(0, 2000).map((name) => new Option(name, name)));
  field.value = "";
  dialog.onsubmit = async (event) => {
    if (event.submitter?.value !== "go") return;
    event.preventDefault();
    if (await go(field.value.trim())) dialog.close();
    else byId("jump-error").textContent = translate("no_such_pair");
  };
  dialog.showModal();
}

/** Asks whether an alignment that agrees less with the print is saved; resolves with the answer. */
export function confirmWorse(before, after) {
  const dialog = byId("confirm");
  const values = { before: localNumber(before, 3), after: localNumber(after, 3) };
  byId("confirm-text").textContent = translate("worse_alignment", values);
  dialog.returnValue = "";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.onclose = () => {
      // The event of an earlier question may arrive late.
      if (!dialog.open) resolve(dialog.returnValue === "yes");
    };
  });
}

export const help = () => byId("help").showModal();
