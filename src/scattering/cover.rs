//! A flat clear layer over the relief, such as a disc's polycarbonate or a foil's lacquer
//! (docs/model.md#covers-and-relative-sizes).
//!
//! ```text
//! n          refractive index of the cover, relative to the air outside
//! w, w'      unit vector of a direction outside and inside, away from the relief
//! θ, θ'      angles of w and w' from the normal z
//! x, x'      tangential parts of w and w': x' = x/n (Snell's law)
//! T(θ)       Fresnel transmittance of the cover's flat side for unpolarised light
//! f_out      T(θi)·T(θo)/n² · f_in(wi', wo', λ/n)     reflectance outside, from that inside the cover
//! ```
//!
//! The factor 1/n² is the change of radiance where light leaves the cover.
//!
//! Inside the cover, light of the wavelength λ/n meets the bare relief. The relief magnified n times scatters light of
//! the wavelength λ into the same directions. A [`Cover`] therefore needs tables of the magnified relief, built with a
//! coherence window that is magnified, too, and with indices relative to that of the cover. `f_in` is the reflectance
//! of the magnified relief: a density over solid angle does not change with size. Light that is reflected repeatedly
//! inside the cover is left out.

use super::{ComplexIndex, Pair, SpectralIndex, Vec3, direction_above};

/// The flat side of a cover, seen from air. Directions are unit vectors with z > 0, away from the relief.
///
/// ```
/// use sunbeam::scattering::Cover;
///
/// let cover = Cover::new(1.5);
/// let wi = [0.6, 0.0, 0.8];
/// // Snell's law: 0.6/1.5.
/// assert!((cover.inside(wi)[0] - 0.4).abs() < 1e-15);
/// // At normal incidence: 1 − ((n − 1)/(n + 1))².
/// assert!((cover.transmittance([0.0, 0.0, 1.0]) - 0.96).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    eta: f64,
}

impl Cover {
    /// A cover of refractive index `eta`, at least 1.
    pub fn new(eta: f64) -> Self {
        Self { eta }
    }

    /// Index of the cover.
    pub fn eta(self) -> f64 {
        self.eta
    }

    /// Direction inside the cover of light that has the direction `w` outside.
    pub fn inside(self, [x, y, z]: Vec3) -> Vec3 {
        // n·cosθ', since n² cos²θ' = n² − sin²θ = (n² − 1) + cos²θ, where z is cosθ.
        let normal = (self.eta * self.eta - 1.0 + z * z).sqrt();
        [x, y, normal].map(|c| c / self.eta)
    }

    /// Direction outside of light that has the direction `w` inside; `None` for light that is totally reflected.
    pub fn outside(self, [x, y, _]: Vec3) -> Option<Vec3> {
        direction_above(self.eta * x, self.eta * y)
    }

    /// Fresnel transmittance of the flat side for unpolarised light that has the direction `w` outside.
    pub fn transmittance(self, w: Vec3) -> f64 {
        let squared = self.eta * self.eta;
        let normal = (squared - 1.0 + w[2] * w[2]).sqrt();
        // With N = n·cosθ' (`normal`) and the denominators s and p of the Fresnel coefficients, the transmittance is
        // the mean of 4N·cosθ/s² and 4N·n²·cosθ/p². Near the horizon this form is more precise than 1 − R.
        let (s, p) = (w[2] + normal, squared * w[2] + normal);
        2.0 * w[2] * normal * (1.0 / (s * s) + squared / (p * p))
    }

    /// Factor on the reflectance inside: `T(θi)·T(θo)/n²`, from the directions outside.
    pub fn factor(self, wi: Vec3, wo: Vec3) -> f64 {
        self.transmittance(wi) * self.transmittance(wo) / (self.eta * self.eta)
    }

    /// Solid angle inside per solid angle outside, `cosθ/(n² cosθ')`, about the direction `w` outside.
    pub fn solid_angle_ratio(self, w: Vec3) -> f64 {
        w[2] / (self.eta * self.eta * self.inside(w)[2])
    }
}

/// A pair of directions inside a cover, with which tables are read, and the factors that the cover contributes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside {
    /// Incident direction inside.
    pub wi: Vec3,
    /// Outgoing direction inside.
    pub wo: Vec3,
    /// Reflectance outside per reflectance inside ([`Cover::factor`]).
    pub factor: f64,
    /// Density of a sampled `wo` over solid angle outside, per density inside ([`Cover::solid_angle_ratio`]).
    pub density: f64,
}

impl Inside {
    /// The pair at a surface without a cover.
    pub fn bare(wi: Vec3, wo: Vec3) -> Self {
        Self { wi, wo, factor: 1.0, density: 1.0 }
    }

    /// The pair of two unit vectors outside; `None` unless both lie above the surface. Without a cover it is
    /// [`Inside::bare`].
    pub fn new(cover: Option<Cover>, wi: Vec3, wo: Vec3) -> Option<Self> {
        Pair::new(wi, wo)?;
        Some(match cover {
            None => Self::bare(wi, wo),
            Some(cover) => Self {
                wi: cover.inside(wi),
                wo: cover.inside(wo),
                factor: cover.factor(wi, wo),
                density: cover.solid_angle_ratio(wo),
            },
        })
    }
}

impl ComplexIndex {
    /// The index relative to that of a lossless medium.
    pub fn relative_to(self, eta: f64) -> Self {
        Self { eta: self.eta / eta, k: self.k / eta }
    }
}

impl SpectralIndex {
    /// The index relative to that of a lossless medium without dispersion.
    pub fn relative_to(&self, eta: f64) -> Self {
        match self {
            Self::Constant(index) => Self::Constant(index.relative_to(eta)),
            Self::Sampled(samples) => {
                Self::Sampled(samples.iter().map(|&(nm, index)| (nm, index.relative_to(eta))).collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fresnel_unpolarised;
    use super::*;

    #[test]
    fn directions_pass_the_cover_and_return() {
        let cover = Cover::new(1.58);
        for w in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.3, -0.9, (1.0f64 - 0.9).sqrt()]] {
            let inside = cover.inside(w);
            assert!((inside.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-15);
            let outside = cover.outside(inside).unwrap();
            assert!((0..3).all(|c| (outside[c] - w[c]).abs() < 1e-14), "{w:?}: {outside:?}");
        }
        // Beyond the critical angle, asin(1/1.58) = 39°.
        assert_eq!(cover.outside([0.64, 0.0, 0.768]), None);
    }

    #[test]
    fn transmittance_is_the_rest_of_fresnel_reflectance() {
        let cover = Cover::new(1.58);
        for degrees in 0..90 {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let reflectance = fresnel_unpolarised(cos, ComplexIndex { eta: 1.58, k: 0.0 });
            assert!((cover.transmittance([sin, 0.0, cos]) - (1.0 - reflectance)).abs() < 1e-14, "{degrees}");
        }
    }

    #[test]
    fn solid_angles_inside_fill_the_cone_of_the_critical_angle() {
        let cover = Cover::new(1.58);
        let steps = 4000;
        // Midpoints of cosθ over the hemisphere.
        let ratio = |i: usize| {
            let cos = (i as f64 + 0.5) / f64::from(steps);
            cover.solid_angle_ratio([(1.0 - cos * cos).sqrt(), 0.0, cos])
        };
        // Solid angle of the cone over 2π: the mean of the ratio over cosθ.
        let inside = (0..steps as usize).map(ratio).sum::<f64>() / f64::from(steps);
        assert!((inside - (1.0 - (1.0 - 1.0 / (1.58 * 1.58f64)).sqrt())).abs() < 1e-6);
    }

    #[test]
    fn an_index_of_one_changes_nothing() {
        let (cover, wi, wo) = (Cover::new(1.0), [0.6, 0.0, 0.8], [0.0, 0.0, 1.0]);
        assert!((0..3).all(|c| (cover.inside(wi)[c] - wi[c]).abs() < 1e-15));
        assert_eq!((cover.factor(wi, wo), cover.transmittance(wi)), (1.0, 1.0));
    }
}
