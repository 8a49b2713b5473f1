//! Queries of a lobe at wavelengths, by plain numbers of double precision.

use super::mixture::UNIFORM_FRACTION;
use super::{Lobe, PerWavelength};
use crate::numeric::Plain;
use crate::scattering::{Pair, Vec3};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

type Double<'a> = Plain<'a, f64>;

/// Value and density of one pair of directions at one wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// `f_r` in 1/sr, as the surface's `eval` returns it.
    pub f: f64,
    /// Density of the surface's `sample` per solid angle, 1/sr.
    pub pdf: f64,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction, of unit length.
    pub wo: Vec3,
    /// Density per solid angle in 1/sr, the mean over the wavelengths carried.
    pub pdf: f64,
    /// `f_r cosθo / pdf` at the first wavelength.
    pub weight: f64,
}

/// Whether both directions lie above the surface and the wavelength (nm) within the tables' range.
pub(crate) fn is_answered(wi: Vec3, wo: Vec3, wavelength_nm: f64) -> bool {
    Pair::new(wi, wo).is_some() && (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm)
}

/// `f_r` in 1/sr; zero outside the range of [`is_answered`].
pub(crate) fn eval<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
    if !is_answered(wi, wo, wavelength_nm) {
        return 0.0;
    }
    let [f] = lobe.eval(wi, wo, [wavelength_nm], true);
    f
}

/// `f_r` and density; zeros outside the range of [`is_answered`].
pub(crate) fn eval_pdf<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
    if !is_answered(wi, wo, wavelength_nm) {
        return Answer::default();
    }
    let ([f], pdf) = lobe.eval_pdf(wi, wo, [wavelength_nm], true);
    Answer { f, pdf }
}

/// Density of a direction sampled for several wavelengths: the mean of their densities.
pub(crate) fn pdf<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
    let density = |&nm: &f64| if is_answered(wi, wo, nm) { lobe.pdf(wi, wo, [nm], true) } else { 0.0 };
    wavelengths_nm.iter().map(density).sum::<f64>() / wavelengths_nm.len().max(1) as f64
}

/// A sampled direction with density and weight; `None` as in [`sample_direction`].
pub(crate) fn sample<'a>(
    lobe: &impl PerWavelength<Double<'a>>,
    wi: Vec3,
    wavelengths_nm: &[f64],
    u: [f64; 3],
) -> Option<Sample> {
    let wo = sample_direction(lobe, wi, wavelengths_nm, u)?;
    let pdf = pdf(lobe, wi, wo, wavelengths_nm);
    (pdf > 0.0).then(|| Sample { wo, pdf, weight: eval(lobe, wi, wo, wavelengths_nm[0]) * wo[2] / pdf })
}

/// A direction from three random numbers in [0, 1); `None` where it falls below the horizon, or `wi` lies there.
pub(crate) fn sample_direction<'a>(
    lobe: &impl PerWavelength<Double<'a>>,
    wi: Vec3,
    wavelengths_nm: &[f64],
    u: [f64; 3],
) -> Option<Vec3> {
    let rest = (u[0] - UNIFORM_FRACTION).max(0.0) / (1.0 - UNIFORM_FRACTION) * wavelengths_nm.len() as f64;
    let hero = (rest as usize).min(wavelengths_nm.len().checked_sub(1)?);
    // The first number once more, as the lobe expects it for the one wavelength chosen.
    let fresh = UNIFORM_FRACTION + (1.0 - UNIFORM_FRACTION) * (rest - hero as f64).min(1.0);
    let first = if u[0] < UNIFORM_FRACTION { u[0] } else { fresh };
    let wo = lobe.sample(wi, [wavelengths_nm[hero]], [first, u[1], u[2]], wi[2] > 0.0);
    (wo[2] > 0.0).then_some(wo)
}
