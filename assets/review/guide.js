// The guide: when to pass, with example pictures.

import { translate } from "./config.js";
import { exampleImages } from "./image-cache.js";
import { alert } from "./ui.js";

const dialog = document.getElementById("guide");

/** Draws the print with the outline of the relief, as the viewer does. */
async function draw(figure) {
  const canvas = figure.querySelector("canvas");
  const layers = await exampleImages(figure.dataset.example);
  [canvas.width, canvas.height] = [layers.width, layers.height];
  const context = canvas.getContext("2d");
  context.drawImage(layers.print, 0, 0);
  // Shifted copies make the outline wide enough for a small picture.
  for (const [x, y] of [[-1, 0], [1, 0], [0, -1], [0, 1], [0, 0]]) context.drawImage(layers.edges, x, y);
  figure.dataset.drawn = "true";
}

export async function openGuide() {
  dialog.showModal();
  // One after the other: the cache holds fewer items than the guide and the queue need together.
  try {
    for (const figure of dialog.querySelectorAll("figure:not([data-drawn])")) await draw(figure);
  } catch (error) {
    alert(translate("no_image", { why: error.message }));
  }
}

export const closeGuide = () => dialog.close();
