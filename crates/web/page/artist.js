// The Web Worker that has the canvas and the graphics device.

import * as sunbeam from "./wasm/sunbeam_web.js";
import { answer } from "./answering.js";

/**
 * While the view moves, pictures stay coarse until it has rested for so many milliseconds: the finest one is a single piece of work
 * for the device, and whoever moves on would have to wait for it.
 */
const REST_MS = 100;

let artist = null;
// They outlive the device.
let draft = null;
let scene = null;
let method = null;
let view = null;
// Counts what has changed what is to be seen.
let wanted = 0;
let drawing = false;
// What was told of the picture that is shown.
let last = null;
let movedAt = -Infinity;
let wake = () => {};
// Calls that draw follow each other.
let queue = Promise.resolve();

function inTurn(task) {
  const done = queue.then(task);
  queue = done.catch(() => {});
  return done;
}

/** Waits until the view has rested, or is another one. */
async function rest() {
  const ms = movedAt + REST_MS - performance.now();
  if (ms <= 0) return;
  await new Promise((resolve) => {
    wake = resolve;
    setTimeout(resolve, ms);
  });
}

async function drawAll() {
  if (drawing || !artist) return;
  drawing = true;
  try {
    for (let seen = 0; artist && seen !== wanted; ) {
      seen = wanted;
      for (;;) {
        // The view may be another one by the time that this one is drawn.
        let serial;
        const report = await inTurn(() => {
          ({ serial } = view);
          return artist?.step();
        });
        if (report !== undefined) last = { serial, ...JSON.parse(report) };
        // Whoever asked for the picture that is there already hears that it is.
        else if (last && seen === wanted && last.serial !== serial) last.serial = serial;
        else break;
        postMessage({ type: "drawn", ...last });
        if (!last.finest) await rest();
      }
    }
  } catch (error) {
    // The loss of the device is told by its own callback.
    if (error.kind !== "lost") postMessage({ type: "failed", message: error.message ?? String(error) });
  } finally {
    drawing = false;
  }
}

function look() {
  if (!artist || !view) return;
  wanted += 1;
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
    look();
    return JSON.parse(opened.adapter());
  },
  async scene({ bytes, draft: isDraft }) {
    if (isDraft) [draft, scene] = [bytes, null];
    else scene = bytes;
    await inTurn(() => artist?.set_scene(bytes, isDraft));
    look();
  },
  async method({ bytes }) {
    method = bytes;
    await inTurn(() => artist?.set_method(bytes));
    look();
    return bytes.length;
  },
  view(fields) {
    view = fields;
    movedAt = performance.now();
    look();
  },
  pixels: () =>
    inTurn(async () => {
      const [width, height] = artist.size();
      return { width, height, rgb: await artist.pixels() };
    }),
  // The picture in full, whatever has been drawn of it so far.
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
