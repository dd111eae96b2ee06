// Requests that change something.

import { parseReply, refusalIn } from "./reply.js";

/** The token that they carry. */
export const token = document.querySelector('meta[name="csrf-token"]').content;

/** Says, in the language of the page, that the program does not answer. */
export function noAnswer() {
  return new Error(document.getElementById("offline").textContent.trim());
}

/** Shows a message in its place; an empty text hides it. It gets the focus, unless the user goes on with a list. */
export function showProblem(problem, text, hasFocus = true) {
  problem.textContent = text;
  problem.hidden = !text;
  if (!text) return;
  if (hasFocus) {
    problem.tabIndex = -1;
    problem.focus({ preventScroll: true });
  }
  // A refusal of a long form would stand below the window.
  problem.scrollIntoView({ block: "nearest" });
}

/** Returns what a reply says; throws the sentence of a refusal, with its status and the retired pairs that it names. */
export function read(status, text) {
  const reply = parseReply(text);
  if (status !== 200) {
    const why = refusalIn(document.documentElement.lang, text, status);
    throw Object.assign(new Error(why), { status, retired: reply.retired ?? [] });
  }
  return reply;
}

/** Sends an action. Its reply says which page follows. With `keepalive`, it is sent even while the page is closed. */
export async function act(address, fields, keepalive = false) {
  const response = await fetch(address, {
    method: "POST",
    keepalive,
    headers: { "content-type": "application/json", "x-csrf-token": token },
    body: JSON.stringify(fields),
  }).catch(() => {
    throw noAnswer();
  });
  return read(response.status, await response.text());
}
