// Looks at all files of an import while its page is shown, and lists the ones that cannot be used.

const part = document.getElementById("file-problems");
const [count, unusable, list] = ["looked-at", "unusable", "unusable-files"].map((id) => document.getElementById(id));
/** Most files that are listed. */
const SHOWN = 200;
let found = 0;

function add(problems) {
  for (const problem of problems) {
    found += 1;
    if (found > SHOWN) continue;
    const item = document.createElement("li");
    item.textContent = problem;
    list.append(item);
  }
  unusable.textContent = String(found);
  unusable.classList.toggle("bad", found > 0);
}

// A request ends when the page is left.
for (let next = 0; next !== null;) {
  const join = part.dataset.address.includes("?") ? "&" : "?";
  const response = await fetch(`${part.dataset.address}${join}after=${next}`).catch(() => null);
  if (!response?.ok) break;
  const reply = await response.json();
  count.textContent = String(reply.looked_at);
  add(reply.problems);
  next = reply.next;
}
part.dataset.over = "true";
