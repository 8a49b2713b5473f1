// The drawing worker: a Web Worker with the page's canvas and the graphics device.
//
// `artist` is the Rust object of crates/web/src/wasm/artist.rs. It draws a picture in steps, from coarse to fine. Its
// calls must not overlap, so each goes through the queue of `inTurn`. Events to the page: "drawn" with the report of a
// step, "failed", and "lost" when the device is lost.

import * as sunbeam from "./wasm/sunbeam_web.js";
import { answer } from "./answering.js";

/**
 * Pause in ms between the last change of the view and a finer picture. Chosen: the device cannot interrupt a picture,
 * and a visitor who moves on would have to wait for it.
 */
const REST_MS = 100;

/** The Rust artist; null before the device is opened and after its loss. */
let artist = null;
// Data of the library, kept for a device that is opened after a loss.
let draft = null;
let scene = null;
let method = null;
/** The last ordered view: settings, size and serial number. */
let view = null;
/** Number of changes of view, scene, method and device. */
let changes = 0;
/** Whether `drawAll` is running. */
let drawing = false;
/** The report of the picture shown. */
let last = null;
/** Time in ms of the last change of the view. */
let movedAt = -Infinity;
/** Ends `rest` early. */
let wake = () => {};
/** Promise of the last queued call of the artist. */
let queue = Promise.resolve();

/** Runs a task after all tasks that were queued before. */
function inTurn(task) {
  const done = queue.then(task);
  queue = done.catch(() => {});
  return done;
}

/** Waits until REST_MS have passed since the view's last change, or until it changes again. */
async function rest() {
  const ms = movedAt + REST_MS - performance.now();
  if (ms <= 0) return;
  await new Promise((resolve) => {
    wake = resolve;
    setTimeout(resolve, ms);
  });
}

/** Draws finer and finer pictures until the finest one of the last change is shown. */
async function drawAll() {
  if (drawing || !artist) return;
  drawing = true;
  try {
    for (let drawnChanges = 0; artist && drawnChanges !== changes; ) {
      drawnChanges = changes;
      for (;;) {
        // The view may change while the picture is drawn.
        let serial;
        const report = await inTurn(() => {
          ({ serial } = view);
          return artist?.step();
        });
        if (report !== undefined) last = { serial, ...JSON.parse(report) };
        // The picture shown already answers the new order.
        else if (last && drawnChanges === changes && last.serial !== serial) last.serial = serial;
        else break;
        postMessage({ type: "drawn", ...last });
        if (!last.finest) await rest();
      }
    }
  } catch (error) {
    // The callback of on_lost tells of the loss of the device.
    if (error.kind !== "lost") postMessage({ type: "failed", message: error.message ?? String(error) });
  } finally {
    drawing = false;
  }
}

/** Passes the view to the artist and starts drawing, after a change of view, scene, method or device. */
function restart() {
  if (!artist || !view) return;
  changes += 1;
  wake();
  artist.set_view(view.settings, view.width, view.height, 1);
  drawAll();
}

answer({
  async open({ canvas }) {
    const opened = await sunbeam.Artist.open(canvas);
    last = null;
    artist = opened;
    opened.on_lost((message) => {
      if (artist === opened) artist = null;
      postMessage({ type: "lost", message });
    });
    if (draft) await opened.set_scene(draft, true);
    if (scene) await opened.set_scene(scene, false);
    if (method) await opened.set_method(method);
    restart();
    return JSON.parse(opened.adapter());
  },
  async scene({ bytes, draft: isDraft }) {
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
    movedAt = performance.now();
    restart();
  },
  pixels: () =>
    inTurn(async () => {
      const [width, height] = artist.size();
      return { width, height, rgb: await artist.pixels() };
    }),
  // The finest picture, also before the steps have reached it.
  png: () =>
    inTurn(async () => {
      await artist.draw();
      return artist.png();
    }),
  draw: () => inTurn(async () => JSON.parse(await artist.draw())),
  query: ({ x, y }) =>
    inTurn(async () => {
      const found = await artist?.query(x, y);
      return found && JSON.parse(found);
    }),
  map: ({ wi, side }) => inTurn(() => artist?.map(wi, side)),
  lose: () => artist.lose(),
});
