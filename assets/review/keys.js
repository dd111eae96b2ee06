// Keys by their place on the keyboard. A key that is held or typed into a field does nothing here.

import { keys } from "./boot.js";

/** Names of keys that have no letter. */
const NAMES = {
  Backspace: "⌫", Space: "␣", ArrowRight: "→", ArrowLeft: "←", BracketLeft: "[", BracketRight: "]", Comma: ",",
  Period: ".", Equal: "=", Minus: "−", Enter: "⏎", Escape: "Esc", Slash: "/", Semicolon: ";", Quote: "'",
};

function nameOf(code) {
  return NAMES[code] ?? code.replace(/^(Key|Digit|Numpad)/, "");
}

/** Writes each action's key where the page has a place for it. */
export function label() {
  const codes = Object.fromEntries(Object.entries(keys()).map(([code, action]) => [action, code]));
  for (const place of document.querySelectorAll("kbd[data-key]")) {
    const code = codes[place.dataset.key];
    place.textContent = code ? nameOf(code) : "";
    place.hidden = !code;
    const button = place.closest("button");
    if (button && code) button.setAttribute("aria-keyshortcuts", nameOf(code));
  }
}

/** What stood in a dialog has the focus for a moment after that is shut, and types nothing any more. */
const isTyping = (target) =>
  target.closest?.("input, textarea, select, dialog") && !target.closest("dialog:not([open])");
/** Keys that a focused control needs for itself. */
const isControls = (event) =>
  ["Enter", "Space"].includes(event.code) && event.target.closest?.("button, a, summary");

/** Calls `act(action, event)` when a key goes down, and `release(action)` when it comes up. */
export function listen(act, release) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing || isTyping(event.target)) return;
    const action = keys()[event.code] ?? (event.code.startsWith("Arrow") ? event.code : undefined);
    if (!action || isControls(event)) return;
    event.preventDefault();
    act(action, event);
  });
  addEventListener("keyup", (event) => {
    const action = keys()[event.code];
    if (action) release(action);
  });
  addEventListener("blur", () => release("flicker"));
}

