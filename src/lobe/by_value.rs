//! Evaluation and sampling of a lobe at any number of wavelengths, in plain numbers of double precision. A [`Lobe`]
//! itself needs valid arguments; these functions check directions, and all but [`sample_direction`] check wavelengths.
//!
//! `wi` and `wo` are unit vectors that point away from the surface, towards the light and the viewer.

use super::mixture::UNIFORM_FRACTION;
use super::{Lobe, PerWavelength, sample_mixture};
use crate::numeric::Plain;
use crate::scattering::Vec3;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Plain numbers of double precision. Their mask `active`, the last argument of a lobe's methods, is a `bool`.
type Double<'a> = Plain<'a, f64>;

/// Value and density of one pair of directions at one wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Reflectance `f_r` in 1/sr, as the surface's `eval` returns it.
    pub f: f64,
    /// Density of the surface's `sample` over solid angle, in 1/sr.
    pub pdf: f64,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction, of unit length.
    pub wo: Vec3,
    /// Density over solid angle in 1/sr, the mean over the wavelengths carried.
    pub pdf: f64,
    /// Sample weight `f |cosθo| / pdf` at the first of the wavelengths carried, with the reflectance f.
    pub weight: f64,
}

/// Whether a direction is finite, and light may come from or leave along it
/// ([`Sides::accepts`](super::Sides::accepts)).
fn accepts<'a>(lobe: &impl PerWavelength<Double<'a>>, w: Vec3) -> bool {
    w.iter().all(|c| c.is_finite()) && lobe.accepts(w)
}

/// Whether both directions are accepted, and the wavelength lies within the range of the tables.
fn is_in_domain<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> bool {
    accepts(lobe, wi) && accepts(lobe, wo) && (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm)
}

/// Reflectance `f_r` in 1/sr; zero unless [`is_in_domain`].
pub(crate) fn eval<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
    if !is_in_domain(lobe, wi, wo, wavelength_nm) {
        return 0.0;
    }
    let [f] = lobe.eval(wi, wo, [wavelength_nm], true);
    f
}

/// `f_r` and density; zeros unless [`is_in_domain`].
pub(crate) fn eval_pdf<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
    if !is_in_domain(lobe, wi, wo, wavelength_nm) {
        return Answer::default();
    }
    let ([f], pdf) = lobe.eval_pdf(wi, wo, [wavelength_nm], true);
    Answer { f, pdf }
}

/// Density in 1/sr of a direction sampled for several wavelengths: the mean of their densities; 0 without a wavelength.
pub(crate) fn pdf<'a>(lobe: &impl PerWavelength<Double<'a>>, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
    let density = |&nm: &f64| if is_in_domain(lobe, wi, wo, nm) { lobe.pdf(wi, wo, [nm], true) } else { 0.0 };
    wavelengths_nm.iter().map(density).sum::<f64>() / wavelengths_nm.len().max(1) as f64
}

/// A sampled direction with density and weight. `None` where [`sample_direction`] returns `None` or the density is
/// zero.
pub(crate) fn sample<'a>(
    lobe: &impl PerWavelength<Double<'a>>,
    wi: Vec3,
    wavelengths_nm: &[f64],
    u: [f64; 3],
) -> Option<Sample> {
    let wo = sample_direction(lobe, wi, wavelengths_nm, u)?;
    let density = pdf(lobe, wi, wo, wavelengths_nm);
    (density > 0.0).then(|| {
        let weight = eval(lobe, wi, wo, wavelengths_nm[0]) * wo[2].abs() / density;
        Sample { wo, pdf: density, weight }
    })
}

/// A direction from three random numbers in [0, 1). `None` where it falls below the horizon, where `wi` is not finite
/// or not accepted by the lobe, and without a wavelength.
///
/// The first number chooses the side ([`Sides::choose`](super::Sides::choose)) and is rescaled to [0, 1). Below
/// [`UNIFORM_FRACTION`] it then selects a uniform direction, above it one of the wavelengths with equal probabilities.
/// Callers keep all wavelengths within the range of the tables: [`pdf`] counts others as zero, so samples drawn for
/// them would be biased.
pub(crate) fn sample_direction<'a>(
    lobe: &impl PerWavelength<Double<'a>>,
    wi: Vec3,
    wavelengths_nm: &[f64],
    u: [f64; 3],
) -> Option<Vec3> {
    let (to_below, [first, second, third]) = lobe.choose(wi, u);
    // The whole part of `position` is the index of the chosen wavelength. The fraction is a random number, independent
    // of the choice.
    let position = (first - UNIFORM_FRACTION).max(0.0) / (1.0 - UNIFORM_FRACTION) * wavelengths_nm.len() as f64;
    let chosen = (position as usize).min(wavelengths_nm.len().checked_sub(1)?);
    let fraction = (position - chosen as f64).min(1.0);
    let nm = wavelengths_nm[chosen];
    // `sample_mixture` is called for one wavelength. It takes a first number below UNIFORM_FRACTION for a uniform
    // direction, and rescales one above it to [0, 1). So the fraction is mapped to [UNIFORM_FRACTION, 1).
    let rescaled =
        if first < UNIFORM_FRACTION { first } else { UNIFORM_FRACTION + (1.0 - UNIFORM_FRACTION) * fraction };
    let draw = |_choice, u, active| lobe.draw(wi, to_below, nm, u, active);
    let [x, y, z] = sample_mixture::<Double<'a>, 1>([rescaled, second, third], accepts(lobe, wi), draw);
    // The zero vector stands for no direction. Directions drawn above the relief are mirrored to the side chosen.
    (z != 0.0).then_some([x, y, if to_below { -z } else { z }])
}
