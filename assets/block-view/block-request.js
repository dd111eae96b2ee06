// Requests of the pages on which a block is changed.

import { blockText } from "./block-messages.js";
import { parseReply, refusalIn } from "./reply.js";

/** Returns the JSON of a reply; throws the sentence of a refusal in the language of the page. */
export async function request(language, path, options) {
  const response = await fetch(path, options).catch(() => null);
  if (!response) throw new Error(blockText(language, "no_answer"));
  const answer = await response.text();
  if (!response.ok) throw new Error(refusalIn(language, answer, response.status));
  return parseReply(answer);
}

/** Sends a change with the token of the page, and returns the reply. */
export function send(language, path, token, body) {
  const headers = { "content-type": "application/json", "x-csrf-token": token };
  return request(language, path, { method: "POST", headers, body: JSON.stringify(body) });
}
