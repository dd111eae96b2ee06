// Columns that were chosen for a list. This browser uses them again for lists with the same header.

const part = document.getElementById("columns");
const key = `columns ${part.dataset.header}`;
const choices = [...part.querySelectorAll("form select")];
const here = new URL(location.href);

/** Returns whether the form has a column with this name and value. */
function isOffered([name, value]) {
  const column = choices.find((choice) => choice.name === name);
  return [...(column?.options ?? [])].some((option) => option.value === value);
}

/** Returns names and values of the columns that were chosen; none if the browser keeps nothing. */
function kept() {
  try {
    // Without a value that the form takes, the page would be opened again and again.
    return JSON.parse(localStorage.getItem(key)).filter(isOffered);
  } catch {
    return [];
  }
}

function keep(chosen) {
  try {
    if (chosen.length > 0) localStorage.setItem(key, JSON.stringify(chosen));
    else localStorage.removeItem(key);
  } catch {
    // The browser keeps nothing; the import goes on without it.
  }
}

part.querySelector("form").addEventListener("submit", () => {
  keep(choices.filter((choice) => choice.value).map((choice) => [choice.name, choice.value]));
});

const chosen = kept();
if (chosen.length > 0 && !choices.some((choice) => here.searchParams.has(choice.name))) {
  for (const [name, value] of chosen) here.searchParams.set(name, value);
  here.searchParams.set("kept_columns", "yes");
  location.replace(here);
}
