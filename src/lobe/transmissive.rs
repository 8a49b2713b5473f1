//! Lobes of transparent bodies, which reflect and transmit (docs/model.md#bodies-that-transmit): at wavelengths, and in
//! linear sRGB.
//!
//! Values are the scattering function (BSDF) of light from `wi` to `wo` in 1/sr, without the cosine:
//!
//! ```text
//! f_s = factor · S(f; κ)/λ² / A
//!
//! n        refractive index of the body
//! λ        wavelength in vacuum
//! Ko       tangential part of the outgoing wave vector, in units of 2π/λ
//! factor   small-slope factor F, times (d²Ko/n²)/(cosθo dωo), which turns a density over Ko into one over solid angle
//!          (`TransparentPair::factor`)
//! S(f; κ)  power spectrum in µm², at the frequency f in cycles/µm and the phase rate κ in rad per µm of height, of the
//!          relief magnified n times in pattern and heights
//! A        the larger of 1 and the albedos of wi and wo; 1 without a table of albedos
//! ```
//!
//! Directions are unit vectors that point away from the relief on either side of it: above into air; below into the
//! medium of an interface, or into the air behind a film. Wave vectors "over n" are in units of the wave number in the
//! medium: their length is 1 in the medium and 1/n in air. Further symbols are those of `scattering/transparent.rs`.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable, and
//! `lit` makes a constant.

use super::colour_lobe::ColourLobe;
use super::spectral::SpectralLobe;
use super::{Gamut, InColour, PerWavelength, Sides};
use crate::colour_table::ColourView;
use crate::energy::{AlbedoTable, AlbedoView, GridPlace};
use crate::numeric::{Number, Numbers, Plain, Real};
use crate::sampling::{BELOW_ONE, direction_above};
use crate::scattering::{BodyWave, Passage, Reading, RelativeSize, TransparentBody, TransparentPair, Vec3};
use std::array;

/// Smallest probability with which a sample leaves on either side. It limits the weights of samples on the side to
/// which a flat body sends less light. Chosen: smaller values allow larger weights; larger ones waste samples there.
const SIDE_PROBABILITY_MIN: f64 = 0.05;

/// The lobe of a transparent body over its table data, for any number of wavelengths (see [`Lobe`](super::Lobe)).
#[derive(Clone, Copy)]
pub struct TransmissiveLobe<'a, N: Numbers> {
    /// The medium and its lower boundary.
    pub body: TransparentBody,
    /// The lobe of the magnified relief, whose tables and size are read.
    pub relief: SpectralLobe<'a, N>,
}

/// The lobe of a transparent body in linear sRGB (see [`Lobe`](super::Lobe)).
pub struct TransmissiveColourLobe<N: Numbers> {
    /// The medium and its lower boundary.
    pub body: TransparentBody,
    /// The lobe of the magnified relief, whose tables and size are read.
    pub relief: ColourLobe<N>,
}

/// Quantities of a pair of directions that all wavelengths share.
pub(crate) struct BodyDirections<N: Numbers> {
    /// Incident wave.
    wi: BodyWave<N>,
    /// Outgoing wave.
    wo: BodyWave<N>,
    /// Scattering vector and small-slope factor of the pair.
    pair: TransparentPair<N>,
    /// The incident direction and the side of wo, in the form that samplers take.
    passage: Passage<N>,
    /// Outgoing tangential wave vector over n, times [`Passage::turn`], which is −1 where the power spectrum is read at
    /// the opposite frequency, else 1. In double precision, since frequencies follow from it.
    outgoing: [N::Double; 2],
    /// Tangential area of outgoing wave vectors over n, per solid angle: factor from a density over that area to a
    /// density over solid angle.
    per_solid_angle: N::Real,
}

impl<N: Numbers> BodyDirections<N> {
    /// Quantities of the unit vectors `wi` and `wo` at a body.
    #[inline(always)]
    fn new(body: TransparentBody, wi: [N::Real; 3], wo: [N::Real; 3]) -> Self {
        let (i, o) = (body.wave::<N>(wi), body.wave::<N>(wo));
        let pair = body.pair(&i, &o);
        let passage = Passage::at_body(body, &i, o.is_below);
        let turn = N::widen(passage.turn);
        Self {
            outgoing: o.tangential_double().map(|k| k * turn),
            per_solid_angle: pair.per_projected_solid_angle() * wo[2].abs(),
            wi: i,
            wo: o,
            pair,
            passage,
        }
    }

    /// Places of wi and wo in a table of albedos.
    #[inline(always)]
    fn places(&self, albedo: &AlbedoView<N>) -> [GridPlace<N>; 2] {
        [&self.wi, &self.wo].map(|wave| albedo.place_at_body(wave.in_own_medium(), wave.is_below))
    }
}

/// Scattering function of a transparent body in 1/sr, for [`Exact`](super::Exact), which has no table of S.
///
/// `spectrum(f, κ)` is S of the magnified relief in µm², at f in cycles/µm and κ in rad/µm. The value is divided by A
/// where a table of albedos is given. Zero unless both directions lie off the horizon and the wavelength is positive.
pub(super) fn value_at_body(
    body: TransparentBody,
    wi: Vec3,
    wo: Vec3,
    wavelength_nm: f64,
    spectrum: impl Fn([f64; 2], f64) -> f64,
    albedo: Option<&AlbedoTable>,
) -> f64 {
    let accepts = |w: Vec3| w.iter().all(|c| c.is_finite()) && w[2] != 0.0;
    if !(accepts(wi) && accepts(wo) && wavelength_nm > 0.0) {
        return 0.0;
    }
    let directions = BodyDirections::<Plain<f64>>::new(body, wi, wo);
    let reading = Reading::at(wavelength_nm);
    let (f, kappa) = directions.pair.at(&reading);
    let per_albedo = albedo.map_or(1.0, |albedo| {
        let view = albedo.view::<f64>();
        let [at_wi, at_wo] = directions.places(&view);
        view.factor_at(&at_wi, &at_wo, &reading, true)
    });
    directions.pair.factor() * per_albedo * spectrum(f, kappa) / reading.divisor_um2()
}

/// Scattering function of a transparent body in linear sRGB in 1/sr, from the colour table of the magnified relief and
/// its size. Divided by A where albedos are given. Zero unless both directions `[wi, wo]` lie off the horizon.
#[inline(always)]
pub(crate) fn colour_at_body<N: Numbers>(
    body: TransparentBody,
    table: &ColourView<N>,
    albedo: Option<&AlbedoView<N>>,
    size: Option<RelativeSize<N::Real>>,
    [wi, wo]: [[N::Real; 3]; 2],
    active: N::Mask,
) -> [N::Real; 3] {
    let one = N::Real::lit(1.0);
    let active = active & Sides::<N>::accepts(&body, wi) & Sides::<N>::accepts(&body, wo);
    let directions = BodyDirections::new(body, wi, wo);
    let RelativeSize { scale, depth } = size.unwrap_or(RelativeSize { scale: one, depth: one });
    let [u, v] = directions.pair.tangential().map(|k| N::narrow(k) * scale);
    let colour = table.relief_rgb(u, v, directions.pair.normal() * depth, active);
    // With the scale s and the depth d of a resized relief, the colour is s² times that at (s u, s v, d w).
    let factor = directions.pair.factor() * scale * scale;
    let per_albedo = match albedo {
        Some(albedo) => albedo.band_factor_at(directions.places(albedo), size, active),
        None => [one; 3],
    };
    array::from_fn(|c| N::Real::select(active, colour[c] * factor * per_albedo[c], N::Real::lit(0.0)))
}

/// Sides of a transparent body. A sample's side is chosen by the reflectance of a flat body.
impl<N: Numbers> Sides<N> for TransparentBody {
    #[inline(always)]
    fn accepts(&self, w: [N::Real; 3]) -> N::Mask {
        N::Real::lit(0.0).lt(w[2].abs())
    }

    #[inline(always)]
    fn choose(&self, wi: [N::Real; 3], u: [N::Real; 3]) -> (N::Mask, [N::Real; 3]) {
        let (zero, one) = (N::Real::lit(0.0), N::Real::lit(1.0));
        let incident = self.wave::<N>(wi);
        let reflected = reflected_probability(&incident);
        let is_reflected = u[0].lt(reflected);
        let to_below = (incident.is_below & is_reflected) | (!incident.is_below & !is_reflected);
        // On either side u[0] is uniform in a part of [0, 1). Rescaled to [0, 1), it serves the next choice.
        let rescaled = N::Real::select(is_reflected, u[0] / reflected, (u[0] - reflected) / (one - reflected));
        (to_below, [rescaled.clip(zero, N::Real::lit(BELOW_ONE)), u[1], u[2]])
    }

    #[inline(always)]
    fn probability(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> N::Real {
        let (wi, wo) = (self.wave::<N>(wi), self.wave::<N>(wo));
        let reflected = reflected_probability(&wi);
        N::Real::select(wi.is_on_side_of(&wo), reflected, N::Real::lit(1.0) - reflected)
    }
}

/// Probability that a sample is reflected: the reflectance of a flat body, bounded by [`SIDE_PROBABILITY_MIN`].
#[inline(always)]
fn reflected_probability<N: Numbers>(wi: &BodyWave<N>) -> N::Real {
    let [low, high] = [SIDE_PROBABILITY_MIN, 1.0 - SIDE_PROBABILITY_MIN].map(N::Real::lit);
    wi.reflectance().clip(low, high)
}

/// Implements [`Sides`] for a lobe with the methods of its body.
macro_rules! sides_of_the_body {
    ($lobe:ty) => {
        impl<N: Numbers> Sides<N> for $lobe {
            #[inline(always)]
            fn accepts(&self, w: [N::Real; 3]) -> N::Mask {
                Sides::<N>::accepts(&self.body, w)
            }

            #[inline(always)]
            fn choose(&self, wi: [N::Real; 3], u: [N::Real; 3]) -> (N::Mask, [N::Real; 3]) {
                Sides::<N>::choose(&self.body, wi, u)
            }

            #[inline(always)]
            fn probability(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> N::Real {
                Sides::<N>::probability(&self.body, wi, wo)
            }
        }
    };
}
sides_of_the_body!(TransmissiveLobe<'_, N>);
sides_of_the_body!(TransmissiveColourLobe<N>);

/// The direction of a drawn wave vector; the zero vector where the wave vector lies beyond the horizon. The direction
/// points upwards on either side of the relief, since callers flip the directions of samples below.
///
/// `draw_tangential` draws the tangential part of the wave vector over n, times [`Passage::turn`]; its mask is false
/// where nothing is scattered.
#[inline(always)]
fn draw<N: Numbers>(
    body: TransparentBody,
    wi: [N::Real; 3],
    to_below: N::Mask,
    draw_tangential: impl FnOnce(&Passage<N>) -> ([N::Real; 2], N::Mask),
) -> [N::Real; 3] {
    let passage = Passage::at_body(body, &body.wave::<N>(wi), to_below);
    let (drawn, is_drawn) = draw_tangential(&passage);
    // Factor from wave vectors over n to directions: 1 below an interface, n in air, where wave vectors over n have the
    // length 1/n.
    let eta = N::Real::lit(body.eta);
    let scale = if body.is_film { eta } else { N::Real::select(to_below, N::Real::lit(1.0), eta) };
    direction_above::<N>(drawn.map(|k| k * passage.turn * scale), is_drawn)
}

impl<N: Numbers> PerWavelength<N> for TransmissiveLobe<'_, N> {
    type Pair = BodyDirections<N>;

    #[inline(always)]
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> BodyDirections<N> {
        BodyDirections::new(self.body, wi, wo)
    }

    #[inline(always)]
    fn value(&self, directions: &BodyDirections<N>, nm: N::Real, active: N::Mask) -> N::Real {
        let reading = self.relief.reading(nm);
        let (frequency, kappa) = directions.pair.at(&reading);
        let spectrum = self.relief.table().density_of(frequency, kappa, reading.order_width_factor, active);
        let undivided = directions.pair.factor() * spectrum / reading.divisor_um2();
        let value = match self.relief.albedo() {
            None => undivided,
            Some(albedo) => {
                let [at_wi, at_wo] = directions.places(&albedo);
                undivided * albedo.factor_at(&at_wi, &at_wo, &reading, active)
            }
        };
        N::Real::select(active, value, N::Real::lit(0.0))
    }

    #[inline(always)]
    fn density(&self, directions: &BodyDirections<N>, nm: N::Real, active: N::Mask) -> N::Real {
        self.relief.sampler().density(&directions.passage, directions.outgoing, &self.relief.reading(nm), active)
            * directions.per_solid_angle
    }

    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], to_below: N::Mask, nm: N::Real, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let reading = self.relief.reading(nm);
        // Samplers need two random numbers; u[0] is left over from the choices of side and wavelength (mixture.rs).
        draw(self.body, wi, to_below, |passage| self.relief.sampler().draw(passage, &reading, [u[1], u[2]], active))
    }
}

impl<N: Numbers> InColour<N> for TransmissiveColourLobe<N> {
    fn gamut(&self) -> Gamut {
        self.relief.factors.gamut
    }

    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let ColourLobe { table, albedo, size, .. } = &self.relief;
        colour_at_body(self.body, table, albedo.as_ref(), *size, [wi, wo], active)
    }

    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let directions = BodyDirections::new(self.body, wi, wo);
        self.relief.sampler.density(&directions.passage, directions.outgoing.map(N::narrow), active)
            * directions.per_solid_angle
    }

    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], to_below: N::Mask, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        draw(self.body, wi, to_below, |passage| self.relief.sampler.draw(passage, [u[1], u[2]], active))
    }
}
