// Search, and the contents that are folded on narrow screens.
(() => {
  "use strict";
  /** The folder of the first page. */
  const root = new URL(".", document.currentScript.src);
  /** Results that are shown. */
  const MAX_RESULTS = 20;
  /** Letters before and after a found word. */
  const BEFORE = 40;
  const AFTER = 100;

  /** Returns a text without marks and in lower case, so that `van khac` finds `ván khắc`. It has as many letters. */
  function plain(text) {
    const letter = (one) => one.normalize("NFD").replace(/\p{M}/gu, "").replace(/[đĐ]/g, "d").toLowerCase();
    return [...text.normalize("NFC")].map((one) => (letter(one).length === one.length ? letter(one) : one)).join("");
  }

  /** Loads the texts of all pages once. A page that is opened as a file may load scripts, but no data. */
  let loading = null;
  function load() {
    loading ??= new Promise((resolve, reject) => {
      const script = document.createElement("script");
      script.src = new URL("search-index.js", root).href;
      script.onload = () => resolve(window.mocbanSearch.map((section) => ({ ...section, plain: plain(`${section.heading} ${section.text}`) })));
      script.onerror = reject;
      document.head.append(script);
    });
    return loading;
  }

  /** Returns the sections with all words; those with a word in their heading come first, and pages of this language. */
  function find(sections, query) {
    const words = plain(query).split(/\s+/).filter(Boolean);
    if (words.length === 0) return [];
    const language = document.documentElement.lang;
    const score = (one) => 2 * words.filter((word) => plain(one.heading).includes(word)).length + (one.language === language ? 1 : 0);
    const found = sections.filter((one) => words.every((word) => one.plain.includes(word)));
    return found.map((one) => [score(one), one]).sort((a, b) => b[0] - a[0]).map(([, one]) => ({ ...one, word: words[0] }));
  }

  function result({ path, anchor, title, heading, text, word, language }) {
    const link = document.createElement("a");
    link.href = new URL(path + (anchor ? `#${anchor}` : ""), root).href;
    link.lang = language;
    link.textContent = heading === title ? title : `${title}: ${heading}`;
    const place = plain(text).indexOf(word);
    const excerpt = document.createElement("p");
    excerpt.lang = language;
    const start = Math.max(0, place - BEFORE);
    excerpt.textContent = `${start > 0 ? "… " : ""}${text.slice(start, Math.max(0, place) + AFTER)} …`;
    const item = document.createElement("li");
    item.append(link, excerpt);
    return item;
  }

  const search = document.getElementById("search");
  const [input, list, status] = ["search-text", "search-results", "search-status"].map((id) => document.getElementById(id));
  async function show() {
    const query = input.value;
    const sections = await load().catch(() => []);
    // More letters may have been typed meanwhile.
    if (query !== input.value) return;
    const found = find(sections, query);
    list.replaceChildren(...found.slice(0, MAX_RESULTS).map(result));
    search.classList.toggle("active", query.trim() !== "");
    status.textContent = query.trim() ? status.dataset.found.replace("{n}", found.length) : "";
  }
  input.addEventListener("focus", () => load().catch(() => {}));
  input.addEventListener("input", show);
  input.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    input.value = "";
    show();
  });
  search.addEventListener("submit", (event) => {
    event.preventDefault();
    list.querySelector("a")?.click();
  });

  const button = document.getElementById("contents-button");
  const contents = document.getElementById("contents");
  button.addEventListener("click", () => {
    const isOpen = contents.classList.toggle("open");
    button.setAttribute("aria-expanded", isOpen);
  });
  document.documentElement.classList.add("script");
})();
