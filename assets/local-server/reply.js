// Replies of the server.

/** Parses a reply. A request that reached no page is refused in English and, on the next line, in Vietnamese. */
export function parseReply(text) {
  try {
    return JSON.parse(text);
  } catch {
    const [error, vietnamese] = text.split("\n");
    return { error, error_vi: vietnamese };
  }
}

/** Returns why a request was refused, in a language if the reply has it; the status if the reply says nothing. */
export function refusalIn(language, text, status) {
  const reply = parseReply(text);
  return reply[`error_${language}`] || reply.error || text || String(status);
}
