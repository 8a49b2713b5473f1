//! Colour of a relief, tabulated over the scattering vector `q = wi + wo = (u, v, w)`: the integral over wavelength,
//! which RGB renderers and the GPU read with a few fetches. wi and wo are the unit vectors to the light and to the
//! viewer.
//!
//! Without obliquity and shadowing, the reflectance of a pair of directions has the colour
//!
//! `F(q) = ∫ R(λ, |q|/2)·S(f; κ)/λ² · weight(λ) dλ`, with `f = (u, v)/λ` and `κ = 2πw/λ`.
//!
//! - `F`: linear sRGB in 1/sr. Colours outside sRGB have negative channels.
//! - `S`: power spectrum in µm² ([`crate::table`]) of the phase screen `exp(iκh)` with the relief's heights h, at the
//!   frequency `f` in cycles/µm. The phase rate `κ` is in rad/µm.
//! - `R`: reflectance of the interface at the half vector, whose cosine with either direction is `|q|/2`; 1 where the
//!   caller applies it.
//! - `weight`: linear sRGB per wavelength, for the CIE 1931 observer under D65 from 380 to 780 nm. `S/λ² = 1` at every
//!   wavelength has the colour (1, 1, 1).
//!
//! The layout follows the widths of the features of `F`. Like `q`, these are dimensionless:
//!
//! - Near `(u, v) = 0` features are as fine as an order: 0.003 at the default coherence length. Along the radius
//!   `r = |(u, v)|` the integral over wavelength smears them to about 4 % of `r`. So the table consists of rings around
//!   the centre whose spacing grows with `r` (`rings.rs`).
//! - Along a ring features stay as fine as an order. The number of directions is proportional to the circumference.
//! - Over `w` features are as wide as `λ/(range of heights)`. Since `|q| ≤ 2`, outer rings span less of `w` and need
//!   fewer knots.
//!
//! On a ring, a scaled `F` (`fit.rs`) is a cubic B-spline over direction (periodic) and `w`. Between rings it is the
//! cubic polynomial through four of them. A look-up ([`ColourView`]) reads 4 × 4 × 4 words of 32 bits.

mod build;
mod collocation;
mod fit;
mod lookup;
mod pack;
mod path;
mod rings;

pub use build::ColourTableOptions;
pub use lookup::{ColourView, SUM_SQUARED_MAX};
pub use path::Reflectance;

use crate::colour::ColourError;
use crate::numeric::{Numbers, Plain};
use crate::table::TableError;
use serde::{Deserialize, Serialize};

/// Accepted values of [`ColourTableOptions::resolution`].
pub const RESOLUTION: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// Colour of a relief over `q = (u, v, w)`; see the [module](self).
///
/// ```
/// use sunbeam::colour_table::{ColourTable, ColourTableOptions};
/// use sunbeam::{Model, Preset, Tiling};
///
/// let options = ColourTableOptions {
///     coherence_length_um: 10.0,
///     model: Model::Ensemble,
///     tiling: Tiling::Periodic,
///     tolerance: 1e-3,
///     resolution: 0.5,
///     build_limit: 1.0,
/// };
/// let table = ColourTable::build(&Preset::Blazed.build(None, None)?, &options)?;
///
/// // A period of 2.5 µm at normal incidence: order 1 is blue at u = 0.45/2.5 and red at u = 0.65/2.5.
/// // The last argument is a mask of SIMD lanes; a plain number is one lane, which is active.
/// let view = table.view::<f32>();
/// let colour = |u: f32| view.relief_rgb(u, 0.0, 1.0 + (1.0 - u * u).sqrt(), true);
/// let ([red, _, blue], [other_red, _, other_blue]) = (colour(0.18), colour(0.26));
/// assert!(blue > red && other_red > other_blue);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTable {
    layout: ColourLayout,
    /// Spline coefficients `[ring][direction][w]`, one word for the three channels ([`pack`]), then padding to a
    /// multiple of four words, then a record per ring ([`Ring::words`]).
    #[serde(with = "words")]
    words: Vec<u32>,
    report: ColourTableReport,
}

/// Layout of a [`ColourTable`]'s words.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourLayout {
    /// Spacing of the rings near the centre. Ring k has the radius `inner_spacing/growth · sinh(growth·(k + ½))`.
    pub inner_spacing: f32,
    /// Ratio of the spacing of the outer rings to their radius.
    pub growth: f32,
    /// Scale of w above which knots are spaced logarithmically; see [`Ring::knots_per_efold`].
    pub w_log: f32,
    /// Addend that makes the stored exponent of a word the biased exponent of a single-precision number.
    pub exponent_offset: u32,
    /// Index of the outermost ring, counted from zero at the centre.
    pub last_ring: u32,
    /// Start of the rings' records in [`ColourTable::words`], in packets of four words.
    pub rings_at: u32,
}

/// Record of one ring: its part of the coefficients, and the splines' scale.
///
/// A value w lies `knots_per_w·w + knots_per_efold·ln(1 + w/w_log)` knots above knot 0, which is w = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Index of the ring's first coefficient in [`ColourTable::words`].
    pub offset: u32,
    /// Number of directions, uniformly spaced over a full turn, from +u towards +v.
    pub directions: u32,
    /// Number of spline coefficients over w; the first belongs to the knot −1.
    pub w_count: u32,
    /// Uniform part of the spacing of knots: knots per unit of w.
    pub knots_per_w: f32,
    /// Logarithmic part of the spacing of knots: knots per e-fold of `1 + w/w_log`.
    pub knots_per_efold: f32,
    /// Square of `knee`, a value of w: the spline represents `F·(w² + knee²)/(w² + zero²)`.
    pub knee_squared: f32,
    /// Square of `zero`, a value of w from 0 to `knee`.
    pub zero_squared: f32,
}

/// Build time, size and resolution of a colour table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableReport {
    /// Size in bytes.
    pub bytes: usize,
    /// Number of rings.
    pub rings: usize,
    /// Largest number of directions on a ring: that of the outermost.
    pub directions: usize,
    /// Coherence length of the table in µm: the surface's, or a shorter one where features would need more than
    /// [`ColourTable::LIMIT_BYTES`] or too much time.
    pub coherence_length_um: f64,
    /// Standard deviation of an order, the narrowest feature, in cycles/µm.
    pub order_sigma_per_um: f64,
    /// Relative error of the spectral table; see [`crate::table::TableReport::relative_error`].
    pub spectral_error: f64,
    /// Build time in seconds, including that of the spectral table, from which the colours are integrated.
    pub build_seconds: f64,
}

/// Reasons for which a colour table is not built.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum ColourTableError {
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colour(#[from] ColourError),
}

impl Ring {
    /// Number of words of a ring's record.
    const WORDS: usize = 8;

    /// The record as words: integers, then the bits of single-precision numbers, then a word of padding.
    fn words(&self) -> [u32; Self::WORDS] {
        let floats = [self.knots_per_w, self.knots_per_efold, self.knee_squared, self.zero_squared];
        let [knots_per_w, knots_per_efold, knee_squared, zero_squared] = floats.map(f32::to_bits);
        [self.offset, self.directions, self.w_count, knots_per_w, knots_per_efold, knee_squared, zero_squared, 0]
    }

    /// The record from [`Ring::WORDS`] words.
    fn from_words(words: &[u32]) -> Self {
        let [offset, directions, w_count] = std::array::from_fn(|i| words[i]);
        let [knots_per_w, knots_per_efold, knee_squared, zero_squared] =
            std::array::from_fn(|i| f32::from_bits(words[3 + i]));
        Self { offset, directions, w_count, knots_per_w, knots_per_efold, knee_squared, zero_squared }
    }
}

impl ColourTable {
    /// Largest size of a table in bytes: half of the storage buffer that every WebGPU device can bind, 128 MiB.
    pub const LIMIT_BYTES: usize = 64 << 20;
    /// Largest number of rings. Their records take half of the uniform buffer that all WebGPU devices can bind, 64 KiB.
    /// Tables reach [`ColourTable::LIMIT_BYTES`] first.
    pub const RINGS_MAX: usize = (64 << 10) / 2 / (4 * Ring::WORDS);

    /// Build time, size and resolution.
    pub fn report(&self) -> &ColourTableReport {
        &self.report
    }

    /// Layout of the words.
    pub fn layout(&self) -> &ColourLayout {
        &self.layout
    }

    /// All words: packed coefficients `[ring][direction][w]`, padding, then the rings' records.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Words before the rings' records: packed coefficients `[ring][direction][w]`, padded to a multiple of four words.
    pub fn coefficients(&self) -> &[u32] {
        &self.words[..4 * self.layout.rings_at as usize]
    }

    /// Records of the rings, from the centre outwards.
    pub fn rings(&self) -> impl ExactSizeIterator<Item = Ring> + '_ {
        self.words[4 * self.layout.rings_at as usize..].chunks_exact(Ring::WORDS).map(Ring::from_words)
    }

    /// Evaluator in the precision `F`, `f32` or `f64`.
    pub fn view<F>(&self) -> ColourView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourView { layout: self.layout, words: &self.words }
    }
}

/// Serialisation of words as little-endian bytes, which is faster than a sequence of numbers.
mod words {
    use serde::de::{Error, Visitor};
    use serde::{Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(words: &[u32], serializer: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        serializer.serialize_bytes(&bytes)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u32>, D::Error> {
        struct Bytes;
        impl Visitor<'_> for Bytes {
            type Value = Vec<u32>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("bytes of whole words")
            }
            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<u32>, E> {
                if bytes.len() % 4 != 0 {
                    return Err(E::invalid_length(bytes.len(), &self));
                }
                Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
            }
        }
        deserializer.deserialize_bytes(Bytes)
    }
}
