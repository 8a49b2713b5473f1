// What is saved and copied.

import { direction } from "./map.js";
import { pictureSize } from "./picture.js";
import { mapOf } from "./reading.js";
import { address } from "./settings.js";
import { byId, page } from "./state.js";
import { say } from "./words.js";

const EXR_SIDE = 256;

function save(bytes, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1e4);
}

const fileStem = () => (page.source?.name ?? page.settings.surface.preset).replace(/\.[^.]*$/, "");

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    byId("status").textContent = `${what} copied.`;
  } catch {
    // Where the browser keeps the clipboard to itself, the text can be marked here.
    say(text);
  }
}

function onClick(id, task) {
  byId(id).addEventListener("click", async () => {
    try {
      await task();
    } catch (error) {
      say(error.message);
    }
  });
}

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
