//! Catalogue: the entries of the page's drop-down lists, as JSON. `README.md` of this crate documents the object.

use crate::relief::FILE_BYTES_MAX;
use serde::Serialize;
use serde_json::{Value, json};
use sunbeam::config::ReliefSource;
use sunbeam::height_field::{Preset, READABLE};
use sunbeam::methods::MethodKind;

/// A metal with its refractive index `eta + ik` at 550 nm.
#[derive(Serialize)]
struct Conductor {
    name: &'static str,
    eta: f64,
    k: f64,
}

/// Metals of the page's list (Rakić 1998 for aluminium and chromium, Johnson and Christy 1972 for the others). The
/// renderer has one index for all wavelengths, so gold is as grey as silver.
const CONDUCTORS: [Conductor; 5] = [
    Conductor { name: "aluminium", eta: 0.96, k: 6.69 },
    Conductor { name: "chromium", eta: 3.18, k: 3.33 },
    Conductor { name: "copper", eta: 1.04, k: 2.59 },
    Conductor { name: "gold", eta: 0.42, k: 2.35 },
    Conductor { name: "silver", eta: 0.06, k: 3.59 },
];

/// One JSON object with these fields:
///
/// - `presets`, `methods`, `conductors`: entries of the lists;
/// - `extensions`: extensions of readable files; `file_bytes_max`: the largest file in bytes;
/// - `source_fields`: fields of [`Settings::surface`](crate::Settings::surface) that select a relief;
/// - `version`: version of this crate.
pub fn catalogue() -> Value {
    let preset = |preset: Preset| {
        let mut entry = json!({ "name": preset.name(), "title": preset_title(preset) });
        // Only gratings have a period and a height.
        if let Some((period_um, height_um)) = preset.defaults_um() {
            (entry["period_um"], entry["height_um"]) = (json!(period_um), json!(height_um));
        }
        entry
    };
    let method = |kind: MethodKind| {
        // Some methods have only the patch model, one coherence window at a fixed position, which cannot conserve
        // energy.
        let conserves_energy = !kind.is_patch_only();
        json!({ "name": kind.name(), "title": method_title(kind), "conserves_energy": conserves_energy })
    };
    json!({
        "presets": Preset::ALL.map(preset),
        "methods": MethodKind::ALL.map(method),
        "conductors": CONDUCTORS,
        "extensions": extensions(),
        "source_fields": ReliefSource::NAMES,
        "file_bytes_max": FILE_BYTES_MAX,
        "version": env!("CARGO_PKG_VERSION"),
    })
}

/// Extensions of readable files, each with a dot: [`READABLE`] split at commas. Its last entry, ".000 to .999" of
/// Nanoscope files, becomes `.000`; files with other extensions of this range can be dropped on the page.
fn extensions() -> Vec<&'static str> {
    READABLE.split(", ").filter_map(|extension| extension.split(' ').next()).collect()
}

/// Title of a preset in the page's list.
const fn preset_title(preset: Preset) -> &'static str {
    match preset {
        Preset::Flat => "Mirror",
        Preset::Blazed => "Blazed grating",
        Preset::Sinusoidal => "Sinusoidal grating",
        Preset::Lamellar => "Lamellar grating",
        Preset::Cd => "Compact disc",
        Preset::Elaphe => "Rat snake (Elaphe)",
        Preset::Xenopeltis => "Sunbeam snake (Xenopeltis)",
    }
}

/// Title of a method in the page's list; `docs/realtime.md` describes the methods.
const fn method_title(kind: MethodKind) -> &'static str {
    match kind {
        MethodKind::Flss => "FLSS, equal steps of the wavelength",
        MethodKind::Nmm => "NMM, wavelengths at whole orders",
        MethodKind::Pq => "PQ, a finite number of tiles",
        MethodKind::Stam => "Stam, the spacing alone",
        MethodKind::Table => "Colour table",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Settings;

    #[test]
    fn every_listed_choice_is_accepted() {
        let catalogue = catalogue();
        let names = |list: &str| -> Vec<String> {
            catalogue[list].as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap().to_owned()).collect()
        };
        for preset in names("presets") {
            Settings::from_json(&json!({ "surface": { "preset": preset } }).to_string()).unwrap();
        }
        for method in names("methods") {
            Settings::from_json(&json!({ "method": method }).to_string()).unwrap();
        }
        for conductor in catalogue["conductors"].as_array().unwrap() {
            let surface = json!({ "preset": "cd", "eta": conductor["eta"], "k": conductor["k"] });
            Settings::from_json(&json!({ "surface": surface }).to_string()).unwrap();
        }
        let extensions = extensions();
        for needed in [".gsf", ".gwy", ".npy", ".tiff", ".png", ".txt", ".exr"] {
            assert!(extensions.contains(&needed), "{needed} in {extensions:?}");
        }
        assert!(extensions.iter().all(|extension| extension.starts_with('.')));
    }
}
