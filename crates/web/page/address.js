// The page's address, which has the settings after the #.

import { toHash } from "./link.js";
import { page } from "./state.js";

/**
 * Delay in ms before the address is written. Browsers refuse hundreds of changes within half a minute, so writing may
 * fail during a drag with a much shorter delay. A longer one leaves an old address for longer.
 */
const DELAY_MS = 250;

/** Identifier of the pending delay. */
let timer = 0;

/** Writes the settings into the address after a delay, which each call starts anew. */
export function updateAddress() {
  clearTimeout(timer);
  timer = setTimeout(() => history.replaceState(null, "", address()), DELAY_MS);
}

/** Address of the page with its current settings: path, query, and the part after the #. */
export function address() {
  // SHA-256 of the surface's file, or of the file that a link names and the page awaits.
  const checksum = (page.source ?? page.wanted)?.sha256;
  const hash = toHash(page.engine.compact(page.settings), page.settings.surface.filename ? checksum : null);
  // An empty hash would open the first example. Default settings are therefore written by their preset.
  return `${location.pathname}${location.search}#${hash || `surface.preset=${page.settings.surface.preset}`}`;
}
