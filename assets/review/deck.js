// The cards in order, the reviewer's answers to them, and the way back through the answers.

import { say } from "./boot.js";

export class Deck {
  constructor() {
    this.items = [];
    /** Names of all pairs that there are cards of. */
    this.pairs = [];
    this.place = 0;
    /** Ids of answered cards, oldest first, with the number of each act. */
    this.acts = [];
  }

  /** Reads the deck; answers that are still on their way count. */
  async load(waiting) {
    const answer = await fetch("/api/deck");
    if (!answer.ok) throw new Error((await answer.json()).error);
    const { items, pairs } = await answer.json();
    this.items = items;
    this.pairs = pairs;
    const answered = this.items.filter((item) => item.answer);
    answered.sort((a, b) => a.answer.at - b.answer.at);
    this.acts = answered.map(({ id, answer }) => ({ id, event: answer.event }));
    for (const { path, body } of waiting) this.replay(path, body);
    const open = this.items.findIndex((item) => !item.answer);
    this.place = open < 0 ? this.items.length : open;
  }

  replay(path, body) {
    if (path === "/api/undo") this.forget(body.event);
    const item = this.items.find((item) => item.id === body.item);
    if (path === "/api/answer" && item) this.answer(item, body);
  }

  get current() {
    return this.items[this.place];
  }

  get done() {
    return this.items.filter((item) => item.answer).length;
  }

  /** The cards that come next, the current one first. */
  ahead(count) {
    const open = this.items.slice(this.place + 1).filter((item) => !item.answer);
    return [this.current, ...open].filter(Boolean).slice(0, count + 1);
  }

  /** The cards answered last, newest first. */
  behind(count) {
    return this.acts.slice(-count).reverse().map(({ id }) => this.items.find((item) => item.id === id)).filter(Boolean);
  }

  answer(item, { event, verdict, reason, note }) {
    item.answer = { event, verdict, reason, note, before: item.answer };
    this.acts.push({ id: item.id, event });
  }

  /** To the next card that is not answered, from the one after this round to the start. */
  advance() {
    const count = this.items.length;
    for (let step = 1; step <= count; step++) {
      const place = (this.place + step) % count;
      if (!this.items[place].answer) return (this.place = place);
    }
    return (this.place = count);
  }

  /** Forgets an act; what was answered before it stands again. Gives the card. */
  forget(event) {
    this.acts = this.acts.filter((act) => act.event !== event);
    const item = this.items.find((item) => item.answer?.event === event);
    if (item) item.answer = item.answer.before;
    return item;
  }

  /** The newest act. */
  last() {
    return this.acts.at(-1);
  }

  step(by) {
    const place = this.place + by;
    if (place < 0 || place >= this.items.length) return false;
    this.place = place;
    return true;
  }

  goTo(item) {
    const place = this.items.indexOf(item);
    if (place >= 0) this.place = place;
    return place >= 0;
  }

  /** What a card is called: by its pair, or by its number where knowing a pair again would tell too much. */
  name(item) {
    return item.pair ?? say("picture_n", { n: this.items.indexOf(item) + 1 });
  }

  /** The card of a number such as #7, or the first of a pair that is not answered, else the first. */
  async find(name) {
    if (/^#\d+$/.test(name)) return this.items[Number(name.slice(1)) - 1];
    const cards = this.items.filter((item) => item.pair === name);
    if (cards.length > 0) return cards.find((item) => !item.answer) ?? cards[0];
    const answer = await fetch(`/api/find/${encodeURIComponent(name)}`);
    if (!answer.ok) return undefined;
    const { id } = await answer.json();
    return this.items.find((item) => item.id === id);
  }
}
