// The page's address, which holds the settings after the #.

import { toHash } from "./link.js";
import { page } from "./state.js";

/** Delay in ms before an address is written: browsers refuse more than some hundred changes in half a minute. */
const DELAY_MS = 250;

let timer = 0;

/** Writes the settings into the address a little later. */
export function updateAddress() {
  clearTimeout(timer);
  timer = setTimeout(() => history.replaceState(null, "", address()), DELAY_MS);
}

/** The address of the page with its present settings: path, query and #. */
export function address() {
  const checksum = (page.source ?? page.wanted)?.sha256;
  const hash = toHash(page.engine.compact(page.settings), page.settings.surface.filename ? checksum : null);
  // An address without settings opens the first example, whose settings are not the defaults.
  return `${location.pathname}${location.search}#${hash || `surface.preset=${page.settings.surface.preset}`}`;
}
