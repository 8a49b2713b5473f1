// The controls: they show the settings and change them.

import { goBack } from "./making.js";
import { look, recover, resetView } from "./picture.js";
import { refreshMap } from "./reading.js";
import { change, isFile } from "./settings.js";
import { chooseFile, choosePreset } from "./sources.js";
import { byId, page, views } from "./state.js";
import { degrees, progress, say, signed } from "./words.js";

const DIELECTRICS = [{ name: "Keratin", eta: 1.56 }, { name: "Polycarbonate", eta: 1.58 }];

export function showControls() {
  const { settings } = page;
  const { surface } = settings;
  const put = (id, value) => {
    // What is being typed stays as it is.
    if (document.activeElement !== byId(id)) byId(id).value = value ?? "";
  };
  const preset = page.engine.catalogue.presets.find(({ name }) => name === surface.preset);
  byId("preset").value = isFile() ? "" : surface.preset;
  byId("grating").hidden = preset?.period_um === undefined;
  put("period", surface.period ?? preset?.period_um);
  put("height", surface.height ?? preset?.height_um);
  byId("file-options").hidden = !isFile();
  put("pixel_size", surface.pixel_size);
  put("max_height", surface.max_height);
  byId("fill").value = surface.fill ?? "none";
  put("channel", surface.channel);
  byId("level").value = surface.level ?? (isFile() ? "plane" : "none");
  const published = settings.method !== "table";
  byId("tiling").value = published ? "periodic" : (surface.tiling ?? (isFile() ? "aperiodic" : "periodic"));
  byId("tiling").disabled = published;
  byId("method").value = settings.method;
  byId("method-note").textContent = page.engine.catalogue.methods.find(({ name }) => name === settings.method)?.title ?? "";
  put("coherence_length", surface.coherence_length);
  const conserves = page.engine.catalogue.methods.find(({ name }) => name === settings.method)?.conserves_energy;
  byId("conserve_energy").disabled = !conserves;
  byId("conserve_energy").checked = Boolean(conserves && surface.conserve_energy);
  put("eta", surface.eta ?? 1.56);
  put("k", surface.k ?? 0);
  const material = [...byId("material").options].find(
    ({ dataset }) => Number(dataset.eta) === (surface.eta ?? 1.56) && Number(dataset.k) === (surface.k ?? 0),
  );
  byId("material").value = material?.value ?? "other";
  byId("blend").value = settings.pigment;
  byId("exposure").value = settings.exposure;
  byId("exposure-value").textContent = `${settings.exposure > 0 ? "+" : ""}${signed(settings.exposure)} stops`;
  for (const radio of document.querySelectorAll("input[name=scene]")) radio.checked = radio.value === settings.shape;
  for (const radio of document.querySelectorAll("input[name=example]")) {
    radio.checked = page.examples[radio.value]?.name === page.example;
  }
  showSun();
  showMapLight();
}

export function showMapLight() {
  byId("map_theta").value = page.settings.map.theta_deg;
  byId("map_phi").value = page.settings.map.phi_deg;
}

export function showSun() {
  const { sun, camera } = page.settings;
  views.sky.show(sun, camera);
  byId("azimuth").value = sun.azimuth_deg;
  byId("elevation").value = sun.elevation_deg;
  byId("azimuth-value").textContent = degrees(sun.azimuth_deg);
  byId("elevation-value").textContent = degrees(sun.elevation_deg);
}

export function listenToControls() {
  const surface = (id, read) =>
    byId(id).addEventListener("change", () => {
      const value = read(byId(id));
      change(({ surface }) => {
        if (value === undefined) delete surface[id];
        else surface[id] = value;
      });
    });
  const number = (field) => (field.value === "" ? undefined : field.valueAsNumber);
  for (const id of ["period", "height", "coherence_length", "eta"]) surface(id, number);
  // The two are given together.
  byId("k").addEventListener("change", () => change(({ surface }) => {
    surface.k = number(byId("k")) || undefined;
    surface.eta ??= number(byId("eta"));
  }));
  for (const id of ["level", "tiling", "fill"]) surface(id, (field) => field.value);
  surface("channel", (field) => field.value.trim() || undefined);
  surface("conserve_energy", (field) => field.checked);
  byId("preset").addEventListener("change", () => choosePreset(byId("preset").value));
  byId("file").addEventListener("change", () => {
    const [file] = byId("file").files;
    if (file) chooseFile(file);
    // The same file can be chosen again.
    byId("file").value = "";
  });
  byId("scale").addEventListener("submit", (event) => {
    event.preventDefault();
    change(({ surface }) => {
      for (const id of ["pixel_size", "max_height"]) {
        const value = number(byId(id));
        if (value === undefined) delete surface[id];
        else surface[id] = value;
      }
    });
  });
  byId("method").addEventListener("change", () => change((settings) => {
    settings.method = byId("method").value;
    settings.options = {};
  }));
  byId("material").addEventListener("change", () => {
    const { eta, k } = byId("material").selectedOptions[0].dataset;
    if (eta === undefined) return byId("eta").focus();
    change(({ surface }) => {
      surface.eta = Number(eta);
      if (Number(k)) surface.k = Number(k);
      else delete surface.k;
    });
  });
  byId("blend").addEventListener("change", () => change((settings) => (settings.pigment = byId("blend").value)));
  byId("exposure").addEventListener("input", () => change((settings) => (settings.exposure = byId("exposure").valueAsNumber)));
  for (const [id, key] of [["azimuth", "azimuth_deg"], ["elevation", "elevation_deg"]]) {
    byId(id).addEventListener("input", () => change(({ sun }) => (sun[key] = byId(id).valueAsNumber)));
  }
  for (const [id, key] of [["map_theta", "theta_deg"], ["map_phi", "phi_deg"]]) {
    byId(id).addEventListener("change", () => {
      change(({ map }) => (map[key] = byId(id).valueAsNumber));
      refreshMap();
    });
  }
  byId("size").addEventListener("change", look);
  for (const radio of document.querySelectorAll("input[name=scene]")) {
    radio.addEventListener("change", () => change((settings) => (settings.shape = radio.value)));
  }
  byId("cancel").addEventListener("click", () => {
    page.engine.cancel();
    progress(null);
    goBack();
    // Not in the line of the picture, which is drawn again and would replace it.
    say(page.good ? "Cancelled. This is the picture from before." : "Cancelled.");
  });
  byId("recover").addEventListener("click", recover);
  byId("message").querySelector("button").addEventListener("click", () => say(null));
  byId("reset").addEventListener("click", resetView);

  for (const kind of ["dragenter", "dragover"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      byId("drop").classList.add("over");
    });
  }
  document.addEventListener("dragleave", (event) => event.relatedTarget ?? byId("drop").classList.remove("over"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    byId("drop").classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (file) chooseFile(file);
  });
  new ResizeObserver(() => {
    if (byId("size").value === "auto") look();
  }).observe(byId("frame"));
}

export function fillLists() {
  const { presets, conductors, extensions, version } = page.engine.catalogue;
  const option = (value, text, data = {}) => {
    const element = new Option(text, value);
    Object.assign(element.dataset, data);
    return element;
  };
  // Shown where the surface is a file.
  const none = option("", "none, a file");
  none.hidden = true;
  byId("preset").replaceChildren(none, ...presets.map(({ name, title }) => option(name, title)));
  const index = ({ name, eta, k = 0 }) => option(name, `${name}, ${eta}${k ? ` + ${k}i` : ""}`, { eta, k });
  byId("material").replaceChildren(...DIELECTRICS.map(index), ...conductors.map(index), option("other", "another index"));
  byId("file").accept = extensions.join(",");
  byId("about").textContent = `sunbeam ${version}`;
}
