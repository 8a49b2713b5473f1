// The artist: the Web Worker with the page's canvas and the graphics device.
//
// It keeps the scene, the realtime method and the view that the page sends, and draws pictures of them in steps, from
// coarse to fine. `artist` is the Rust object of crates/web/src/wasm/artist.rs. Its calls that draw must not overlap,
// so each asynchronous call goes through the queue of `inTurn`. `set_view` may be called at any time.
//
// Events to the page: "drawn" with the report of a picture, "failed" with a message, and "lost" when the device is
// lost.

import * as sunbeam from "./wasm/sunbeam_web.js";
import { answer } from "./answering.js";

/**
 * Time in ms from the last change of the view to the start of a finer picture. A longer one delays the finest picture.
 * A shorter one starts it during short rests of a drag; the drag then waits until the device finishes what was
 * submitted.
 */
const REST_MS = 100;
/** Rays along each side of a pixel of the finest picture. More rays smooth edges and take longer. */
const SUPERSAMPLE = 1;

/** The Rust artist; null before the device is opened and after its loss. */
let artist = null;
// Bytes that the page sent last, kept for a device that is opened after a loss.
/** The coarse scene. */
let draft = null;
/** The full scene. */
let scene = null;
/** The method's data. */
let method = null;
/**
 * The last view that the page ordered: {settings, width, height, serial}, with JSON settings and sizes in pixels. By
 * the serial number the page tells which of its orders a picture answers.
 */
let view = null;
/** Number of changes of view, scene, method and device so far, as counted by `restart`. */
let changeCount = 0;
/** Whether `drawAll` is running. */
let drawing = false;
/** Report of the picture shown (`Artist.step`) with the serial number of its order; null for none. */
let shown = null;
/** Time in ms of the last change of the view. */
let viewChangedAt = -Infinity;
/** Ends the wait of `rest` early; does nothing while none is running. */
let endRest = () => {};
/** Promise of the last queued task. It never fails. */
let queue = Promise.resolve();

/** Runs a task after all tasks that were queued before. Returns the promise of its result. */
function inTurn(task) {
  const done = queue.then(task);
  queue = done.catch(() => {});
  return done;
}

/** Waits until REST_MS have passed since the view's last change, or until the next change of any kind. */
async function rest() {
  const ms = viewChangedAt + REST_MS - performance.now();
  if (ms <= 0) return;
  await new Promise((resolve) => {
    endRest = resolve;
    setTimeout(resolve, ms);
  });
}

/**
 * Draws the next finer picture and updates `shown`. Returns false if `shown` stays: there is no finer picture, data are
 * missing, or a change has stopped the drawing. `handledChanges` is `changeCount` as `drawAll` has last read it.
 */
async function step(handledChanges) {
  // Serial number of the order at the start of the drawing, since the view may change while it is drawn.
  let serial;
  const report = await inTurn(() => {
    ({ serial } = view);
    return artist?.step();
  });
  if (report !== undefined) {
    shown = { serial, ...JSON.parse(report) };
    return true;
  }
  // Nothing was drawn. Without a further change the picture shown is that of the last order, and gets the order's
  // serial number: an order that changes nothing else still needs a report.
  if (!shown || handledChanges !== changeCount || shown.serial === serial) return false;
  shown.serial = serial;
  return true;
}

/** Draws finer and finer pictures until the finest one after the last change is shown. Only one call runs at a time. */
async function drawAll() {
  if (drawing || !artist) return;
  drawing = true;
  // `changeCount` is at least 1 here. If `restart` increases it during the drawing, the drawing is repeated, also after
  // a failure.
  let handledChanges = 0;
  while (artist && handledChanges !== changeCount) {
    handledChanges = changeCount;
    try {
      while (await step(handledChanges)) {
        postMessage({ type: "drawn", ...shown });
        if (!shown.finest) await rest();
      }
    } catch (error) {
      // A loss of the device is reported by the callback of `on_lost`.
      if (error.kind !== "lost") postMessage({ type: "failed", message: error.message ?? String(error) });
    }
  }
  drawing = false;
}

/** Passes the view to the artist and starts drawing, after a change of view, scene, method or device. */
function restart() {
  if (!artist || !view) return;
  changeCount += 1;
  endRest();
  artist.set_view(view.settings, view.width, view.height, SUPERSAMPLE);
  drawAll();
}

// Messages of the page; engine.js has a method for each, and crates/web/README.md has the units and layouts of results.
answer({
  // Opens a device on the canvas. Data that are kept from a lost device are uploaded again.
  async open({ canvas }) {
    const opened = await sunbeam.Artist.open(canvas);
    // In the queue, so that data which arrive meanwhile are uploaded afterwards.
    await inTurn(async () => {
      shown = null;
      artist = opened;
      opened.on_lost((message) => {
        // Another device may be open already.
        if (artist === opened) artist = null;
        postMessage({ type: "lost", message });
      });
      if (draft) await opened.set_scene(draft, true);
      if (scene) await opened.set_scene(scene, false);
      if (method) await opened.set_method(method);
    });
    restart();
    return JSON.parse(opened.adapter());
  },
  async scene({ bytes, draft: isDraft }) {
    // A draft announces another scene, so the old one is dropped.
    if (isDraft) [draft, scene] = [bytes, null];
    else scene = bytes;
    await inTurn(() => artist?.set_scene(bytes, isDraft));
    restart();
  },
  async method({ bytes }) {
    method = bytes;
    await inTurn(() => artist?.set_method(bytes));
    restart();
    return bytes.length;
  },
  view(fields) {
    view = fields;
    viewChangedAt = performance.now();
    restart();
  },
  // The picture shown.
  pixels: () =>
    inTurn(async () => {
      const [width, height] = artist.size();
      return { width, height, rgb: await artist.pixels() };
    }),
  // Saves the finest picture, even if the steps have not reached it yet.
  png: () =>
    inTurn(async () => {
      await artist.draw();
      return artist.png();
    }),
  // Draws the finest picture at once.
  draw: () => inTurn(async () => JSON.parse(await artist.draw())),
  // The point seen at (x, y), each in [0, 1) from the upper left of the picture; nothing without a device.
  query: ({ x, y }) =>
    inTurn(async () => {
      const found = await artist?.query(x, y);
      return found && JSON.parse(found);
    }),
  map: ({ wi, side }) => inTurn(() => artist?.map(wi, side)),
  // Destroys the device, for tests.
  lose: () => artist.lose(),
});
