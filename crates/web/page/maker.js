// The maker: a Web Worker that reads files and builds data by the calls of crates/web/src/wasm/maker.rs, which has the
// units and layouts of their arguments and results.
//
// Its calls block. To cancel one, the page ends the worker and starts another. The maker holds one relief and the
// evaluators that were built from it. The page builds each of these before it sends a message that uses it.

import * as sunbeam from "./wasm/sunbeam_web.js";
import { answer } from "./answering.js";

/** Largest side of the relief's picture in pixels. A larger one shows finer details and needs more memory. */
const PICTURE_SIDE = 512;

// Objects of the library, which are not garbage collected: `free` releases their memory.
/** The relief: levelled heights; null until the first message `relief`. */
let relief = null;
/** Evaluator of colours on the CPU; null until it is built for the relief. */
let reflectance = null;
/** Evaluator of spectra; null until it is built for the relief. */
let spectra = null;

// Messages of the page; engine.js has a method for each. `settings` is JSON; `progress` takes a fraction in [0, 1].
answer({
  // Reads a preset, or `file` where there is one, and returns a summary and a picture of the relief.
  async relief({ settings, file }) {
    const bytes = file ? new Uint8Array(await file.arrayBuffer()) : undefined;
    // If this throws, the old relief stays.
    const next = new sunbeam.Relief(settings, bytes);
    relief?.free();
    reflectance?.free();
    spectra?.free();
    relief = next;
    reflectance = spectra = null;
    const picture = relief.picture(PICTURE_SIDE);
    const { width, height, bar_um, um_per_pixel, rgba } = picture;
    picture.free();
    return { facts: JSON.parse(relief.facts(settings)), width, height, bar_um, um_per_pixel, rgba };
  },
  // SHA-256 of a file.
  async checksum({ file }) {
    return sunbeam.sha256(new Uint8Array(await file.arrayBuffer()));
  },
  // Bytes of the method's tables for the artist, the worker that draws.
  method: ({ settings }, progress) => relief.method(settings, progress),
  reflectance({ settings }, progress) {
    // The old evaluator is freed first, so that both do not need memory at the same time.
    reflectance?.free();
    reflectance = null;
    reflectance = relief.reflectance(settings, progress);
  },
  spectra({ settings }, progress) {
    spectra?.free();
    spectra = null;
    spectra = relief.spectra(settings, progress);
  },
  // The refractive index may have changed since an evaluator was built: most evaluators keep no data that depend on it
  // (`Settings::keys`). `map` and `spectrum` therefore set it.
  map({ settings, theta_deg, phi_deg, side }, progress) {
    reflectance.set_index(settings);
    return reflectance.map(theta_deg, phi_deg, side, progress);
  },
  spectrum({ settings, wi, wo }) {
    spectra.set_index(settings);
    return spectra.spectrum(wi, wo);
  },
  // Bytes of the scene's mesh and texture for the artist; coarser where `draft` is true.
  scene: ({ settings, draft }, progress) => sunbeam.make_scene(settings, draft, progress),
});
