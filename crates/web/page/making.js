// Makes what the settings need and is not there, and goes back where that fails.

import { showControls } from "./controls.js";
import { look } from "./picture.js";
import { readSpectrum, refreshMap } from "./reading.js";
import { hideRelief, showRelief } from "./relief.js";
import { currentKeys, isFile, remember } from "./settings.js";
import { byId, page, views } from "./state.js";
import { progress, say, titleOf } from "./words.js";

const SPECTRUM_NOTE_MS = 300;

// What is being made of each kind, and how often that was begun: what is changed of one leaves the other at work.
const pending = { surface: null, scene: null };
const turns = { surface: 0, scene: 0, all: 0 };
let sceneShare = null;
// What the artist has, by the keys of the library, whether or not all that belongs to it was made.
const held = { method: null, scene: null };

/** Whether this kind has been begun anew, or given up, since. */
function staleOf(kind) {
  const turn = ++turns[kind];
  return () => turn !== turns[kind];
}

/** Makes what the settings need and is not there. */
export async function make() {
  // Nothing can be made of a file that is not there.
  if (isFile() && !page.source) return;
  const keys = currentKeys();
  const surfaceChanged = keys.relief !== page.keys.relief || keys.method !== page.keys.method;
  const sceneChanged = keys.scene !== page.keys.scene && page.adapter !== null;
  if (!surfaceChanged && !sceneChanged) return;
  page.keys = { ...keys, scene: sceneChanged ? keys.scene : page.keys.scene };
  const stale = staleOf("all");
  page.making = true;
  if (surfaceChanged) pending.surface = makeSurface(keys, staleOf("surface"));
  if (sceneChanged) pending.scene = makeScene(keys, staleOf("scene"));
  try {
    await Promise.all([pending.surface, pending.scene]);
    if (stale()) return;
    page.good = { settings: structuredClone(page.settings), source: page.source, read: page.read, keys: page.keys };
    page.making = false;
    progress(null);
    look();
    refreshMap();
    // Spectra need data of their own, which nobody waits for.
    setTimeout(() => !stale() && makeSpectra(), SPECTRUM_NOTE_MS);
  } catch (error) {
    if (!stale()) failed(error);
  }
}

async function makeSurface(keys, stale) {
  const { engine, settings, source } = page;
  engine.cancel();
  views.spectrum.say("");
  if (!engine.holds(keys.relief)) {
    progress("Reading the relief");
    const read = await engine.relief(settings, source?.file, keys.relief);
    if (stale()) return;
    page.read = read;
    byId("relief-name").textContent = source?.name ?? titleOf(settings.surface.preset);
    byId("scale").hidden = settings.surface.pixel_size === undefined && settings.surface.max_height === undefined;
    showRelief(read);
  }
  const { too_much } = await engine.estimate(settings);
  if (too_much) throw Object.assign(new Error(too_much), { kind: "limit" });
  if (stale()) return;
  const name = settings.method === "table" ? "Making the colour table" : `Making the data of ${settings.method}`;
  progress(name, 0);
  const start = performance.now();
  const told = (share) => stale() || progress(name, share);
  const bytes = page.adapter === null ? null : await engine.method(settings, told);
  const seconds = (performance.now() - start) / 1e3;
  await page.opening;
  if (stale()) return;
  if (!page.adapter) {
    await engine.reflectance(settings, keys.method, told);
    return;
  }
  page.made = { bytes: bytes.length, seconds };
  if (sceneShare !== null) progress("Making the shape", sceneShare);
  held.method = keys.method;
  await engine.setMethod(bytes);
}

async function makeScene(keys, stale) {
  sceneShare = 0;
  const { engine, settings } = page;
  for (const draft of [true, false]) {
    const bytes = await engine.scene(settings, draft, (share) => (sceneShare = share));
    if (draft) sceneShare = 0;
    else sceneShare = null;
    await page.opening;
    if (stale() || !page.adapter) return;
    held.scene = keys.scene;
    await engine.setScene(bytes, draft);
  }
}

function failed(error) {
  progress(null);
  page.making = false;
  if (error.kind === "scale") return askScale(error);
  if (error.kind !== "cancelled") say(error.kind === "internal" ? `The computation broke off: ${error.message}` : error.message);
  goBack();
}

/** To what was there before. */
export function goBack() {
  const { good } = page;
  for (const kind in turns) turns[kind] += 1;
  pending.surface = pending.scene = null;
  page.making = false;
  if (!good) {
    page.keys = { relief: null, method: null, scene: null };
    return;
  }
  const { surface, method, options, shape, resolution } = good.settings;
  page.settings = structuredClone({ ...page.settings, surface, method, options, shape, resolution });
  page.source = good.source;
  page.keys = page.adapter ? { ...good.keys, ...held } : good.keys;
  if (page.read !== good.read) {
    page.read = good.read;
    byId("relief-name").textContent = page.source?.name ?? titleOf(surface.preset);
    showRelief(good.read);
  }
  byId("scale").hidden = true;
  showControls();
  remember();
  // The artist may have got one of two things that were to be shown together. If what was there cannot be made anew, nothing is
  // left to go back to.
  if (page.keys.method !== good.keys.method || page.keys.scene !== good.keys.scene) page.good = null;
  make();
  look();
}

function askScale(error) {
  const { parameter } = error;
  byId("scale").hidden = false;
  byId("relief-name").textContent = page.source.name;
  byId("scale-question").textContent =
    parameter === "max_height"
      ? "The file does not say how high its largest value is. How high is it?"
      : "The file does not say how large a pixel is. How large is it?";
  byId(parameter).focus();
  hideRelief();
  page.read = null;
}

async function makeSpectra() {
  const { engine, settings } = page;
  if (isFile() && !page.source) return;
  const keys = currentKeys();
  if (!engine.holds(keys.relief) || engine.hasSpectra(keys.method)) return;
  const told = (share) => views.spectrum.say(`making its data: ${Math.floor(100 * share)} %`);
  told(0);
  try {
    await engine.spectra(settings, keys.method, told);
  } catch (error) {
    if (error.kind !== "cancelled") views.spectrum.say(error.message);
    return;
  }
  views.spectrum.say("");
  readSpectrum();
}
