// Files from the browser: they are chosen or dragged, and sent one after another.

import { act, read, showProblem, token } from "./action.js";
import { localNumber } from "./scan-messages.js";

const form = document.getElementById("upload");
const texts = form.dataset;
const extensions = new Set(texts.extensions.split(" "));
const systemFolders = new Set(texts.systemFolders.split(" "));
const choice = document.getElementById("upload-choice");
const state = document.getElementById("upload-state");
const bar = state.querySelector("progress");
const done = document.getElementById("upload-done");
const phase = document.getElementById("upload-phase");
const arrived = document.getElementById("upload-arrived");
const problem = document.getElementById("upload-problem");
const cancel = document.getElementById("upload-cancel");
const takeOver = document.getElementById("upload-take-over");
/** Most characters of a file name in the name of a folder. */
const MAX_STEM = 50;
/** The status of an upload that another page has begun, and this one can take over. */
const CONFLICT = 409;

/** The upload in progress: its id, and the request of its current file. */
let current = null;
/** Files that another page has begun to send. */
let refused = null;

/** Returns whether an import can use a file. Hidden files and those of systems are left out. */
function isWanted({ path }) {
  const names = path.split("/");
  const [, extension] = /\.([^.]*)$/.exec(names.at(-1)) ?? [];
  const isOfSystem = names.some((name) => name.startsWith(".") || systemFolders.has(name));
  return !isOfSystem && extensions.has(extension?.toLowerCase());
}

/** Returns a number of bytes as a person reads it. */
function size(bytes) {
  const [unit, divisor, digits] = bytes < 1e6 ? ["kB", 1e3, 0] : bytes < 1e9 ? ["MB", 1e6, 1] : ["GB", 1e9, 1];
  const rounded = digits === 0 ? Math.ceil(bytes / divisor) : bytes / divisor;
  return `${localNumber(rounded, digits)} ${unit}`;
}

function show(files, count, sent, bytes) {
  bar.max = Math.max(bytes, 1);
  bar.value = sent;
  done.textContent = `${localNumber(files)} / ${localNumber(count)} ${texts.files}, ${size(sent)} / ${size(bytes)}`;
}

/** Sends a file; `sent` hears how much of it is on its way. */
function sendFile(upload, { path, file }, sent) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    upload.request = request;
    request.open("POST", `uploads/${upload.id}/${encodeURIComponent(path)}?modified=${file.lastModified}`);
    request.setRequestHeader("content-type", "application/octet-stream");
    request.setRequestHeader("x-csrf-token", token);
    request.upload.onprogress = (event) => sent(event.loaded);
    request.upload.onload = () => {
      if (path.toLowerCase().endsWith(".zip")) phase.textContent = texts.unpacking;
    };
    request.onload = () => {
      try {
        resolve(read(request.status, request.responseText));
      } catch (error) {
        reject(error);
      }
    };
    request.onerror = () => reject(null);
    request.onabort = () => reject(null);
    request.send(file);
  });
}

/** Asks how far an archive is unpacked. */
async function follow(upload) {
  if (upload !== current || phase.textContent !== texts.unpacking) return;
  const reply = await fetch(`uploads/${upload.id}`, { headers: { accept: "application/json" } }).catch(() => null);
  const count = reply?.ok ? await reply.json() : null;
  if (count && upload === current) done.textContent = `${localNumber(count.files)} ${texts.files}, ${size(count.bytes)}`;
}

/** Returns why an upload was cut off. */
async function reason(upload) {
  const reply = await fetch(`uploads/${upload.id}`, { headers: { accept: "application/json" } }).catch(() => null);
  if (!reply) return texts.gone;
  const text = (await reply.json().catch(() => null))?.error;
  return text ?? texts.cut;
}

/** Returns a hash of the paths, sizes and times of files. The same files have the same hash, in any order. */
async function contentOf(files) {
  const lines = files.map(({ path, file }) => `${path}\n${file.size} ${file.lastModified}\n`);
  const bytes = new TextEncoder().encode(lines.sort().join(""));
  const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  return [...hash].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Begins an upload, or resumes an interrupted one of the same files. */
async function begin(files, bytes, takesOver) {
  const [name, content] = [nameOf(files), await contentOf(files)];
  const about = { name, content, files: files.length, bytes, project: texts.project, take_over: takesOver };
  const begun = await act("actions/upload", about);
  return { id: begun.upload, arrived: new Set(begun.arrived.map(({ path }) => path)), isCancelled: false };
}

/** Says how many files are not sent again. */
function showArrived(count) {
  arrived.textContent = `${texts.arrived}: ${localNumber(count)}`;
  arrived.hidden = count === 0;
}

/** Sends all files, and opens the page on which their pairs are shown. */
async function sendAll(files, takesOver) {
  const bytes = files.reduce((sum, { file }) => sum + file.size, 0);
  const upload = await begin(files, bytes, takesOver);
  current = upload;
  showArrived(upload.arrived.size);
  const timer = setInterval(() => follow(upload), 500);
  try {
    let sent = 0;
    for (const [index, file] of files.entries()) {
      phase.textContent = texts.sending;
      show(index, files.length, sent, bytes);
      if (!upload.arrived.has(file.path.normalize("NFC"))) {
        await sendFile(upload, file, (loaded) => show(index, files.length, sent + loaded, bytes));
      }
      if (upload.isCancelled) throw null;
      sent += file.file.size;
    }
    show(files.length, files.length, sent, bytes);
    phase.textContent = texts.storing;
    cancel.disabled = true;
    const reply = await act("actions/upload-end", { upload: upload.id, end: "finish", project: texts.project });
    current = null;
    location.assign(reply.go);
  } catch (error) {
    current = null;
    if (upload.isCancelled) throw new Error(texts.cancelled);
    throw error ?? new Error(await reason(upload));
  } finally {
    clearInterval(timer);
  }
}

/** Begins an upload of what was chosen, unless one is in progress. */
async function start(chosen, takesOver = false) {
  if (current || form.getAttribute("aria-busy") === "true") return;
  refused = null;
  takeOver.hidden = true;
  const files = chosen.filter(isWanted);
  showProblem(problem, files.length > 0 ? "" : texts.nothing);
  if (files.length === 0) return;
  form.setAttribute("aria-busy", "true");
  cancel.disabled = false;
  phase.textContent = texts.sending;
  show(0, files.length, 0, 0);
  choice.hidden = true;
  state.hidden = false;
  try {
    await sendAll(files, takesOver);
  } catch (error) {
    if (error.status === CONFLICT) refused = files;
    takeOver.hidden = !refused;
    state.hidden = true;
    choice.hidden = false;
    showProblem(problem, error.message);
  } finally {
    form.removeAttribute("aria-busy");
  }
}

/** Returns the name that the folder of the files gets: that of the only folder or archive, or else that of the first file. */
function nameOf(files) {
  const tops = new Set(files.map(({ path }) => path.split("/")[0]));
  const [top] = tops;
  const stem = top.replace(/(.)\.[^.]*$/, "$1");
  if (tops.size === 1 && files[0].path.includes("/")) return top;
  if (files.length === 1 && top.toLowerCase().endsWith(".zip")) return stem;
  return `files ${[...stem].slice(0, MAX_STEM).join("")}`;
}

function chosenIn(input) {
  return [...input.files].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
}

form.addEventListener("change", async (event) => {
  await start(chosenIn(event.target));
  event.target.value = "";
});

/** Returns the files of an entry that was dragged, also those in folders. */
async function below(entry, path) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    return [{ path: path + file.name, file }];
  }
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (entries.length === 0) return found;
    for (const next of entries) found.push(...(await below(next, `${path}${entry.name}/`)));
  }
}

form.addEventListener("dragover", (event) => {
  event.preventDefault();
  form.classList.add("over");
});
form.addEventListener("dragleave", () => form.classList.remove("over"));
form.addEventListener("drop", async (event) => {
  event.preventDefault();
  form.classList.remove("over");
  const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean);
  try {
    const found = await Promise.all(entries.map((entry) => below(entry, "")));
    await start(found.flat());
  } catch (error) {
    showProblem(problem, error.message);
  }
});

takeOver.addEventListener("click", () => {
  if (refused) start(refused, true);
});

cancel.addEventListener("click", async () => {
  const upload = current;
  if (!upload) return;
  upload.isCancelled = true;
  await act("actions/upload-end", { upload: upload.id, end: "cancel", project: "" }).catch(() => null);
  upload.request?.abort();
});

window.addEventListener("beforeunload", (event) => {
  if (current) event.preventDefault();
});
// The files that have arrived are kept for the next page.
window.addEventListener("pagehide", () => {
  if (!current || current.isCancelled) return;
  act("actions/upload-end", { upload: current.id, end: "pause", project: "" }, true).catch(() => null);
});

form.dataset.ready = "true";
