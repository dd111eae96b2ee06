// The page of `mocban view` and of a pair in the app: loads the scan from the server and shows it.

import { preferredLanguage, scanText } from "./scan-messages.js";
import { mountScanViewer } from "./scan-viewer.js";

/** Returns the sentence of a refusal, which the app sends as JSON. */
async function refusal(response) {
  const text = await response.text();
  try {
    return JSON.parse(text).error ?? text;
  } catch {
    return text;
  }
}

const language = preferredLanguage();
document.documentElement.lang = language;
const container = document.getElementById("scan-viewer");
try {
  const response = await fetch("scan");
  if (!response.ok) throw new Error(await refusal(response));
  await mountScanViewer(container, await response.arrayBuffer(), { language });
} catch (error) {
  container.textContent = scanText(language, "no_data", { why: error.message });
}
