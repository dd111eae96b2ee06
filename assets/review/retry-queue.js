// Requests to store: sent in order, and retried until the server confirms that they are on the disk.

import { csrfToken, refusalOf, sendLimitMs } from "./config.js";

const STORAGE_KEY = "mocban-pending";
/** Number of unsaved requests at which the page accepts no more answers. */
export const MAX_PENDING = 3;
const FIRST_DELAY_MS = 300;
const MAX_DELAY_MS = 4000;
/** Place of the invitation in the path of the session, if there is one, and path of the review below the session. */
const [, GUEST = "", BELOW = ""] = location.pathname.match(/^\/s\/[0-9a-f]{64}\/([0-9a-f]{16}\/)?(.*)$/) ?? [];

export class RetryQueue {
  /** Calls `onChange(pendingCount, problem)` when either changes, and `onReject(request, why)` if the server refuses. */
  constructor(reviewer, onChange, onReject) {
    this.storageKey = [STORAGE_KEY, reviewer, GUEST + BELOW].filter(Boolean).join(":");
    this.onChange = onChange;
    this.onReject = onReject;
    this.requests = this.restore();
    this.problem = null;
    this.sending = null;
    addEventListener("online", () => this.wake?.());
    addEventListener("beforeunload", (event) => {
      if (this.requests.length > 0 && !this.isMoving) event.preventDefault();
    });
  }

  get pendingCount() {
    return this.requests.length;
  }

  get isFull() {
    return this.pendingCount >= MAX_PENDING;
  }

  /** Adds a request; resolves with the response when it is stored. */
  push(path, body) {
    const request = { path, body };
    const response = new Promise((resolve) => (request.resolve = resolve));
    this.requests.push(request);
    this.persist();
    this.start();
    return response;
  }

  /** Starts sending, unless it is already running. */
  start() {
    this.sending ??= this.run().finally(() => (this.sending = null));
    return this.sending;
  }

  async run() {
    let delay = FIRST_DELAY_MS;
    while (this.requests.length > 0) {
      const outcome = await this.send(this.requests[0]);
      if (outcome.retry) {
        this.report(outcome.retry);
        await this.wait(delay);
        delay = Math.min(2 * delay, MAX_DELAY_MS);
        continue;
      }
      delay = FIRST_DELAY_MS;
      const request = this.requests.shift();
      this.report(null);
      this.persist();
      if (outcome.why) this.onReject(request, outcome.why);
      else request.resolve?.(outcome.stored);
    }
  }

  /** Sends one request. Returns `{ stored }`, `{ why }` if it is rejected for good, or `{ retry }` with the problem. */
  async send({ path, body }) {
    let response, stored;
    try {
      response = await fetch(path, {
        method: "POST",
        headers: { "content-type": "application/json", "x-csrf-token": csrfToken() },
        body: JSON.stringify(body),
        // Also ends a response that stops in the middle. An event that arrives twice is stored once.
        signal: AbortSignal.timeout(sendLimitMs),
      });
      if (response.ok) stored = await response.json();
    } catch {
      return { retry: "disconnected" };
    }
    if (response.ok) return { stored };
    if (response.status === 401) {
      this.moveToNewSession();
      return { retry: GUEST ? "invitation_ended" : "restarted" };
    }
    if (response.status >= 500) return { retry: "disconnected" };
    return { why: await refusalOf(response) };
  }

  /**
   * A restarted server has a new session, which the user may have opened in another tab, and so has an invitation with a new
   * link. This page then moves there; the unsaved requests are in the session storage, and are sent from there.
   */
  moveToNewSession() {
    const session = localStorage.getItem(GUEST ? `mocban-session:${GUEST}` : "mocban-session");
    if (!session || location.pathname.startsWith(session)) return;
    this.isMoving = true;
    location.replace(session + BELOW);
  }

  wait(ms) {
    return new Promise((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, ms);
    });
  }

  report(problem) {
    this.problem = problem;
    this.onChange(this.pendingCount, problem);
  }

  /** Keeps unsaved requests in the session storage, so that they survive a reload. */
  persist() {
    const requests = this.requests.map(({ path, body }) => ({ path, body }));
    sessionStorage.setItem(this.storageKey, JSON.stringify(requests));
    this.onChange(this.pendingCount, this.problem);
  }

  restore() {
    try {
      return JSON.parse(sessionStorage.getItem(this.storageKey) ?? "[]");
    } catch {
      return [];
    }
  }
}
