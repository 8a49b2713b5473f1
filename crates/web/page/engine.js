// The engine: the page's interface to the Rust library, compiled to WebAssembly. Only this module uses the workers.
//
// - `quick`: calls without long computations, on the page's own thread.
// - The maker (maker.js): a Web Worker that reads a relief and builds a method's data and spectra. A second maker
//   builds scenes. A maker cannot be interrupted. To cancel its work, it is ended and replaced.
// - The artist (artist.js): the Web Worker that draws with WebGPU.
//
// A *key* is a string that changes whenever the relief, the method's data or the scene have to be built again
// (`Engine.keys`). Settings are objects here and JSON in the library. A parameter `progress` is a function, called with
// the finished fraction from 0 to 1. An *evaluator* computes the BSDF in the maker, as colours or as spectra.

import init, * as sunbeam from "./wasm/sunbeam_web.js";
import { Channel, WorkerError } from "./channel.js";

export { WorkerError };

const MODULE = new URL("./wasm/sunbeam_web_bg.wasm", import.meta.url);
const MAKER = new URL("./maker.js", import.meta.url);
const ARTIST = new URL("./artist.js", import.meta.url);

/** Compiles the library once, for the page and its workers. Returns the engine. `listener` gets the artist's events. */
export async function openEngine(listener) {
  const response = await fetch(MODULE);
  if (!response.ok) throw new Error(`${MODULE.pathname}: ${response.status} ${response.statusText}`);
  // `compileStreaming` would need a host that serves the type application/wasm.
  const module = await WebAssembly.compile(await response.arrayBuffer());
  await init({ module_or_path: module });
  return new Engine(module, listener);
}

/**
 * The library and its workers. Failed calls of a worker throw a `WorkerError`, failed calls on the page's own thread
 * the library's error.
 */
export class Engine {
  /** Calls without long computations, on the page's own thread (crates/web/src/wasm/quick.rs). */
  quick = sunbeam;
  #module;
  #listener;
  /** Maker of the relief, the method's data and the spectra. */
  #maker = null;
  /** Maker of scenes. */
  #sceneMaker = null;
  /** The artist; null before its device is opened. */
  #artist = null;
  /** Keys of the relief, the evaluator of colours and the evaluator of spectra that the maker has; null for none. */
  #reliefKey = null;
  #reflectanceKey = null;
  #spectraKey = null;

  constructor(module, listener) {
    this.#module = module;
    this.#listener = listener;
    /** Entries of the page's lists (crates/web/README.md). */
    this.catalogue = JSON.parse(sunbeam.catalogue());
  }

  /** Keys for these settings: {relief, method, scene}. state.js adds the checksum of the surface's file, if any. */
  keys(settings) {
    return JSON.parse(sunbeam.keys(JSON.stringify(settings)));
  }

  /** The settings, checked and with all fields. Throws an error with the library's message if one is refused. */
  complete(settings) {
    return JSON.parse(sunbeam.complete_settings(JSON.stringify(settings)));
  }

  /** The fields of the settings that differ from the defaults. */
  compact(settings) {
    return JSON.parse(sunbeam.compact_settings(JSON.stringify(settings)));
  }

  // Makers

  /** Ends the maker, if there is one, and starts another. */
  #newMaker() {
    this.#maker?.end();
    this.#maker = new Channel(MAKER, this.#module);
    this.#reliefKey = this.#reflectanceKey = this.#spectraKey = null;
    return this.#maker;
  }

  /** A maker without work. A busy one is ended and replaced. */
  #idleMaker() {
    return this.#maker && !this.#maker.busy ? this.#maker : this.#newMaker();
  }

  /** Cancels all work of the maker of reliefs, methods and spectra. */
  cancel() {
    if (this.#maker?.busy) this.#newMaker();
  }

  /** Asks a worker a question. `question` holds the arguments of `Channel.ask`: type, fields and options. */
  async #ask(channel, ...question) {
    try {
      return await channel.ask(...question);
    } catch (error) {
      // The library is unusable after a panic, so the maker is replaced.
      if (error.kind === "internal" && channel === this.#maker) this.#newMaker();
      throw error;
    }
  }

  /** SHA-256 of a file (a Blob) in hexadecimal. */
  checksum(file) {
    return this.#ask(this.#idleMaker(), "checksum", { file });
  }

  /**
   * Reads the relief of the settings, from `file` (a Blob) unless it is a preset. `key` is its key, for `holds`.
   *
   * Returns its facts (relief.rs) and its picture with the length of a scale bar: {facts, width, height, bar_um,
   * um_per_pixel, rgba}.
   */
  async relief(settings, file, key) {
    const maker = this.#idleMaker();
    // Null until the relief is read, and also if reading fails. Evaluators of the old relief go with it.
    this.#reliefKey = this.#reflectanceKey = this.#spectraKey = null;
    const read = await this.#ask(maker, "relief", { settings: JSON.stringify(settings), file });
    // A maker that was replaced in the meantime took its relief with it.
    if (maker === this.#maker) this.#reliefKey = key;
    return read;
  }

  /** Whether the maker has the relief with this key, which is not null. */
  holds(key) {
    return this.#reliefKey === key;
  }

  /** Builds the method's data for the relief that was read last. Returns their bytes, for `setMethod`. */
  method(settings, progress) {
    return this.#ask(this.#maker, "method", { settings: JSON.stringify(settings) }, { progress });
  }

  /** Builds the evaluator of colours on the CPU, for maps without WebGPU. `key` is that of the method's data. */
  async reflectance(settings, key, progress) {
    const maker = this.#maker;
    this.#reflectanceKey = null;
    await this.#ask(maker, "reflectance", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#reflectanceKey = key;
  }

  /** Whether the maker has the evaluator of colours for this key of the method; false for null. */
  hasReflectance(key) {
    return this.#reflectanceKey !== null && this.#reflectanceKey === key;
  }

  /** Builds the evaluator of spectra. `key` is that of the method's data. */
  async spectra(settings, key, progress) {
    const maker = this.#maker;
    this.#spectraKey = null;
    await this.#ask(maker, "spectra", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#spectraKey = key;
  }

  /** Whether the maker has the evaluator of spectra for this key of the method; false for null. */
  hasSpectra(key) {
    return this.#spectraKey !== null && this.#spectraKey === key;
  }

  /**
   * Reflectance `f_r` in 1/sr at 380, 385, …, 780 nm, for the unit vectors to the light and to the viewer, by the last
   * `spectra`. Empty if the method has no values by wavelength.
   */
  spectrum(settings, wi, wo) {
    const directions = { wi: Float32Array.from(wi), wo: Float32Array.from(wo) };
    return this.#ask(this.#maker, "spectrum", { settings: JSON.stringify(settings), ...directions });
  }

  /**
   * The BRDF map of the last `reflectance`, as `map` returns it, `side` pixels wide and high. The direction to the
   * light has the polar angle `theta_deg` and the azimuth `phi_deg`.
   */
  mapOnCpu(settings, theta_deg, phi_deg, side, progress) {
    const question = { settings: JSON.stringify(settings), theta_deg, phi_deg, side };
    return this.#ask(this.#maker, "map", question, { progress });
  }

  /**
   * Builds mesh, bounding-volume hierarchy and pigment. Returns their bytes, for `setScene`. A draft is coarser and
   * takes a fifth of the time. A call cancels an earlier one that is still running.
   */
  async scene(settings, draft, progress) {
    if (this.#sceneMaker?.busy) {
      this.#sceneMaker.end();
      this.#sceneMaker = null;
    }
    const maker = (this.#sceneMaker ??= new Channel(MAKER, this.#module));
    try {
      return await maker.ask("scene", { settings: JSON.stringify(settings), draft }, { progress });
    } catch (error) {
      // The maker may be unusable, and holds no state: the next call starts another.
      if (this.#sceneMaker === maker) {
        maker.end();
        this.#sceneMaker = null;
      }
      throw error;
    }
  }

  // The artist. Calls other than `openArtist` and `view` need a device: the page makes them only while `page.adapter`
  // (state.js) is set.

  /**
   * Opens the graphics device on an unused canvas. Returns {name, backend, software} of its adapter. Fails with an
   * error of kind "no-webgpu" or "gpu".
   */
  async openArtist(canvas) {
    if (!navigator.gpu) {
      const message = isSecureContext
        ? "this browser does not offer WebGPU"
        : "browsers offer WebGPU only to pages that come over https, and this one does not";
      throw new WorkerError({ message, kind: "no-webgpu" });
    }
    if (!canvas.transferControlToOffscreen) {
      throw new WorkerError({ message: "this browser cannot draw from a worker", kind: "no-webgpu" });
    }
    // After a loss of the device, the worker is used again: it keeps scene and method.
    const artist = this.#artist ?? new Channel(ARTIST, this.#module, (event) => this.#listener(event));
    const offscreen = canvas.transferControlToOffscreen();
    try {
      const adapter = await artist.ask("open", { canvas: offscreen }, { transfer: [offscreen] });
      this.#artist = artist;
      return adapter;
    } catch (error) {
      artist.end();
      this.#artist = null;
      throw error;
    }
  }

  /** Transfers the bytes of `scene` to the artist. `draft` is that of the call of `scene`. */
  setScene(bytes, draft) {
    return this.#artist.ask("scene", { bytes, draft }, { transfer: [bytes.buffer] });
  }

  /** Transfers the bytes of `method` to the artist. */
  setMethod(bytes) {
    return this.#artist.ask("method", { bytes }, { transfer: [bytes.buffer] });
  }

  /** Orders a picture of this size in pixels. The listener gets a report of each step, with this serial number. */
  view(settings, width, height, serial) {
    this.#artist?.tell("view", { settings: JSON.stringify(settings), width, height, serial });
  }

  // Questions to the artist. crates/web/README.md documents its calls of the same names. `loseDevice` is for tests.
  draw = () => this.#artist.ask("draw");
  pixels = () => this.#artist.ask("pixels");
  png = () => this.#artist.ask("png");
  query = (x, y) => this.#artist.ask("query", { x, y });
  map = (wi, side) => this.#artist.ask("map", { wi: Float32Array.from(wi), side });
  loseDevice = () => this.#artist.ask("lose");
}
