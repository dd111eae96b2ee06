// What is to be stored: sent in order, again and again until the server says that it is on the disk.

import { renew, word } from "./boot.js";

const SHELF = "mocban-outbox";
/** With so many unsaved the page takes no more. */
export const LIMIT = 3;
const FIRST_PAUSE_MS = 300;
const LONGEST_PAUSE_MS = 4000;

export class Outbox {
  /** `changed(waiting, trouble)` is called when either changes; `refused(letter, why)` when one will never be taken. */
  constructor(reviewer, changed, refused) {
    this.shelf = `${SHELF}:${reviewer}`;
    this.changed = changed;
    this.refused = refused;
    this.letters = this.restore();
    this.trouble = null;
    this.sending = null;
    addEventListener("online", () => this.wake?.());
    addEventListener("beforeunload", (event) => {
      if (this.letters.length > 0) event.preventDefault();
    });
  }

  get waiting() {
    return this.letters.length;
  }

  get isFull() {
    return this.waiting >= LIMIT;
  }

  /** Puts something to be sent; resolves with the reply when it is stored. */
  put(path, body) {
    const letter = { path, body };
    const reply = new Promise((resolve) => (letter.stored = resolve));
    this.letters.push(letter);
    this.keep();
    this.start();
    return reply;
  }

  /** Sends what is there, unless that is being done. */
  start() {
    this.sending ??= this.run().finally(() => (this.sending = null));
    return this.sending;
  }

  async run() {
    let pause = FIRST_PAUSE_MS;
    while (this.letters.length > 0) {
      const outcome = await this.send(this.letters[0]);
      if (outcome.again) {
        this.tell(outcome.again);
        await this.rest(pause);
        pause = Math.min(2 * pause, LONGEST_PAUSE_MS);
        continue;
      }
      pause = FIRST_PAUSE_MS;
      const letter = this.letters.shift();
      this.tell(null);
      this.keep();
      if (outcome.why) this.refused(letter, outcome.why);
      else letter.stored?.(outcome.reply);
    }
  }

  /** Stored, refused for good, or to be sent again and why. */
  async send({ path, body }) {
    let answer;
    try {
      answer = await fetch(path, {
        method: "POST",
        headers: { "content-type": "application/json", "x-mocban-word": word() },
        body: JSON.stringify(body),
      });
    } catch {
      return { again: "lost" };
    }
    if (answer.ok) return { reply: await answer.json() };
    if (answer.status === 401 || answer.status === 403) {
      // Another start of the server has other secrets; the cookie is there once its address was opened.
      await renew().catch(() => {});
      return { again: "restarted" };
    }
    if (answer.status >= 500) return { again: "lost" };
    const told = await answer.json().catch(() => ({}));
    return { why: told.error ?? String(answer.status) };
  }

  rest(ms) {
    return new Promise((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, ms);
    });
  }

  tell(trouble) {
    this.trouble = trouble;
    this.changed(this.waiting, trouble);
  }

  /** A reload must not lose what was not stored yet. */
  keep() {
    const letters = this.letters.map(({ path, body }) => ({ path, body }));
    sessionStorage.setItem(this.shelf, JSON.stringify(letters));
    this.changed(this.waiting, this.trouble);
  }

  restore() {
    try {
      return JSON.parse(sessionStorage.getItem(this.shelf) ?? "[]");
    } catch {
      return [];
    }
  }
}
