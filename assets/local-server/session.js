// Remembers the address of the session and opens it. Every page without a session loads this script.

// Each invitation has a place of its own, so that guests who share a browser keep their sessions apart.
const SESSION = /^\/s\/[0-9a-f]{64}\/([0-9a-f]{16}\/)?/;
const { session: opened, place, guest } = document.body.dataset;

/** Returns the address of the session that this browser opened last. Other ports have a storage of their own. */
function remembered() {
  const of = (opened ?? location.pathname).match(SESSION)?.[1] ?? (place ? `${place}/` : "");
  // Without its place, the page of a guest cannot know whose session to open.
  if (guest !== undefined && !of) return "";
  const key = of ? `mocban-session:${of}` : "mocban-session";
  try {
    if (opened) localStorage.setItem(key, opened);
    return opened ?? localStorage.getItem(key) ?? "";
  } catch {
    // The browser stores nothing; then the page has no other address.
    return opened ?? "";
  }
}

const session = remembered();
// A session that has ended shows this page: opening it again would never end.
if (session.match(SESSION)?.[0] === session && !location.pathname.startsWith(session)) location.replace(session);
