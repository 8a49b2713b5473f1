// Starts the page and opens the settings of its address. The state of the page is `page`, whose fields state.js
// explains. `page.engine.quick` is the library on the page's own thread, for calls without long computations.

import { listenToControls } from "./controls.js";
import { openEngine } from "./engine.js";
import { fromHash } from "./link.js";
import { MapView } from "./map.js";
import { fillLists } from "./panel.js";
import { handleArtistEvent, openArtist, showWithoutArtist } from "./picture.js";
import { readAt, refreshMap } from "./reading.js";
import { listenToSaving } from "./saving.js";
import { change, settingsChanged } from "./settings.js";
import { Sky } from "./sky.js";
import { chooseExample, fetched, showExamples, showStill, showWanted } from "./sources.js";
import { Spectrum } from "./spectrum.js";
import { byId, page, SUN_ELEVATION_MIN_DEG, views } from "./state.js";
import { showMessage } from "./words.js";

/** Opens the settings in the part of an address after the #, or the first example if there are none. */
async function open(hash) {
  const choice = ++page.choices;
  const { settings, sha256 } = fromHash(hash);
  if (Object.keys(settings).length === 0 && page.examples.length > 0) {
    page.settings = JSON.parse(page.engine.quick.default_settings());
    return chooseExample(page.examples[0]);
  }
  let complete;
  try {
    complete = page.engine.complete(settings);
  } catch (error) {
    showMessage(`The link's settings are ignored: ${error.message}`);
    complete = JSON.parse(page.engine.quick.default_settings());
  }
  page.settings = complete;
  page.wanted = null;
  const { filename, preset } = complete.surface;
  const isPreset = filename === undefined;
  // Whether the page has the file of the address already.
  const isHeld = !isPreset && page.source?.name === filename && (!sha256 || page.source.sha256 === sha256);
  if (!isHeld) page.source = null;
  const example = isPreset ? exampleOfPreset(preset) : exampleOfFile(filename, page.source?.sha256 ?? sha256);
  page.example = example?.name ?? null;
  if (!isPreset && !isHeld) {
    // The file is that of an example, or the visitor has to drop it.
    const source = example ? await fetchedOrNull(example) : null;
    // Another relief was chosen during the fetch, or a failed build has restored the one before (making.js).
    if (choice !== page.choices || page.settings.surface.filename !== filename) return;
    page.source = source;
    page.wanted = source ? null : { name: filename, sha256 };
  }
  showWanted();
  showStill(example);
  settingsChanged();
  // The new address may differ only in the light of the map. If data are being built, the map is drawn afterwards.
  if (page.good && !page.making) refreshMap();
}

/** The example without a file that has this preset; undefined for none. */
function exampleOfPreset(preset) {
  return page.examples.find(({ file, settings }) => !file && settings.surface.preset === preset);
}

/**
 * The example with this file; undefined for none. A visitor's file may have the same name; the checksum, if it is not
 * null, tells them apart.
 */
function exampleOfFile(filename, sha256) {
  return page.examples.find((example) => example.file === filename && (!sha256 || example.sha256 === sha256));
}

/** The file of an example as `fetched` returns it. If it cannot be fetched, shows a message and returns null. */
async function fetchedOrNull(example) {
  try {
    return await fetched(example);
  } catch (error) {
    showMessage(error.message);
    return null;
  }
}

/** The list of examples (crates/web/README.md); empty if the page was built without any. */
async function fetchExamples() {
  const response = await fetch("examples/index.json");
  return response.ok ? response.json() : [];
}

/** Loads the library, opens the graphics device, and shows the settings of the address. */
async function start() {
  views.spectrum = new Spectrum(byId("spectrum"));
  const [engine, examples] = await Promise.all([openEngine(handleArtistEvent), fetchExamples()]);
  Object.assign(page, { engine, examples });
  // For measurements.
  performance.mark("loaded");
  views.sky = new Sky(byId("sky"), (azimuth_deg, elevation_deg) =>
    change(({ sun }) =>
      Object.assign(sun, { azimuth_deg, elevation_deg: Math.max(SUN_ELEVATION_MIN_DEG, elevation_deg) }),
    ),
  );
  views.map = new MapView(byId("map"), byId("map-marks"), readAt);
  fillLists();
  showExamples();
  listenToControls();
  listenToSaving();
  addEventListener("hashchange", () => open(location.hash));
  // The device opens while the first tables are built.
  const opening = openArtist();
  await open(location.hash);
  const error = await opening;
  if (error) showWithoutArtist(error);
  // For tests.
  document.body.dataset.ready = "";
}

start().catch((error) => {
  showMessage(`The page could not start: ${error.message}`);
});
