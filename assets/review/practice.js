// The practice round: examples with known answers in the viewer. Nothing is stored.

import { examples, REASONS, translate } from "./config.js";
import { exampleImages } from "./image-cache.js";
import * as ui from "./ui.js";

/** Actions without meaning for an example. */
const UNUSED = new Set(["undo", "note", "previous", "jump", "details", "align", "scan_view"]);

/** Share of correct answers below which another round is suggested. */
const MIN_RIGHT = 0.8;

export class Practice {
  /** Shows the first example. `refresh` updates the buttons; `onEnd` is called after the last example or a skip. */
  constructor(viewer, refresh, onEnd) {
    Object.assign(this, { viewer, refresh, onEnd });
    const used = examples.filter(({ practice }) => practice !== null);
    this.examples = used.sort((a, b) => a.practice - b.practice);
    this.index = 0;
    this.rightCount = 0;
    this.answeredCount = 0;
    document.getElementById("practice-next").onclick = () => this.next();
    document.getElementById("practice-skip").onclick = () => this.end();
    this.show();
  }

  get current() {
    return this.examples[this.index];
  }

  async show() {
    const example = this.current;
    this.answer = null;
    this.viewer.clear();
    ui.practice(this.index, this.examples.length, translate("practice_ask"), false);
    this.refresh();
    const layers = await exampleImages(example.name).catch((error) => {
      ui.alert(translate("no_image", { why: error.message }));
    });
    if (!layers || this.current !== example) return;
    this.viewer.show(layers);
    ui.sideImages(layers);
    ui.busy(false);
    document.body.dataset.shown = `example-${example.name}`;
  }

  /** Handles an action; returns false for actions that only change the display. */
  handle(action) {
    if (["pass", "fail", "unsure", ...REASONS].includes(action)) this.judge(action);
    else if (action === "save" || action === "next") this.next();
    else if (action === "cancel") this.end();
    else return UNUSED.has(action);
    return true;
  }

  judge(action) {
    if (this.answer) return;
    const reason = REASONS.includes(action) ? action : null;
    this.answer = { verdict: reason ? "fail" : action, reason };
    this.answeredCount += 1;
    const { name, ...expected } = this.current;
    const isRight = this.answer.verdict === expected.verdict;
    if (isRight) this.rightCount += 1;
    const values = { answer: ui.answerText(expected), why: translate(`why_${name}`) };
    const isOtherReason = isRight && reason && reason !== expected.reason;
    const key = isOtherReason ? "practice_other_reason" : isRight ? "practice_right" : "practice_wrong";
    const text = translate(key, values);
    ui.practice(this.index, this.examples.length, text, true);
    this.refresh();
  }

  next() {
    if (!this.answer) return;
    if (this.index + 1 === this.examples.length) return this.end();
    this.index += 1;
    this.show();
  }

  end() {
    const [right, all] = [this.rightCount, this.answeredCount];
    this.index = this.examples.length;
    ui.endPractice();
    this.onEnd();
    if (all > 0) ui.announce(translate(right < MIN_RIGHT * all ? "practice_done_again" : "practice_done", { right, all }), 8);
  }
}
