// Key bindings by physical key. Keys typed into a field are ignored here.

import { keys } from "./config.js";

/** Labels of keys without a letter. */
const LABELS = {
  Backspace: "⌫", Space: "␣", ArrowRight: "→", ArrowLeft: "←", BracketLeft: "[", BracketRight: "]", Comma: ",",
  Period: ".", Equal: "=", Minus: "−", Enter: "⏎", Escape: "Esc", Slash: "?", Semicolon: ";", Quote: "'",
};

function labelOf(code) {
  return LABELS[code] ?? code.replace(/^(Key|Digit|Numpad)/, "");
}

/** Writes the key of each action into its `kbd` elements. */
export function labelKeys() {
  const codes = Object.fromEntries(Object.entries(keys()).map(([code, action]) => [action, code]));
  for (const element of document.querySelectorAll("kbd[data-key]")) {
    const code = codes[element.dataset.key];
    element.textContent = code ? labelOf(code) : "";
    element.hidden = !code;
    const button = element.closest("button");
    if (button && code) button.setAttribute("aria-keyshortcuts", labelOf(code));
  }
}

/** An element of a closed dialog may keep the focus for a moment; keys are no longer meant for it. */
const isGone = (target) => Boolean(target.closest?.("dialog:not([open])"));
const isTyping = (target) => target.closest?.("input, textarea, select, dialog") && !isGone(target);
/** Keys of the numeric keypad that do the same as another key, unless they have an action of their own. */
const KEYPAD = { NumpadEnter: "Enter", NumpadAdd: "Equal", NumpadSubtract: "Minus" };
/** Without NumLock, the digits of the keypad are arrow keys and the like. */
const keypadDigit = ({ code, key }) => (/^[0-9]$/.test(key) ? code.replace("Numpad", "Digit") : code);
const actionOf = (event) => keys()[event.code] ?? keys()[KEYPAD[event.code] ?? keypadDigit(event)];
/** Returns whether the focused control handles the key itself. */
const isHandledByControl = ({ code, target }) =>
  ["Enter", "NumpadEnter", "Space"].includes(code) && target.closest?.("button, a, summary") && !isGone(target);

/** Calls `press(action, event)` on key down and `release(action)` on key up. */
export function listen(press, release) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing || isTyping(event.target)) return;
    const action = actionOf(event) ?? (event.code.startsWith("Arrow") ? event.code : undefined);
    if (!action || isHandledByControl(event)) return;
    event.preventDefault();
    press(action, event);
  });
  addEventListener("keyup", (event) => {
    const action = actionOf(event);
    if (action) release(action);
  });
  addEventListener("blur", () => release("flicker"));
}
