// Listens to the controls, each of which changes a setting. panel.js shows the settings in them.

import { goBack } from "./making.js";
import { KERATIN_ETA, showPercent } from "./panel.js";
import { recover, resetView } from "./picture.js";
import { refreshMap } from "./reading.js";
import { change } from "./settings.js";
import { chooseFile, choosePreset } from "./sources.js";
import { byId, page } from "./state.js";
import { orderPicture } from "./view.js";
import { showMessage, showProgress } from "./words.js";

/** Relative size for a slider at 0 %: the smallest that the library accepts (src/scattering/size.rs). */
const SIZE_MIN = 1e-3;

/** Adds the listeners of all controls. */
export function listenToControls() {
  listenToSources();
  listenToRelief();
  listenToSun();
  listenToDiffraction();
  listenToInterface();
  listenToPicture();
  listenToMap();
  listenToDrops();
}

/** Number in an input; undefined for an empty one. */
const number = (input) => (input.value === "" ? undefined : input.valueAsNumber);

/** Sets a field of a part of the settings. Undefined selects the default. */
function setField(part, key, value) {
  if (value === undefined) delete part[key];
  else part[key] = value;
}

/** Lets the control `id` change the field of the surface with the same name. `read(control)` returns the value. */
function listenForSurface(id, read) {
  byId(id).addEventListener("change", () => {
    const value = read(byId(id));
    change(({ surface }) => setField(surface, id, value));
  });
}

/** Preset with its period and height, and the button that chooses a file. */
function listenToSources() {
  byId("preset").addEventListener("change", () => choosePreset(byId("preset").value));
  for (const id of ["period", "height"]) listenForSurface(id, number);
  byId("file").addEventListener("change", () => {
    const [file] = byId("file").files;
    if (file) chooseFile(file);
    // Cleared, so that the same file can be chosen again.
    byId("file").value = "";
  });
}

/** Form for a missing scale, and options of the reader. */
function listenToRelief() {
  byId("scale").addEventListener("submit", (event) => {
    event.preventDefault();
    change(({ surface }) => {
      for (const id of ["pixel_size", "max_height"]) setField(surface, id, number(byId(id)));
    });
  });
  for (const id of ["level", "tiling", "fill"]) listenForSurface(id, (field) => field.value);
  listenForSurface("channel", (field) => field.value.trim() || undefined);
}

/** Sliders of the sun's angles. The drawing of the sky also sets them (main.js). */
function listenToSun() {
  for (const [id, key] of [["azimuth", "azimuth_deg"], ["elevation", "elevation_deg"]]) {
    byId(id).addEventListener("input", () => change(({ sun }) => (sun[key] = byId(id).valueAsNumber)));
  }
}

/** Method, coherence length, relative sizes and energy conservation. */
function listenToDiffraction() {
  byId("method").addEventListener("change", () => change((settings) => {
    // The options of one method do not apply to another.
    settings.method = byId("method").value;
    settings.options = {};
  }));
  listenForSurface("coherence_length", number);
  // Sliders of relative sizes, in percent. Each change builds the tables anew, so they act when released.
  for (const [id, key] of [["pattern", "scale"], ["depth", "depth"]]) {
    byId(id).addEventListener("change", () =>
      change(({ surface }) => (surface[key] = Math.max(byId(id).valueAsNumber / 100, SIZE_MIN))),
    );
    byId(id).addEventListener("input", () => showPercent(id, byId(id).valueAsNumber));
  }
  listenForSurface("conserve_energy", (field) => field.checked);
}

/** Material, refractive indices and the choice of a film. */
function listenToInterface() {
  byId("material").addEventListener("change", () => {
    const { eta, k } = byId("material").selectedOptions[0].dataset;
    // The entry "another index" has no index of its own.
    if (eta === undefined) return byId("eta").focus();
    change(({ surface }) => {
      surface.eta = Number(eta);
      setField(surface, "k", Number(k) || undefined);
    });
  });
  for (const id of ["eta", "cover_eta"]) listenForSurface(id, number);
  // The library accepts `k` only with `eta`, so the shown default of `eta` is set, too. A `k` of 0 is left out.
  byId("k").addEventListener("change", () => change(({ surface }) => {
    setField(surface, "k", number(byId("k")) || undefined);
    surface.eta ??= KERATIN_ETA;
  }));
  // The library requires the refractive index of a film. It refuses absorption, a cover, shadowing, and any obliquity
  // factor but the default one.
  byId("transmission").addEventListener("change", () => change(({ surface }) => {
    delete surface.transmission;
    if (!byId("transmission").checked) return;
    surface.transmission = "film";
    surface.eta ??= KERATIN_ETA;
    for (const key of ["k", "cover_eta", "shadowing", "obliquity"]) delete surface[key];
  }));
}

/** Shape, pigment, exposure and size of the picture, and the buttons on it. */
function listenToPicture() {
  for (const radio of document.querySelectorAll("input[name=scene]")) {
    radio.addEventListener("change", () => change((settings) => (settings.shape = radio.value)));
  }
  byId("blend").addEventListener("change", () => change((settings) => (settings.pigment = byId("blend").value)));
  byId("exposure").addEventListener("input", () =>
    change((settings) => (settings.exposure = byId("exposure").valueAsNumber)),
  );
  byId("size").addEventListener("change", orderPicture);
  // Also called once at the start.
  new ResizeObserver(() => {
    if (byId("size").value === "auto") orderPicture();
  }).observe(byId("frame"));
  byId("cancel").addEventListener("click", () => {
    page.engine.cancel();
    showProgress(null);
    goBack();
    // `page.good` is the last state with a complete picture, to which `goBack` has returned; null without one. A
    // message is shown, since the next picture overwrites the status line.
    showMessage(page.good ? "Cancelled. This is the picture from before." : "Cancelled.");
  });
  byId("recover").addEventListener("click", recover);
  byId("message").querySelector("button").addEventListener("click", () => showMessage(null));
  byId("reset").addEventListener("click", resetView);
}

/** Light of the BRDF map. */
function listenToMap() {
  for (const [id, key] of [["map_theta", "theta_deg"], ["map_phi", "phi_deg"]]) {
    byId(id).addEventListener("change", () => {
      change(({ map }) => setField(map, key, number(byId(id))));
      refreshMap();
    });
  }
}

/** Files that are dropped anywhere on the page. */
function listenToDrops() {
  for (const kind of ["dragenter", "dragover"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      byId("drop").classList.add("over");
    });
  }
  document.addEventListener("dragleave", (event) => {
    // Without relatedTarget the pointer has left the window, otherwise only an element of the page.
    if (!event.relatedTarget) byId("drop").classList.remove("over");
  });
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    byId("drop").classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (file) chooseFile(file);
  });
}
