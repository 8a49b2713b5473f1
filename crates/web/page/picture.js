// The picture on the canvas: the graphics device behind it, and the gestures on it. The *artist* is the worker that
// owns the device and draws (artist.js).

import { updateAddress } from "./address.js";
import { listenToGestures } from "./gestures.js";
import { onlyLatest } from "./latest.js";
import { makeMissing } from "./making.js";
import { angles } from "./map.js";
import { showMapLight, showSun } from "./panel.js";
import { DRAFT_SIDE, drawMap, readAt, refreshMap } from "./reading.js";
import { change } from "./settings.js";
import { showStill } from "./sources.js";
import { byId, page, THETA_MAX_DEG } from "./state.js";
import { orderPicture } from "./view.js";
import { rounded, showMessage, showStatus } from "./words.js";

/**
 * Time in ms after which an unfinished picture is reported in the status line. Chosen longer than the time between two
 * pictures of a drag, so that the line does not change then: laying out its text takes a tenth of the time of a draft.
 */
const STATUS_DELAY_MS = 100;
/**
 * Time in ms within which a second loss of the device is taken for a defect. The visitor is then asked before the
 * device is opened again. Chosen: with a shorter time, a device that is lost again and again may be opened each time;
 * with a longer one, visitors are asked after independent losses, too.
 */
const REPEATED_LOSS_MS = 10000;

/** Timer of the next report in the status line. */
let statusTimer = 0;

/** Handles an event of the artist (artist.js): a picture that was drawn, a failure, or the loss of the device. */
export function handleArtistEvent(event) {
  if (event.type === "lost") return handleLoss(event.message);
  // An order of a picture that the worker could not handle gives an "error" (answering.js).
  if (event.type === "failed" || event.type === "error") return showMessage(event.message);
  // The time of the first picture of complete data (state.js).
  if (page.good && !page.making) page.good.at ??= performance.now();
  // Performance marks are for measurements.
  if (!page.drawn) performance.mark("first-picture");
  if (event.finest) performance.mark("finest-picture");
  page.drawn = event;
  clearTimeout(statusTimer);
  if (event.finest) showStatus();
  else statusTimer = setTimeout(showStatus, STATUS_DELAY_MS);
}

/** Replaces the canvas by a new one and returns it. A device can only be opened on a canvas that was never drawn on. */
function newCanvas() {
  const old = byId("picture");
  const canvas = old.cloneNode(false);
  const focused = document.activeElement === old;
  old.replaceWith(canvas);
  if (focused) canvas.focus();
  listenToGestures(canvas, actions);
  return canvas;
}

/** Time in ms (`performance.now`) of the last loss of the device. */
let lastLoss = -Infinity;

/** Reports the loss of the device, and opens it again. Asks the visitor first after a repeated loss. */
async function handleLoss(message) {
  page.adapter = null;
  const repeated = performance.now() - lastLoss < REPEATED_LOSS_MS;
  lastLoss = performance.now();
  showMessage(null);
  byId("lost").hidden = false;
  byId("lost-text").textContent = `The graphics device was lost: ${message || "no reason was given"}.`;
  byId("recover").hidden = !repeated;
  if (!repeated) await recover();
}

/** Opens the device again and builds the data that it lacks. */
export async function recover() {
  byId("lost-text").textContent = "The graphics device was lost. It is being started again.";
  const error = await openArtist();
  if (error) {
    byId("lost-text").textContent = `The graphics device was lost and cannot be started again: ${error.message}`;
    byId("recover").hidden = false;
    return;
  }
  byId("lost").hidden = byId("still").hidden = true;
  showMessage("The graphics device was lost and has been started again.");
  // `makeMissing` builds what the artist lacks: without a device, data were built for the CPU alone.
  page.keys = { ...page.keys, ...page.held };
  makeMissing();
}

/**
 * Opens the graphics device and sets `page.adapter`, `undefined` until then and null if it fails. Returns the error if
 * it fails, otherwise null.
 */
export async function openArtist() {
  page.adapter = undefined;
  const opening = page.engine.openArtist(newCanvas());
  // Tasks that only wait for the end of opening do not handle its error.
  page.opening = opening.catch(() => {});
  try {
    page.adapter = await opening;
  } catch (error) {
    page.adapter = null;
    // The engine has ended the artist, and its data are lost.
    page.held = { method: null, scene: null };
    return error;
  }
  orderPicture();
  return null;
}

/** Shows why there is no graphics device, and a ready-made picture instead. */
export function showWithoutArtist(error) {
  byId("no-gpu").hidden = false;
  byId("no-gpu-reason").textContent = `The reason: ${error.message}.`;
  // These controls change pictures, which are not drawn.
  for (const field of document.querySelectorAll("#save-png, #reset, #size, #blend, .tabs input")) field.disabled = true;
  showStill(page.examples.find(({ name }) => name === page.example));
  showStatus();
}

/** Changes camera or sun by the function `name` of the library (quick.rs), called with the settings and `numbers`. */
const move = (name, ...numbers) => {
  page.settings = JSON.parse(page.engine.quick[name](JSON.stringify(page.settings), ...numbers));
  showSun();
  updateAddress();
  orderPicture();
};

/** Effects of gestures, for `listenToGestures`. */
const actions = {
  turn: (right, down) => move("turned", right, down),
  sun: (right, down) => move("sunned", right, down),
  pan: (right, down) => move("panned", right, down, byId("frame").clientWidth),
  zoom: (factor) => move("zoomed", factor),
  reset: resetView,
  dragsSun: () => document.querySelector("input[name=drag]:checked").value === "sun",
  hover,
  // Draws the map of the last point again, at full resolution.
  leave: () => refreshMap(),
};

/** Sets camera and sun to their defaults. */
export function resetView() {
  const { camera, sun } = JSON.parse(page.engine.quick.default_settings());
  change((settings) => Object.assign(settings, { camera, sun }));
}

/**
 * Shows a point of the picture in the map: a coarse map for the light at the point, read at the viewer's direction.
 * Coordinates are in [0, 1) from the upper left. Points off the relief change nothing.
 */
const showPoint = onlyLatest(async (x, y) => {
  const found = await page.engine.query(x, y);
  // A film may be lit and seen from below, but the map has the directions above the surface alone.
  const isBelow = found && Math.min(found.wi[2], found.wo[2]) <= 0;
  if (!found || (isBelow && page.settings.surface.transmission === "film")) return;
  const { theta_deg, phi_deg } = angles(found.wi);
  page.settings.map = { theta_deg: rounded(Math.min(theta_deg, THETA_MAX_DEG)), phi_deg: rounded(phi_deg) };
  showMapLight();
  await drawMap(found.wi, DRAFT_SIDE);
  readAt(found.wo);
});

/** Shows the point under the pointer in the map, at full resolution once the pointer rests. Shows errors. */
async function hover(x, y) {
  if (!page.adapter || !page.drawn) return;
  try {
    // True if no newer point waits (latest.js).
    if (await showPoint(x, y)) refreshMap();
  } catch (error) {
    // `handleLoss` reports the loss of the device. A cancelled question belongs to a worker that was ended.
    if (error.kind !== "lost" && error.kind !== "cancelled") showMessage(error.message);
  }
}
