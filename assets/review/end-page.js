// The page after the last image: what the reviewer has done, and what to do next.

import { reviewOrder, translate } from "./config.js";

const element = document.getElementById("end");

function create(tag, text, ...children) {
  const created = document.createElement(tag);
  if (text) created.textContent = text;
  created.append(...children);
  return created;
}

function lines({ results, reviewer, is_inattentive: isInattentive, others }) {
  const { pass, fail, unsure } = results;
  const texts = [translate("summary_results", { n: pass + fail + unsure, pass, fail, unsure })];
  const { attention_checks: checks, duplicates } = reviewer;
  if (checks.n > 0) texts.push(translate("summary_checks", checks));
  if (isInattentive) texts.push(translate("summary_practise"));
  if (duplicates.n > 0) texts.push(translate("summary_shown_twice", duplicates));
  for (const { a, b, n, agreed } of others) {
    const other = a === reviewer.reviewer ? b : a;
    if (n > 0) texts.push(translate("summary_agreement", { reviewer: other, n, agreed }));
  }
  return texts;
}

/** Returns the choices of this review, with which another person gets the same results: the last part of its address in the app. */
function choices() {
  return decodeURIComponent(location.pathname.split("/").at(-2));
}

/** Returns what a reviewer does next: with the app, with commands, or, if invited, nothing. */
function nextSteps(summary) {
  if (summary.project_page) {
    const page = (name, text) => {
      const link = create("a", text);
      link.href = `${summary.project_page}${name}`;
      return create("p", "", link);
    };
    const next = [page("report", translate("open_report"))];
    // Settled conflicts need no further reviewer.
    if (reviewOrder !== "adjudicate") next.push(page(`review?${choices()}`, translate("open_review")));
    return next;
  }
  if (!summary.command) return [create("p", translate("invited_end"))];
  const command = (text) => create("code", `${summary.command} ${text}`);
  return [
    create("p", `${translate("next_report")} `, command("report -o report.html")),
    create("p", `${translate("next_reviewer")} `, command(summary.next_reviewer)),
  ];
}

/** Shows a heading, and the summary once the server has it. */
export async function showEnd(heading, hasItems) {
  element.hidden = false;
  document.body.classList.add("ended");
  element.replaceChildren(create("h2", heading));
  if (!hasItems) return;
  // Without a connection, or before the last answer is stored, there is no summary yet.
  const response = await fetch("api/summary").catch(() => null);
  if (!response?.ok || element.hidden) return;
  const summary = await response.json();
  element.replaceChildren(
    create("h2", translate("summary")),
    create("ul", "", ...lines(summary).map((text) => create("li", text))),
    create("h3", translate("next_steps")),
    ...nextSteps(summary),
  );
  element.dataset.ready = "true";
}

export function hideEnd() {
  element.hidden = true;
  document.body.classList.remove("ended");
  delete element.dataset.ready;
}
