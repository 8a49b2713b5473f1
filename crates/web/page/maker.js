// The maker: a Web Worker that reads files and builds data by the calls of crates/web/src/wasm/maker.rs.
//
// Its calls block. To cancel one, the page ends the worker and starts another. The maker holds one relief and the
// evaluators that were built from it.

import * as sunbeam from "./wasm/sunbeam_web.js";
import { answer } from "./answering.js";

/** Largest side of the relief's picture in pixels. A larger one shows finer details and needs more memory. */
const PICTURE_SIDE = 512;

// Objects of the library, which are not garbage collected: `free` releases their memory.
/** The levelled heights. */
let relief = null;
/** Evaluator of colours on the CPU; null until it is built for the relief. */
let reflectance = null;
/** Evaluator of spectra; null until it is built for the relief. */
let spectra = null;

// Messages of the page; engine.js has a method for each. `settings` is JSON.
answer({
  async relief({ settings, file }) {
    const bytes = file ? new Uint8Array(await file.arrayBuffer()) : undefined;
    // If this throws, the old relief stays.
    const read = new sunbeam.Relief(settings, bytes);
    relief?.free();
    reflectance?.free();
    spectra?.free();
    relief = read;
    reflectance = spectra = null;
    const picture = relief.picture(PICTURE_SIDE);
    const { width, height, bar_um, um_per_pixel, rgba } = picture;
    picture.free();
    return { facts: JSON.parse(relief.facts(settings)), width, height, bar_um, um_per_pixel, rgba };
  },
  async checksum({ file }) {
    return sunbeam.sha256(new Uint8Array(await file.arrayBuffer()));
  },
  method: ({ settings }, progress) => relief.method(settings, progress),
  reflectance({ settings }, progress) {
    // Freed first, so that both do not need memory at the same time.
    reflectance?.free();
    reflectance = null;
    reflectance = relief.reflectance(settings, progress);
  },
  spectra({ settings }, progress) {
    spectra?.free();
    spectra = null;
    spectra = relief.spectra(settings, progress);
  },
  // The refractive index may have changed since the evaluators were built (`Settings::keys`).
  map({ settings, theta_deg, phi_deg, side }, progress) {
    reflectance.set_index(settings);
    return reflectance.map(theta_deg, phi_deg, side, progress);
  },
  spectrum({ settings, wi, wo }) {
    spectra.set_index(settings);
    return spectra.spectrum(wi, wo);
  },
  scene: ({ settings, draft }, progress) => sunbeam.make_scene(settings, draft, progress),
});
