// The items in order, the reviewer's answers, and the log of events for undo.

import { refusalOf, translate } from "./config.js";

export class ReviewQueue {
  constructor() {
    this.items = [];
    /** Names of all pairs in the queue. */
    this.pairs = [];
    this.index = 0;
    /** Whether the page opens the guide at the start. */
    this.opensGuide = false;
    /** Number of faults that were made and wanted, if fewer could be made. */
    this.faultShortage = null;
    /** Item and event ids of the answers, oldest first. */
    this.events = [];
  }

  /** Loads the queue; `pending` requests that are not stored yet are applied on top. */
  async load(pending) {
    const response = await fetch("api/queue");
    if (!response.ok) throw new Error(await refusalOf(response));
    const { items, pairs, opens_guide: opensGuide, fault_shortage: faultShortage } = await response.json();
    this.opensGuide = opensGuide;
    this.faultShortage = faultShortage;
    this.items = items;
    this.pairs = pairs;
    const answered = this.items.filter((item) => item.answer);
    answered.sort((a, b) => a.answer.at - b.answer.at);
    this.events = answered.map(({ id, answer }) => ({ id, event: answer.event }));
    for (const { path, body } of pending) this.replay(path, body);
    const open = this.items.findIndex((item) => !item.answer);
    this.index = open < 0 ? this.items.length : open;
  }

  replay(path, body) {
    if (path === "api/undo") this.removeAnswer(body.event);
    const item = this.items.find((item) => item.id === body.item);
    // If only the reply was lost, the server has the answer already.
    if (path === "api/answer" && item && item.answer?.event !== body.event) this.answer(item, body);
  }

  get current() {
    return this.items[this.index];
  }

  get answeredCount() {
    return this.items.filter((item) => item.answer).length;
  }

  /** Returns the current item and the next `count` unanswered items. */
  upcoming(count) {
    const open = this.items.slice(this.index + 1).filter((item) => !item.answer);
    return [this.current, ...open].filter(Boolean).slice(0, count + 1);
  }

  /** Returns the latest answered items, newest first. */
  latest(count) {
    return this.events.slice(-count).reverse().map(({ id }) => this.items.find((item) => item.id === id)).filter(Boolean);
  }

  answer(item, { event, verdict, reason, note }) {
    item.answer = { event, verdict, reason, note, previous: item.answer };
    this.events.push({ id: item.id, event });
  }

  /** Moves to the next unanswered item, wrapping around at the end. */
  advance() {
    const count = this.items.length;
    for (let step = 1; step <= count; step++) {
      const index = (this.index + step) % count;
      if (!this.items[index].answer) return (this.index = index);
    }
    return (this.index = count);
  }

  /** Removes an answer and restores the one before it. Returns the item. */
  removeAnswer(event) {
    this.events = this.events.filter((other) => other.event !== event);
    const item = this.items.find((item) => item.answer?.event === event);
    if (item) item.answer = item.answer.previous;
    return item;
  }

  lastEvent() {
    return this.events.at(-1);
  }

  step(by) {
    const index = this.index + by;
    if (index < 0 || index >= this.items.length) return false;
    this.index = index;
    return true;
  }

  goTo(item) {
    const index = this.items.indexOf(item);
    if (index >= 0) this.index = index;
    return index >= 0;
  }

  /** Returns the name of an item: its pair, or its number while attention checks hide the pairs. */
  label(item) {
    return item.pair ?? translate("image_n", { n: this.items.indexOf(item) + 1 });
  }

  /** Finds an item by number, such as #7, or by pair: the first unanswered one, else the first. */
  async find(name) {
    if (/^#\d+$/.test(name)) return this.items[Number(name.slice(1)) - 1];
    const items = this.items.filter((item) => item.pair === name);
    if (items.length > 0) return items.find((item) => !item.answer) ?? items[0];
    const response = await fetch(`api/find/${encodeURIComponent(name)}`);
    if (!response.ok) return undefined;
    const { id } = await response.json();
    return this.items.find((item) => item.id === id);
  }
}
