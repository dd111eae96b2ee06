// Configuration from the server: CSRF token, key bindings, messages.

import { refusalIn } from "./reply.js";
import { withValues } from "./scan-messages.js";

export const language = document.documentElement.lang;

const config = await load();

async function load() {
  const response = await fetch("api/config");
  if (!response.ok) throw new Error(await response.text());
  return response.json();
}

export const csrfToken = () => config.csrf_token;
export const keys = () => config.keys;
export const reviewOrder = config.review_order;
export const minViewMs = config.min_view_ms;
/** Time after which a request to store something is given up and sent again, ms. */
export const sendLimitMs = config.send_limit_ms;
/** Examples of the guide with their right answers. */
export const examples = config.examples;
export const REASONS = ["angle", "strokes_lost", "background_in", "shift_or_scale", "mirrored", "wrong_pair"];

/** Returns the message of a key, with `{name}` replaced by the values. */
export function translate(key, values = {}) {
  return withValues(config.messages[language]?.[key] ?? key, values);
}

/** Returns why a request was refused, in the language of the page if the server says it. */
export async function refusalOf(response) {
  const text = await response.text().catch(() => "");
  return refusalIn(language, text, response.status);
}
