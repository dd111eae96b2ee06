// Pair, metrics and scores of an answered item.

import { translate } from "./config.js";
import { localNumber } from "./scan-messages.js";
import * as ui from "./ui.js";

/** Announces the details of an item. They are on the server until the item is answered. */
export async function showDetails(item) {
  if (!item?.answer) return ui.announce(translate("answer_first"));
  const response = await fetch(`api/details/${item.id}`);
  if (!response.ok) return ui.announce(translate("answer_first"));
  const { pair, metrics, iou, dice, others } = await response.json();
  const number = (value) => localNumber(value, 3);
  const verdicts = others.map((other) => `${other.reviewer}: ${ui.answerText(other)}${other.note ? ` (${other.note})` : ""}`);
  const parts = [
    pair,
    `${translate("metrics")}: ${metrics.map((title) => translate(title)).join(", ")}`,
    `${translate("iou")} ${number(iou)}`,
    `${translate("dice")} ${number(dice)}`,
    ...(verdicts.length > 0 ? [`${translate("other_reviewers")}: ${verdicts.join("; ")}`] : []),
  ];
  ui.announce(parts.join(" · "));
}
