// The state that the page's modules share, in one object `page`. A *key* is a text that names the inputs of some data:
// data are built again when their key changes.

/** The page's element with this id. */
export const byId = (id) => document.getElementById(id);

/**
 * Largest polar angle of the map's light in degrees. At 90° the light misses the surface. The library refuses angles
 * above its own equal limit (crates/web/src/settings/mod.rs).
 */
export const THETA_MAX_DEG = 89.9;

/** Smallest elevation of the sun in degrees. The library refuses smaller ones (crates/web/src/settings/mod.rs). */
export const SUN_ELEVATION_MIN_DEG = 0.5;

/** The state. main.js sets `engine` and `settings` at the start. */
export const page = {
  /** The library with its workers (engine.js). */
  engine: null,
  /** The settings (crates/web/README.md), with all fields. */
  settings: null,
  /** The dropped or fetched file: {name, file (a Blob), sha256}; null for a preset and while a file is awaited. */
  source: null,
  /**
   * Number of reliefs chosen so far, by an address, in the panel or as a file. A choice that waited for its file has no
   * effect if another one has followed.
   */
  choices: 0,
  /** The file that is awaited, because a link names it: {name, sha256}; null for none. */
  wanted: null,
  /** The entries of examples/index.json (crates/web/README.md). */
  examples: [],
  /** Name of the selected example; null for none. */
  example: null,
  /** The graphics device: {name, backend, software}; null without one or after its loss, undefined while it opens. */
  adapter: undefined,
  /** Promise that is fulfilled when the graphics device is open or has failed to open. */
  opening: null,
  /**
   * The last state whose data were complete, to which `goBack` (making.js) returns: {settings, source, example, relief,
   * keys}, and `at`, the `performance.now()` of the state's first picture. Null before the first such state.
   */
  good: null,
  /** Keys (`currentKeys`) of the relief, method and scene that exist or are being built; null for none. */
  keys: { relief: null, method: null, scene: null },
  /** Keys of the data that the artist (artist.js, the worker that draws) has; null for none. */
  held: { method: null, scene: null },
  /** Whether data that a picture needs are being built. */
  making: false,
  /** The relief that was read last, as Engine.relief returns it; null for none. */
  relief: null,
  /** Size and build time of the method's data: {bytes, seconds}; null for none. */
  made: null,
  /** The BRDF map shown (map.js); null for none. */
  map: null,
  /** Unit vectors to the light and to the viewer, in the relief's frame, at which the map is read; null for none. */
  wi: null,
  wo: null,
  /**
   * Spectrum at wi and wo: the BRDF in 1/sr every 5 nm from 380 to 780 nm. Empty if the method has no spectrum, null
   * before the first one.
   */
  spectrum: null,
  /** Serial number of the last picture ordered. */
  lastOrder: 0,
  /** The artist's report of the last picture drawn, with the serial number of its order; null for none. */
  drawn: null,
};
// For the browser's console and for tests.
globalThis.sunbeam = page;

/** Parts of the page that draw themselves: objects of Spectrum, Sky and MapView, which main.js creates. */
export const views = { spectrum: null, sky: null, map: null };

/** Whether the relief comes from a file. */
export function isFile() {
  return page.settings.surface.filename !== undefined;
}

/** Keys for the current settings: {relief, method, scene}. The first two also depend on the contents of the file. */
export function currentKeys() {
  const { relief, method, scene } = page.engine.keys(page.settings);
  const content = page.source?.sha256 ?? "";
  return { relief: relief + content, method: method + content, scene };
}
