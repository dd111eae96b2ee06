// The 3D view of an item in a dialog over the page.

import { language, refusalOf, translate } from "./config.js";

const dialog = document.getElementById("scan");
let mounted = null;

/** Returns whether the dialog is open. The page then ignores its own keys. */
export const isScanOpen = () => dialog.open;

/** Opens the 3D view of an item. Resolves when it is shown; rejects if its data cannot be loaded. */
export async function openScan(item) {
  const container = document.createElement("div");
  container.className = "scan-frame";
  container.textContent = translate("loading");
  dialog.replaceChildren(container);
  dialog.showModal();
  try {
    const [{ mountScanViewer }, response] = await Promise.all([import("./scan-viewer.js"), fetch(`scan/${item.id}`)]);
    if (!response.ok) throw new Error(await refusalOf(response));
    const data = await response.arrayBuffer();
    // The dialog may have been closed, and even opened again, while the data arrived.
    if (!container.isConnected) return;
    mounted = await mountScanViewer(container, data, { language, close: () => dialog.close() });
    if (!container.isConnected) unmount();
  } catch (error) {
    if (container.isConnected) dialog.close();
    throw error;
  }
}

function unmount() {
  mounted?.unmount();
  mounted = null;
}

dialog.addEventListener("close", () => {
  unmount();
  dialog.replaceChildren();
});
