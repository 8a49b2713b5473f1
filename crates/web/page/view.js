// Orders pictures from the artist.

import { byId, page } from "./state.js";

/** Largest width in pixels of a picture whose size follows the window. Chosen. */
const WIDTH_MAX = 1536;
/** Smallest width in pixels of a picture whose size follows the window. Chosen. */
const WIDTH_MIN = 96;

/** Width and height in pixels of the finest picture. */
export function pictureSize() {
  const chosen = byId("size").value;
  if (chosen !== "auto") return chosen.split("x").map(Number);
  const width = Math.max(WIDTH_MIN, Math.min(WIDTH_MAX, Math.round(byId("frame").clientWidth * devicePixelRatio)));
  return [width, Math.round((width * 2) / 3)];
}

/**
 * Orders a picture of the present settings. It may be called for every event of a drag: browsers send these once a
 * frame, and the artist draws the last order only.
 */
export function orderPicture() {
  if (!page.adapter) return;
  page.asked += 1;
  page.engine.view(page.settings, ...pictureSize(), page.asked);
}
