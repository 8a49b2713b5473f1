// Where the heights come from: presets, files, examples.

import { showControls } from "./controls.js";
import { change, settled } from "./settings.js";
import { byId, page } from "./state.js";
import { progress, say } from "./words.js";

/** A scan of 4096² in double precision has a quarter of this; all of it has to fit into the memory of a tab, twice. */
const FILE_BYTES_MAX = 512e6;

/** Fields of `surface` that belong to one source of heights and not to another. */
const OF_A_SOURCE = ["preset", "filename", "period", "height", "region_size", "region_spread", "pixel_size", "max_height", "channel", "fill", "level", "tiling"];

const withoutSource = (surface) => Object.fromEntries(Object.entries(surface).filter(([key]) => !OF_A_SOURCE.includes(key)));

export function choosePreset(preset) {
  page.source = page.wanted = page.example = null;
  showWanted();
  byId("scale").hidden = true;
  change((settings) => (settings.surface = { ...withoutSource(settings.surface), preset }));
}

export async function chooseFile(file) {
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

export function showWanted() {
  const { wanted } = page;
  byId("wanted").hidden = !wanted;
  if (!wanted) return;
  const sum = wanted.sha256 ? ` (SHA-256 ${wanted.sha256.slice(0, 12)}…)` : "";
  byId("wanted").textContent = `This link is about the file ${wanted.name}${sum}. Drop it here to see the picture.`;
}

export async function chooseExample(example) {
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

export async function fetched(example) {
  const answer = await fetch(`examples/${example.file}`);
  if (!answer.ok) throw new Error(`examples/${example.file}: ${answer.status} ${answer.statusText}`);
  return { name: example.file, file: new File([await answer.blob()], example.file), sha256: example.sha256 };
}

export function showStill(example) {
  byId("still").hidden = page.adapter !== null || !example;
  if (byId("still").hidden) return;
  byId("still").src = `examples/${example.thumbnail}`;
  byId("still").alt = `${example.title}, a ready-made picture`;
}

export function showExamples() {
  byId("examples").hidden = page.examples.length === 0;
  byId("examples").querySelector(".cards").replaceChildren(
    ...page.examples.map((example, index) => {
      const card = document.createElement("label");
      const [radio, image, title] = ["input", "img", "span"].map((name) => document.createElement(name));
      card.className = "card";
      Object.assign(radio, { type: "radio", name: "example", value: index });
      Object.assign(image, { src: `examples/${example.thumbnail}`, alt: "", width: 288, height: 192 });
      title.textContent = example.title;
      card.append(radio, image, title);
      radio.addEventListener("change", () => chooseExample(example));
      return card;
    }),
  );
}
