//! The colour of a relief as a table over the scattering vector `q = wi + wo = (u, v, w)`: the integral over
//! wavelength, read with a few fetches by RGB renderers and on the GPU.
//!
//! Apart from obliquity, the colour of a pair of directions is
//!
//! `F(q) = ∫ R(λ, |q|/2)·S(f; κ)/λ² · weight(λ) dλ`, with `f = (u, v)/λ` and `κ = 2πw/λ`.
//!
//! It depends on `q` alone, since the cosine at the half vector is `|q|/2`. `R` is the reflectance of the interface, or
//! 1 where the caller applies it. `weight` is linear sRGB for the CIE 1931 observer under D65, from 380 to 780 nm:
//! `S/λ² = 1` at every wavelength has the colour (1, 1, 1). Colours outside sRGB have negative channels.
//!
//! Features of `F` differ in width. Around the centre they are as fine as an order, about 0.003. Along the radius
//! `r = |(u, v)|` the integral over wavelength smears them to about 4 % of `r`. Over `w` they are as wide as
//! `λ/(range of heights)`. So the table consists of rings in the (u, v) plane whose spacing grows in proportion to `r`
//! (`rings.rs`). The number of directions on a ring is proportional to its circumference. On a ring, a scaled `F`
//! (`fit.rs`) is a cubic B-spline over direction (periodic) and w; between rings it is the cubic through four of them.
//! A look-up ([`ColourView`]) reads 64 words of 32 bits. Since `|q| ≤ 2`, outer rings need fewer knots over w.

mod build;
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

/// Accepted factors on the number of samples along each axis of the table.
pub const RESOLUTION: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// The colour of a relief over `q = (u, v, w)`; see the [module](self).
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
/// let view = table.view::<f32>();
/// let colour = |u: f32| view.relief_rgb(u, 0.0, 1.0 + (1.0 - u * u).sqrt(), true);
/// let ([red, _, blue], [other_red, _, other_blue]) = (colour(0.18), colour(0.26));
/// assert!(blue > red && other_red > other_blue);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTable {
    layout: ColourLayout,
    /// Spline coefficients `[ring][direction][height]`, packed by [`pack`], then a record per ring ([`Ring::words`]).
    #[serde(with = "words")]
    words: Vec<u32>,
    report: ColourTableReport,
}

/// Layout of a [`ColourTable`]'s words.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourLayout {
    /// Spacing of the rings near the centre; ring k has the radius `knee_radius/growth · sinh(growth·(k + ½))`.
    pub knee_radius: f32,
    /// Relative spacing of the outer rings.
    pub growth: f32,
    /// Scale of w above which knots are spaced logarithmically.
    pub w_log: f32,
    /// Number that is added to a word's exponent to make it a single-precision exponent.
    pub exponent_offset: u32,
    /// Number of the outermost ring.
    pub last_ring: u32,
    /// Start of the rings' records among the words, in packets of four.
    pub rings_at: u32,
}

/// Record of one ring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// First word of the ring's coefficients.
    pub offset: u32,
    /// Number of directions, uniformly spaced from +u towards +v.
    pub directions: u32,
    /// Number of spline coefficients over w; the first belongs to the knot −1.
    pub heights: u32,
    /// Knots per unit of w.
    pub knots_per_w: f32,
    /// Knots per e-fold of `1 + w/w_log`.
    pub knots_per_efold: f32,
    /// `knee²`: the spline is that of `F·(w² + knee²)/(w² + zero²)`.
    pub knee_squared: f32,
    /// `zero²`, at most `knee²`.
    pub zero_squared: f32,
}

/// Build time, size and resolution of a colour table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableReport {
    /// Size in bytes.
    pub bytes: usize,
    /// Number of rings.
    pub rings: usize,
    /// Number of directions on the outermost ring.
    pub directions: usize,
    /// Coherence length of the table in µm: the surface's, or a shorter one where features would need more than
    /// [`ColourTable::LIMIT_BYTES`] or too much time.
    pub coherence_length_um: f64,
    /// Standard deviation of an order, the narrowest feature, in cycles/µm.
    pub order_sigma_per_um: f64,
    /// Relative error of the spectral table; see [`crate::table::TableReport`].
    pub spectral_error: f64,
    /// Build time in seconds, spectral table included.
    pub build_seconds: f64,
}

/// Reason why a colour table is not built.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum ColourTableError {
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colour(#[from] ColourError),
}

impl Ring {
    /// Words of a ring's record.
    const WORDS: usize = 8;

    /// The record as words: integers, then the bits of single-precision numbers.
    fn words(&self) -> [u32; Self::WORDS] {
        let [w, efold, knee, zero] =
            [self.knots_per_w, self.knots_per_efold, self.knee_squared, self.zero_squared].map(f32::to_bits);
        [self.offset, self.directions, self.heights, w, efold, knee, zero, 0]
    }

    /// The record from [`Ring::WORDS`] words.
    fn from_words(words: &[u32]) -> Self {
        let [offset, directions, heights] = std::array::from_fn(|i| words[i]);
        let [knots_per_w, knots_per_efold, knee_squared, zero_squared] =
            std::array::from_fn(|i| f32::from_bits(words[3 + i]));
        Self { offset, directions, heights, knots_per_w, knots_per_efold, knee_squared, zero_squared }
    }
}

impl ColourTable {
    /// Largest size of a table in bytes: half of the smallest storage buffer that WebGPU guarantees.
    pub const LIMIT_BYTES: usize = 64 << 20;
    /// Largest number of rings: their records take half of the smallest uniform buffer that WebGPU guarantees, 64 KiB.
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

    /// All words: coefficients, then the rings' records.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Words of the coefficients, a multiple of four.
    pub fn samples(&self) -> &[u32] {
        &self.words[..4 * self.layout.rings_at as usize]
    }

    /// The rings, from the centre outwards.
    pub fn rings(&self) -> impl ExactSizeIterator<Item = Ring> + '_ {
        self.words[4 * self.layout.rings_at as usize..].chunks_exact(Ring::WORDS).map(Ring::from_words)
    }

    /// Look-ups in the precision `F`, `f32` or `f64`.
    pub fn view<F>(&self) -> ColourView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourView { layout: self.layout, words: &self.words }
    }
}

/// Serialisation of words as little-endian bytes, smaller and faster than a sequence of numbers.
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
