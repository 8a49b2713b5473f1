// Selection of the relief: a preset, a visitor's file, or an example. The form `scale` asks for the scale of a file
// that has none. state.js explains the fields of `page`. A function that has waited for a file is stale, and must end
// without an effect, if `page.choices` has changed in the meantime.

import { showControls } from "./panel.js";
import { change, settingsChanged } from "./settings.js";
import { byId, page } from "./state.js";
import { showMessage, showProgress } from "./words.js";

/** The settings of a surface without the fields that select its relief. */
const withoutSource = (surface) =>
  Object.fromEntries(Object.entries(surface).filter(([key]) => !page.engine.catalogue.source_fields.includes(key)));

/** The promise that the last call of `withProgress` awaits or awaited. */
let awaited = null;

/** Awaits a promise and shows `text` meanwhile, unless another promise or a build shows its own text. */
async function withProgress(text, promise) {
  awaited = promise;
  showProgress(text);
  try {
    return await promise;
  } finally {
    if (awaited === promise && byId("progress-text").textContent === text) showProgress(null);
  }
}

/** Selects a preset. */
export function choosePreset(preset) {
  page.choices += 1;
  page.source = page.wanted = page.example = null;
  showWanted();
  showStill(undefined);
  byId("scale").hidden = true;
  change((settings) => (settings.surface = { ...withoutSource(settings.surface), preset }));
}

/** Selects a file of the visitor. If the page waits for the file of a link, the link's settings apply to this file. */
export async function chooseFile(file) {
  showMessage(null);
  const { file_bytes_max } = page.engine.catalogue;
  if (file.size > file_bytes_max) {
    const [size, most] = [file.size, file_bytes_max].map((bytes) => Math.round(bytes / 1e6));
    showMessage(`${file.name} has ${size} MB, and the page reads files of up to ${most} MB.`);
    return;
  }
  const choice = ++page.choices;
  const isStale = () => choice !== page.choices;
  let sha256;
  try {
    sha256 = await withProgress("Reading the file", page.engine.checksum(file));
  } catch (error) {
    if (!isStale() && error.kind !== "cancelled") showMessage(error.message);
    return;
  }
  if (isStale()) return;
  const { wanted } = page;
  // Without a key the relief counts as missing: a file that is dropped a second time is read again, so that its scale
  // can be entered anew.
  page.keys = { ...page.keys, relief: null };
  page.source = { name: file.name, file, sha256 };
  page.example = null;
  showStill(undefined);
  if (wanted) {
    // The surface is that of the link, with its scale, if any.
    page.wanted = null;
    showWanted();
    if (wanted.sha256 && wanted.sha256 !== sha256) {
      showMessage(`${file.name} is not the file that the link was made with, and gives another picture.`);
    }
    // The visitor may have renamed the file.
    page.settings.surface.filename = file.name;
    // Unlike `change`, this keeps the message.
    settingsChanged();
    return;
  }
  byId("scale").hidden = true;
  for (const id of ["pixel_size", "max_height"]) byId(id).value = "";
  change((settings) => (settings.surface = { ...withoutSource(settings.surface), filename: file.name }));
}

/** Shows which file the page waits for, or hides this line. */
export function showWanted() {
  const { wanted } = page;
  byId("wanted").hidden = !wanted;
  if (!wanted) return;
  const sum = wanted.sha256 ? ` (SHA-256 ${wanted.sha256.slice(0, 12)}…)` : "";
  byId("wanted").textContent = `This link is about the file ${wanted.name}${sum}. Drop it here to see the picture.`;
}

/** Selects an example with its settings and file, if any. Camera, sun and map stay unless the settings have them. */
export async function chooseExample(example) {
  const choice = ++page.choices;
  const isStale = () => choice !== page.choices;
  let source = null;
  if (example.file) {
    try {
      source = await withProgress("Fetching the scan", fetched(example));
    } catch (error) {
      if (isStale()) return;
      showMessage(error.message);
      // The click has marked this card; the card of `page.example` is marked again.
      showControls();
      return;
    }
    if (isStale()) return;
  }
  const { camera, sun, map } = page.settings;
  try {
    page.settings = page.engine.complete({ camera, sun, map, ...example.settings });
  } catch (error) {
    showMessage(error.message);
    showControls();
    return;
  }
  page.source = source;
  page.wanted = null;
  page.example = example.name;
  showWanted();
  byId("scale").hidden = true;
  showMessage(null);
  showStill(example);
  settingsChanged();
}

/** Fetches the file of an example. Returns it in the form of page.source. */
export async function fetched(example) {
  const response = await fetch(`examples/${example.file}`);
  if (!response.ok) throw new Error(`examples/${example.file}: ${response.status} ${response.statusText}`);
  return { name: example.file, file: new File([await response.blob()], example.file), sha256: example.sha256 };
}

/**
 * Shows the ready-made picture of an example if there is no graphics device. Hides it for `undefined`, no example, and
 * for examples that were built without a graphics adapter, which have no picture.
 */
export function showStill(example) {
  byId("still").hidden = page.adapter !== null || !example?.thumbnail;
  if (byId("still").hidden) return;
  byId("still").src = `examples/${example.thumbnail}`;
  byId("still").alt = `${example.title}, a ready-made picture`;
}

/** Shows a card for each example. */
export function showExamples() {
  byId("examples").hidden = page.examples.length === 0;
  byId("examples").querySelector(".cards").replaceChildren(
    ...page.examples.map((example, index) => {
      const card = document.createElement("label");
      const [radio, image, title] = ["input", "img", "span"].map((name) => document.createElement(name));
      card.className = "card";
      Object.assign(radio, { type: "radio", name: "example", value: index });
      // THUMBNAIL_SIZE of page_twin.rs.
      Object.assign(image, { alt: "", width: 288, height: 192 });
      if (example.thumbnail) image.src = `examples/${example.thumbnail}`;
      title.textContent = example.title;
      card.append(radio, image, title);
      radio.addEventListener("change", () => chooseExample(example));
      return card;
    }),
  );
}
