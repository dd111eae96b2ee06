// The page of `mocban view` and of a pair in the app: loads the scan from the server and shows it.

import { refusalIn } from "./reply.js";
import { preferredLanguage, scanText } from "./scan-messages.js";
import { mountScanViewer } from "./scan-viewer.js";

const language = preferredLanguage();
document.documentElement.lang = language;
const container = document.getElementById("scan-viewer");
try {
  const response = await fetch("scan");
  if (!response.ok) throw new Error(refusalIn(language, await response.text(), response.status));
  await mountScanViewer(container, await response.arrayBuffer(), { language });
} catch (error) {
  container.textContent = scanText(language, "no_data", { why: error.message });
}
