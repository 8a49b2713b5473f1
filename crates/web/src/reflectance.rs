//! Evaluates a realtime method's BRDF `f_r` on the CPU: for BRDF maps and single directions, also without a GPU.
//!
//! An *answer* is the value that a method computes for a pair of directions: the whole `f_r`
//! ([`AnswerKind::Reflectance`], [`AnswerKind::Film`]) or the relief's part ([`AnswerKind::Relief`]). Two factors
//! complete the relief's part:
//!
//! `f_r` = interface · angular factor · relief's part
//!
//! The interface factor ([`Pair::interface`]) is Fresnel's reflectance or the small-slope factor. The angular factor
//! ([`Options::angular_factor`]) is the product of obliquity and shadowing. `docs/model.md` has the formulas.
//!
//! A *cover* is a flat clear layer over the relief. Under it, answer and factors are those of the directions inside the
//! layer, and `f_r` is multiplied by the cover's factor ([`Inside`]). A *film* is a sheet that reflects and transmits.

use crate::settings::Settings;
use sunbeam::methods::{AnswerKind, Method};
use sunbeam::scattering::{ComplexIndex, Cover, Inside, Options, Pair, Vec3, map_direction};
use sunbeam::table::Progress;

/// A realtime method with everything that completes its answers to `f_r`.
pub struct Reflectance {
    method: Box<dyn Method>,
    /// The library's options; only their obliquity factor and shadowing are read.
    options: Options,
    /// Refractive index relative to that of the cover.
    index: ComplexIndex,
    /// The cover; `None` for a bare surface.
    cover: Option<Cover>,
}

impl Reflectance {
    /// Combines `method`, which was built with `settings`, with their index and options.
    pub fn new(method: Box<dyn Method>, settings: &Settings) -> Self {
        let (index, cover) = (settings.index_inside(), settings.surface.cover());
        Self { method, options: settings.library_options(), index, cover }
    }

    /// Replaces the refractive index and the obliquity factor by those of `settings`, which must have the same cover.
    /// With energy conservation or a film the method's data also depend on the index. The page then builds them again,
    /// as after a change of the cover, because their key has changed ([`Settings::keys`]).
    pub fn set_index(&mut self, settings: &Settings) {
        self.index = settings.index_inside();
        self.options = settings.library_options();
    }

    /// `f_r` in 1/sr, integrated over the visible spectrum to linear sRGB. `wi` is the unit vector to the light and
    /// `wo` that to the viewer. The colour is 0 unless both lie above the surface.
    pub fn rgb(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        let Some(Inside { wi, wo, factor: cover_factor, .. }) = Inside::new(self.cover, wi, wo) else {
            return [0.0; 3];
        };
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let factor = match self.method.answers() {
            // The whole `f_r`; a film has no cover, so its factor is 1.
            AnswerKind::Reflectance | AnswerKind::Film { .. } => cover_factor,
            AnswerKind::Relief => {
                let interface = pair.interface(Some(self.index), self.options.obliquity);
                cover_factor * interface * self.options.angular_factor(&pair)
            }
        };
        self.method.answer_rgb(single(wi), single(wo)).map(|channel| factor * f64::from(channel))
    }

    /// BRDF map for the unit vector `wi` to the light: [`Reflectance::rgb`] at the outgoing direction of each of
    /// `side`² pixels ([`map_direction`]), rows from the top. Pixels outside the disc of the hemisphere are 0. Progress
    /// is reported by rows.
    pub fn map(&self, wi: Vec3, side: usize, progress: &Progress) -> Vec<[f32; 3]> {
        let finished_rows = progress.of_steps(side);
        let mut map = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let rgb = map_direction(column, row, side).map_or([0.0; 3], |wo| self.rgb(wi, wo));
                map.push(rgb.map(|value| value as f32));
            }
            finished_rows.one();
        }
        map
    }
}

/// The unit vector with the angle `theta_deg` to the normal and the azimuth `phi_deg`, counted from +x towards +y.
pub fn direction(theta_deg: f64, phi_deg: f64) -> Vec3 {
    let (sin_theta, cos_theta) = theta_deg.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
    [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
}

/// Direction in single precision, the argument of [`Method::answer_rgb`].
pub(crate) fn single(direction: Vec3) -> [f32; 3] {
    direction.map(|component| component as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Relief;

    #[test]
    fn a_map_is_black_outside_the_disc() {
        let json = r#"{"surface": {"preset": "sinusoidal", "coherence_length": 10}, "method": "stam"}"#;
        let settings = Settings::from_json(json).unwrap();
        let reflectance = Relief::new(&settings, None).unwrap().reflectance(&settings, &Progress::none()).unwrap();
        let map = reflectance.map(direction(30.0, 0.0), 16, &Progress::none());
        assert_eq!((map.len(), map[0]), (256, [0.0; 3]));
        assert!(map.iter().flatten().all(|value| value.is_finite()));
        assert!(map.iter().flatten().any(|value| *value > 0.0));
    }
}
