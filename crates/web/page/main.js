// Starts the page, and opens the settings of its address.

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
import { byId, page, views } from "./state.js";
import { showMessage } from "./words.js";

/** Opens the settings of an address's part after the #; without settings, the first example. */
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
    showMessage(`The link's settings are left aside: ${error.message}`);
    complete = JSON.parse(page.engine.quick.default_settings());
  }
  page.settings = complete;
  page.example = null;
  page.wanted = null;
  const { filename } = complete.surface;
  if (filename === undefined) {
    page.source = null;
    const { preset } = complete.surface;
    page.example = page.examples.find(({ file, settings }) => !file && settings.surface.preset === preset)?.name;
  } else if (page.source?.name !== filename || (sha256 && page.source.sha256 !== sha256)) {
    const example = page.examples.find(({ file, sha256: sum }) => file === filename && (!sha256 || sum === sha256));
    page.example = example?.name ?? null;
    page.source = example ? await fetched(example) : null;
    page.wanted = example ? null : { name: filename, sha256 };
  }
  showWanted();
  showStill(page.examples.find(({ name }) => name === page.example));
  settingsChanged();
  // The new address may differ in the light of the map alone. After data are made, the map is drawn anyway.
  if (page.good && !page.making) refreshMap();
}

/** The list of examples, empty where the page was built without. */
async function fetchExamples() {
  const answer = await fetch("examples/index.json");
  return answer.ok ? answer.json() : [];
}

/** Loads the library, opens the graphics device, and shows the settings of the address. */
async function start() {
  views.spectrum = new Spectrum(byId("spectrum"));
  const [engine, examples] = await Promise.all([openEngine(handleArtistEvent), fetchExamples()]);
  Object.assign(page, { engine, examples });
  performance.mark("loaded");
  views.sky = new Sky(byId("sky"), (azimuth_deg, elevation_deg) =>
    change(({ sun }) => Object.assign(sun, { azimuth_deg, elevation_deg: Math.max(0.5, elevation_deg) })),
  );
  views.map = new MapView(byId("map"), byId("map-marks"), readAt);
  fillLists();
  showExamples();
  listenToControls();
  listenToSaving();
  addEventListener("hashchange", () => open(location.hash));
  // The device opens while tables are made.
  const opening = openArtist();
  await open(location.hash);
  const error = await opening;
  if (error) showWithoutArtist(error);
  document.body.dataset.ready = "";
}

start().catch((error) => {
  showMessage(`The page could not start: ${error.message}`);
});
