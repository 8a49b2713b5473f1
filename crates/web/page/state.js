// What the page's modules share: what is chosen, what is there, what is drawn.

export const byId = (id) => document.getElementById(id);

/** Largest polar angle of the map's light in degrees: at 90° nothing is lit. */
export const THETA_MAX_DEG = 89.9;

export const page = {
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
  /** The serial number of the picture that was asked for last, and what was told of the one that was drawn last. */
  asked: 0,
  drawn: null,
  making: false,
};
// For the browser's console, and for tests.
globalThis.sunbeam = page;

/** Parts of the page that draw themselves; they are there once it has started. */
export const views = { spectrum: null, sky: null, map: null };
