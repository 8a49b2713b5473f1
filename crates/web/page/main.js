// Starts the page, and opens what an address asks for.

import { fillLists, listenToControls } from "./controls.js";
import { openEngine } from "./engine.js";
import { fromHash } from "./link.js";
import { MapView } from "./map.js";
import { artistSays, openArtist, withoutArtist } from "./picture.js";
import { readAt, refreshMap } from "./reading.js";
import { listenToSaving } from "./saving.js";
import { change, settled } from "./settings.js";
import { Sky } from "./sky.js";
import { chooseExample, fetched, showExamples, showStill, showWanted } from "./sources.js";
import { Spectrum } from "./spectrum.js";
import { byId, page, views } from "./state.js";
import { say } from "./words.js";

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
  // Another light of the map is all that some addresses bring; what has to be made first is mapped when it is there.
  if (page.good && !page.making) refreshMap();
}

async function fetchExamples() {
  const answer = await fetch("examples/index.json");
  return answer.ok ? answer.json() : [];
}

export async function start() {
  views.spectrum = new Spectrum(byId("spectrum"));
  const [engine, examples] = await Promise.all([openEngine(artistSays), fetchExamples()]);
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
