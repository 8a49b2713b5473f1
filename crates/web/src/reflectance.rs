//! The reflectance on the processor, for pages without a GPU and for spectra.

use crate::error::WebError;
use crate::settings::Settings;
use sunbeam::height_field::HeightField;
use sunbeam::methods::{AnswerKind, Method, MethodKind};
use sunbeam::reflectance::{ComplexIndex, Options, Pair, Surface, Vec3, map_direction};
use sunbeam::table::Progress;

/// Wavelengths of a spectrum: 380, 385, …, 780 nm.
pub const SPECTRUM_COUNT: usize = 81;

/// A method with the optics around it, and the spectral tables once a spectrum has been asked for.
pub struct Reflectance {
    field: HeightField,
    method: Box<dyn Method>,
    kind: MethodKind,
    model: Options,
    index: ComplexIndex,
    surface: Option<Surface>,
}

impl Reflectance {
    /// A method that was built of these heights and settings.
    pub fn new(field: HeightField, method: Box<dyn Method>, settings: &Settings) -> Self {
        let (kind, model, index) = (settings.method, settings.model(), settings.index());
        Self { field, method, kind, model, index, surface: None }
    }

    /// The integral of `f_r` over the visible spectrum, linear sRGB in 1/sr; zero unless both directions, which are unit
    /// vectors, lie above the surface.
    pub fn rgb(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let factor = match self.method.answers() {
            AnswerKind::Reflectance => 1.0,
            AnswerKind::Relief => {
                pair.interface(Some(self.index), self.model.obliquity) * self.model.angular_factor(&pair)
            }
        };
        self.method.answer_rgb(single(wi), single(wo)).map(|channel| factor * f64::from(channel))
    }

    /// [`Reflectance::rgb`] over the hemisphere as [`map_direction`] lays it out, rows from the top, for light from `wi`.
    pub fn map(&self, wi: Vec3, side: usize, progress: &Progress) -> Vec<[f32; 3]> {
        let rows = progress.of_steps(side);
        let mut map = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let rgb = map_direction(column, row, side).map_or([0.0; 3], |wo| self.rgb(wi, wo));
                map.push(rgb.map(|value| value as f32));
            }
            rows.one();
        }
        map
    }

    /// `f_r` in 1/sr at each of [`SPECTRUM_COUNT`] wavelengths; empty where the method has no value by wavelength. Of the
    /// method `table` the spectral tables are built when they are first asked.
    ///
    /// # Errors
    /// [`WebError::Limit`] for tables that would take too much.
    pub fn spectrum(&mut self, wi: Vec3, wo: Vec3) -> Result<Vec<f32>, WebError> {
        if self.kind == MethodKind::Table && self.surface.is_none() {
            self.surface = Some(Surface::new(&self.field, &self.model)?);
        }
        let Some(pair) = Pair::new(wi, wo) else { return Ok(vec![0.0; SPECTRUM_COUNT]) };
        let interface = pair.interface(Some(self.index), self.model.obliquity);
        let at = |wavelength_nm: f64| match &self.surface {
            Some(surface) => Some(interface * surface.eval(wi, wo, wavelength_nm)),
            None => {
                let relief = self.method.answer_spectral(single(wi), single(wo), wavelength_nm as f32)?;
                Some(interface * self.model.angular_factor(&pair) * f64::from(relief))
            }
        };
        let wavelengths_nm = (0..SPECTRUM_COUNT).map(|i| 380.0 + 5.0 * i as f64);
        Ok(wavelengths_nm.map_while(at).map(|value| value as f32).collect())
    }
}

/// A direction by its angles in degrees: with the normal, and from +x towards +y.
pub fn direction(theta_deg: f64, phi_deg: f64) -> Vec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    [sin * cos_phi, sin * sin_phi, cos]
}

/// A direction as the methods take it.
fn single(direction: Vec3) -> [f32; 3] {
    direction.map(|component| component as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Relief;
    use sunbeam::colour::SpectralToRgb;

    fn of(method: &str) -> Reflectance {
        let json =
            format!(r#"{{"surface": {{"preset": "sinusoidal", "coherence_length": 10}}, "method": "{method}"}}"#);
        let settings = Settings::from_json(&json).unwrap();
        Relief::new(&settings, None).unwrap().reflectance(&settings, &Progress::none()).unwrap()
    }

    #[test]
    fn the_spectrum_adds_up_to_the_colour() {
        // Near the first order of 480 nm.
        let (wi, wo) = (direction(30.0, 180.0), direction(18.0, 0.0));
        let colours = SpectralToRgb::new(380.0, 5.0, SPECTRUM_COUNT).unwrap();
        for method in ["table", "flss"] {
            let mut reflectance = of(method);
            let spectrum: Vec<f64> = reflectance.spectrum(wi, wo).unwrap().into_iter().map(f64::from).collect();
            assert_eq!(spectrum.len(), SPECTRUM_COUNT);
            let (summed, rgb) = (colours.rgb(&spectrum), reflectance.rgb(wi, wo));
            let largest = rgb.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            for c in 0..3 {
                // The table's quadrature has steps of 1 nm.
                assert!((summed[c] - rgb[c]).abs() < 0.02 * largest, "{method}: {summed:?} {rgb:?}");
            }
        }
        assert!(of("stam").spectrum(wi, direction(100.0, 0.0)).unwrap().iter().all(|value| *value == 0.0));
    }

    #[test]
    fn a_map_is_black_outside_the_disc_and_tells_how_far_it_is() {
        let map = of("stam").map(direction(30.0, 0.0), 16, &Progress::none());
        assert_eq!((map.len(), map[0]), (256, [0.0; 3]));
        assert!(map.iter().flatten().all(|value| value.is_finite()));
        assert!(map.iter().flatten().any(|value| *value > 0.0));
    }
}
