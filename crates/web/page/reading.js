// Draws the BRDF map, and shows the colour and the spectrum at one of its directions. A direction is *read* when the
// pointer or a key selects it.
//
// `wi` is the direction to the light and `wo` that to the viewer, as unit vectors in the relief's frame.
// `page.engine.quick` is the library on the page's own thread.

import { updateAddress } from "./address.js";
import { onlyLatest } from "./latest.js";
import { angles, colourAt, direction, halfway } from "./map.js";
import { byId, currentKeys, page, views } from "./state.js";
import { degrees, showMessage, signed } from "./words.js";

/** Side of the map in pixels. Larger maps resolve finer orders; their time grows with the square. */
const MAP_SIDE = 128;
/** Side in pixels of a map that follows the pointer, small enough to be drawn for each of its movements. */
export const DRAFT_SIDE = 48;

/**
 * Draws the map for light from `wi`, with `side` pixels along each side, if `mapOf` has one. Of the calls during a run,
 * only the last one is made (latest.js).
 */
export const drawMap = onlyLatest(async (wi, side) => {
  const rgb = await mapOf(wi, side);
  if (!rgb) return;
  page.map = { rgb, wi, side };
  views.map.show(page.engine.quick.map_picture(rgb, side), side);
  page.wi = wi;
  // The values at the last read direction change with the map.
  if (page.wo) readAt(page.wo);
  else views.map.mark(wi, null);
});

/**
 * Promise of the map's pixels for light from `wi`: f_r in 1/sr as linear sRGB (`rgb` in map.js). The GPU draws them if
 * there is an adapter. Null if the map's data are not built yet.
 */
export function mapOf(wi, side) {
  const { engine } = page;
  if (page.adapter) return engine.map(wi, side);
  if (!engine.hasReflectance(currentKeys().method)) return null;
  const { theta_deg, phi_deg } = angles(wi);
  return engine.mapOnCpu(page.settings, theta_deg, phi_deg, side);
}

/**
 * Draws the map for the light of the settings, and writes this light into the address. Shows errors, except a lost GPU,
 * which has its own message, and a worker that the page has ended.
 */
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
  // The exposure is in stops.
  const swatch = page.engine.quick.to_srgb(radiance, page.settings.exposure);
  byId("swatch").style.backgroundColor = `rgb(${swatch.join(" ")})`;
  readSpectrum();
}

/** Computes and shows the spectrum at page.wi and page.wo. It is empty if the method has no values by wavelength. */
const showSpectrum = onlyLatest(async () => {
  const values = await page.engine.spectrum(page.settings, page.wi, page.wo);
  page.spectrum = values;
  if (values.length) views.spectrum.show(values);
  else views.spectrum.say(`${page.settings.method} has no spectrum`);
});

/** Shows the spectrum at page.wi and page.wo if both are set and the spectrum's data exist. Errors go to the plot. */
export async function readSpectrum() {
  if (!page.wi || !page.wo || !page.engine.hasSpectra(currentKeys().method)) return;
  try {
    await showSpectrum();
  } catch (error) {
    if (error.kind !== "cancelled") views.spectrum.say(error.message);
  }
}
