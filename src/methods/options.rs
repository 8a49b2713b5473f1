//! Kinds and options of the methods, and the reasons why a method is refused. Sources are cited by author and year, and
//! listed in docs/model.md#sources.
//!
//! κH is the largest phase of the relief in rad, measured from its middle height. H is half the range of heights in µm.
//! The phase rate κ is 2πw/λ in rad/µm, with `w = cosθi + cosθo ≤ 2` of light and viewer. *The tolerance* is the
//! surface's parameter `tolerance`, a relative error.

use super::bessel::TERMS_MAX;
use crate::colour::ColourError;
use crate::colour_table::{ColourTableError, RESOLUTION};
use crate::height_field::MAX_LENGTH_UM;
use crate::scattering::{Transmission, TransparentBody};
use crate::table::{COHERENCE_LENGTH_UM, TOLERANCE, TableError};
use crate::transform::Series;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Accepted steps between wavelengths in nm. Coarser steps leave channels with little or no weight; finer ones gain no
/// accuracy.
pub const LAMBDA_STEP_NM: std::ops::RangeInclusive<f64> = 0.1..=100.0;
/// Largest number of orders along each axis that an evaluation sums. It bounds the time of an evaluation, which is
/// proportional to the square of the number.
pub const NEIGHBOURHOOD_MAX: usize = 64;
/// Accepted sharpness of the highlight in Stam's shader of GPU Gems, in 1/µm. The wide range only keeps numbers finite.
pub const GEMS_SHARPNESS: std::ops::RangeInclusive<f64> = 0.0..=1e4;
/// Accepted components of the highlight's colour in the same shader, linear sRGB. The wide range only keeps numbers
/// finite.
const GEMS_HIGHLIGHT: std::ops::RangeInclusive<f64> = 0.0..=100.0;
/// Largest number of repeats of the tile along an axis. The peaks of more repeats are too narrow for single precision.
pub const REPEATS_MAX: u32 = 10_000;

/// The methods: four published ones and the colour table (docs/realtime.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MethodKind {
    /// Full lambda spectral sampling: wavelengths in equal steps.
    Flss,
    /// NMM: only the wavelengths at which an order leaves towards the viewer.
    Nmm,
    /// P×Q: a finite number of repeats of the tile, P along x and Q along y.
    Pq,
    /// Stam's model: one groove spacing, in one of the forms of [`StamForm`].
    Stam,
    /// The colour table: the integral over wavelength, tabulated.
    Table,
}

impl MethodKind {
    /// Every kind, in the order in which messages list them.
    pub const ALL: [Self; 5] = [Self::Flss, Self::Nmm, Self::Pq, Self::Stam, Self::Table];

    /// The name used on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flss => "flss",
            Self::Nmm => "nmm",
            Self::Pq => "pq",
            Self::Stam => "stam",
            Self::Table => "table",
        }
    }

    /// The fields of [`MethodOptions`] that the method reads; it ignores the others.
    pub const fn options(self) -> &'static [&'static str] {
        match self {
            Self::Flss => &["lambda_step_nm", "terms", "neighbourhood", "series"],
            Self::Nmm => &["terms", "neighbourhood", "series", "weighted"],
            Self::Pq => &["lambda_step_nm", "terms", "series", "repeats"],
            Self::Stam => &["period_um", "stam_form", "gems_sharpness", "gems_highlight"],
            Self::Table => &["resolution"],
        }
    }

    /// Refuses a transparent body that the method does not show. The table shows films, the published methods none.
    ///
    /// # Errors
    /// [`MethodError::Unsupported`].
    pub fn accept(self, body: Option<TransparentBody>) -> Result<(), MethodError> {
        let Some(body) = body else { return Ok(()) };
        let accepted = match (self, body.is_film) {
            (Self::Table, true) => return Ok(()),
            (Self::Table, false) => "none and film",
            (_, true) => "none; the method table knows it",
            (_, false) => "none; the method table knows film, too",
        };
        let found = if body.is_film { Transmission::Film } else { Transmission::Interface }.name();
        Err(MethodError::Unsupported { method: self.name(), parameter: "transmission", found, accepted })
    }

    /// Whether the method evaluates only a single window at a fixed position over a tile that repeats, as all published
    /// methods do.
    pub const fn is_patch_only(self) -> bool {
        !matches!(self, Self::Table)
    }
}

impl fmt::Display for MethodKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Options of the methods; [`MethodKind::options`] lists those that a method reads.
///
/// ```
/// use sunbeam::methods::MethodOptions;
///
/// let options: MethodOptions = serde_json::from_str(r#"{"lambda_step_nm": 10, "repeats": [26, 1]}"#)?;
/// options.validate()?;
/// let refused = MethodOptions { lambda_step_nm: 0.0, ..options }.validate().unwrap_err();
/// assert_eq!(refused.to_string(), "parameter \"lambda_step_nm\" is 0, but must be 0.1 to 100 nm");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MethodOptions {
    /// Step between wavelengths in nm, 0.1 to 100 (default: 5).
    pub lambda_step_nm: f64,
    /// Terms of the series of the phase screen, 1 to 256 (default: the number that the tolerance requires).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<usize>,
    /// Number of orders summed along each axis, 1 to 64 (default: the number that the tolerance requires). For colours,
    /// the default of NMM is at most the number that a tolerance of 0.15 requires, since its choice of wavelengths
    /// causes larger errors. Single 2014 sums 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbourhood: Option<usize>,
    /// The series of the phase screen (default: `chebyshev`). Single 2014 has `taylor`.
    pub series: Series,
    /// Whether NMM weights each wavelength by the width of the interval that it represents (default: true). Single 2014
    /// has no such weights.
    pub weighted: bool,
    /// Repeats of the tile in PQ, along both axes or along x and y, 1 to 10000 (default: the number that makes peaks as
    /// bright as with the coherence window).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// Spacing of Stam's model in µm (default: the dominant period along x).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_um: Option<f64>,
    /// Form of Stam's model (default: `spacing`).
    pub stam_form: StamForm,
    /// Sharpness r of the highlight of the form `gems` (stam_gems.rs) in 1/µm, 0 to 10000 (default: 50).
    pub gems_sharpness: f64,
    /// Colour of the highlight of the form `gems`, linear sRGB, each component 0 to 100 (default: 1, 0.7, 0.3).
    pub gems_highlight: [f64; 3],
    /// Factor on the number of the colour table's samples along each axis, 0.25 to 4 (default: 1, which keeps 99 % of
    /// the hemisphere within a ΔE₂₀₀₀ of 1).
    pub resolution: f64,
}

impl Default for MethodOptions {
    fn default() -> Self {
        Self {
            lambda_step_nm: 5.0,
            terms: None,
            neighbourhood: None,
            series: Series::default(),
            weighted: true,
            repeats: None,
            period_um: None,
            stam_form: StamForm::default(),
            // GPU Gems gives no values for these two; they are those of a public implementation (docs/realtime.md).
            gems_sharpness: 50.0,
            gems_highlight: [1.0, 0.7, 0.3],
            resolution: 1.0,
        }
    }
}

/// The forms of Stam's model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StamForm {
    /// A reflectance of eight orders on each side, in the colours of the CIE observer (stam.rs).
    #[default]
    Spacing,
    /// The form of GPU Gems, chapter 8: a highlight and seven orders on each side, in colours of its own
    /// (stam_gems.rs).
    Gems,
}

/// Repeats of a tile: one number for both axes, or one for x and one for y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a whole number or an array of two")]
pub enum Repeats {
    /// Repeats along each axis.
    Both(u32),
    /// Repeats along x and along y.
    Each([u32; 2]),
}

impl Repeats {
    /// Repeats along x and along y.
    pub fn xy(self) -> [u32; 2] {
        match self {
            Self::Both(both) => [both; 2],
            Self::Each(each) => each,
        }
    }
}

/// Reason why a method is refused.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum MethodError {
    #[error("parameter {name:?} is {found}, but must be {accepted}")]
    OutOfRange { name: &'static str, found: f64, accepted: &'static str },
    #[error(
        "the relief is too deep: at 380 nm κH is {kappa_h:.0}, and {limit} terms, the most a method holds, do not \
         reach the tolerance"
    )]
    TooManyTerms { kappa_h: f64, limit: usize },
    #[error(
        "the relief is too deep for the series \"taylor\" in single precision: at 380 nm κH is {kappa_h:.0}, the \
         limit is {limit}; use \"chebyshev\""
    )]
    TaylorRange { kappa_h: f64, limit: f64 },
    #[error(
        "the coherence window is so small against the tile that it joins {needed} orders along an axis, more than \
         {limit}; use a longer coherence length, a smaller tile, or give \"neighbourhood\""
    )]
    TooWide { needed: usize, limit: usize },
    #[error(
        "the diffraction orders would take {needed_mb:.0} MB, more than the {limit_mb:.0} MB allowed; use a smaller \
         tile, coarser pixels or fewer terms"
    )]
    TooLarge { needed_mb: f64, limit_mb: f64 },
    #[error("the surface has no period along x; give \"period_um\"")]
    NoPeriod,
    #[error("the method {method} does not know {parameter} = {found}, only {accepted}")]
    Unsupported { method: &'static str, parameter: &'static str, found: &'static str, accepted: &'static str },
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colour(#[from] ColourError),
}

impl From<ColourTableError> for MethodError {
    fn from(error: ColourTableError) -> Self {
        match error {
            ColourTableError::Table(error) => Self::Table(error),
            ColourTableError::Colour(error) => Self::Colour(error),
        }
    }
}

impl MethodOptions {
    /// Checks the ranges of all values, also of those that a method does not read.
    ///
    /// # Errors
    /// [`MethodError::OutOfRange`], which names the field.
    pub fn validate(&self) -> Result<(), MethodError> {
        in_range("lambda_step_nm", self.lambda_step_nm, &LAMBDA_STEP_NM, "0.1 to 100 nm")?;
        let up_to = |most: usize, name, value: Option<usize>, accepted| match value {
            Some(found) if !(1..=most).contains(&found) => {
                Err(MethodError::OutOfRange { name, found: found as f64, accepted })
            }
            _ => Ok(()),
        };
        up_to(TERMS_MAX, "terms", self.terms, "1 to 256")?;
        up_to(NEIGHBOURHOOD_MAX, "neighbourhood", self.neighbourhood, "1 to 64")?;
        for repeats in self.repeats.map(Repeats::xy).into_iter().flatten() {
            up_to(REPEATS_MAX as usize, "repeats", Some(repeats as usize), "1 to 10000")?;
        }
        in_range("gems_sharpness", self.gems_sharpness, &GEMS_SHARPNESS, "0 to 10000 1/µm")?;
        for value in self.gems_highlight {
            in_range("gems_highlight", value, &GEMS_HIGHLIGHT, "0 to 100")?;
        }
        in_range("resolution", self.resolution, &RESOLUTION, "0.25 to 4")?;
        match self.period_um {
            Some(found) if !(found > 0.0 && found <= MAX_LENGTH_UM) => {
                Err(MethodError::OutOfRange { name: "period_um", found, accepted: "a length in µm in (0, 1e3]" })
            }
            _ => Ok(()),
        }
    }
}

/// Checks the coherence length in µm and the tolerance, a relative error, of a method.
///
/// # Errors
/// [`MethodError::OutOfRange`] with the name of the parameter.
pub(super) fn check_window_and_tolerance(coherence_length_um: f64, tolerance: f64) -> Result<(), MethodError> {
    in_range("coherence_length", coherence_length_um, &COHERENCE_LENGTH_UM, "a length in µm in [1e-3, 1e5]")?;
    in_range("tolerance", tolerance, &TOLERANCE, "a relative error in [1e-6, 1e-1]")
}

/// Checks that the number `found` is in its range; `accepted` describes the range for the message.
///
/// # Errors
/// [`MethodError::OutOfRange`] with the name of the parameter.
pub(super) fn in_range(
    name: &'static str,
    found: f64,
    range: &std::ops::RangeInclusive<f64>,
    accepted: &'static str,
) -> Result<(), MethodError> {
    if range.contains(&found) { Ok(()) } else { Err(MethodError::OutOfRange { name, found, accepted }) }
}
