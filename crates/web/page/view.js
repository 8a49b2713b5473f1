// Orders of pictures from the artist, the Web Worker that draws (artist.js).

import { byId, page } from "./state.js";

/** Largest width in pixels of a picture whose size follows the window. Larger values are sharper and slower to draw. */
const WIDTH_MAX = 1536;
/** Smallest width in pixels of a picture whose size follows the window, for windows that are nearly closed. */
const WIDTH_MIN = 96;

/** Width and height in pixels: the visitor's choice, or 3:2 in the width of the frame. Coarser drafts come first. */
export function pictureSize() {
  const chosen = byId("size").value;
  if (chosen !== "auto") return chosen.split("x").map(Number);
  const width = Math.max(WIDTH_MIN, Math.min(WIDTH_MAX, Math.round(byId("frame").clientWidth * devicePixelRatio)));
  return [width, Math.round((width * 2) / 3)];
}

/**
 * Orders a picture of the current settings, if a device is open. It may be called for every event of a drag: browsers
 * send one each frame, and the artist draws only the last order.
 */
export function orderPicture() {
  if (!page.adapter) return;
  page.lastOrder += 1;
  page.engine.view(page.settings, ...pictureSize(), page.lastOrder);
}
