// Actions, and parts of pages that are read again while they are shown.

import { act, showProblem } from "./action.js";
import { forgetTyped, showAgain } from "./typed.js";

const offline = document.getElementById("offline");

/** Returns the fields of a form, with the button that sent it. A name that occurs twice has a list. */
function fields(form, button) {
  const data = new FormData(form, button);
  const names = new Set(data.keys());
  return Object.fromEntries([...names].map((name) => {
    const values = data.getAll(name);
    return [name, values.length > 1 ? values : values[0]];
  }));
}

/** Returns the name under which this tab keeps the pairs that a form sends, if it sends any. */
function keptName(form) {
  return form.closest("[data-chosen]")?.dataset.chosen;
}

/** Sets the values of fields in an address. Empty ones are removed from it. */
function addFields(address, fields) {
  for (const field of fields) {
    const value = field.type === "checkbox" && !field.checked ? "" : field.value;
    if (value) address.searchParams.set(field.name, value);
    else address.searchParams.delete(field.name);
  }
}

/** Keeps fields of a refused form in the address, so that they stay if the page is loaded again, as a refusal may ask. */
function keepInAddress(form) {
  const kept = [...form.querySelectorAll("[data-in-address]")];
  if (kept.length === 0) return;
  const here = new URL(location.href);
  addFields(here, kept);
  history.replaceState(null, "", here);
}

// Links to the same page, such as those to other folders, keep what was typed. A confirmation in a checkbox is not kept: it is
// about the files that are shown.
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[href]");
  const typed = document.querySelectorAll("[data-in-address]:not([type=checkbox])");
  if (!link || typed.length === 0) return;
  const to = new URL(link.href);
  if (to.pathname !== location.pathname || to.origin !== location.origin) return;
  addFields(to, typed);
  link.href = to;
});

// The listener before this one may have changed the address of the link. With a key, another tab or window opens.
document.addEventListener("click", (event) => {
  const link = event.target.closest("header a[hreflang]");
  if (link && !(event.ctrlKey || event.metaKey || event.shiftKey || event.altKey)) showAgain(link.href);
});

document.addEventListener("submit", async (event) => {
  const form = event.target;
  if (!form.dataset.post) return;
  event.preventDefault();
  const question = event.submitter?.dataset.confirm;
  if (question && !window.confirm(question)) return;
  if (form.getAttribute("aria-busy") === "true") return;
  form.setAttribute("aria-busy", "true");
  const problem = form.querySelector(".problem");
  showProblem(problem, "");
  try {
    const kept = keptName(form);
    const pairs = kept && { pairs: JSON.parse(sessionStorage.getItem(kept) ?? "[]") };
    const reply = await act(form.dataset.post, { ...fields(form, event.submitter), ...pairs });
    if (kept) for (const name of [kept, `${kept}:open`]) sessionStorage.removeItem(name);
    if (reply.go) forgetTyped(form);
    if (reply.go) location.assign(reply.go);
    else if (reply.reload) await refresh(true);
  } catch (error) {
    showProblem(problem, error.message);
    keepInAddress(form);
    if (keptName(form)) document.dispatchEvent(new CustomEvent("refused", { detail: error.retired ?? [] }));
  } finally {
    form.removeAttribute("aria-busy");
  }
});

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-copy]");
  if (!button) return;
  try {
    await navigator.clipboard.writeText(button.dataset.copy);
    button.textContent = button.dataset.copied;
  } catch {
    // The browser forbids it; then the user copies the selected text.
    button.parentElement.querySelector("input").select();
  }
});

/** Returns whether a part can be replaced without taking something away from the user. */
function isInUse(part) {
  const active = document.activeElement;
  const isTyping = active && part.contains(active) && active.matches("input:not([readonly]), select, textarea");
  return isTyping || part.querySelector('[aria-busy="true"], .problem:not([hidden])') !== null;
}

/** Moves the focus to the element in the place of the one that had it. */
function withFocus(part, change) {
  const active = document.activeElement;
  const all = (root) => [...root.querySelectorAll("a[href], button, input, select, summary")];
  const index = part.contains(active) ? all(part).indexOf(active) : -1;
  change();
  if (index >= 0) all(part)[index]?.focus({ preventScroll: true });
}

/** Keeps what the user has typed in fields of forms that are still there. */
function keepTyped(part, fresh) {
  const of = (field) => `${field.form?.dataset.post} ${field.name}`;
  const fields = (root) => [...root.querySelectorAll("input:not([type=hidden], [readonly])")];
  for (const field of fields(part)) {
    if (field.value === field.defaultValue && field.checked === field.defaultChecked) continue;
    const same = fields(fresh).find((other) => of(other) === of(field));
    if (!same) continue;
    same.value = field.value;
    same.checked = field.checked;
  }
}

/** Keeps the pictures that are shown, so that they do not flicker. */
function update(part, fresh) {
  // Two lists may show the same picture.
  const shown = [...part.querySelectorAll("img")];
  for (const image of fresh.querySelectorAll("img")) {
    const at = shown.findIndex((known) => known.getAttribute("src") === image.getAttribute("src"));
    if (at >= 0) image.replaceWith(shown.splice(at, 1)[0]);
  }
  withFocus(part, () => part.replaceChildren(...fresh.childNodes));
}

/** Asks for a page; a failure is then explained in one too. */
const PAGE = { headers: { accept: "text/html" } };

/** Reads the page again and replaces its moving part. Without one, loads the page. */
async function refresh(mustReload) {
  const part = document.querySelector("[data-live]");
  if (!part) {
    if (mustReload) location.reload();
    return;
  }
  if (!mustReload && isInUse(part)) return;
  const response = await fetch(location.href, PAGE).catch(() => null);
  // An error is an answer, too: what causes it is said after the next action.
  offline.hidden = response !== null;
  if (!response?.ok) return;
  const page = new DOMParser().parseFromString(await response.text(), "text/html");
  // The language was changed on another page.
  if (page.documentElement.lang !== document.documentElement.lang) {
    if (document.activeElement?.matches("input:not([readonly]), select, textarea")) return;
    showAgain();
    location.reload();
    return;
  }
  const fresh = page.querySelector("[data-live]");
  if (!fresh || fresh.innerHTML === part.dataset.html) return;
  part.dataset.html = fresh.innerHTML;
  // After an action its form is empty again.
  if (!mustReload) keepTyped(part, fresh);
  update(part, fresh);
}

const live = document.querySelector("[data-live]");
if (live) {
  live.dataset.html = live.innerHTML;
  const interval = Number(live.dataset.live);
  const next = async () => {
    if (!document.hidden) await refresh(false);
    setTimeout(next, interval);
  };
  setTimeout(next, interval);
}

document.addEventListener("click", (event) => {
  if (event.target.closest("[data-print]")) window.print();
});

/** Loads the parts of a page that take long. */
const loads = [...document.querySelectorAll("[data-load]")].map(async (part) => {
  const response = await fetch(part.dataset.load, PAGE).catch(() => null);
  if (!response) offline.hidden = false;
  const text = await response?.text();
  const page = new DOMParser().parseFromString(text ?? "", "text/html");
  // The heading and the links of a page that fails are not those of this page.
  const failure = response?.ok ? null : page.querySelector("main .notice.bad");
  part.replaceChildren(...(failure ? [failure] : page.body.childNodes));
  part.dataset.loaded = "true";
});
await Promise.all(loads);
for (const button of document.querySelectorAll("[data-print]")) button.disabled = false;

// The language was chosen with this address; a later one may be chosen on another page. What was done is said once, except
// for retired pairs, whose number is read anew.
const here = new URL(location.href);
const once = ["language", "saved"];
if (here.searchParams.get("done") !== "retire") once.push("done", "count", "still_out");
if (once.some((name) => here.searchParams.has(name))) {
  for (const name of once) here.searchParams.delete(name);
  history.replaceState(null, "", here);
}

document.body.dataset.ready = "true";
