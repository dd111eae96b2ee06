// Looks at all files of an import while its page is shown, and lists the ones that cannot be used.

const element = (id) => document.getElementById(id);
const part = element("file-problems");
/** Most files that are listed. */
const SHOWN = 200;
let found = 0;

/** Returns a number with a thin space between groups of three digits, as the pages have it. */
const grouped = (number) => String(number).replace(/\B(?=(\d{3})+$)/g, "\u202f");

function add(problems) {
  for (const problem of problems) {
    found += 1;
    if (found > SHOWN) continue;
    const item = document.createElement("li");
    item.textContent = problem;
    element("unusable-files").append(item);
  }
  element("unusable").textContent = grouped(found);
  element("unusable").classList.toggle("bad", found > 0);
  element("more-unusable").hidden = found <= SHOWN;
  element("more-unusable").querySelector("b").textContent = grouped(Math.max(found - SHOWN, 0));
}

// A request ends when the page is left.
for (let next = 0; next !== null;) {
  const join = part.dataset.address.includes("?") ? "&" : "?";
  const response = await fetch(`${part.dataset.address}${join}after=${next}`).catch(() => null);
  const reply = response?.ok ? await response.json().catch(() => null) : null;
  if (!reply) {
    element("stopped-looking").hidden = false;
    break;
  }
  element("looked-at").textContent = `${grouped(reply.looked_at)} / ${grouped(reply.total)}`;
  element("other-pairs").hidden = reply.next !== null || reply.looked_at >= reply.total;
  add(reply.problems);
  next = reply.next;
}
part.dataset.over = "true";
