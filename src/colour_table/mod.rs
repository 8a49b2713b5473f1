//! The colour of a surface as a table over `q = wi + wo = (u, v, w)`: the whole integral over wavelength, read with a few
//! fetches by the path tracer in RGB and by the realtime renderer.
//!
//! The colour of a pair of directions, obliquity aside, is
//! `F(q) = ∫ R(λ, |q|/2)·S(f; κ)/λ² · weight(λ) dλ` with `f = (u, v)/λ` and `κ = 2πw/λ`: a function of `q` alone, since the
//! cosine at the half vector is `|q|/2`. `R` is what the interface reflects (1 where it is left to the caller). Features of `F`
//! are very uneven. Across the radius `r = |(u, v)|` they are as fine as the coherence window makes an order, about
//! 0.003; along the radius the integral over wavelength has smeared them to about 4 % of `r`; and in `w` they are as
//! wide as `λ/`(range of heights). So the table has rings ([`rings`]) whose spacing grows in proportion to `r`, as many directions on
//! each as its circumference asks for, and few heights. On a ring F is a cubic B-spline in direction (periodic) and height;
//! between rings it is the cubic through four of them: 64 words of 32 bits a look-up ([`ColourView`]).
//!
//! Since `|q| ≤ 2`, records shorten outwards. Near the horizon `F` falls as `w²` where order zero is not, and the obliquity
//! factor divides by that. So that relative accuracy survives, rings hold `F·(w² + knee²)/(w² + zero²)`, with a `zero` at
//! which the power of order zero, as the ring sees it, takes over.
//!
//! Colours outside sRGB keep their negative channels. Wavelengths count by D65 and the CIE 1931 observer, whose tables end at
//! 380 and 780 nm; `S/λ² = 1` at every wavelength is (1, 1, 1).

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

/// Accepted multiples of the table's samples along each of its axes.
pub const RESOLUTION: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// The colour of a surface over `(u, v, w)`; see the [module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTable {
    layout: ColourLayout,
    /// Spline coefficients, `[ring][direction][height]`, packed by [`pack`], then eight words for each ring ([`Ring::words`]).
    #[serde(with = "words")]
    words: Vec<u32>,
    report: ColourTableReport,
}

/// What a look-up has to know besides the words.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourLayout {
    /// Radius below which rings are equally spaced, over `growth`.
    pub knee_radius: f32,
    /// Relative spacing of rings further out.
    pub growth: f32,
    /// Scale of w below which knots are equally spaced again.
    pub w_log: f32,
    /// Added to a word's exponent to make that of a float.
    pub exponent_offset: u32,
    /// The outermost ring's number.
    pub last_ring: u32,
    /// Where the rings' records begin among the words, in packets of four.
    pub rings_at: u32,
}

/// One ring, from the centre outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// First word of the ring.
    pub offset: u32,
    /// Directions, equally spaced from +u towards +v.
    pub directions: u32,
    /// Spline coefficients over height, the first of which belongs to the knot −1.
    pub heights: u32,
    /// Knots per unit of w.
    pub knots_per_w: f32,
    /// Knots per e-fold of `1 + w/w_log`.
    pub knots_per_efold: f32,
    /// `knee²` of the module's page.
    pub knee_squared: f32,
    /// `zero²` of the module's page, at most `knee²`.
    pub zero_squared: f32,
}

/// What building took and gave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Number of rings.
    pub rings: usize,
    /// Directions on the outermost ring.
    pub directions: usize,
    /// The coherence length shown, in µm: that of the surface, or less where its features would take more than
    /// [`ColourTable::LIMIT_BYTES`] or too long to integrate.
    pub coherence_length_um: f64,
    /// Standard deviation in cycles/µm of the narrowest feature, that of an order.
    pub order_sigma_per_um: f64,
    /// Relative error of the spectral table that it is made of; see [`crate::table::TableReport`].
    pub spectral_error: f64,
    /// Seconds for everything.
    pub build_seconds: f64,
}

/// Why a table was not built.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum ColourTableError {
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colour(#[from] ColourError),
}

impl Ring {
    /// Words that a ring's record takes.
    const WORDS: usize = 8;

    /// The record: whole numbers as they are, others by their bits.
    fn words(&self) -> [u32; Self::WORDS] {
        let [w, efold, knee, zero] =
            [self.knots_per_w, self.knots_per_efold, self.knee_squared, self.zero_squared].map(f32::to_bits);
        [self.offset, self.directions, self.heights, w, efold, knee, zero, 0]
    }

    /// Of [`Ring::WORDS`] words.
    fn from_words(words: &[u32]) -> Self {
        let [offset, directions, heights] = std::array::from_fn(|i| words[i]);
        let [knots_per_w, knots_per_efold, knee_squared, zero_squared] =
            std::array::from_fn(|i| f32::from_bits(words[3 + i]));
        Self { offset, directions, heights, knots_per_w, knots_per_efold, knee_squared, zero_squared }
    }
}

impl ColourTable {
    /// No table is larger.
    pub const LIMIT_BYTES: usize = 64 << 20;
    /// Nor has more rings, which is what half of the smallest uniform buffer of any graphics adapter holds. The limit of bytes
    /// comes first.
    pub const RINGS_MAX: usize = 1024;

    /// What building took and gave.
    pub fn report(&self) -> &ColourTableReport {
        &self.report
    }

    /// What a look-up has to know besides the words.
    pub fn layout(&self) -> &ColourLayout {
        &self.layout
    }

    /// All words: the samples', then the rings'.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The words of the samples alone, a multiple of four.
    pub fn samples(&self) -> &[u32] {
        &self.words[..4 * self.layout.rings_at as usize]
    }

    /// The rings, from the centre outwards.
    pub fn rings(&self) -> impl ExactSizeIterator<Item = Ring> + '_ {
        self.words[4 * self.layout.rings_at as usize..].chunks_exact(Ring::WORDS).map(Ring::from_words)
    }

    /// The table as numbers by value read it.
    pub fn view<F>(&self) -> ColourView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourView { layout: self.layout, words: &self.words }
    }
}

/// Words as bytes, little-endian, which take less time and place than numbers of any length.
mod words {
    use serde::de::{Error, Visitor};
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer>(words: &[u32], serializer: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        serializer.serialize_bytes(&bytes)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u32>, D::Error> {
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
