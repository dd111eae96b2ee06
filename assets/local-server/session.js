// Remembers the address of the session and opens it. Every page without a session loads this script.

const KEY = "mocban-session";
const IS_SESSION = /^\/s\/[0-9a-f]{64}\/$/;

/** Returns the address of the session that this browser opened last. Other ports have a storage of their own. */
function remembered() {
  const opened = document.body.dataset.session;
  try {
    if (opened) localStorage.setItem(KEY, opened);
    return opened ?? localStorage.getItem(KEY) ?? "";
  } catch {
    // The browser stores nothing; then the page has no other address.
    return opened ?? "";
  }
}

const session = remembered();
// A session that has ended shows this page: opening it again would never end.
if (IS_SESSION.test(session) && !location.pathname.startsWith(session)) location.replace(session);
