// Saves pictures and maps, and copies links, scenes and commands. `page.engine.quick` has the calls of the Rust library
// on the page's own thread (engine.js).

import { address } from "./address.js";
import { direction } from "./map.js";
import { mapOf } from "./reading.js";
import { byId, page } from "./state.js";
import { pictureSize } from "./view.js";
import { showMessage } from "./words.js";

/** Side of a saved map in pixels. A larger one resolves finer orders and takes longer. */
const EXR_SIDE = 256;
/** Time in ms after which the data of a saved file are released, long after the browser has read them. */
const RELEASE_MS = 1e4;

/** Makes the browser save bytes as a file of this name and MIME type. */
function save(bytes, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), RELEASE_MS);
}

/** Name of saved files without extension: that of the relief's file, read or awaited, or of its preset. */
function fileStem() {
  const { filename, preset } = page.settings.surface;
  return (page.source?.name ?? filename ?? preset).replace(/\.[^.]*$/, "");
}

/** Copies text to the clipboard, or shows it if the browser refuses. `name` is the kind of text for the status line. */
async function copy(text, name) {
  try {
    await navigator.clipboard.writeText(text);
    byId("status").textContent = `${name} copied.`;
  } catch {
    showMessage(text);
  }
}

/**
 * Runs a task when the button with this id is clicked. Its errors become a message, except a lost GPU, which has its
 * own message, and a worker that the page has ended.
 */
function onClick(id, task) {
  byId(id).addEventListener("click", async () => {
    try {
      await task();
    } catch (error) {
      if (error.kind !== "lost" && error.kind !== "cancelled") showMessage(error.message);
    }
  });
}

/** Listens to the buttons below the picture. */
export function listenToSaving() {
  onClick("save-png", async () => {
    // Without a device there is no picture to save.
    if (page.adapter) save(await page.engine.png(), `${fileStem()}.png`, "image/png");
  });
  onClick("save-exr", async () => {
    const rgb = await mapOf(direction(page.settings.map.theta_deg, page.settings.map.phi_deg), EXR_SIDE);
    // Null while the data of the map are being built.
    if (rgb) save(page.engine.quick.map_exr(rgb, EXR_SIDE), `${fileStem()}-brdf.exr`, "image/x-exr");
  });
  const settings = () => JSON.stringify(page.settings);
  onClick("copy-link", () => copy(new URL(address(), location.href).href, "Link"));
  onClick("copy-xml", () => copy(page.engine.quick.share_xml(settings(), ...pictureSize()), "Mitsuba XML"));
  // One ray per pixel, as in the page's picture.
  onClick("copy-command", () => copy(page.engine.quick.share_command(settings(), ...pictureSize(), 1), "Command"));
}
