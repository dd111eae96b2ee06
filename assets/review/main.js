// The page put together: what each key and button does.

import { leastViewMs, language, queue, say } from "./boot.js";
import { Correction } from "./correction.js";
import { Deck } from "./deck.js";
import { label, listen } from "./keys.js";
import { Outbox } from "./outbox.js";
import { pictures } from "./pictures.js";
import * as screen from "./screen.js";
import { Stage } from "./stage.js";

const AHEAD = 5;
const HISTORY = 24;
const MODES = ["two_up", "overlay", "edges", "onion", "checker", "difference", "reveal"];
const REASONS = ["angle", "strokes_lost", "background_in", "shift_or_scale", "mirrored", "wrong_pair"];

const deck = new Deck();
const stage = new Stage(document.getElementById("canvas"));
const reviewer = document.querySelector("header b").textContent;
const outbox = new Outbox(reviewer, saved, refused);
const times = [];
let shownAt = null;
let note = null;
let correction = null;

/** What is on its way, and why it does not arrive; the end says whether everything did. */
function saved(waiting, trouble) {
  // A try that fails again must not cover why no more is taken.
  screen.saved(waiting, trouble === "lost" && outbox.isFull ? "blocked" : trouble);
  if (deck.items.length > 0 && !deck.current) screen.head(null, deck, waiting);
}

/** Shows the current card; it is there at once when it was decoded ahead. */
async function show(pressedAt) {
  const item = deck.current;
  leaveCorrection();
  note = item?.answer?.note ?? null;
  shownAt = null;
  const found = item && pictures(item.id);
  if (found?.ready) return picture(item, found.ready, pressedAt);
  stage.clear();
  around(item, null);
  if (!item) return screen.tell(document.getElementById("pair").textContent);
  try {
    const layers = await found.loading;
    if (deck.current === item) picture(item, layers, pressedAt);
  } catch (error) {
    if (deck.current === item) screen.alert(say("no_picture", { why: error.message }));
  }
}

/** The picture first; all that stands around it when it is on the screen. */
function picture(item, layers, pressedAt) {
  stage.show(layers);
  afterPaint(() => {
    if (deck.current !== item) return;
    shownAt = performance.now();
    if (pressedAt) document.body.dataset.paintMs = String(Math.round(shownAt - pressedAt));
    screen.measure(pressedAt ? say("painted", { ms: document.body.dataset.paintMs }) : "");
    around(item, layers);
    document.body.dataset.shown = item.id;
    lookAhead(item);
  });
}

/** Calls back when what was drawn in this turn is on its way to the screen. */
function afterPaint(then) {
  requestAnimationFrame(() => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = then;
    port2.postMessage(null);
  });
}

function around(item, layers) {
  if (!outbox.trouble) screen.calm();
  screen.head(item, deck, outbox.waiting);
  screen.history(deck, HISTORY, go);
  screen.sides(layers);
  screen.pace(times.slice(-200));
  refresh();
}

/** Decodes what comes next; the page tells when all of it is there. */
async function lookAhead(item) {
  await Promise.allSettled(deck.ahead(AHEAD).map(({ id }) => pictures(id).loading));
  document.body.dataset.ahead = item.id;
}

/** Marks what is on, in words and buttons. */
function refresh() {
  const on = new Set([stage.mode]);
  for (const [name, isOn] of Object.entries(stage.overlays)) if (isOn) on.add(name);
  if (stage.rocking) on.add("rock");
  if (stage.lens.zoom > 1) on.add("zoom");
  if (correction) on.add("correct");
  const answer = deck.current?.answer;
  if (answer) on.add(answer.verdict).add(answer.reason);
  if (note) on.add("note");
  screen.pressed(on);
  screen.legend(correction ? [] : stage.legend(), underStage());
}

/** What is said under the picture, besides what colours mean. */
function underStage() {
  if (correction) return `${correction.words()} — ${say("correct_hint")}`;
  if (stage.turn) return say("turned_by", { deg: stage.turn.toFixed(2) });
  const corrected = stage.layers && deck.current?.corrected;
  return corrected ? screen.laid(corrected) : "";
}

function give(verdict, reason, pressedAt) {
  const item = deck.current;
  if (!item) return;
  if (outbox.isFull) return screen.alert(say("blocked"));
  if (shownAt === null || pressedAt - shownAt < leastViewMs) return screen.tell(say("too_soon"));
  const body = { ...answerTo(item, verdict, reason), shown_ms: Math.round(pressedAt - shownAt) };
  times.push(body.shown_ms);
  deck.answer(item, body);
  deck.advance();
  show(pressedAt);
  send(item, body);
}

/** An answer as it stands on the page now. */
function answerTo(item, verdict, reason) {
  const turned = stage.turn === 0 ? null : Number(stage.turn.toFixed(2));
  return { event: crypto.randomUUID(), item: item.id, verdict, reason, note, angle_read_deg: turned };
}

function send(item, body) {
  screen.tell(`${deck.name(item)}: ${screen.words(body)}`);
  outbox.put("/api/answer", body).then(() => {
    if (queue === "adjudicate") about(item);
  });
}

function undo(pressedAt) {
  const act = deck.last();
  if (!act) return screen.tell(say("nothing_to_undo"));
  if (outbox.isFull) return screen.alert(say("blocked"));
  const item = deck.forget(act.event) ?? deck.items.find(({ id }) => id === act.id);
  if (item) deck.goTo(item);
  show(pressedAt);
  outbox.put("/api/undo", { event: act.event });
  screen.tell(`${say("undone")}: ${item ? deck.name(item) : ""}`);
}

/** The server will never take it: the card is open again, and why is said. */
function refused(letter, why) {
  if (letter.path === "/api/answer") deck.forget(letter.body.event);
  show();
  screen.alert(say("was_refused", { why }));
}

function go(item) {
  if (!deck.goTo(item)) return false;
  show(performance.now());
  return true;
}

/** What is known of a card, once it is answered. */
async function about(item = deck.current) {
  if (!item?.answer) return screen.tell(say("answer_first"));
  await outbox.sending;
  const answer = await fetch(`/api/about/${item.id}`);
  if (!answer.ok) return screen.tell(say("answer_first"));
  const { pair, metrics, iou, dice, others } = await answer.json();
  const number = (value) => value.toFixed(3);
  const said = others.map((other) => `${other.reviewer}: ${screen.words(other)}${other.note ? ` (${other.note})` : ""}`);
  const parts = [
    pair,
    `${say("metrics")} ${metrics.join(", ")}`,
    `${say("iou")} ${number(iou)}`,
    `${say("dice")} ${number(dice)}`,
    ...(said.length > 0 ? [`${say("others")}: ${said.join("; ")}`] : []),
  ];
  screen.tell(parts.join(" · "));
}

async function correct() {
  const item = deck.current;
  const layers = item && pictures(item.id).ready;
  if (correction || !layers) return leaveCorrection();
  stage.lens.reset();
  const begun = await Correction.begin(item, layers, stage, refresh).catch((error) => {
    screen.alert(error.message);
    return null;
  });
  if (!begun) return;
  if (deck.current !== item) return begun.leave();
  correction = begun;
  stage.guest = begun;
  stage.draw();
  refresh();
}

function leaveCorrection() {
  if (!correction) return;
  correction.leave();
  correction = null;
  stage.guest = null;
  stage.draw();
  refresh();
}

async function saveCorrection() {
  if (outbox.isFull) return screen.alert(say("blocked"));
  const { item, map } = correction;
  const stored = await outbox.put("/api/align", correction.body(crypto.randomUUID(), note));
  item.corrected = { ...stored, map };
  screen.tell(`${say("corrected")}: ${say("iou")} ${stored.iou.toFixed(3)}, ${say("dice")} ${stored.dice.toFixed(3)}`);
  leaveCorrection();
}

async function takeNote() {
  const item = deck.current;
  if (!item) return;
  if (outbox.isFull) return screen.alert(say("blocked"));
  const text = await screen.askNote(note);
  if (text === null || deck.current !== item || (text || null) === note) return refresh();
  note = text || null;
  // On a card that is answered the note is an answer again, with the same verdict.
  if (item.answer) {
    const body = { ...answerTo(item, item.answer.verdict, item.answer.reason), shown_ms: null };
    deck.answer(item, body);
    send(item, body);
  }
  refresh();
}

/** What an action does; `at` is when the key or button was pressed. */
const deeds = {
  pass: (at) => give("pass", null, at),
  fail: (at) => give("fail", null, at),
  unsure: (at) => give("unsure", null, at),
  undo,
  note: takeNote,
  flicker: () => stage.hold(true),
  rock: () => stage.rock(),
  protractor: () => stage.toggle("protractor"),
  strokes: () => stage.toggle("strokes"),
  zoom: () => stage.layers && stage.zoom(),
  turn_left: (at, event) => stage.turnBy(event?.shiftKey ? -0.25 : -1),
  turn_right: (at, event) => stage.turnBy(event?.shiftKey ? 0.25 : 1),
  less: () => stage.adjust(-1),
  more: () => stage.adjust(1),
  reset: () => stage.turnBy(-stage.turn),
  next: (at) => deck.step(1) && show(at),
  previous: (at) => deck.step(-1) && show(at),
  jump: () => screen.askPair(deck.pairs, async (name) => {
    const item = await deck.find(name);
    return Boolean(item) && go(item);
  }),
  info: () => about(),
  help: () => screen.help(),
  correct,
  save: () => correction && saveCorrection(),
  leave: () => leaveCorrection(),
  other_language: () => document.getElementById("language").click(),
};
for (const reason of REASONS) deeds[reason] = (at) => give("fail", reason, at);
for (const mode of MODES) deeds[mode] = () => stage.setMode(mode);

/** Holding a key down moves things, but judges nothing twice. */
const MAY_REPEAT = new Set(["turn_left", "turn_right", "less", "more", "next", "previous", "larger", "smaller"]);

/** What goes on to another picture, and would lose a correction that is not saved. */
const LEAVES = new Set(["pass", "fail", "unsure", "undo", "next", "previous", "jump", ...REASONS]);

function act(action, event, at) {
  const isArrow = event?.code?.startsWith("Arrow");
  if (event?.repeat && !MAY_REPEAT.has(action) && !isArrow) return;
  if (correction && event && correction.key(action, event)) return;
  if (correction && LEAVES.has(action)) return screen.tell(say("correct_first"));
  deeds[action]?.(at, event);
  // What goes on to another picture marks things when that is on the screen.
  if (!LEAVES.has(action)) refresh();
}

addEventListener("click", (event) => {
  const button = event.target.closest("[data-do]");
  if (!button) return;
  act(button.dataset.do, null, event.timeStamp);
  // After a click the keys are the page's again; who goes by Tab keeps the place.
  if (event.detail > 0) button.blur();
});
listen((action, event) => act(action, event, event.timeStamp), (action) => action === "flicker" && !stage.rocking && stage.hold(false));
label();

try {
  outbox.start();
  await deck.load(outbox.letters);
  screen.saved(outbox.waiting, null);
  await show();
  document.body.dataset.ready = "true";
} catch (error) {
  screen.alert(error.message);
}
