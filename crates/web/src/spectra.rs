//! Spectra on the processor.

use crate::error::WebError;
use crate::reflectance::single;
use crate::settings::Settings;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::methods::{self, Method, MethodKind};
use sunbeam::scattering::{ComplexIndex, Options, Pair, Vec3};
use sunbeam::table::Progress;

/// Wavelengths of a spectrum: 380, 385, …, 780 nm.
pub const SPECTRUM_COUNT: usize = 81;

/// What gives a reflectance at one wavelength, with the optics around it.
pub struct Spectra {
    source: Source,
    model: Options,
    index: ComplexIndex,
}

enum Source {
    /// Of the method `table`, which holds colours alone, the spectral tables.
    Surface(Box<Surface>),
    Method(Box<dyn Method>),
}

impl Spectra {
    /// Makes what the settings' method needs for spectra; `progress` hears how far it has come.
    ///
    /// # Errors
    /// [`WebError::Limit`] for tables that would take too much, [`WebError::Settings`].
    pub fn new(field: &HeightField, settings: &Settings, progress: &Progress) -> Result<Self, WebError> {
        let (model, index) = (settings.model(), settings.index());
        let source = match settings.method {
            MethodKind::Table => Source::Surface(Box::new(Surface::watched(field, &model, progress)?)),
            kind => Source::Method(methods::build_watched(kind, field, &model, &settings.options, progress)?),
        };
        progress.report(1.0);
        Ok(Self { source, model, index })
    }

    /// Takes the refractive index of other settings, which no data depend on unless energy is conserved.
    pub fn set_index(&mut self, settings: &Settings) {
        self.index = settings.index();
    }

    /// `f_r` in 1/sr at each of [`SPECTRUM_COUNT`] wavelengths; empty where the method has no value by wavelength. Zero unless
    /// both directions, which are unit vectors, lie above the surface.
    pub fn spectrum(&self, wi: Vec3, wo: Vec3) -> Vec<f32> {
        let Some(pair) = Pair::new(wi, wo) else { return vec![0.0; SPECTRUM_COUNT] };
        let interface = pair.interface(Some(self.index), self.model.obliquity);
        let at = |wavelength_nm: f64| match &self.source {
            Source::Surface(surface) => Some(interface * surface.eval(wi, wo, wavelength_nm)),
            Source::Method(method) => {
                let relief = method.answer_spectral(single(wi), single(wo), wavelength_nm as f32)?;
                Some(interface * self.model.angular_factor(&pair) * f64::from(relief))
            }
        };
        let wavelengths_nm = (0..SPECTRUM_COUNT).map(|i| 380.0 + 5.0 * i as f64);
        wavelengths_nm.map_while(at).map(|value| value as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Relief, direction};
    use std::sync::{Arc, Mutex};
    use sunbeam::colour::SpectralToRgb;

    fn of(method: &str) -> (Relief, Settings) {
        let json =
            format!(r#"{{"surface": {{"preset": "sinusoidal", "coherence_length": 10}}, "method": "{method}"}}"#);
        let settings = Settings::from_json(&json).unwrap();
        (Relief::new(&settings, None).unwrap(), settings)
    }

    #[test]
    fn the_spectrum_adds_up_to_the_colour() {
        // Near the first order of 480 nm.
        let (wi, wo) = (direction(30.0, 180.0), direction(18.0, 0.0));
        let colours = SpectralToRgb::new(380.0, 5.0, SPECTRUM_COUNT).unwrap();
        for method in ["table", "flss"] {
            let (relief, settings) = of(method);
            let spectra = relief.spectra(&settings, &Progress::none()).unwrap();
            let spectrum: Vec<f64> = spectra.spectrum(wi, wo).into_iter().map(f64::from).collect();
            assert_eq!(spectrum.len(), SPECTRUM_COUNT);
            let reflectance = relief.reflectance(&settings, &Progress::none()).unwrap();
            let (summed, rgb) = (colours.rgb(&spectrum), reflectance.rgb(wi, wo));
            let largest = rgb.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            for c in 0..3 {
                // The table's quadrature has steps of 1 nm.
                assert!((summed[c] - rgb[c]).abs() < 0.02 * largest, "{method}: {summed:?} {rgb:?}");
            }
        }
        let (relief, settings) = of("stam");
        let spectra = relief.spectra(&settings, &Progress::none()).unwrap();
        assert!(spectra.spectrum(wi, direction(100.0, 0.0)).iter().all(|value| *value == 0.0));
    }

    #[test]
    fn progress_comes_in_steps_and_ends_at_one() {
        for method in ["table", "flss", "nmm", "pq"] {
            let (relief, settings) = of(method);
            let heard = Arc::new(Mutex::new(Vec::new()));
            let ears = Arc::clone(&heard);
            let progress = Progress::new(move |share| ears.lock().unwrap().push(share));
            relief.spectra(&settings, &progress).unwrap();
            let heard = heard.lock().unwrap();
            assert!(heard.iter().filter(|share| **share < 0.9).count() >= 3, "{method}: {heard:?}");
            assert_eq!(heard.last(), Some(&1.0), "{method}");
        }
    }
}
