// The page: what is chosen, what is made of it, and what is shown.

import { openEngine } from "./engine.js";
import { listen } from "./gestures.js";
import { fromHash, toHash } from "./link.js";
import { angles, colourAt, direction, halfway, MapView } from "./map.js";
import { hideRelief, showRelief } from "./relief.js";
import { Sky } from "./sky.js";
import { Spectrum } from "./spectrum.js";

const byId = (id) => document.getElementById(id);
const MAP_SIDE = 128;
/** Of a map that follows the pointer. */
const DRAFT_SIDE = 48;
const EXR_SIDE = 256;
/** Of the map's light: at 90° nothing is lit. */
const THETA_MAX = 89.9;
/** Widest picture of the screen's own resolution, in pixels. */
const WIDTH_MAX = 1536;
/** A second loss within so many milliseconds is not mended without being asked. */
const LOSS_MS = 10000;
/** A scan of 4096² in double precision has a quarter of this; all of it has to fit into the memory of a tab, twice. */
const FILE_BYTES_MAX = 512e6;
const SPECTRUM_NOTE_MS = 300;
/** Fields of `surface` that belong to one source of heights and not to another. */
const OF_A_SOURCE = ["preset", "filename", "period", "height", "region_size", "region_spread", "pixel_size", "max_height", "channel", "fill", "level", "tiling"];
const DIELECTRICS = [{ name: "Keratin", eta: 1.56 }, { name: "Polycarbonate", eta: 1.58 }];

const page = {
  engine: null,
  settings: null,
  /** The file that was dropped or fetched: {name, file, sha256}; null for a preset. */
  source: null,
  /** The file that a link asks for and that is not there: {name, sha256}. */
  wanted: null,
  /** The graphics device; null where there is none, undefined while it is being opened, which `opening` waits for. */
  adapter: undefined,
  opening: null,
  examples: [],
  /** What was made last, with all that belongs to it: {settings, source, read}. */
  good: null,
  /** What is there or being made, by the keys of the library. */
  keys: { relief: null, method: null, scene: null },
  read: null,
  map: null,
  /** Directions that the map's facts are of. */
  wi: null,
  wo: null,
  /** The picture that was asked for last, null while that is being done: {serial, at}; and the one that was drawn last. */
  asked: null,
  drawn: null,
  making: false,
};
// For the browser's console, and for tests.
globalThis.sunbeam = page;

let spectrum, sky, mapView;

// Words

/** With a minus sign that is as wide as a digit. */
const signed = (text) => String(text).replace("-", "−");
const rounded = (angle) => Number(angle.toFixed(2));
const degrees = (angle) => `${signed(angle.toFixed(1))}°`;

function say(text) {
  byId("message").hidden = !text;
  byId("message").firstElementChild.textContent = text ?? "";
}

function progress(text, share) {
  byId("progress").hidden = text === null;
  if (text === null) return;
  byId("progress-text").textContent = share === undefined ? text : `${text}: ${Math.floor(100 * share)} %`;
  if (share === undefined) byId("progress-bar").removeAttribute("value");
  else byId("progress-bar").value = share;
}

function showStatus() {
  const { drawn, made, adapter, settings } = page;
  const parts = [settings.method];
  if (made) parts.push(`${(made.bytes / 1e6).toFixed(made.bytes < 1e6 ? 2 : 1)} MB made in ${made.seconds.toFixed(1)} s`);
  if (drawn) parts.push(`${drawn.width} × ${drawn.height} in ${Math.round(drawn.ms)} ms${drawn.finest ? "" : " (draft)"}`);
  parts.push(adapter ? adapter.name || adapter.backend : "no WebGPU");
  byId("status").textContent = parts.join(" · ");
}

// Settings

/** Changes settings by a function; says so where they are refused. */
function change(edit) {
  const next = structuredClone(page.settings);
  edit(next);
  try {
    page.settings = page.engine.complete(next);
  } catch (error) {
    say(error.message);
    showControls();
    return;
  }
  say(null);
  settled();
}

/** After settings have changed, in whatever way. */
function settled() {
  showControls();
  remember();
  make();
  look();
}

let remembering = 0;
function remember() {
  // Browsers refuse more than some hundred changes in half a minute.
  clearTimeout(remembering);
  remembering = setTimeout(() => history.replaceState(null, "", address()), 250);
}

function address() {
  const checksum = (page.source ?? page.wanted)?.sha256;
  const hash = toHash(page.engine.compact(page.settings), page.settings.surface.filename ? checksum : null);
  // An address without settings opens the first example, which the default settings are not.
  return `${location.pathname}${location.search}#${hash || `surface.preset=${page.settings.surface.preset}`}`;
}

function isFile() {
  return page.settings.surface.filename !== undefined;
}

function showControls() {
  const { settings } = page;
  const { surface } = settings;
  const put = (id, value) => {
    // What is being typed stays as it is.
    if (document.activeElement !== byId(id)) byId(id).value = value ?? "";
  };
  const preset = page.engine.catalogue.presets.find(({ name }) => name === surface.preset);
  byId("preset").value = isFile() ? "" : surface.preset;
  byId("grating").hidden = preset?.period_um === undefined;
  put("period", surface.period ?? preset?.period_um);
  put("height", surface.height ?? preset?.height_um);
  byId("file-options").hidden = !isFile();
  put("pixel_size", surface.pixel_size);
  put("max_height", surface.max_height);
  byId("fill").value = surface.fill ?? "none";
  put("channel", surface.channel);
  byId("level").value = surface.level ?? (isFile() ? "plane" : "none");
  const published = settings.method !== "table";
  byId("tiling").value = published ? "periodic" : (surface.tiling ?? (isFile() ? "aperiodic" : "periodic"));
  byId("tiling").disabled = published;
  byId("method").value = settings.method;
  byId("method-note").textContent = page.engine.catalogue.methods.find(({ name }) => name === settings.method)?.title ?? "";
  put("coherence_length", surface.coherence_length);
  const conserves = page.engine.catalogue.methods.find(({ name }) => name === settings.method)?.conserves_energy;
  byId("conserve_energy").disabled = !conserves;
  byId("conserve_energy").checked = Boolean(conserves && surface.conserve_energy);
  put("eta", surface.eta ?? 1.56);
  put("k", surface.k ?? 0);
  const material = [...byId("material").options].find(
    ({ dataset }) => Number(dataset.eta) === (surface.eta ?? 1.56) && Number(dataset.k) === (surface.k ?? 0),
  );
  byId("material").value = material?.value ?? "other";
  byId("blend").value = settings.pigment;
  byId("exposure").value = settings.exposure;
  byId("exposure-value").textContent = `${settings.exposure > 0 ? "+" : ""}${signed(settings.exposure)} stops`;
  for (const radio of document.querySelectorAll("input[name=scene]")) radio.checked = radio.value === settings.shape;
  for (const radio of document.querySelectorAll("input[name=example]")) {
    radio.checked = page.examples[radio.value]?.name === page.example;
  }
  showSun();
  showMapLight();
}

function showMapLight() {
  byId("map_theta").value = page.settings.map.theta_deg;
  byId("map_phi").value = page.settings.map.phi_deg;
}

function showSun() {
  const { sun, camera } = page.settings;
  sky.show(sun, camera);
  byId("azimuth").value = sun.azimuth_deg;
  byId("elevation").value = sun.elevation_deg;
  byId("azimuth-value").textContent = degrees(sun.azimuth_deg);
  byId("elevation-value").textContent = degrees(sun.elevation_deg);
}

// Making

function currentKeys() {
  const { relief, method, scene } = page.engine.keys(page.settings);
  const of = page.source?.sha256 ?? "";
  return { relief: relief + of, method: method + of, scene };
}

let turns = 0;
let sceneShare = null;

/** Makes what the settings need and is not there. */
async function make() {
  // Nothing can be made of a file that is not there.
  if (isFile() && !page.source) return;
  const keys = currentKeys();
  const tasks = [];
  const surfaceChanged = keys.relief !== page.keys.relief || keys.method !== page.keys.method;
  const sceneChanged = keys.scene !== page.keys.scene && page.adapter !== null;
  if (!surfaceChanged && !sceneChanged) return;
  page.keys = { ...keys, scene: sceneChanged ? keys.scene : page.keys.scene };
  const turn = ++turns;
  const stale = () => turn !== turns;
  page.making = true;
  if (surfaceChanged) tasks.push(makeSurface(keys, stale));
  if (sceneChanged) tasks.push(makeScene(stale));
  try {
    await Promise.all(tasks);
    if (stale()) return;
    page.good = { settings: structuredClone(page.settings), source: page.source, read: page.read, keys: page.keys };
    page.making = false;
    progress(null);
    look();
    refreshMap();
    // Spectra need data of their own, which nobody waits for.
    setTimeout(() => !stale() && makeReflectance(), SPECTRUM_NOTE_MS);
  } catch (error) {
    if (!stale()) failed(error);
  }
}

async function makeSurface(keys, stale) {
  const { engine, settings, source } = page;
  engine.cancel();
  spectrum.say("");
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
  await engine.setMethod(bytes);
}

async function makeScene(stale) {
  sceneShare = 0;
  const bytes = await page.engine.scene(page.settings, (share) => (sceneShare = share));
  sceneShare = null;
  await page.opening;
  if (!stale() && page.adapter) await page.engine.setScene(bytes);
}

function failed(error) {
  progress(null);
  page.making = false;
  if (error.kind === "scale") return askScale(error);
  if (error.kind !== "cancelled") say(error.kind === "internal" ? `The computation broke off: ${error.message}` : error.message);
  goBack();
}

/** To what was there before. */
function goBack() {
  const { good } = page;
  turns += 1;
  page.making = false;
  if (!good) {
    page.keys = { relief: null, method: null, scene: null };
    return;
  }
  const { surface, method, options, shape, resolution } = good.settings;
  page.settings = structuredClone({ ...page.settings, surface, method, options, shape, resolution });
  page.source = good.source;
  page.keys = good.keys;
  if (page.read !== good.read) {
    page.read = good.read;
    byId("relief-name").textContent = page.source?.name ?? titleOf(surface.preset);
    showRelief(good.read);
  }
  byId("scale").hidden = true;
  showControls();
  remember();
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

async function makeReflectance() {
  const { engine, settings } = page;
  if (!page.adapter || (isFile() && !page.source)) return;
  const keys = currentKeys();
  if (!engine.holds(keys.relief) || engine.hasReflectance(keys.method)) return;
  spectrum.say("making its data");
  try {
    await engine.reflectance(settings, keys.method);
  } catch (error) {
    if (error.kind !== "cancelled") spectrum.say(error.message);
    return;
  }
  readSpectrum();
}

const titleOf = (preset) => page.engine.catalogue.presets.find(({ name }) => name === preset)?.title ?? preset;

// The picture

function pictureSize() {
  const chosen = byId("size").value;
  if (chosen !== "auto") return chosen.split("x").map(Number);
  const width = Math.max(96, Math.min(WIDTH_MAX, Math.round(byId("frame").clientWidth * devicePixelRatio)));
  return [width, Math.round((width * 2) / 3)];
}

let looking = 0;
let serial = 0;
/** Asks for the picture anew, once a frame. */
function look() {
  if (!page.adapter) return;
  page.asked = null;
  if (looking) return;
  looking = requestAnimationFrame(() => {
    looking = 0;
    page.asked = { serial: ++serial, at: performance.now() };
    page.engine.view(page.settings, ...pictureSize(), serial);
  });
}

function artistSays(event) {
  if (event.type === "lost") return lost(event.message);
  if (event.type === "failed") return say(event.message);
  if (!page.drawn) performance.mark("first-picture");
  // The first picture of what was made.
  if (page.good && !page.making) page.good.at ??= performance.now();
  page.drawn = event;
  if (event.finest) performance.mark("finest-picture");
  showStatus();
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

async function recover() {
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
async function openArtist() {
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

function withoutArtist(error) {
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

function resetView() {
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
      page.settings.map = { theta_deg: rounded(Math.min(theta_deg, THETA_MAX)), phi_deg: rounded(phi_deg) };
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

// The map

let mapping = false;
let mapNext = null;
/** Draws the map for light from `wi`; of several asked for meanwhile, the last. */
async function drawMap(wi, side) {
  mapNext = { wi, side };
  if (mapping) return;
  mapping = true;
  try {
    while (mapNext) {
      const { wi, side } = mapNext;
      mapNext = null;
      const rgb = await mapOf(wi, side);
      if (!rgb) continue;
      page.map = { rgb, side, wi };
      mapView.show(page.engine.quick.map_picture(rgb, side), side);
      const { theta_deg, phi_deg } = angles(wi);
      page.wi = wi;
      if (page.wo) readAt(page.wo);
      else mapView.mark(wi, null);
    }
  } finally {
    mapping = false;
  }
}

function mapOf(wi, side) {
  const { engine } = page;
  if (page.adapter) return engine.map(wi, side);
  if (!engine.hasReflectance(currentKeys().method)) return null;
  const { theta_deg, phi_deg } = angles(wi);
  return engine.mapOnProcessor(theta_deg, phi_deg, side);
}

async function refreshMap() {
  const { theta_deg, phi_deg } = page.settings.map;
  remember();
  try {
    await drawMap(direction(theta_deg, phi_deg), MAP_SIDE);
  } catch (error) {
    if (error.kind !== "lost" && error.kind !== "cancelled") say(error.message);
  }
}

const inDegrees = (unit) => {
  const { theta_deg, phi_deg } = angles(unit);
  return `θ ${degrees(theta_deg)}, φ ${degrees(phi_deg)}`;
};

/** Reads the map towards `wo`. */
function readAt(wo) {
  page.wo = wo;
  const { wi, map } = page;
  if (!map || !wi) return;
  mapView.mark(wi, wo);
  const rgb = colourAt(map, wo);
  byId("fact-wo").textContent = inDegrees(wo);
  byId("fact-h").textContent = inDegrees(halfway(wi, wo));
  byId("fact-rgb").textContent = Array.from(rgb, (value) => signed(Number(value.toPrecision(3)))).join(", ");
  // What a surface that lies in this light would show: radiance over that of white which faces the sun.
  const shown = Float32Array.from(rgb, (value) => value * Math.PI * wi[2]);
  byId("swatch").style.backgroundColor = `rgb(${page.engine.quick.to_srgb(shown, page.settings.exposure).join(" ")})`;
  readSpectrum();
}

let reading = false;
let readNext = false;
async function readSpectrum() {
  readNext = true;
  if (reading || !page.wo || !page.engine.hasReflectance(currentKeys().method)) return;
  reading = true;
  try {
    while (readNext) {
      readNext = false;
      const values = await page.engine.spectrum(page.wi, page.wo);
      page.spectrum = values;
      if (values.length) spectrum.show(values);
      else spectrum.say(`${page.settings.method} has no spectrum`);
    }
  } catch (error) {
    if (error.kind !== "cancelled") spectrum.say(error.message);
  } finally {
    reading = false;
  }
}

// Sources

const withoutSource = (surface) => Object.fromEntries(Object.entries(surface).filter(([key]) => !OF_A_SOURCE.includes(key)));

function choosePreset(preset) {
  page.source = page.wanted = page.example = null;
  showWanted();
  byId("scale").hidden = true;
  change((settings) => (settings.surface = { ...withoutSource(settings.surface), preset }));
}

async function chooseFile(file) {
  say(null);
  if (file.size > FILE_BYTES_MAX) {
    say(`${file.name} has ${Math.round(file.size / 1e6)} MB, and the page reads files of up to ${FILE_BYTES_MAX / 1e6} MB.`);
    return;
  }
  let sha256;
  try {
    progress("Reading the file");
    sha256 = await page.engine.checksum(file);
  } catch (error) {
    progress(null);
    if (error.kind !== "cancelled") say(error.message);
    return;
  }
  progress(null);
  const { wanted } = page;
  // The same file may be dropped again, to be asked for its scale once more.
  page.keys = { ...page.keys, relief: null };
  page.source = { name: file.name, file, sha256 };
  page.example = null;
  if (wanted) {
    page.wanted = null;
    showWanted();
    if (wanted.sha256 && wanted.sha256 !== sha256) {
      say(`${file.name} is not the file that the link was made with, and gives another picture.`);
    }
    // The link's settings are for this file, whatever its name is now.
    page.settings.surface.filename = file.name;
    settled();
    return;
  }
  byId("scale").hidden = true;
  for (const id of ["pixel_size", "max_height"]) byId(id).value = "";
  change((settings) => (settings.surface = { ...withoutSource(settings.surface), filename: file.name }));
}

function showWanted() {
  const { wanted } = page;
  byId("wanted").hidden = !wanted;
  if (!wanted) return;
  const sum = wanted.sha256 ? ` (SHA-256 ${wanted.sha256.slice(0, 12)}…)` : "";
  byId("wanted").textContent = `This link is about the file ${wanted.name}${sum}. Drop it here to see the picture.`;
}

async function chooseExample(example) {
  let source = null;
  if (example.file) {
    progress("Fetching the scan");
    try {
      source = await fetched(example);
    } catch (error) {
      progress(null);
      say(error.message);
      showControls();
      return;
    }
    progress(null);
  }
  page.source = source;
  page.wanted = null;
  page.example = example.name;
  showWanted();
  byId("scale").hidden = true;
  const { camera, sun, map } = page.settings;
  try {
    page.settings = page.engine.complete({ camera, sun, map, ...example.settings });
  } catch (error) {
    say(error.message);
    return;
  }
  say(null);
  showStill(example);
  settled();
}

async function fetched(example) {
  const answer = await fetch(`examples/${example.file}`);
  if (!answer.ok) throw new Error(`examples/${example.file}: ${answer.status} ${answer.statusText}`);
  return { name: example.file, file: new File([await answer.blob()], example.file), sha256: example.sha256 };
}

function showStill(example) {
  byId("still").hidden = page.adapter !== null || !example;
  if (byId("still").hidden) return;
  byId("still").src = `examples/${example.thumbnail}`;
  byId("still").alt = `${example.title}, a ready-made picture`;
}

function showExamples() {
  byId("examples").hidden = page.examples.length === 0;
  byId("examples").querySelector(".cards").replaceChildren(
    ...page.examples.map((example, index) => {
      const card = document.createElement("label");
      const [radio, image, title] = ["input", "img", "span"].map((name) => document.createElement(name));
      card.className = "card";
      Object.assign(radio, { type: "radio", name: "example", value: index });
      Object.assign(image, { src: `examples/${example.thumbnail}`, alt: "", width: 384, height: 256 });
      title.textContent = example.title;
      card.append(radio, image, title);
      radio.addEventListener("change", () => chooseExample(example));
      return card;
    }),
  );
}

// Saving

function save(bytes, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1e4);
}

const fileStem = () => (page.source?.name ?? page.settings.surface.preset).replace(/\.[^.]*$/, "");

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    byId("status").textContent = `${what} copied.`;
  } catch {
    // Where the browser keeps the clipboard to itself, the text can be marked here.
    say(text);
  }
}

function onClick(id, task) {
  byId(id).addEventListener("click", async () => {
    try {
      await task();
    } catch (error) {
      say(error.message);
    }
  });
}

// Controls

function listenToControls() {
  const surface = (id, read) =>
    byId(id).addEventListener("change", () => {
      const value = read(byId(id));
      change(({ surface }) => {
        if (value === undefined) delete surface[id];
        else surface[id] = value;
      });
    });
  const number = (field) => (field.value === "" ? undefined : field.valueAsNumber);
  for (const id of ["period", "height", "coherence_length", "eta"]) surface(id, number);
  surface("k", (field) => number(field) || undefined);
  for (const id of ["level", "tiling", "fill"]) surface(id, (field) => field.value);
  surface("channel", (field) => field.value.trim() || undefined);
  surface("conserve_energy", (field) => field.checked);
  byId("preset").addEventListener("change", () => choosePreset(byId("preset").value));
  byId("file").addEventListener("change", () => {
    const [file] = byId("file").files;
    if (file) chooseFile(file);
    // The same file can be chosen again.
    byId("file").value = "";
  });
  byId("scale").addEventListener("submit", (event) => {
    event.preventDefault();
    change(({ surface }) => {
      for (const id of ["pixel_size", "max_height"]) {
        const value = number(byId(id));
        if (value === undefined) delete surface[id];
        else surface[id] = value;
      }
    });
  });
  byId("method").addEventListener("change", () => change((settings) => {
    settings.method = byId("method").value;
    settings.options = {};
  }));
  byId("material").addEventListener("change", () => {
    const { eta, k } = byId("material").selectedOptions[0].dataset;
    if (eta === undefined) return byId("eta").focus();
    change(({ surface }) => {
      surface.eta = Number(eta);
      if (Number(k)) surface.k = Number(k);
      else delete surface.k;
    });
  });
  byId("blend").addEventListener("change", () => change((settings) => (settings.pigment = byId("blend").value)));
  byId("exposure").addEventListener("input", () => change((settings) => (settings.exposure = byId("exposure").valueAsNumber)));
  for (const [id, key] of [["azimuth", "azimuth_deg"], ["elevation", "elevation_deg"]]) {
    byId(id).addEventListener("input", () => change(({ sun }) => (sun[key] = byId(id).valueAsNumber)));
  }
  for (const [id, key] of [["map_theta", "theta_deg"], ["map_phi", "phi_deg"]]) {
    byId(id).addEventListener("change", () => {
      change(({ map }) => (map[key] = byId(id).valueAsNumber));
      refreshMap();
    });
  }
  byId("size").addEventListener("change", look);
  for (const radio of document.querySelectorAll("input[name=scene]")) {
    radio.addEventListener("change", () => change((settings) => (settings.shape = radio.value)));
  }
  byId("cancel").addEventListener("click", () => {
    page.engine.cancel();
    progress(null);
    goBack();
    byId("status").textContent = page.good ? "Cancelled. This is the picture from before." : "Cancelled.";
  });
  byId("recover").addEventListener("click", recover);
  byId("message").querySelector("button").addEventListener("click", () => say(null));
  onClick("save-png", async () => save(await page.engine.png(), `${fileStem()}.png`, "image/png"));
  onClick("save-exr", async () => {
    const rgb = await mapOf(direction(page.settings.map.theta_deg, page.settings.map.phi_deg), EXR_SIDE);
    if (rgb) save(page.engine.quick.map_exr(rgb, EXR_SIDE), `${fileStem()}-brdf.exr`, "image/x-exr");
  });
  const settings = () => JSON.stringify(page.settings);
  onClick("copy-link", () => copy(new URL(address(), location.href).href, "Link"));
  onClick("copy-xml", () => copy(page.engine.quick.share_xml(settings(), ...pictureSize()), "Mitsuba XML"));
  onClick("copy-command", () => copy(page.engine.quick.share_command(settings(), ...pictureSize(), 1), "Command"));
  byId("reset").addEventListener("click", resetView);

  for (const kind of ["dragenter", "dragover"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      byId("drop").classList.add("over");
    });
  }
  document.addEventListener("dragleave", (event) => event.relatedTarget ?? byId("drop").classList.remove("over"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    byId("drop").classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (file) chooseFile(file);
  });
  new ResizeObserver(() => {
    if (byId("size").value === "auto") look();
  }).observe(byId("frame"));
  addEventListener("hashchange", () => open(location.hash));
}

function fillLists() {
  const { presets, conductors, extensions, version } = page.engine.catalogue;
  const option = (value, text, data = {}) => {
    const element = new Option(text, value);
    Object.assign(element.dataset, data);
    return element;
  };
  // Shown where the surface is a file.
  const none = option("", "none, a file");
  none.hidden = true;
  byId("preset").replaceChildren(none, ...presets.map(({ name, title }) => option(name, title)));
  const index = ({ name, eta, k = 0 }) => option(name, `${name}, ${eta}${k ? ` + ${k}i` : ""}`, { eta, k });
  byId("material").replaceChildren(...DIELECTRICS.map(index), ...conductors.map(index), option("other", "another index"));
  byId("file").accept = extensions.join(",");
  byId("about").textContent = `sunbeam ${version}`;
}

/** Takes the settings of an address. */
async function open(hash) {
  const { settings, sha256 } = fromHash(hash);
  if (Object.keys(settings).length === 0 && page.examples.length > 0) {
    page.settings = JSON.parse(page.engine.quick.default_settings());
    return chooseExample(page.examples[0]);
  }
  let complete;
  try {
    complete = page.engine.complete(settings);
  } catch (error) {
    say(`The link's settings are left aside: ${error.message}`);
    complete = JSON.parse(page.engine.quick.default_settings());
  }
  page.settings = complete;
  page.example = null;
  page.wanted = null;
  const { filename } = complete.surface;
  if (filename === undefined) {
    page.source = null;
    page.example = page.examples.find(({ file, settings }) => !file && settings.surface.preset === complete.surface.preset)?.name;
  } else if (page.source?.name !== filename || (sha256 && page.source.sha256 !== sha256)) {
    const example = page.examples.find(({ file, sha256: sum }) => file === filename && (!sha256 || sum === sha256));
    page.example = example?.name ?? null;
    page.source = example ? await fetched(example) : null;
    page.wanted = example ? null : { name: filename, sha256 };
  }
  showWanted();
  showStill(page.examples.find(({ name }) => name === page.example));
  settled();
}

async function fetchExamples() {
  const answer = await fetch("examples/index.json");
  return answer.ok ? answer.json() : [];
}

async function start() {
  spectrum = new Spectrum(byId("spectrum"));
  const [engine, examples] = await Promise.all([openEngine(artistSays), fetchExamples()]);
  Object.assign(page, { engine, examples });
  performance.mark("loaded");
  sky = new Sky(byId("sky"), (azimuth_deg, elevation_deg) =>
    change(({ sun }) => Object.assign(sun, { azimuth_deg, elevation_deg: Math.max(0.5, elevation_deg) })),
  );
  mapView = new MapView(byId("map"), byId("map-marks"), readAt);
  fillLists();
  showExamples();
  listenToControls();
  // Tables are made meanwhile.
  const opening = openArtist();
  await open(location.hash);
  const error = await opening;
  if (error) withoutArtist(error);
  document.body.dataset.ready = "";
}

start().catch((error) => {
  say(`The page could not start: ${error.message}`);
});
