// Shows the settings in the controls. controls.js reads them back. The *catalogue* is the library's list of presets,
// methods, conductors and accepted file types.

import { byId, isFile, page, views } from "./state.js";
import { degrees, signed } from "./words.js";

/** Refractive index of keratin, equal to the library's default (KERATIN in crates/realtime/src/view.rs). */
export const KERATIN_ETA = 1.56;

/** Dielectrics with their refractive index at 550 nm. */
const DIELECTRICS = [{ name: "Keratin", eta: KERATIN_ETA }, { name: "Polycarbonate", eta: 1.58 }];

/** Shows all settings. Fields without a value show the library's default, or are empty without one. */
export function showControls() {
  const { catalogue } = page.engine;
  const { surface } = page.settings;
  showSource(surface, catalogue.presets.find(({ name }) => name === surface.preset));
  showDiffraction(page.settings, catalogue.methods.find(({ name }) => name === page.settings.method));
  showInterface(page.settings);
  showPictureOptions(page.settings);
  showSun();
  showMapLight();
}

/** Shows a value in a field, unless the visitor may be typing there: the field has the focus. */
function put(id, value) {
  if (document.activeElement !== byId(id)) byId(id).value = value ?? "";
}

/** Shows the source of the relief and the options for reading a file. `preset` is undefined for a file. */
function showSource(surface, preset) {
  byId("preset").value = isFile() ? "" : surface.preset;
  byId("grating").hidden = preset?.period_um === undefined;
  put("period", surface.period ?? preset?.period_um);
  put("height", surface.height ?? preset?.height_um);
  for (const radio of document.querySelectorAll("input[name=example]")) {
    // The values of these radio buttons are positions in the list.
    radio.checked = page.examples[radio.value]?.name === page.example;
  }
  put("pixel_size", surface.pixel_size);
  put("max_height", surface.max_height);
  byId("level").value = surface.level ?? (isFile() ? "plane" : "none");
  byId("file-options").hidden = !isFile();
  byId("fill").value = surface.fill ?? "none";
  put("channel", surface.channel);
}

/** Shows the method, with the options that depend on it. `method` is its entry in the catalogue. */
function showDiffraction({ surface, method: name }, method) {
  // All methods but the colour table, `table`, are published ones, which have only periodic tiles.
  const published = name !== "table";
  byId("tiling").value = published ? "periodic" : (surface.tiling ?? (isFile() ? "aperiodic" : "periodic"));
  byId("tiling").disabled = published;
  byId("method").value = name;
  byId("method-note").textContent = method?.title ?? "";
  put("coherence_length", surface.coherence_length);
  for (const [id, size] of [["pattern", surface.scale], ["depth", surface.depth]]) {
    const percent = Math.round(100 * (size ?? 1));
    byId(id).value = percent;
    showPercent(id, percent);
  }
  const canConserve = method?.conserves_energy;
  byId("conserve_energy").disabled = !canConserve;
  byId("conserve_energy").checked = Boolean(canConserve && surface.conserve_energy);
}

/** Shows material, refractive indices and the choice of a film. */
function showInterface({ surface, method }) {
  const { eta = KERATIN_ETA, k = 0 } = surface;
  put("eta", eta);
  put("k", k);
  const material = [...byId("material").options].find(
    ({ dataset }) => Number(dataset.eta) === eta && Number(dataset.k) === k,
  );
  byId("material").value = material?.value ?? "other";
  put("cover_eta", surface.cover_eta);
  byId("transmission").checked = surface.transmission === "film";
  // Only the colour table, the method `table`, shows films.
  byId("transmission").disabled = method !== "table";
}

/** Shows shape, pigment and exposure. */
function showPictureOptions({ shape, pigment, exposure }) {
  for (const radio of document.querySelectorAll("input[name=scene]")) radio.checked = radio.value === shape;
  byId("blend").value = pigment;
  byId("exposure").value = exposure;
  byId("exposure-value").textContent = `${exposure > 0 ? "+" : ""}${signed(exposure)} stops`;
}

/** Shows the value of the slider `pattern` or `depth`, in percent of the size in the relief's source. */
export function showPercent(id, percent) {
  byId(`${id}-value`).textContent = `${percent} %`;
}

/** Shows the light of the BRDF map. */
export function showMapLight() {
  byId("map_theta").value = page.settings.map.theta_deg;
  byId("map_phi").value = page.settings.map.phi_deg;
}

/** Shows the sun in the sky and its angles. */
export function showSun() {
  const { sun, camera } = page.settings;
  views.sky.show(sun, camera);
  byId("azimuth").value = sun.azimuth_deg;
  byId("elevation").value = sun.elevation_deg;
  byId("azimuth-value").textContent = degrees(sun.azimuth_deg);
  byId("elevation-value").textContent = degrees(sun.elevation_deg);
}

/** Fills the lists of presets, materials and accepted file types, and shows the version. */
export function fillLists() {
  const { presets, conductors, extensions, version } = page.engine.catalogue;
  const option = (value, text, data = {}) => {
    const element = new Option(text, value);
    Object.assign(element.dataset, data);
    return element;
  };
  // Selected while the surface is a file.
  const none = option("", "none, a file");
  none.hidden = true;
  byId("preset").replaceChildren(none, ...presets.map(({ name, title }) => option(name, title)));
  const material = ({ name, eta, k = 0 }) => option(name, `${name}, ${eta}${k ? ` + ${k}i` : ""}`, { eta, k });
  const other = option("other", "another index");
  byId("material").replaceChildren(...DIELECTRICS.map(material), ...conductors.map(material), other);
  byId("file").accept = extensions.join(",");
  byId("about").textContent = `sunbeam ${version}`;
}
