// Builds the data that the settings need and that do not exist yet. If a build fails, the settings return to the last
// ones whose data were complete (`page.good`).
//
// Two kinds of data are built in parallel: the surface (relief, then the method's data) and the scene (mesh and
// pigment). A change of one kind does not disturb the other. Each start of a build of one kind is a *turn*, counted in
// `turns`. A task that resumes after an `await` is *stale* if another turn of its kind has started. It must then end
// without an effect.
//
// `page.engine` builds data in Web Workers, the *makers*. The *artist* is the worker that draws pictures with WebGPU. A
// *key* is a text that names the settings that some data depend on (`currentKeys`). `page.keys` has the keys of the
// data that exist or are being built, `page.held` those of the data that the artist has. `page.opening` resolves when
// the attempt to open a graphics device has ended.

import { updateAddress } from "./address.js";
import { showControls } from "./panel.js";
import { readSpectrum, refreshMap } from "./reading.js";
import { hideRelief, showRelief } from "./relief.js";
import { byId, currentKeys, isFile, page, views } from "./state.js";
import { orderPicture } from "./view.js";
import { showMessage, showProgress, titleOf } from "./words.js";

/**
 * Delay in ms before the evaluator of spectra is built, which no picture needs. A shorter one would start builds
 * between two quick changes of the settings, only for the second change to cancel them; a longer one delays spectra.
 */
const SPECTRA_DELAY_MS = 300;

/** Promises of the last task of each kind; null before the first task and after a return to the last good state. */
const pending = { surface: null, scene: null };
/** Number of turns of each kind; `all` counts the calls of `makeMissing` that build. `goBack` increments all three. */
const turns = { surface: 0, scene: 0, all: 0 };
/** Finished fraction of the scene; null while none is being built. */
let sceneFraction = null;

/** Starts a turn of this kind. Returns the function `stale`, true once another turn of the kind has started. */
function startTurn(kind) {
  const turn = ++turns[kind];
  return () => turn !== turns[kind];
}

/** Builds all data whose keys have changed, then orders picture, map and spectrum. */
export async function makeMissing() {
  // The visitor may not have dropped the file of a link yet.
  if (isFile() && !page.source) return;
  const keys = currentKeys();
  const surfaceChanged = keys.relief !== page.keys.relief || keys.method !== page.keys.method;
  // `page.adapter` is null without a graphics device, and undefined while one is being opened. Without a device no
  // pictures are drawn, and no scene is needed.
  const sceneChanged = keys.scene !== page.keys.scene && page.adapter !== null;
  if (!surfaceChanged && !sceneChanged) return;
  // Without a device the key of the scene stays old, so that the scene is built when a device opens.
  page.keys = { ...keys, scene: sceneChanged ? keys.scene : page.keys.scene };
  const stale = startTurn("all");
  page.making = true;
  if (surfaceChanged) pending.surface = makeSurface(keys, startTurn("surface"));
  if (sceneChanged) pending.scene = makeScene(keys, startTurn("scene"));
  try {
    await Promise.all([pending.surface, pending.scene]);
    if (stale()) return;
    const { settings, source, example, relief, keys: built } = page;
    page.good = { settings: structuredClone(settings), source, example, relief, keys: built };
    page.making = false;
    showProgress(null);
    orderPicture();
    refreshMap();
    setTimeout(() => !stale() && makeSpectra(), SPECTRA_DELAY_MS);
  } catch (error) {
    if (!stale()) handleFailure(error);
  }
}

/** Reads and shows the relief, unless the maker has it already. */
async function readRelief(keys, stale) {
  const { engine, settings, source } = page;
  if (engine.holds(keys.relief)) return;
  showProgress("Reading the relief");
  const relief = await engine.relief(settings, source?.file, keys.relief);
  if (stale()) return;
  page.relief = relief;
  byId("relief-name").textContent = source?.name ?? titleOf(settings.surface.preset);
  // A scale that the visitor has entered can be changed.
  byId("scale").hidden = settings.surface.pixel_size === undefined && settings.surface.max_height === undefined;
  showRelief(relief);
}

/** Reads the relief and builds the method's data for the artist, or without WebGPU an evaluator on the CPU. */
async function makeSurface(keys, stale) {
  const { engine, settings } = page;
  engine.cancel();
  views.spectrum.say("");
  await readRelief(keys, stale);
  if (stale()) return;
  const task = settings.method === "table" ? "Making the colour table" : `Making the data of ${settings.method}`;
  showProgress(task, 0);
  const start = performance.now();
  const report = (fraction) => {
    if (!stale()) showProgress(task, fraction);
  };
  // While the device is still being opened, the data are built for it.
  const bytes = page.adapter === null ? null : await engine.method(settings, report);
  const seconds = (performance.now() - start) / 1e3;
  await page.opening;
  if (stale()) return;
  // Without a device, now or when the build began, the CPU draws maps. If a device opens later, `recover` (picture.js)
  // has its data built.
  if (!page.adapter || !bytes) {
    await engine.reflectance(settings, keys.method, report);
    return;
  }
  page.made = { bytes: bytes.length, seconds };
  // The picture also waits for a scene that is still being built.
  if (sceneFraction !== null) showProgress("Making the shape", sceneFraction);
  // Set before the message is sent: the artist takes the data even if this task becomes stale in the meantime.
  page.held.method = keys.method;
  await engine.setMethod(bytes);
}

/** Builds mesh and pigment for the artist: first a coarse draft, then the full scene. */
async function makeScene(keys, stale) {
  sceneFraction = 0;
  const { engine, settings } = page;
  for (const draft of [true, false]) {
    const bytes = await engine.scene(settings, draft, (fraction) => {
      if (!stale()) sceneFraction = fraction;
    });
    if (!stale()) sceneFraction = draft ? 0 : null;
    await page.opening;
    if (stale() || !page.adapter) return;
    // Set before the message is sent, like `page.held.method`. A draft alone is no scene.
    page.held.scene = draft ? null : keys.scene;
    await engine.setScene(bytes, draft);
  }
}

/**
 * Shows an error and returns to the last good state. If a file has no scale, asks the visitor for it instead. A
 * cancelled build has no message: it ends when the maker has to compute the checksum of a newly chosen file.
 */
function handleFailure(error) {
  showProgress(null);
  page.making = false;
  if (error.kind === "scale") return askScale(error);
  const prefix = error.kind === "internal" ? "The computation failed: " : "";
  if (error.kind !== "cancelled") showMessage(prefix + error.message);
  goBack();
}

/** Returns to the last state whose data were complete, `page.good`. Settings without data, such as the sun, stay. */
export function goBack() {
  const { good } = page;
  // Makes all tasks stale.
  for (const kind in turns) turns[kind] += 1;
  pending.surface = pending.scene = null;
  sceneFraction = null;
  page.making = false;
  if (!good) {
    page.keys = { relief: null, method: null, scene: null };
    return;
  }
  // All settings that data depend on.
  const { surface, method, options, shape, resolution } = good.settings;
  page.settings = structuredClone({ ...page.settings, surface, method, options, shape, resolution });
  Object.assign(page, { source: good.source, example: good.example });
  // The artist may already have data that are newer than the good state.
  page.keys = page.adapter ? { ...good.keys, ...page.held } : good.keys;
  if (page.relief !== good.relief) {
    page.relief = good.relief;
    byId("relief-name").textContent = page.source?.name ?? titleOf(surface.preset);
    showRelief(good.relief);
  }
  byId("scale").hidden = true;
  showControls();
  updateAddress();
  // If the artist already has the new method or scene, the old one has to be built again. Until then no state is
  // complete.
  if (page.keys.method !== good.keys.method || page.keys.scene !== good.keys.scene) page.good = null;
  makeMissing();
  orderPicture();
}

/** Asks the visitor for the scale that the file does not have: `parameter` is the name of the setting. */
function askScale({ parameter }) {
  byId("scale").hidden = false;
  byId("relief-name").textContent = page.source.name;
  byId("scale-question").textContent =
    parameter === "max_height"
      ? "The file does not say how high its largest value is. How high is it?"
      : "The file does not say how large a pixel is. How large is it?";
  byId(parameter).focus();
  hideRelief();
  page.relief = null;
}

/** Builds the evaluator of spectra in the background, then shows the spectrum. Its errors go to the plot. */
async function makeSpectra() {
  const { engine, settings } = page;
  if (isFile() && !page.source) return;
  const keys = currentKeys();
  if (!engine.holds(keys.relief) || engine.hasSpectra(keys.method)) return;
  const report = (fraction) => views.spectrum.say(`making its data: ${Math.floor(100 * fraction)} %`);
  report(0);
  try {
    await engine.spectra(settings, keys.method, report);
  } catch (error) {
    if (error.kind !== "cancelled") views.spectrum.say(error.message);
    return;
  }
  views.spectrum.say("");
  readSpectrum();
}
