//! Evaluates the BRDF `f_r` by wavelength on the CPU, for the page's plot of a spectrum.
//!
//! `f_r` = cover's factor · interface factor · angular factor · *value*
//!
//! `reflectance.rs` explains the factors, covers and films. The value comes from a [`Source`]; some values include
//! factors already.

use crate::error::WebError;
use crate::reflectance::single;
use crate::settings::Settings;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::methods::{self, Method, MethodKind};
use sunbeam::scattering::{ComplexIndex, Cover, Inside, Options, Pair, Vec3};
use sunbeam::table::Progress;

/// Number of wavelengths of a spectrum: 380, 385, …, 780 nm.
pub const SPECTRUM_COUNT: usize = 81;
/// First wavelength of a spectrum in nm.
const FIRST_NM: f64 = 380.0;
/// Step between the wavelengths of a spectrum in nm.
const STEP_NM: f64 = 5.0;

/// A source of values by wavelength, with the factors that complete them to `f_r`.
pub struct Spectra {
    source: Source,
    /// The library's options; only their obliquity factor, shadowing and film are read.
    options: Options,
    /// Refractive index relative to that of the cover.
    index: ComplexIndex,
    /// The cover; `None` for a bare surface.
    cover: Option<Cover>,
}

/// Source of values by wavelength.
enum Source {
    /// Spectral tables, for the method `table`, which itself has only colours. Values include the angular factor of
    /// the options that the tables were built with, and for a film also the interface factor.
    Surface(Box<Surface>),
    /// A published method, which has values by wavelength or none. They include no factor. Settings with a film have no
    /// such method.
    Method(Box<dyn Method>),
}

impl Spectra {
    /// Builds the source of spectra for the settings' method. The caller, [`Relief::spectra`](crate::Relief::spectra),
    /// has multiplied the lengths of `field`, heights included, by the index of the cover or film.
    ///
    /// # Errors
    /// [`WebError::Limit`] for a build that needs too much memory or time, [`WebError::Settings`] for options that do
    /// not fit the relief.
    pub fn new(field: &HeightField, settings: &Settings, progress: &Progress) -> Result<Self, WebError> {
        let (options, index, cover) = (settings.library_options(), settings.index_inside(), settings.surface.cover());
        let source = match settings.method {
            MethodKind::Table => Source::Surface(Box::new(Surface::watched(field, &options, progress)?)),
            kind => Source::Method(methods::build_watched(kind, field, &options, &settings.options, progress)?),
        };
        progress.report(1.0);
        Ok(Self { source, options, index, cover })
    }

    /// Replaces the refractive index and the obliquity factor by those of `settings`, which must have the same cover.
    /// With energy conservation or a film the tables also depend on the index. The page then builds them again, as
    /// after a change of the cover, because their key has changed ([`Settings::keys`]).
    pub fn set_index(&mut self, settings: &Settings) {
        self.index = settings.index_inside();
        self.options = settings.library_options();
    }

    /// `f_r` in 1/sr at each of [`SPECTRUM_COUNT`] wavelengths. `wi` is the unit vector to the light and `wo` that to
    /// the viewer. All values are 0 unless both directions lie above the surface. For directions above the surface, the
    /// result is empty if the method has no values by wavelength.
    pub fn spectrum(&self, wi: Vec3, wo: Vec3) -> Vec<f32> {
        let black = || vec![0.0; SPECTRUM_COUNT];
        let Some(Inside { wi, wo, factor: cover_factor, .. }) = Inside::new(self.cover, wi, wo) else { return black() };
        let Some(pair) = Pair::new(wi, wo) else { return black() };
        let cover_and_interface = match self.options.body {
            // A film has no cover, and its values include the interface.
            Some(_) => 1.0,
            None => cover_factor * pair.interface(Some(self.index), self.options.obliquity),
        };
        let angular = self.options.angular_factor(&pair);
        let f_r = |wavelength_nm: f64| match &self.source {
            Source::Surface(surface) => {
                // 1 unless `set_index` has changed the obliquity factor since the tables were built.
                let angular_change = angular / surface.options().angular_factor(&pair);
                Some(cover_and_interface * angular_change * surface.eval(wi, wo, wavelength_nm))
            }
            Source::Method(method) => {
                let relief = method.answer_spectral(single(wi), single(wo), wavelength_nm as f32)?;
                Some(cover_and_interface * angular * f64::from(relief))
            }
        };
        let wavelengths_nm = (0..SPECTRUM_COUNT).map(|i| FIRST_NM + STEP_NM * i as f64);
        // A method answers at every wavelength or at none.
        wavelengths_nm.map_while(f_r).map(|value| value as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Relief, direction};
    use std::sync::{Arc, Mutex};
    use sunbeam::colour::SpectralToRgb;

    /// A sinusoidal grating, and settings that draw it with this method.
    fn with_method(method: &str) -> (Relief, Settings) {
        with_surface(method, "")
    }

    /// [`with_method`] with further parameters of the surface, as JSON that begins with a comma.
    fn with_surface(method: &str, more: &str) -> (Relief, Settings) {
        let json =
            format!(r#"{{"surface": {{"preset": "sinusoidal", "coherence_length": 10{more}}}, "method": "{method}"}}"#);
        let settings = Settings::from_json(&json).unwrap();
        (Relief::new(&settings, None).unwrap(), settings)
    }

    #[test]
    fn the_spectrum_integrates_to_the_colour() {
        // Near order −1 of 480 nm at a period of 2.5 µm: sin 18° − sin 30° = −0.191, and −0.48/2.5 = −0.192.
        let (wi, wo) = (direction(30.0, 180.0), direction(18.0, 0.0));
        let colours = SpectralToRgb::new(FIRST_NM, STEP_NM, SPECTRUM_COUNT).unwrap();
        let film = r#", "eta": 1.5, "transmission": "film""#;
        for (method, more) in [("table", ""), ("flss", ""), ("table", r#", "cover_eta": 1.5"#), ("table", film)] {
            let (relief, settings) = with_surface(method, more);
            let spectra = relief.spectra(&settings, &Progress::none()).unwrap();
            let spectrum: Vec<f64> = spectra.spectrum(wi, wo).into_iter().map(f64::from).collect();
            assert_eq!(spectrum.len(), SPECTRUM_COUNT);
            let reflectance = relief.reflectance(&settings, &Progress::none()).unwrap();
            let (summed, rgb) = (colours.rgb(&spectrum), reflectance.rgb(wi, wo));
            let largest = rgb.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            for c in 0..3 {
                // Colours are integrated over other wavelengths than those of this test.
                assert!((summed[c] - rgb[c]).abs() < 0.02 * largest, "{method}: {summed:?} {rgb:?}");
            }
        }
        let (relief, settings) = with_method("stam");
        let spectra = relief.spectra(&settings, &Progress::none()).unwrap();
        assert!(spectra.spectrum(wi, direction(100.0, 0.0)).iter().all(|value| *value == 0.0));
    }

    /// The obliquity factor `auto` is `small_slope` for the dielectric and `stam` for the metal.
    #[test]
    fn a_change_of_the_index_gives_the_values_of_a_new_build() {
        // Near order −1 of 480 nm at a period of 2.5 µm, sin 48.6° − sin 70° = −0.190, where both factors differ.
        let (wi, wo) = (direction(70.0, 180.0), direction(48.6, 0.0));
        let (relief, dielectric) = with_surface("table", r#", "eta": 1.5"#);
        let (_, metal) = with_surface("table", r#", "eta": 1, "k": 6"#);
        assert_eq!(dielectric.keys(), metal.keys());
        let mut spectra = relief.spectra(&dielectric, &Progress::none()).unwrap();
        let mut reflectance = relief.reflectance(&dielectric, &Progress::none()).unwrap();
        spectra.set_index(&metal);
        reflectance.set_index(&metal);
        let built_spectrum = relief.spectra(&metal, &Progress::none()).unwrap().spectrum(wi, wo);
        let built_rgb = relief.reflectance(&metal, &Progress::none()).unwrap().rgb(wi, wo);
        let changed_spectrum = spectra.spectrum(wi, wo);
        assert!(built_spectrum.iter().any(|value| *value > 0.0));
        for (changed, built) in changed_spectrum.iter().zip(&built_spectrum) {
            // Rounding alone, with a summand for subnormal numbers.
            assert!((changed - built).abs() <= 1e-5 * built.abs() + f32::MIN_POSITIVE, "{changed} {built}");
        }
        for (changed, built) in reflectance.rgb(wi, wo).iter().zip(built_rgb) {
            assert!((changed - built).abs() <= 1e-5 * built.abs(), "{changed} {built}");
        }
    }

    #[test]
    fn progress_is_reported_in_steps_and_ends_at_one() {
        for method in ["table", "flss", "nmm", "pq"] {
            let (relief, settings) = with_method(method);
            let reports = Arc::new(Mutex::new(Vec::new()));
            let listener = Arc::clone(&reports);
            let progress = Progress::new(move |fraction| listener.lock().unwrap().push(fraction));
            relief.spectra(&settings, &progress).unwrap();
            let reports = reports.lock().unwrap();
            // A few reports before the last tenth show that progress does not jump from start to end.
            assert!(reports.iter().filter(|fraction| **fraction < 0.9).count() >= 3, "{method}: {reports:?}");
            assert_eq!(reports.last(), Some(&1.0), "{method}");
        }
    }
}
