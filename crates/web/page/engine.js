// All that the page asks of the library. Nothing else knows of the wasm module, the workers or their messages.

import init, * as sunbeam from "./wasm/sunbeam_web.js";
import { Channel, WorkerError } from "./channel.js";

export { WorkerError };

const MODULE = new URL("./wasm/sunbeam_web_bg.wasm", import.meta.url);
const MAKER = new URL("./maker.js", import.meta.url);
const ARTIST = new URL("./artist.js", import.meta.url);

/** Compiles the library once, for the page and its workers. */
export async function openEngine(listener) {
  const response = await fetch(MODULE);
  if (!response.ok) throw new Error(`${MODULE.pathname}: ${response.status} ${response.statusText}`);
  // A host that does not know the file type of wasm is no reason to fail.
  const module = await WebAssembly.compile(await response.arrayBuffer());
  await init({ module_or_path: module });
  return new Engine(module, listener);
}

export class Engine {
  // What takes no time is asked on the page's own thread.
  quick = sunbeam;
  #module;
  #listener;
  #maker = null;
  #scenes = null;
  #artist = null;
  /** What the maker has read, so that another is told again. */
  #reliefKey = null;
  #reflectanceKey = null;
  #spectraKey = null;

  constructor(module, listener) {
    this.#module = module;
    this.#listener = listener;
    this.catalogue = JSON.parse(sunbeam.catalogue());
  }

  keys(settings) {
    return JSON.parse(sunbeam.keys(JSON.stringify(settings)));
  }

  complete(settings) {
    return JSON.parse(sunbeam.complete_settings(JSON.stringify(settings)));
  }

  compact(settings) {
    return JSON.parse(sunbeam.compact_settings(JSON.stringify(settings)));
  }

  // Makers

  #newMaker() {
    this.#maker?.end();
    this.#maker = new Channel(MAKER, this.#module);
    this.#reliefKey = this.#reflectanceKey = this.#spectraKey = null;
    return this.#maker;
  }

  /** A maker that answers at once: one that is at work is ended. */
  #idleMaker() {
    return this.#maker && !this.#maker.busy ? this.#maker : this.#newMaker();
  }

  /** Ends what is being made of the relief. */
  cancel() {
    if (this.#maker?.busy) this.#newMaker();
  }

  async #ask(channel, ...question) {
    try {
      return await channel.ask(...question);
    } catch (error) {
      // The module is unusable after a fault of its own.
      if (error.kind === "internal" && channel === this.#maker) this.#newMaker();
      throw error;
    }
  }

  checksum(file) {
    return this.#ask(this.#idleMaker(), "checksum", { file });
  }

  /** The relief of a preset, or of a file: its facts and its picture. `key` is what [`Engine.holds`] knows it by. */
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

  estimate(settings) {
    return this.#ask(this.#maker, "estimate", { settings: JSON.stringify(settings) });
  }

  /** The method's data, of the relief that was read last. */
  method(settings, progress) {
    return this.#ask(this.#maker, "method", { settings: JSON.stringify(settings) }, { progress });
  }

  /** Makes the reflectance on the processor, which maps without WebGPU are read from. */
  async reflectance(settings, key, progress) {
    const maker = this.#maker;
    this.#reflectanceKey = null;
    await this.#ask(maker, "reflectance", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#reflectanceKey = key;
  }

  hasReflectance(key) {
    return this.#reflectanceKey !== null && this.#reflectanceKey === key;
  }

  /** Makes what spectra are read from. */
  async spectra(settings, key, progress) {
    const maker = this.#maker;
    this.#spectraKey = null;
    await this.#ask(maker, "spectra", { settings: JSON.stringify(settings) }, { progress });
    if (maker === this.#maker) this.#spectraKey = key;
  }

  /** Whether spectra can be asked for, of the data of this key. */
  hasSpectra(key) {
    return this.#spectraKey !== null && this.#spectraKey === key;
  }

  spectrum(settings, wi, wo) {
    return this.#ask(this.#maker, "spectrum", { settings: JSON.stringify(settings), wi: Float32Array.from(wi), wo: Float32Array.from(wo) });
  }

  mapOnProcessor(settings, theta_deg, phi_deg, side, progress) {
    return this.#ask(this.#maker, "map", { settings: JSON.stringify(settings), theta_deg, phi_deg, side }, { progress });
  }

  /** Mesh, tree and pigment; a draft of them is made much sooner. */
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

  /** Starts the graphics device on a canvas that nothing has drawn on. Fails with the kind "no-webgpu" or "gpu". */
  async openArtist(canvas) {
    // The worker could not even ask.
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

  setScene(bytes, draft) {
    return this.#artist.ask("scene", { bytes, draft }, { transfer: [bytes.buffer] });
  }

  setMethod(bytes) {
    return this.#artist.ask("method", { bytes }, { transfer: [bytes.buffer] });
  }

  /** What is to be seen from now on. The listener hears of each picture that is drawn, with this serial number. */
  view(settings, width, height, serial) {
    this.#artist?.tell("view", { settings: JSON.stringify(settings), width, height, serial });
  }

  draw = () => this.#artist.ask("draw");
  pixels = () => this.#artist.ask("pixels");
  png = () => this.#artist.ask("png");
  query = (x, y) => this.#artist.ask("query", { x, y });
  map = (wi, side) => this.#artist.ask("map", { wi: Float32Array.from(wi), side });
  loseDevice = () => this.#artist.ask("lose");
}
