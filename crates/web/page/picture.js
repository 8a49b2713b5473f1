// The picture, and the graphics device that draws it.

import { showMapLight, showSun } from "./controls.js";
import { listen } from "./gestures.js";
import { make } from "./making.js";
import { angles } from "./map.js";
import { DRAFT_SIDE, drawMap, readAt, refreshMap } from "./reading.js";
import { change, remember } from "./settings.js";
import { showStill } from "./sources.js";
import { byId, page, THETA_MAX_DEG } from "./state.js";
import { rounded, say, showStatus } from "./words.js";

/** Widest picture of the screen's own resolution, in pixels. */
const WIDTH_MAX = 1536;
/** What is drawn is told of in words when it has stayed for so many milliseconds. */
const SAYING_MS = 100;
/** A second loss within so many milliseconds is not mended without being asked. */
const LOSS_MS = 10000;

export function pictureSize() {
  const chosen = byId("size").value;
  if (chosen !== "auto") return chosen.split("x").map(Number);
  const width = Math.max(96, Math.min(WIDTH_MAX, Math.round(byId("frame").clientWidth * devicePixelRatio)));
  return [width, Math.round((width * 2) / 3)];
}

/** Asks for the picture anew. Browsers tell of what is dragged once a frame, and the artist draws what was asked for last. */
export function look() {
  if (!page.adapter) return;
  page.asked += 1;
  page.engine.view(page.settings, ...pictureSize(), page.asked);
}

let saying = 0;
export function artistSays(event) {
  if (event.type === "lost") return lost(event.message);
  if (event.type === "failed") return say(event.message);
  if (!page.drawn) performance.mark("first-picture");
  // The first picture of what was made.
  if (page.good && !page.making) page.good.at ??= performance.now();
  page.drawn = event;
  if (event.finest) performance.mark("finest-picture");
  // Nobody reads what is said of a draft that the next one replaces, and laying the words out takes a tenth of its time.
  clearTimeout(saying);
  if (event.finest) showStatus();
  else saying = setTimeout(showStatus, SAYING_MS);
}

function newCanvas() {
  const old = byId("picture");
  const canvas = old.cloneNode(false);
  const focused = document.activeElement === old;
  old.replaceWith(canvas);
  if (focused) canvas.focus();
  listen(canvas, hands);
  return canvas;
}

let lastLoss = -Infinity;
async function lost(message) {
  page.adapter = undefined;
  const again = performance.now() - lastLoss < LOSS_MS;
  lastLoss = performance.now();
  say(null);
  byId("lost").hidden = false;
  byId("lost-text").textContent = `The graphics device was lost: ${message || "no reason was given"}.`;
  byId("recover").hidden = !again;
  if (!again) await recover();
}

export async function recover() {
  byId("lost-text").textContent = "The graphics device was lost. It is being started again.";
  const error = await openArtist();
  if (error) {
    byId("lost-text").textContent = `The graphics device was lost and cannot be started again: ${error.message}`;
    byId("recover").hidden = false;
    return;
  }
  byId("lost").hidden = true;
  say("The graphics device was lost and has been started again.");
  make();
}

/** Opens the graphics device; gives the error where that fails. */
export async function openArtist() {
  page.adapter = undefined;
  const opening = page.engine.openArtist(newCanvas());
  page.opening = opening.catch(() => {});
  try {
    page.adapter = await opening;
  } catch (error) {
    page.adapter = null;
    return error;
  }
  look();
  return null;
}

export function withoutArtist(error) {
  byId("no-gpu").hidden = false;
  byId("no-gpu-reason").textContent = `The reason: ${error.message}.`;
  // They are about pictures alone.
  for (const field of document.querySelectorAll("#save-png, #reset, #size, #blend, .tabs input")) field.disabled = true;
  showStill(page.examples.find(({ name }) => name === page.example));
  showStatus();
}

const move = (call, ...numbers) => {
  page.settings = JSON.parse(page.engine.quick[call](JSON.stringify(page.settings), ...numbers));
  showSun();
  remember();
  look();
};

const hands = {
  turn: (right, down) => move("turned", right, down),
  sun: (right, down) => move("sunned", right, down),
  pan: (right, down) => move("panned", right, down, byId("frame").clientWidth),
  zoom: (factor) => move("zoomed", factor),
  reset: resetView,
  dragsSun: () => document.querySelector("input[name=drag]:checked").value === "sun",
  hover,
  leave: () => refreshMap(),
};

export function resetView() {
  const { camera, sun } = JSON.parse(page.engine.quick.default_settings());
  change((settings) => Object.assign(settings, { camera, sun }));
}

let hovering = false;
let hoverNext = null;
/** Shows what the place of the picture sees, in the map. */
async function hover(x, y) {
  hoverNext = [x, y];
  if (hovering || !page.adapter || !page.drawn) return;
  hovering = true;
  try {
    while (hoverNext) {
      const at = hoverNext;
      hoverNext = null;
      const found = await page.engine.query(...at);
      if (!found) continue;
      const { theta_deg, phi_deg } = angles(found.wi);
      page.settings.map = { theta_deg: rounded(Math.min(theta_deg, THETA_MAX_DEG)), phi_deg: rounded(phi_deg) };
      showMapLight();
      await drawMap(found.wi, DRAFT_SIDE);
      readAt(found.wo);
    }
    refreshMap();
  } catch (error) {
    // The loss of the device is told elsewhere.
    if (error.kind !== "lost" && error.kind !== "cancelled") say(error.message);
  } finally {
    hovering = false;
  }
}
