// Draws the BRDF map, and shows the colour and the spectrum at one of its directions.
//
// `wi` is the direction to the light and `wo` that to the viewer, as unit vectors in the relief's frame.

import { updateAddress } from "./address.js";
import { angles, colourAt, direction, halfway } from "./map.js";
import { byId, currentKeys, page, views } from "./state.js";
import { degrees, showMessage, signed } from "./words.js";

/** Side of the map in pixels. Its time grows with the square. */
const MAP_SIDE = 128;
/** Side in pixels of a map that follows the pointer, small enough to be drawn for each of its movements. */
export const DRAFT_SIDE = 48;

/** Whether `drawMap` is running. */
let mapping = false;
/** Light and side of the newest map that is not drawn yet: {wi, side}. */
let mapNext = null;

/** Draws the map for light from `wi`. Of calls that come while a map is drawn, only the last is drawn after it. */
export async function drawMap(wi, side) {
  mapNext = { wi, side };
  if (mapping) return;
  mapping = true;
  try {
    while (mapNext) {
      const next = mapNext;
      mapNext = null;
      const rgb = await mapOf(next.wi, next.side);
      if (!rgb) continue;
      page.map = { rgb, ...next };
      views.map.show(page.engine.quick.map_picture(rgb, next.side), next.side);
      page.wi = next.wi;
      if (page.wo) readAt(page.wo);
      else views.map.mark(next.wi, null);
    }
  } finally {
    mapping = false;
  }
}

/** Promise of the map for light from `wi`: the `rgb` of map.js. Null if its data are not built yet. */
export function mapOf(wi, side) {
  const { engine } = page;
  if (page.adapter) return engine.map(wi, side);
  if (!engine.hasReflectance(currentKeys().method)) return null;
  const { theta_deg, phi_deg } = angles(wi);
  return engine.mapOnProcessor(page.settings, theta_deg, phi_deg, side);
}

/** Draws the map for the light of the settings, and writes this light into the address. Shows errors. */
export async function refreshMap() {
  const { theta_deg, phi_deg } = page.settings.map;
  updateAddress();
  try {
    await drawMap(direction(theta_deg, phi_deg), MAP_SIDE);
  } catch (error) {
    if (error.kind !== "lost" && error.kind !== "cancelled") showMessage(error.message);
  }
}

/** Angle to the normal and azimuth of a unit vector as text. */
const inDegrees = (unit) => {
  const { theta_deg, phi_deg } = angles(unit);
  return `θ ${degrees(theta_deg)}, φ ${degrees(phi_deg)}`;
};

/** Shows colour, angles and spectrum of the current map towards `wo`. */
export function readAt(wo) {
  page.wo = wo;
  const { wi, map } = page;
  if (!map || !wi) return;
  views.map.mark(wi, wo);
  const rgb = colourAt(map, wo);
  byId("fact-wo").textContent = inDegrees(wo);
  byId("fact-h").textContent = inDegrees(halfway(wi, wo));
  byId("fact-rgb").textContent = Array.from(rgb, (value) => signed(Number(value.toPrecision(3)))).join(", ");
  // The picture's sun has an irradiance of π. On the surface it is π cos θi, and the radiance is f_r times this.
  const radiance = Float32Array.from(rgb, (value) => value * Math.PI * wi[2]);
  const swatch = page.engine.quick.to_srgb(radiance, page.settings.exposure);
  byId("swatch").style.backgroundColor = `rgb(${swatch.join(" ")})`;
  readSpectrum();
}

/** Whether `readSpectrum` is running. */
let reading = false;
/** Whether `readSpectrum` has been called since it last asked for a spectrum. */
let readNext = false;

/** Shows the spectrum at page.wi and page.wo. Calls during a computation lead to one more computation at its end. */
export async function readSpectrum() {
  readNext = true;
  if (reading || !page.wo || !page.engine.hasSpectra(currentKeys().method)) return;
  reading = true;
  try {
    while (readNext) {
      readNext = false;
      const values = await page.engine.spectrum(page.settings, page.wi, page.wo);
      page.spectrum = values;
      if (values.length) views.spectrum.show(values);
      else views.spectrum.say(`${page.settings.method} has no spectrum`);
    }
  } catch (error) {
    if (error.kind !== "cancelled") views.spectrum.say(error.message);
  } finally {
    reading = false;
  }
}
