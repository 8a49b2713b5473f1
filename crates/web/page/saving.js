// Saves pictures and maps, and copies links, scenes and commands.

import { address } from "./address.js";
import { direction } from "./map.js";
import { mapOf } from "./reading.js";
import { byId, page } from "./state.js";
import { pictureSize } from "./view.js";
import { showMessage } from "./words.js";

/** Side of a saved map in pixels. Chosen. */
const EXR_SIDE = 256;

/** Has the browser save bytes as a file. */
function save(bytes, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1e4);
}

/** Name of saved files without extension: the relief's. */
const fileStem = () => (page.source?.name ?? page.settings.surface.preset).replace(/\.[^.]*$/, "");

/** Copies text to the clipboard, or shows it where the browser refuses; `name` is its kind for the status line. */
async function copy(text, name) {
  try {
    await navigator.clipboard.writeText(text);
    byId("status").textContent = `${name} copied.`;
  } catch {
    showMessage(text);
  }
}

/** Runs a task when the button is clicked; its errors become a message. */
function onClick(id, task) {
  byId(id).addEventListener("click", async () => {
    try {
      await task();
    } catch (error) {
      showMessage(error.message);
    }
  });
}

/** Listens to the buttons below the picture. */
export function listenToSaving() {
  onClick("save-png", async () => save(await page.engine.png(), `${fileStem()}.png`, "image/png"));
  onClick("save-exr", async () => {
    const rgb = await mapOf(direction(page.settings.map.theta_deg, page.settings.map.phi_deg), EXR_SIDE);
    if (rgb) save(page.engine.quick.map_exr(rgb, EXR_SIDE), `${fileStem()}-brdf.exr`, "image/x-exr");
  });
  const settings = () => JSON.stringify(page.settings);
  onClick("copy-link", () => copy(new URL(address(), location.href).href, "Link"));
  onClick("copy-xml", () => copy(page.engine.quick.share_xml(settings(), ...pictureSize()), "Mitsuba XML"));
  onClick("copy-command", () => copy(page.engine.quick.share_command(settings(), ...pictureSize(), 1), "Command"));
}
