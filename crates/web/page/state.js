// The state that the page's modules share, in one object `page`.

/** The element with this id. */
export const byId = (id) => document.getElementById(id);

/** Largest polar angle of the map's light in degrees, as in settings.rs; at 90° the light misses the surface. */
export const THETA_MAX_DEG = 89.9;

export const page = {
  /** The library, with its workers; see engine.js. */
  engine: null,
  /** The settings of the library (crates/web/README.md), complete. */
  settings: null,
  /** The file that was dropped or fetched: {name, file, sha256}; null for a preset. */
  source: null,
  /** The file that a link names and that is not here: {name, sha256}; null for none. */
  wanted: null,
  /** Examples of examples/index.json. */
  examples: [],
  /** Name of the example whose settings these are; null for none. */
  example: null,
  /** The graphics device: {name, backend, software}; null without one, undefined while it is being opened. */
  adapter: undefined,
  /** Promise of the graphics device being opened. */
  opening: null,
  /**
   * The last state whose data were complete, for `goBack`: {settings, source, read, keys}, and `at`, the time in ms of
   * its first picture.
   */
  good: null,
  /** Keys (Engine.keys) of the relief, method and scene that exist or are being built. */
  keys: { relief: null, method: null, scene: null },
  /** Whether data are being built that a picture needs. */
  making: false,
  /** Facts and picture of the relief that was read last. */
  read: null,
  /** Size and time of the method's data: {bytes, seconds}. */
  made: null,
  /** The BRDF map shown: {rgb, side, wi}. */
  map: null,
  /** Directions to the light and to the viewer at which the map is read. */
  wi: null,
  wo: null,
  /** Reflectance in 1/sr at equal steps from 380 to 780 nm, at wi and wo. */
  spectrum: null,
  /** Serial number of the last picture ordered. */
  asked: 0,
  /** The artist's report of the last picture drawn, with the serial number of its order. */
  drawn: null,
};
// For the browser's console, and for tests.
globalThis.sunbeam = page;

/** Parts of the page that draw themselves; main.js makes them. */
export const views = { spectrum: null, sky: null, map: null };

/** Whether the relief comes from a file. */
export function isFile() {
  return page.settings.surface.filename !== undefined;
}

/** Keys of relief, method and scene for the present settings, with the checksum of the file. */
export function currentKeys() {
  const { relief, method, scene } = page.engine.keys(page.settings);
  const content = page.source?.sha256 ?? "";
  return { relief: relief + content, method: method + content, scene };
}
