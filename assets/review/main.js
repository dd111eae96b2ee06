// Connects the parts of the page: what each key and button does.

import { AlignmentEditor } from "./alignment-editor.js";
import { minViewMs, REASONS, reviewOrder, translate } from "./config.js";
import { showDetails } from "./details.js";
import { hideEnd, showEnd } from "./end-page.js";
import { closeGuide, openGuide } from "./guide.js";
import { images } from "./image-cache.js";
import { labelKeys, listen } from "./keyboard.js";
import { Practice } from "./practice.js";
import { ReviewQueue } from "./queue.js";
import { RetryQueue } from "./retry-queue.js";
import { isScanOpen, openScan } from "./scan-dialog.js";
import { localNumber } from "./scan-messages.js";
import * as ui from "./ui.js";
import { Viewer } from "./viewer.js";

const PREFETCH = 5;
const HISTORY = 24;
const MODES = ["two_up", "overlay", "edges", "onion", "checker", "difference", "reveal"];
/** Answers are too fast if the median of the last `FAST_COUNT` display times is below `FAST_MS`. */
const FAST_COUNT = 10;
const FAST_MS = 800;

const queue = new ReviewQueue();
const viewer = new Viewer(document.getElementById("canvas"));
const reviewer = document.querySelector("header b").textContent;
const requests = new RetryQueue(reviewer, onSaveState, onRejected);
const times = [];
let shownAt = null;
let note = null;
let editor = null;
let practice = null;

/** Shows how many requests are pending and why; updates the end text. */
function onSaveState(pendingCount, problem) {
  // A further failed attempt must not hide the reason why no answer is accepted.
  ui.saveState(pendingCount, problem === "disconnected" && requests.isFull ? "blocked" : problem);
  warnIfTooFast();
  if (queue.items.length === 0 || queue.current || practice) return;
  ui.heading(null, queue, pendingCount);
  if (pendingCount === 0) showEndPage();
}

/** Shows the current item, at once if its images are prefetched. */
async function show(pressedAt) {
  const item = queue.current;
  closeEditor();
  note = item?.answer?.note ?? null;
  shownAt = null;
  if (item) hideEnd();
  const found = item && images(item.id);
  if (found?.ready) return display(item, found.ready, pressedAt);
  viewer.clear();
  updateSurroundings(item, null);
  ui.busy(Boolean(item));
  if (!item) return showEndPage();
  try {
    const layers = await found.loading;
    if (queue.current === item) display(item, layers, pressedAt);
  } catch (error) {
    if (queue.current !== item) return;
    ui.busy(false);
    ui.alert(translate("no_image", { why: error.message }));
  }
}

function showEndPage() {
  const heading = document.getElementById("pair").textContent;
  ui.announce(heading);
  showEnd(heading, queue.items.length > 0);
}

/** Draws the image first, and updates everything else after it is painted. */
function display(item, layers, pressedAt) {
  viewer.show(layers);
  ui.busy(false);
  afterPaint(() => {
    if (queue.current !== item) return;
    shownAt = performance.now();
    if (pressedAt) document.body.dataset.paintMs = String(Math.round(shownAt - pressedAt));
    updateSurroundings(item, layers);
    document.body.dataset.shown = item.id;
    prefetch(item);
  });
}

/** Calls `then` after the browser has painted the current frame. */
function afterPaint(then) {
  requestAnimationFrame(() => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = then;
    port2.postMessage(null);
  });
}

function updateSurroundings(item, layers) {
  if (!requests.problem) ui.hideAlert();
  warnIfTooFast();
  ui.heading(item, queue, requests.pendingCount);
  ui.history(queue, HISTORY, go);
  ui.sideImages(layers);
  ui.pace(times.slice(-200));
  refresh();
}

/** Warns, while images are left and the last answers came faster than anybody can look at all strokes. */
function warnIfTooFast() {
  if (!queue.current || times.length < FAST_COUNT || requests.problem) return;
  const median = ui.median(times.slice(-FAST_COUNT));
  if (median < FAST_MS) ui.alert(translate("too_fast", { n: FAST_COUNT, s: ui.seconds(median) }));
}

/** Prefetches the images of the next items; the page is marked when all are there. */
async function prefetch(item) {
  await Promise.allSettled(queue.upcoming(PREFETCH).map(({ id }) => images(id).loading));
  document.body.dataset.prefetched = item.id;
}

/** Updates the active buttons and the caption. */
function refresh() {
  const on = new Set([viewer.mode]);
  for (const [name, isOn] of Object.entries(viewer.overlays)) if (isOn) on.add(name);
  if (viewer.flickerTimer) on.add("auto_flicker");
  if (viewer.viewport.zoom > 1) on.add("zoom");
  if (editor) on.add("align");
  const answer = practice ? practice.answer : queue.current?.answer;
  if (answer) on.add(answer.verdict).add(answer.reason);
  if (note) on.add("note");
  ui.markActive(on);
  ui.legend(editor || !viewer.layers ? [] : viewer.legend(), caption());
  ui.hint(editor ? translate("alignment_hint") : "");
  ui.alignmentBar(Boolean(editor));
}

/** Returns the text below the image, apart from the legend. */
function caption() {
  if (editor) return editor.summary();
  if (viewer.rotation) return translate("rotated_by", { deg: localNumber(viewer.rotation, 2) });
  const alignment = viewer.layers && queue.current?.manual_alignment;
  return alignment ? ui.alignmentText(alignment) : "";
}

function answer(verdict, reason, pressedAt) {
  const item = queue.current;
  if (!item) return;
  if (requests.isFull) return ui.alert(translate("blocked"));
  if (shownAt === null || pressedAt - shownAt < minViewMs) return ui.announce(translate("too_soon"), 3);
  const body = { ...answerBody(item, verdict, reason), shown_ms: Math.round(pressedAt - shownAt) };
  times.push(body.shown_ms);
  queue.answer(item, body);
  queue.advance();
  show(pressedAt);
  send(item, body);
}

/** Returns a new id. `crypto.randomUUID` does not exist on a page that another computer serves without encryption. */
function eventId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Returns the answer to send, with the note and rotation currently on the page. */
function answerBody(item, verdict, reason) {
  const angle = viewer.rotation === 0 ? null : Number(viewer.rotation.toFixed(2));
  return { event: eventId(), item: item.id, verdict, reason, note, angle_read_deg: angle };
}

function send(item, body) {
  ui.announce(`${queue.label(item)}: ${ui.answerText(body)}`);
  requests.push("api/answer", body).then(() => {
    if (reviewOrder === "adjudicate") details(item);
  });
}

function undo(pressedAt) {
  const last = queue.lastEvent();
  if (!last) return ui.announce(translate("nothing_to_undo"));
  if (requests.isFull) return ui.alert(translate("blocked"));
  const item = queue.removeAnswer(last.event) ?? queue.items.find(({ id }) => id === last.id);
  if (item) queue.goTo(item);
  show(pressedAt);
  requests.push("api/undo", { event: last.event });
  ui.announce(`${translate("undone")}: ${item ? queue.label(item) : ""}`);
}

/** Reopens the item of a request that the server rejected for good, and shows why. */
function onRejected(request, why) {
  if (request.path === "api/answer") queue.removeAnswer(request.body.event);
  show();
  ui.alert(translate("rejected", { why }));
}

function go(item) {
  if (!queue.goTo(item)) return false;
  show(performance.now());
  return true;
}

/** Announces the details of an item after its answer is stored. */
async function details(item = queue.current) {
  await requests.sending;
  await showDetails(item);
}

function startPractice() {
  closeEditor();
  closeGuide();
  hideEnd();
  practice = new Practice(viewer, refresh, () => {
    practice = null;
    show();
  });
}

/** Opens the 3D view of the current item. */
async function showScan() {
  const item = queue.current;
  if (!item) return;
  await openScan(item).catch((error) => ui.alert(translate("no_image", { why: error.message })));
}

/** Opens the alignment editor, or closes it if it is open. */
async function toggleEditor() {
  const item = queue.current;
  const layers = item && images(item.id).ready;
  if (editor || !layers) return closeEditor();
  viewer.viewport.reset();
  const opened = await AlignmentEditor.open(item, layers, viewer, refresh).catch((error) => {
    ui.alert(error.message);
    return null;
  });
  if (!opened) return;
  if (queue.current !== item) return opened.close();
  editor = opened;
  viewer.editor = opened;
  viewer.draw();
  refresh();
}

function closeEditor() {
  if (!editor) return;
  editor.close();
  editor = null;
  viewer.editor = null;
  viewer.draw();
  refresh();
}

async function saveAlignment() {
  if (requests.isFull) return ui.alert(translate("blocked"));
  const { item, map, scores, startScores } = editor;
  if (scores.iou < startScores.iou && !(await ui.confirmWorse(startScores.iou, scores.iou))) return;
  if (!editor || editor.item !== item) return;
  const stored = await requests.push("api/align", editor.body(eventId(), note));
  item.manual_alignment = { ...stored, map };
  ui.announce(`${translate("alignment_saved")}: ${translate("iou")} ${localNumber(stored.iou, 3)}, ${translate("dice")} ${localNumber(stored.dice, 3)}`);
  closeEditor();
}

async function editNote() {
  const item = queue.current;
  if (!item) return;
  if (requests.isFull) return ui.alert(translate("blocked"));
  const text = await ui.askNote(note);
  if (text === null || queue.current !== item || (text || null) === note) return refresh();
  note = text || null;
  // On an answered item the note is sent as a new answer with the same verdict.
  if (item.answer) {
    const body = { ...answerBody(item, item.answer.verdict, item.answer.reason), shown_ms: null };
    queue.answer(item, body);
    send(item, body);
  }
  refresh();
}

/** Handlers by action; `at` is the time of the key press or click. */
const actions = {
  pass: (at) => answer("pass", null, at),
  fail: (at) => answer("fail", null, at),
  unsure: (at) => answer("unsure", null, at),
  undo,
  note: editNote,
  flicker: () => viewer.setFlicker(true),
  auto_flicker: () => viewer.toggleAutoFlicker(),
  angle_guides: () => viewer.toggle("angle_guides"),
  stroke_map: () => viewer.toggle("stroke_map"),
  zoom: () => viewer.layers && viewer.zoom(),
  rotate_left: (at, event) => viewer.rotateBy(event?.shiftKey ? -0.25 : -1),
  rotate_right: (at, event) => viewer.rotateBy(event?.shiftKey ? 0.25 : 1),
  less: () => viewer.adjust(-1),
  more: () => viewer.adjust(1),
  reset: () => viewer.rotateBy(-viewer.rotation),
  next: (at) => queue.step(1) && show(at),
  previous: (at) => queue.step(-1) && show(at),
  jump: () => ui.askPair(queue.pairs, async (name) => {
    const item = await queue.find(name);
    return Boolean(item) && go(item);
  }),
  details: () => details(),
  guide: openGuide,
  practice: startPractice,
  help: () => ui.help(),
  align: toggleEditor,
  scan_view: showScan,
  save: () => editor && saveAlignment(),
  cancel: () => closeEditor(),
  other_language: () => document.getElementById("language").click(),
};
for (const reason of REASONS) actions[reason] = (at) => answer("fail", reason, at);
for (const mode of MODES) actions[mode] = () => viewer.setMode(mode);

/** Actions that repeat while their key is held. Verdicts do not. */
const MAY_REPEAT = new Set(["rotate_left", "rotate_right", "less", "more", "next", "previous", "larger", "smaller"]);

/** Actions that leave the current item and would lose an unsaved alignment. */
const LEAVES_ITEM = new Set(["pass", "fail", "unsure", "undo", "next", "previous", "jump", ...REASONS]);

function perform(action, event, at) {
  if (isScanOpen() || practice?.handle(action)) return;
  const isArrow = event?.code?.startsWith("Arrow");
  if (event?.repeat && !MAY_REPEAT.has(action) && !isArrow) return;
  if (editor && event && editor.handleKey(action, event)) return;
  if (editor && LEAVES_ITEM.has(action)) return ui.announce(translate("unsaved_alignment"));
  actions[action]?.(at, event);
  // An action that leaves the item refreshes when the next image is displayed.
  if (!LEAVES_ITEM.has(action)) refresh();
}

addEventListener("click", (event) => {
  const control = event.target.closest("[data-align], [data-action], #alignment-fine");
  if (!control) return;
  const { align, action } = control.dataset;
  if (align) editor?.step(align, event.shiftKey || ui.isFine());
  else if (action) perform(action, null, event.timeStamp);
  // After a mouse click, return the keys to the page. Keyboard users keep the focus.
  if (event.detail > 0) control.blur();
});
listen(
  (action, event) => perform(action, event, event.timeStamp),
  (action) => action === "flicker" && !viewer.flickerTimer && viewer.setFlicker(false),
);
labelKeys();

try {
  // An answer that is stored while the queue is read would be in neither of the two.
  await queue.load(requests.requests).finally(() => {
    requests.start();
  });
  ui.saveState(requests.pendingCount, null);
  ui.faultShortage(queue.faultShortage);
  await show();
  document.body.dataset.ready = "true";
  if (queue.opensGuide && queue.current) openGuide();
} catch (error) {
  ui.alert(error.message);
}
