// Changes of the settings, and everything that follows from one.

import { updateAddress } from "./address.js";
import { makeMissing } from "./making.js";
import { showControls } from "./panel.js";
import { refreshMap } from "./reading.js";
import { page } from "./state.js";
import { orderPicture } from "./view.js";
import { showMessage } from "./words.js";

/** Applies `edit` to a copy of the settings, which replaces them if the library accepts it; else shows its message. */
export function change(edit) {
  const next = structuredClone(page.settings);
  edit(next);
  try {
    page.settings = page.engine.complete(next);
  } catch (error) {
    showMessage(error.message);
    showControls();
    return;
  }
  showMessage(null);
  settingsChanged();
}

/** Refractive index of the last map; a change of the index alone builds no data, but changes the map. */
let mappedIndex = "";

/** Brings controls, address, data and pictures up to date after the settings have changed in any way. */
export function settingsChanged() {
  showControls();
  updateAddress();
  makeMissing();
  orderPicture();
  const { eta, k } = page.settings.surface;
  const index = `${eta} ${k}`;
  if (index === mappedIndex) return;
  mappedIndex = index;
  if (!page.good) return;
  // The picture's order has told the artist of the index already.
  refreshMap();
}
