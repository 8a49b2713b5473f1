// Settings: how they change, and the address that has them.

import { showControls } from "./controls.js";
import { toHash } from "./link.js";
import { make } from "./making.js";
import { look } from "./picture.js";
import { refreshMap } from "./reading.js";
import { page } from "./state.js";
import { say } from "./words.js";

/** Changes settings by a function; says so where they are refused. */
export function change(edit) {
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

let mappedIndex = "";
/** After settings have changed, in whatever way. */
export function settled() {
  showControls();
  remember();
  make();
  look();
  const { eta, k } = page.settings.surface;
  const index = `${eta} ${k}`;
  if (index === mappedIndex) return;
  mappedIndex = index;
  if (!page.good) return;
  // The artist has heard of it by now.
  refreshMap();
}

let remembering = 0;
export function remember() {
  // Browsers refuse more than some hundred changes in half a minute.
  clearTimeout(remembering);
  remembering = setTimeout(() => history.replaceState(null, "", address()), 250);
}

export function address() {
  const checksum = (page.source ?? page.wanted)?.sha256;
  const hash = toHash(page.engine.compact(page.settings), page.settings.surface.filename ? checksum : null);
  // An address without settings opens the first example, which the default settings are not.
  return `${location.pathname}${location.search}#${hash || `surface.preset=${page.settings.surface.preset}`}`;
}

export function isFile() {
  return page.settings.surface.filename !== undefined;
}

export function currentKeys() {
  const { relief, method, scene } = page.engine.keys(page.settings);
  const of = page.source?.sha256 ?? "";
  return { relief: relief + of, method: method + of, scene };
}
