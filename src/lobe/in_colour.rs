//! Lobes in linear sRGB: treatment of colours outside its gamut, and the mixture of a lobe's own sampler with uniform
//! directions (`mixture.rs`), written once for all lobes.
//!
//! Directions are unit vectors away from the relief: z > 0 above it, z < 0 below it. `N` is a family of numbers
//! (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable.

use super::{LinearSrgb, Lobe, Sides, mixture_density, sample_mixture};
use crate::numeric::{Number, Numbers, Real};

/// A lobe's own value, density and draw in linear sRGB. [`Sides`] tells on which sides of the relief it has light, and
/// with which probability a sample leaves on each. Every type that implements the trait is a [`Lobe`] over
/// [`LinearSrgb`].
pub(crate) trait InColour<N: Numbers>: Sides<N> {
    /// Treatment of negative channels.
    fn gamut(&self) -> Gamut;

    /// `f_r` in 1/sr as linear sRGB, before the gamut's treatment. Zero unless the mask is true and the lobe accepts
    /// both directions.
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3];

    /// Density of [`InColour::draw`] in 1/sr, given the side of `wo`: callers multiply it by [`Sides::probability`].
    /// Ignored where the mask is false. The mask is true only where the lobe accepts both directions.
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real;

    /// A direction from three random numbers in [0, 1); the zero vector where the drawn wave vector belongs to no
    /// direction. Samplers that need two random numbers ignore the first.
    ///
    /// The result lies above the relief, and the caller mirrors it to below where `to_below` is true. Only gratings by
    /// Maxwell's equations that transmit differ: `draw` itself decides on the side, and the result lies on that side.
    /// For them `to_below` is true only where a uniform direction replaces the draw.
    fn draw(&self, wi: [N::Real; 3], to_below: N::Mask, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

impl<N: Numbers, T: InColour<N>> Lobe<N, LinearSrgb> for T {
    type Value = [N::Real; 3];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> [N::Real; 3] {
        let colour = self.value(wi, wo, active);
        match self.gamut() {
            Gamut::Keep => colour,
            Gamut::Desaturate => desaturated(colour),
        }
    }

    #[inline(always)]
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> N::Real {
        let active = active & self.accepts(wi) & self.accepts(wo);
        mixture_density::<N, 1>([self.density(wi, wo, active)], active) * self.probability(wi, wo)
    }

    #[inline(always)]
    fn sample(&self, wi: [N::Real; 3], _: LinearSrgb, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        // The side of the sample, and the random numbers for the draw on this side.
        let (to_below, u) = self.choose(wi, u);
        // One choice, since there are no wavelengths to choose from.
        let draw = |_, u, active| self.draw(wi, to_below, u, active);
        let [x, y, z] = sample_mixture::<N, 1>(u, active & self.accepts(wi), draw);
        [x, y, N::Real::select(to_below, -z, z)]
    }
}

/// Treatment of colours outside sRGB, one or two of whose channels are negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gamut {
    /// Negative channels are returned. Sums of such colours are the colours of the summed spectra.
    Keep,
    /// Grey of equal luminance is mixed in until no channel is negative, for renderers that reject negative channels.
    /// Clamping negative channels to zero instead would add light.
    Desaturate,
}

/// A colour in linear sRGB, mixed with grey of its luminance until no channel is negative. Luminance is kept; black if
/// it is negative.
#[inline(always)]
fn desaturated<R: Real>(colour: [R; 3]) -> [R; 3] {
    let zero = R::lit(0.0);
    let grey = luminance(colour).max(zero);
    let least = colour[0].min(colour[1]).min(colour[2]);
    let is_outside = least.lt(zero);
    // The saturation that takes the least channel to zero: grey + saturation·(least − grey) = 0. It may not be finite
    // for a grey colour, which lies inside sRGB.
    let saturation = grey / (grey - least);
    // Rounding may leave a channel just below zero.
    colour.map(|channel| R::select(is_outside, (channel - grey).fma(saturation, grey).max(zero), channel))
}

/// Luminance Y of a colour in linear sRGB: the second row of the matrix to XYZ of IEC 61966-2-1, with seven digits.
#[inline(always)]
pub fn luminance<R: Real>([r, g, b]: [R; 3]) -> R {
    r.fma(R::lit(0.212_672_9), g.fma(R::lit(0.715_152_2), b * R::lit(0.072_175)))
}
