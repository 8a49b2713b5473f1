//! The error of every function of this crate.

use std::path::PathBuf;
use thiserror::Error;

/// Reason why a height field could not be made, read, changed or written.
///
/// Fields named `parameter` are names of the user's parameters. The messages list fills ([`Fill`](crate::Fill)) and
/// presets as literal text, to which a new one must be added.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant names its fields")]
pub enum HeightFieldError {
    /// The array has no pixels.
    #[error("the height field has no pixels; at least one is needed")]
    Empty,
    /// A pixel size is zero, negative or not finite.
    #[error("the pixel size along {axis} is {value_um} µm; it must be finite and positive")]
    PixelSize { axis: &'static str, value_um: f64 },
    /// A height is NaN or infinite where heights cannot be missing. Rows and columns count from 0, in the order of the
    /// array or file they came from.
    #[error("the height at row {row}, column {column} is {value}; every height must be finite")]
    NotFinite { row: usize, column: usize, value: f64 },
    /// An array has points without a height and the fill is [`Fill::None`](crate::Fill::None), or no point has a
    /// height. Row and column of the first count from 0, in the order of the array. `isolated` is a part of the
    /// message: empty, or "; " and a list of numbers far outside the range of all heights, which mark missing points.
    #[error(
        "{count} of {total} heights are missing (NaN, infinite, 1e30 or more in magnitude, or masked{isolated}), the \
         first at row {row}, column {column}; {}",
        advice(*count, *total)
    )]
    Holes { count: usize, total: usize, row: usize, column: usize, isolated: String },
    /// A name that is not one of the accepted ones.
    #[error("unknown {parameter} \"{found}\"; accepted: {accepted}")]
    UnknownName { parameter: &'static str, found: String, accepted: String },
    /// A grating parameter for a preset that is no grating.
    #[error("`{parameter}` does not apply to preset \"{preset}\"; only blazed, sinusoidal and lamellar take it")]
    PresetParameter { parameter: &'static str, preset: &'static str },
    /// A skin parameter for a preset that is no skin.
    #[error("`{parameter}` does not apply to preset \"{preset}\"; only elaphe and xenopeltis take it")]
    SkinParameter { parameter: &'static str, preset: &'static str },
    /// A number outside of its accepted range.
    #[error("`{parameter}` is {found}; it must be in [{low}, {high}]")]
    NotWithin { parameter: &'static str, found: f64, low: f64, high: f64 },
    /// A length that is not finite and positive.
    #[error("`{parameter}` is {value_um} µm; it must be finite and positive")]
    OutOfRange { parameter: &'static str, value_um: f64 },
    /// A length above the largest accepted one ([`MAX_LENGTH_UM`](crate::MAX_LENGTH_UM)).
    #[error(
        "{what} is {value_um} µm, more than the largest accepted length, {limit_um} µm; lengths are in µm: was it \
         given in nm, or is the file's unit wrong?"
    )]
    TooLarge { what: &'static str, value_um: f64, limit_um: f64 },
    /// A pixel far smaller than an atom.
    #[error(
        "{what} is {value_um} µm, less than {limit_um} µm, far below the size of an atom; lengths are in µm: was it \
         given in m?"
    )]
    TooSmall { what: &'static str, value_um: f64, limit_um: f64 },
    /// A file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// A file cannot be written.
    #[error("{}: cannot be written: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
    /// An extension of no known format.
    #[error("{}: extension \"{found}\" is not supported; accepted: {accepted}", path.display())]
    Extension { path: PathBuf, found: String, accepted: &'static str },
    /// An instrument's format that the Python package converts.
    #[error(
        "{}: \"{found}\" files are not read here; `python -m sunbeam_mitsuba.convert {} -o scan.gsf` (with the extra \
         \"formats\") or Gwyddion writes such a file's heights as .gsf",
        path.display(), path.display()
    )]
    Instrument { path: PathBuf, found: String },
    /// An instrument's format that only Gwyddion reads.
    #[error(
        "{}: \"{found}\" files are not read here; Gwyddion reads them, and saves the heights as .gwy",
        path.display()
    )]
    Gwyddion { path: PathBuf, found: String },
    /// Contents that are truncated, or not of the format that the extension names.
    #[error("{}: not a usable {format} height field: {reason}", path.display())]
    Malformed { path: PathBuf, format: &'static str, reason: String },
    /// The file has no physical scale, and no parameter gives one.
    #[error("{}: the file does not say its {what}; give `{parameter}` in µm", path.display())]
    MissingScale { path: PathBuf, parameter: &'static str, what: String },
    /// A file with a physical scale that differs from the scale given as a parameter.
    #[error("{}: `{parameter}` is given as {given_um} µm but the file says {file_um} µm", path.display())]
    ScaleDisagrees { path: PathBuf, parameter: &'static str, given_um: f64, file_um: f64 },
    /// [`HeightFieldError::Holes`] for points of a file, in the order of the file.
    #[error(
        "{}: {count} of {total} points have no height (NaN, infinite, 1e30 or more in magnitude, or \
         masked{isolated}), the first at row {row}, column {column}; {}",
        path.display(), advice(*count, *total)
    )]
    Missing { path: PathBuf, count: usize, total: usize, row: usize, column: usize, isolated: String },
    /// A rectangle that extends beyond the field or holds no pixel. (x, y) is its corner of smallest x and y.
    #[error(
        "the rectangle at ({x_um}, {y_um}) µm of {width_um} × {height_um} µm does not lie within the field of \
         {extent_x_um} × {extent_y_um} µm, or contains no pixel's centre"
    )]
    Crop { x_um: f64, y_um: f64, width_um: f64, height_um: f64, extent_x_um: f64, extent_y_um: f64 },
    /// A blend narrower than a pixel or wider than a third of the field.
    #[error("a blend of {width_um} µm along {axis} is not between one pixel and a third of the field's {extent_um} µm")]
    Blend { axis: &'static str, width_um: f64, extent_um: f64 },
}

/// Advice for missing heights: `fill` computes them from the others, if there are any.
fn advice(missing: usize, total: usize) -> &'static str {
    if missing == total {
        "no point has a height, so there is nothing to fill them from"
    } else {
        "`fill` computes them from the known heights: laplace or mean"
    }
}
