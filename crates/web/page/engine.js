// The engine: the page's interface to the Rust library, compiled to WebAssembly. Only this module uses the workers.
//
// - `quick`: calls without long computations, on the page's own thread.
// - The maker (maker.js): a Web Worker that reads a relief and builds a method's data and spectra. A second maker
//   builds scenes. A maker cannot be interrupted, so it is ended and replaced to cancel its work.
// - The artist (artist.js): the Web Worker that draws with WebGPU.
//
// A *key* is a string of `keys`; data are out of date when the key of the settings differs from theirs.

import init, * as sunbeam from "./wasm/sunbeam_web.js";
import { Channel, WorkerError } from "./channel.js";

export { WorkerError };

const MODULE = new URL("./wasm/sunbeam_web_bg.wasm", import.meta.url);
const MAKER = new URL("./maker.js", import.meta.url);
const ARTIST = new URL("./artist.js", import.meta.url);

/** Compiles the library once, for the page and its workers. `listener` gets the events of the artist. */
export async function openEngine(listener) {
  const response = await fetch(MODULE);
  if (!response.ok) throw new Error(`${MODULE.pathname}: ${response.status} ${response.statusText}`);
  // compileStreaming would need a host that knows the file type of wasm.
  const module = await WebAssembly.compile(await response.arrayBuffer());
  await init({ module_or_path: module });
  return new Engine(module, listener);
}

export class Engine {
  /** Calls without long computations, on the page's own thread (crates/web/src/wasm/quick.rs). */
  quick = sunbeam;
  #module;
  #listener;
  /** Maker of the relief, the method's data and the spectra. */
  #maker = null;
  /** Maker of scenes. */
  #scenes = null;
  #artist = null;
  /** Keys of the data that the maker holds. */
  #reliefKey = null;
  #reflectanceKey = null;
  #spectraKey = null;

  constructor(module, listener) {
    this.#module = module;
    this.#listener = listener;
    this.catalogue = JSON.parse(sunbeam.catalogue());
  }

  /** Keys of relief, method and scene for these settings. */
  keys(settings) {
    return JSON.parse(sunbeam.keys(JSON.stringify(settings)));
  }

  /** The settings, checked and with all fields; throws an error with the library's message if one is refused. */
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

  /** A maker without work: a busy one is ended. */
  #idleMaker() {
    return this.#maker && !this.#maker.busy ? this.#maker : this.#newMaker();
  }

  /** Ends the making of data of the relief. */
  cancel() {
    if (this.#maker?.busy) this.#newMaker();
  }

  /** Asks a worker; replaces the maker after a fault of its module. */
  async #ask(channel, ...question) {
    try {
      return await channel.ask(...question);
    } catch (error) {
      // The module is unusable after a fault of its own.
      if (error.kind === "internal" && channel === this.#maker) this.#newMaker();
      throw error;
    }
  }

  /** SHA-256 of a file, hexadecimal. */
  checksum(file) {
    return this.#ask(this.#idleMaker(), "checksum", { file });
  }

  /** Reads the relief of a preset or a file; answers with its facts and picture. `key` is the relief's, for `holds`. */
  async relief(settings, file, key) {
    const maker = this.#idleMaker();
    this.#reliefKey = this.#reflectanceKey = this.#spectraKey = null;
    const read = await this.#ask(maker, "relief", { settings: JSON.stringify(settings), file });
    if (maker === this.#maker) this.#reliefKey = key;
    return read;
  }

  /** Whether the maker has the relief of this key. */
  holds(key) {
    return this.#reliefKey === key;
  }

  /** Memory and time of the method's data: {bytes, seconds, too_much?}. */
  estimate(settings) {
    return this.#ask(this.#maker, "estimate", { settings: JSON.stringify(settings) });
  }

  /** Builds the method's data for the relief that was read last; answers with their bytes. */
  method(settings, progress) {
    return this.#ask(this.#maker, "method", { settings: JSON.stringify(settings) }, { progress });
  }

  /** Builds the evaluator on the CPU, for maps without WebGPU. */
  async reflectance(settings, key, progress) {
    const maker = this.#maker;
    this.#reflectanceKey = null;
    await this.#ask(maker, "reflectance", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#reflectanceKey = key;
  }

  /** Whether the maker holds the evaluator on the CPU for this key. */
  hasReflectance(key) {
    return this.#reflectanceKey !== null && this.#reflectanceKey === key;
  }

  /** Builds the evaluator of spectra. */
  async spectra(settings, key, progress) {
    const maker = this.#maker;
    this.#spectraKey = null;
    await this.#ask(maker, "spectra", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#spectraKey = key;
  }

  /** Whether the maker holds the evaluator of spectra for this key. */
  hasSpectra(key) {
    return this.#spectraKey !== null && this.#spectraKey === key;
  }

  /** Reflectance in 1/sr at 380, 385, …, 780 nm; empty where the method has no spectrum. */
  spectrum(settings, wi, wo) {
    const directions = { wi: Float32Array.from(wi), wo: Float32Array.from(wo) };
    return this.#ask(this.#maker, "spectrum", { settings: JSON.stringify(settings), ...directions });
  }

  /** The BRDF map by the evaluator on the CPU; angles of the light in degrees. */
  mapOnProcessor(settings, theta_deg, phi_deg, side, progress) {
    const question = { settings: JSON.stringify(settings), theta_deg, phi_deg, side };
    return this.#ask(this.#maker, "map", question, { progress });
  }

  /** Builds mesh, bounding-volume tree and pigment; a draft is coarser and takes a fifth of the time. */
  async scene(settings, draft, progress) {
    if (this.#scenes?.busy) {
      this.#scenes.end();
      this.#scenes = null;
    }
    const channel = (this.#scenes ??= new Channel(MAKER, this.#module));
    try {
      return await channel.ask("scene", { settings: JSON.stringify(settings), draft }, { progress });
    } catch (error) {
      if (this.#scenes === channel) this.#scenes = null;
      throw error;
    }
  }

  // The artist

  /** Opens the graphics device on an unused canvas. Fails with an error of kind "no-webgpu" or "gpu". */
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

  /** Hands the bytes of `scene` to the artist. */
  setScene(bytes, draft) {
    return this.#artist.ask("scene", { bytes, draft }, { transfer: [bytes.buffer] });
  }

  /** Hands the bytes of `method` to the artist. */
  setMethod(bytes) {
    return this.#artist.ask("method", { bytes }, { transfer: [bytes.buffer] });
  }

  /** Orders a picture; the listener gets a report of each step towards it, with this serial number. */
  view(settings, width, height, serial) {
    this.#artist?.tell("view", { settings: JSON.stringify(settings), width, height, serial });
  }

  // Questions to the artist; crates/web/README.md documents its calls of the same names.
  draw = () => this.#artist.ask("draw");
  pixels = () => this.#artist.ask("pixels");
  png = () => this.#artist.ask("png");
  query = (x, y) => this.#artist.ask("query", { x, y });
  map = (wi, side) => this.#artist.ask("map", { wi: Float32Array.from(wi), side });
  loseDevice = () => this.#artist.ask("lose");
}
