// Shows the relief as a picture with a scale bar, and its numbers.

import { byId } from "./state.js";

/** A length in µm as text with three significant digits, as Gwyddion shows scans. */
const micrometres = (value) => {
  const [number, unit] = value < 0.1 ? [1e3 * value, "nm"] : [value, "µm"];
  return `${Number(number.toPrecision(3))} ${unit}`;
};

/** Hides the relief until another one is read. */
export function hideRelief() {
  byId("relief-shown").hidden = true;
}

/** Shows a relief as Engine.relief returns it. */
export function showRelief({ facts, width, height, bar_um, um_per_pixel, rgba }) {
  byId("relief-shown").hidden = false;
  const canvas = byId("relief-picture");
  canvas.width = width;
  canvas.height = height;
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), width, height), 0, 0);
  // Relative to the picture, whose width on the screen follows the window.
  byId("bar").style.width = `${(100 * bar_um) / (um_per_pixel * width)}%`;
  byId("bar-length").textContent = micrometres(bar_um);
  byId("relief-range").textContent = `0 to ${micrometres(facts.peak_to_valley_um)}`;
  const rows = [["Pixels", facts.pixels.join(" × ")], ["Size", facts.extent_um.map(micrometres).join(" × ")]];
  for (const axis of ["x", "y"]) {
    const period = facts.periods?.[axis];
    if (period?.period_um) rows.push([`Period along ${axis}`, micrometres(period.period_um)]);
  }
  rows.push(["Roughness Sq", micrometres(facts.roughness.sq_um)], ["Roughness Sa", micrometres(facts.roughness.sa_um)]);
  rows.push(["Slopes x, y (rms)", facts.rms_slope.map((slope) => Number(slope.toPrecision(2))).join(", ")]);
  if (facts.channel) rows.push(["Channel", facts.channel]);
  if (facts.filled_points) rows.push(["Filled points", facts.filled_points]);
  const understood = { pixel_size: "Pixel size", height_unit: "Heights", rows: "Rows" };
  for (const [key, name] of Object.entries(understood)) {
    const found = facts.provenance?.[key];
    if (found) rows.push([name, `${found.value} (${found.source})`]);
  }
  for (const doubt of facts.doubts) rows.push(["Doubt", doubt]);
  byId("relief-facts").replaceChildren(...rows.map(row));
}

/** A line of the list of facts. */
function row([name, value]) {
  const line = document.createElement("div");
  const [term, description] = [document.createElement("dt"), document.createElement("dd")];
  term.textContent = name;
  description.textContent = value;
  line.append(term, description);
  return line;
}
