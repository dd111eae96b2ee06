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
