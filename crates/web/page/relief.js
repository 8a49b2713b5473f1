// Shows the relief as a picture with a scale bar, and facts about it.

import { byId } from "./state.js";

/** Text of a length with three significant digits, in nm below 0.1 µm. */
const lengthText = (um) => {
  const [number, unit] = um < 0.1 ? [1e3 * um, "nm"] : [um, "µm"];
  return `${Number(number.toPrecision(3))} ${unit}`;
};

/** Hides the relief until another one is read. */
export function hideRelief() {
  byId("relief-shown").hidden = true;
}

/**
 * Shows a relief as `Engine.relief` returns it: facts (`Facts` of crates/web/src/relief.rs), and a picture in RGBA
 * bytes. bar_um is the length of the scale bar, um_per_pixel the size of a pixel of the picture. Slopes are tangents.
 */
export function showRelief({ facts, width, height, bar_um, um_per_pixel, rgba }) {
  byId("relief-shown").hidden = false;
  const canvas = byId("relief-picture");
  canvas.width = width;
  canvas.height = height;
  // `rgba` has a buffer of its own, without an offset.
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), width, height), 0, 0);
  // In percent, since the width of the picture on the screen follows the window.
  byId("bar").style.width = `${(100 * bar_um) / (um_per_pixel * width)}%`;
  byId("bar-length").textContent = lengthText(bar_um);
  byId("relief-range").textContent = `0 to ${lengthText(facts.peak_to_valley_um)}`;
  const entries = [["Pixels", facts.pixels.join(" × ")], ["Size", facts.extent_um.map(lengthText).join(" × ")]];
  for (const axis of ["x", "y"]) {
    const period = facts.periods?.[axis];
    // There is no period along an axis on which the heights do not depend.
    if (period?.period_um) entries.push([`Period along ${axis}`, lengthText(period.period_um)]);
  }
  entries.push(["Roughness Sq", lengthText(facts.roughness.sq_um)]);
  entries.push(["Roughness Sa", lengthText(facts.roughness.sa_um)]);
  entries.push(["Slopes x, y (rms)", facts.rms_slope.map((slope) => Number(slope.toPrecision(2))).join(", ")]);
  if (facts.channel) entries.push(["Channel", facts.channel]);
  if (facts.filled_points) entries.push(["Filled points", facts.filled_points]);
  // Properties that the file reader had to interpret, each with its value and its source (provenance.rs).
  const interpreted = { pixel_size: "Pixel size", height_unit: "Heights", rows: "Rows" };
  for (const [key, name] of Object.entries(interpreted)) {
    const found = facts.provenance?.[key];
    if (found) entries.push([name, `${found.value} (${found.source})`]);
  }
  for (const doubt of facts.doubts) entries.push(["Doubt", doubt]);
  byId("relief-facts").replaceChildren(...entries.map(factElement));
}

/** Element of the list of facts with this name and value. */
function factElement([name, value]) {
  const line = document.createElement("div");
  const [term, description] = [document.createElement("dt"), document.createElement("dd")];
  term.textContent = name;
  description.textContent = value;
  line.append(term, description);
  return line;
}
