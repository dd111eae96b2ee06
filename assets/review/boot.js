// What the page starts from: the words, the keys, and the word that writes must bring.

export const language = document.documentElement.lang;

let told = await ask();

async function ask() {
  const answer = await fetch("/api/boot");
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

/** Asks again, as after a restart of the server. */
export async function renew() {
  told = await ask();
}

export const word = () => told.word;
export const keys = () => told.keys;
export const queue = told.review_order;
export const leastViewMs = told.min_view_ms;

/** The words for a key, with what stands in braces filled in. */
export function say(key, values = {}) {
  const text = told.words[language]?.[key] ?? key;
  return text.replace(/\{(\w+)\}/g, (hole, name) => values[name] ?? hole);
}
