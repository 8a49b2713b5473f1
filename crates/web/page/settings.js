// Changes of the settings, and everything that follows from one.

import { updateAddress } from "./address.js";
import { makeMissing } from "./making.js";
import { showControls } from "./panel.js";
import { refreshMap } from "./reading.js";
import { page } from "./state.js";
import { orderPicture } from "./view.js";
import { showMessage } from "./words.js";

/**
 * Applies `edit` to a copy of the settings, which the library checks and completes with defaults, and makes the copy
 * current. If the library refuses it, shows the error, and in the controls the settings that stay.
 */
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

/** Refractive index of the last map as text. Its change alone builds no data, so `makeMissing` draws no map. */
let mappedIndex = "";

/** Updates controls, address, data and pictures after any change of the settings. */
export function settingsChanged() {
  showControls();
  updateAddress();
  makeMissing();
  orderPicture();
  const { eta, k } = page.settings.surface;
  const index = `${eta} ${k}`;
  if (index === mappedIndex) return;
  mappedIndex = index;
  // With WebGPU the worker artist.js draws the map, with the index that `orderPicture` has sent. Before the first
  // complete data, `page.good` is null, and there is no map yet.
  if (page.good) refreshMap();
}
