//! The lobe of scalar theory in linear sRGB.
//!
//! ```text
//! f_r    = ∫ R·O·M·S/λ² · weight(λ) dλ = R0·O·M·F     before the division by max(1, A(wi), A(wo))
//! F(q)   = ∫ (R/R0)·S/λ² · weight(λ) dλ               table of colours over the scattering vector q = wi + wo
//! λ      wavelength
//! R, R0  Fresnel reflectance of the material at λ, and that of one refractive index for all λ, the reference
//! O, M   obliquity factor and shadowing factor of the pair of directions
//! S      power spectrum of the relief
//! weight weights of linear sRGB's three channels at λ; a channel's weights over all λ are its *band*
//! A      divisor of a direction that conserves energy (`src/energy`), one for each channel
//! ```
//!
//! For a relief whose pattern is s times as wide and whose heights are d times those of the table, F is
//! `s² F(s u, s v, d w)` with q = (u, v, w) (`scattering/size.rs`): F is an integral over wavelength, and resizing
//! does not mix wavelengths. R/R0 is then that of another half vector than that of wi and wo, which `band_ratio.rs`
//! corrects.
//!
//! O, M and S are those of docs/model.md#the-reflectance. The small-slope factor Q of the reference, if chosen,
//! replaces R0·O. `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced
//! variable, and `lit` makes a constant.

use super::{BandRatio, Gamut, InColour, Sides, are_above};
use crate::colour_table::{ColourView, SUM_SQUARED_MAX};
use crate::energy::AlbedoView;
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::ColourSamplerView;
use crate::scattering::{ComplexIndex, Obliquity, RelativeSize, Scattering};
use std::array;

/// Choice of the factors by which a lobe multiplies the table's colours, and the treatment of negative channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourFactors {
    /// Refractive index of the reference; `None` leaves the interface's factor (R0 or Q) to the caller.
    pub reference: Option<ComplexIndex>,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// Whether the factor M of shadowing by V-shaped grooves applies.
    pub shadowing: bool,
    /// Band means of R/R0 for resized reliefs; `None` if the ratio is 1.
    pub ratio: Option<BandRatio>,
    /// Treatment of negative channels.
    pub gamut: Gamut,
}

/// The lobe of a [`ColourSurface`](super::ColourSurface) over its table data (see [`Lobe`](super::Lobe)).
pub struct ColourLobe<N: Numbers> {
    /// Factors of the table's colours.
    pub factors: ColourFactors,
    /// Table of F.
    pub table: ColourView<N>,
    /// The sampler.
    pub sampler: ColourSamplerView<N>,
    /// Divisors of the reflectance; `None` where nothing is divided.
    pub albedo: Option<AlbedoView<N>>,
    /// Size of the relief at the shaded point; `None` for that of the tables. The sampler holds the same size:
    /// [`ColourSurface::lobe_over`](super::ColourSurface::lobe_over) sets both.
    pub size: Option<RelativeSize<N::Real>>,
}

// The provided methods: the lobe only reflects.
impl<N: Numbers> Sides<N> for ColourLobe<N> {}

impl<N: Numbers> InColour<N> for ColourLobe<N> {
    fn gamut(&self) -> Gamut {
        self.factors.gamut
    }

    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let ColourFactors { reference, obliquity, shadowing, ratio, .. } = self.factors;
        let scattering = Scattering::<N>::reflection(wi, wo, obliquity, shadowing);
        // `SUM_SQUARED_MAX` is 4, the largest |q|² of unit vectors, with room for rounding. The comparison also
        // excludes NaN.
        let active = active & are_above::<N>(wi, wo) & scattering.length_squared().le(lit(SUM_SQUARED_MAX.into()));
        let [u, v, w] = scattering.bounded_q;
        // Factor on all channels, and factors on each.
        let mut factor = scattering.factor;
        let mut channels = match &self.albedo {
            Some(albedo) => albedo.band_factor(wi, wo, self.size, active),
            None => [lit(1.0); 3],
        };
        let colour = match self.size {
            None => self.table.relief_rgb(u, v, w, active),
            Some(RelativeSize { scale, depth }) => {
                // Scattering vector at which the table, made for a scale and depth of 1, is read.
                let [x, y, z] = [u * scale, v * scale, w * depth];
                factor = factor * scale * scale;
                if let Some(ratio) = &ratio {
                    // Cosine between a direction and the half vector of a scattering vector: half of its length.
                    let cosine = |[x, y, z]: [N::Real; 3]| z.fma(z, x.fma(x, y * y)).sqrt() * lit(0.5);
                    let quotients = ratio.quotients(cosine([u, v, w]), cosine([x, y, z]));
                    channels = array::from_fn(|c| channels[c] * quotients[c]);
                }
                self.table.relief_rgb(x, y, z, active)
            }
        };
        if let Some(index) = reference {
            factor = factor * scattering.interface(index, obliquity);
        }
        array::from_fn(|c| N::Real::select(active, colour[c] * factor * channels[c], lit(0.0)))
    }

    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        self.sampler.pdf(wi, wo, active)
    }

    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], _to_below: N::Mask, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        // The lobe only reflects, so `_to_below` is false. The sampler needs two of the three random numbers.
        self.sampler.sample(wi, [u[1], u[2]], active)
    }
}
