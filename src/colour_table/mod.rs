//! Colour table: a surface's colour over the scattering vector `q = wi + wo = (u, v, w)`, integrated over wavelength.
//! RGB variants and the realtime renderer read it.
//!
//! ```text
//! F(q) = ∫ R(λ, |q|/2)·S(f; κ)/λ² · weight(λ) dλ,   f = (u, v)/λ,  κ = 2πw/λ
//! ```
//!
//! `R` is the interface's Fresnel reflectance, whose cosine at the half vector is `|q|/2`, or 1 if the caller applies
//! it. The obliquity factor is left out, so `F` depends on `q` alone. Its features have three scales:
//!
//! - around the centre, at the radius `r = |(u, v)|`: the width of an order, about 0.003;
//! - along the radius: about 4 % of `r`, since wavelengths smear an order radially;
//! - in `w`: λ over the range of heights.
//!
//! The table therefore consists of rings ([`rings`]) whose spacing grows in proportion to `r`. A ring has directions in
//! proportion to its circumference, and few samples in `w` ("heights"):
//!
//! ```text
//! r_k  = (knee_radius/growth) sinh(growth (k + ½))           radius of ring k
//! x    = directions · angle/2π                               coordinate around a ring, periodic
//! y    = knots_per_w · w + knots_per_efold · ln(1 + w/w_log)  coordinate in w, in knots
//! H_k  = Σ c_ij B(x − i) B(y − j)                            values of ring k; B cubic B-spline, c packed in 32 bits
//! F    = H · (w² + zero²)/(w² + knee²)                       H from the cubic through the values of four rings
//! ```
//!
//! A look-up reads 4 × 4 coefficients on each of four rings: 64 words ([`ColourView`]).
//!
//! Since `|q| ≤ 2`, outer rings have fewer heights. Away from order zero `F` falls as `w²` near the horizon, and the
//! obliquity factor divides by `w²`. The values `H` do not fall, which keeps the relative accuracy: `knee` is the w
//! below which `F` falls, and `zero` the w below which the power of order zero, as seen by the ring, dominates.
//!
//! Colours outside sRGB keep their negative channels. The weights are D65 times the CIE 1931 observer from 380 to 780
//! nm, scaled so that `S/λ² = 1` at every wavelength is (1, 1, 1).

mod build;
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

/// Accepted factors on the number of samples along each axis.
pub const RESOLUTION: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// The colour of a surface over `(u, v, w)`; see the [module](self).
///
/// ```
/// use sunbeam::colour_table::{ColourTable, ColourTableOptions};
/// use sunbeam::{Model, Preset, Tiling};
///
/// let options = ColourTableOptions {
///     coherence_length_um: 5.0,
///     model: Model::Ensemble,
///     tiling: Tiling::Periodic,
///     tolerance: 1e-2,
///     resolution: 0.5,
///     build_limit: 1.0,
/// };
/// let table = ColourTable::build(&Preset::Flat.build(None, None)?, &options)?;
///
/// // A flat relief reflects into the mirror direction, q = (0, 0, w), and little elsewhere.
/// let view = table.view::<f32>();
/// let ([_, mirror, _], [_, off, _]) = (view.relief_rgb(0.0, 0.0, 2.0, true), view.relief_rgb(0.5, 0.0, 1.9, true));
/// assert!(mirror > 100.0 * off.abs());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTable {
    layout: ColourLayout,
    /// Spline coefficients `[ring][direction][height]`, packed by [`pack`]; then eight words per ring
    /// ([`Ring::words`]).
    #[serde(with = "words")]
    words: Vec<u32>,
    report: ColourTableReport,
}

/// Constants of a look-up, besides the table data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourLayout {
    /// Spacing of the innermost rings; from the radius `knee_radius/growth` on, spacings grow in proportion to it.
    pub knee_radius: f32,
    /// Spacing of outer rings relative to their radius.
    pub growth: f32,
    /// The w below which the logarithm of the coordinate y is linear in w.
    pub w_log: f32,
    /// Biased exponent of single precision for a stored exponent of 0 ([`pack`]).
    pub exponent_offset: u32,
    /// Number of the outermost ring.
    pub last_ring: u32,
    /// Start of the rings' records, in packets of four words.
    pub rings_at: u32,
}

/// One ring, from the centre outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Index of the ring's first word.
    pub offset: u32,
    /// Number of directions, equally spaced from +u towards +v.
    pub directions: u32,
    /// Number of spline coefficients in w; the first belongs to the knot −1.
    pub heights: u32,
    /// Knots per unit of w.
    pub knots_per_w: f32,
    /// Knots per e-fold of `1 + w/w_log`.
    pub knots_per_efold: f32,
    /// `knee²` of the [module](self).
    pub knee_squared: f32,
    /// `zero²` of the [module](self), at most `knee²`.
    pub zero_squared: f32,
}

/// Size, build time and error of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Number of rings.
    pub rings: usize,
    /// Directions on the outermost ring.
    pub directions: usize,
    /// Coherence length of the table in µm: the surface's, or a shorter one if the surface's features would exceed
    /// [`ColourTable::LIMIT_BYTES`] or take too long to integrate.
    pub coherence_length_um: f64,
    /// Standard deviation in cycles/µm of the narrowest feature, that of an order.
    pub order_sigma_per_um: f64,
    /// Relative error of the spectral table it is integrated from; see [`crate::table::TableReport`].
    pub spectral_error: f64,
    /// Seconds of the whole build.
    pub build_seconds: f64,
}

/// Reason that a table was not built.
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

    /// The record: integers as they are, floats by their bits.
    fn words(&self) -> [u32; Self::WORDS] {
        let [w, efold, knee, zero] =
            [self.knots_per_w, self.knots_per_efold, self.knee_squared, self.zero_squared].map(f32::to_bits);
        [self.offset, self.directions, self.heights, w, efold, knee, zero, 0]
    }

    /// A ring from its record of [`Ring::WORDS`] words.
    fn from_words(words: &[u32]) -> Self {
        let [offset, directions, heights] = std::array::from_fn(|i| words[i]);
        let [knots_per_w, knots_per_efold, knee_squared, zero_squared] =
            std::array::from_fn(|i| f32::from_bits(words[3 + i]));
        Self { offset, directions, heights, knots_per_w, knots_per_efold, knee_squared, zero_squared }
    }
}

impl ColourTable {
    /// Largest size of a table in bytes. Chosen: 64 MiB, half of the storage buffer that every WebGPU device offers.
    pub const LIMIT_BYTES: usize = 64 << 20;
    /// Largest number of rings. Their records fill half of the smallest uniform buffer of any graphics adapter; in
    /// practice [`ColourTable::LIMIT_BYTES`] is reached first.
    pub const RINGS_MAX: usize = 1024;

    /// Size, build time and error of a table.
    pub fn report(&self) -> &ColourTableReport {
        &self.report
    }

    /// Constants of a look-up, besides the table data.
    pub fn layout(&self) -> &ColourLayout {
        &self.layout
    }

    /// Table data: samples, then rings' records.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Data of the samples alone; their number is a multiple of four.
    pub fn samples(&self) -> &[u32] {
        &self.words[..4 * self.layout.rings_at as usize]
    }

    /// The rings, from the centre outwards.
    pub fn rings(&self) -> impl ExactSizeIterator<Item = Ring> + '_ {
        self.words[4 * self.layout.rings_at as usize..].chunks_exact(Ring::WORDS).map(Ring::from_words)
    }

    /// The table over plain numbers.
    pub fn view<F>(&self) -> ColourView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourView { layout: self.layout, words: &self.words }
    }
}

/// Serialises words as little-endian bytes, which is faster and smaller than varints.
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
