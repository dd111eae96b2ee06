// Keeps what was typed in forms for the way back to a page, and for the same page in the other language.

/** Parts of an address that only say something about the same page. */
const PASSING = ["language", "saved", "done", "count", "still_out"];
/** Names the page that is shown again at once, with what was typed. */
const AGAIN = "shown again";
const FIELDS = "form :is(input:not([type=hidden], [type=file], [type=checkbox], [type=radio], [readonly]), select, textarea)";

/** Returns a text that differs between the pages of two addresses. */
function pageOf(address) {
  const { pathname, searchParams } = new URL(address, location.href);
  for (const name of PASSING) searchParams.delete(name);
  searchParams.sort();
  return `${pathname}?${searchParams}`;
}

/** Returns the key of what was typed in a page. */
function keptAs(page) {
  return `typed ${page}`;
}

/** Returns a text that differs between the forms of a page. Each setting has a form; only the hidden values differ. */
function formName(form) {
  const hidden = [...form.elements].filter(({ type, name }) => type === "hidden" && name !== "language");
  const action = form.dataset.post ?? form.getAttribute("action");
  return JSON.stringify([action, ...hidden.map(({ name, value }) => [name, value])]);
}

/** Returns the fields of forms that were not sent, by the name of the form and their own. */
function fields() {
  const named = [...document.querySelectorAll(FIELDS)].filter((field) => field.name && !("sent" in field.form.dataset));
  return named.map((field) => [`${formName(field.form)} ${field.name}`, field]);
}

/** Returns the value that a field had when the page was made. */
function made(field) {
  if (!field.matches("select")) return field.defaultValue;
  const options = [...field.options];
  return (options.find((option) => option.defaultSelected) ?? options[0])?.value ?? "";
}

/** Says that a form has been sent, so that what was typed in it is not kept. */
export function forgetTyped(form) {
  form.dataset.sent = "";
}

/** Says that this page is shown again at an address, so that what was typed stays. */
export function showAgain(address = location.href) {
  sessionStorage.setItem(AGAIN, pageOf(address));
}

function keep() {
  const kept = keptAs(sessionStorage.getItem(AGAIN) ?? pageOf(location.href));
  const typed = fields().filter(([, field]) => field.value !== made(field));
  if (typed.length > 0) sessionStorage.setItem(kept, JSON.stringify(typed.map(([name, field]) => [name, field.value])));
  else sessionStorage.removeItem(kept);
}

function restore() {
  const [navigation] = performance.getEntriesByType("navigation");
  const page = pageOf(location.href);
  const isAgain = sessionStorage.getItem(AGAIN) === page;
  sessionStorage.removeItem(AGAIN);
  const kept = new Map(JSON.parse(sessionStorage.getItem(keptAs(page)) ?? "[]"));
  sessionStorage.removeItem(keptAs(page));
  if (!isAgain && navigation?.type !== "back_forward") return;
  for (const [name, field] of fields()) {
    const value = kept.get(name);
    const isKnown = value !== undefined && (!field.matches("select") || [...field.options].some((option) => option.value === value));
    // The browser may have filled it in itself.
    if (!isKnown || field.value !== made(field)) continue;
    field.value = value;
    for (const event of ["input", "change"]) field.dispatchEvent(new Event(event, { bubbles: true }));
  }
}

// The scripts of the page then listen to changes.
if (document.readyState === "complete") restore();
else window.addEventListener("load", restore);
window.addEventListener("pagehide", keep);
