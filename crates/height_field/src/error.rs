//! [`HeightFieldError`], the error of every function of this crate.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// Reason why a height field could not be made, read, changed or written.
///
/// Fields named `parameter` hold the user's name of a parameter, such as `pixel_size`. Some messages list presets and
/// fills ([`Fill`](crate::Fill)) literally, so a new preset or fill must be added to these messages.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant shows its fields")]
pub enum HeightFieldError {
    /// The array has no pixels.
    #[error("the height field has no pixels; at least one is needed")]
    Empty,
    /// A pixel size is zero, negative or not finite.
    #[error("the pixel size along {axis} is {value_um} µm; it must be finite and positive")]
    PixelSize { axis: &'static str, value_um: f64 },
    /// A height is NaN or infinite in [`HeightField::new`](crate::HeightField::new), which fills no missing points.
    /// Row and column count from 0, in the order of the array.
    #[error("the height at row {row}, column {column} is {value}; every height must be finite")]
    NotFinite { row: usize, column: usize, value: f64 },
    /// An array with missing points, for which [`Fill::None`](crate::Fill::None) was given, or without any height.
    ///
    /// `row` and `column` are those of the first missing point, from 0 in the order of the array. `isolated_note` is a
    /// part of the message: empty, or clauses such as `; 3 of them -9999, isolated from the rest`. Such numbers are far
    /// from all other heights and count as missing (`isolated.rs`). The message's limit of 1e30 is that of `holes.rs`.
    #[error(
        "{count} of {total} heights are missing (NaN, infinite, 1e30 or more in magnitude, or masked{isolated_note}), \
         the first at row {row}, column {column}; {}",
        advice(*count, *total)
    )]
    Holes { count: usize, total: usize, row: usize, column: usize, isolated_note: String },
    /// A name that is not one of the accepted ones.
    #[error("unknown {parameter} \"{found}\"; accepted: {accepted}")]
    UnknownName { parameter: &'static str, found: String, accepted: String },
    /// A parameter of gratings (`period`, `height`) for a preset that is no grating.
    #[error("`{parameter}` does not apply to preset \"{preset}\"; only blazed, sinusoidal and lamellar take it")]
    PresetParameter { parameter: &'static str, preset: &'static str },
    /// A parameter of skins (`region_size`) for a preset that is no skin.
    #[error("`{parameter}` does not apply to preset \"{preset}\"; only elaphe and xenopeltis take it")]
    SkinParameter { parameter: &'static str, preset: &'static str },
    /// A number outside of its accepted interval.
    #[error("`{parameter}` is {}; it must be in [{low}, {high}]", concise(*found))]
    NotWithin { parameter: &'static str, found: f64, low: f64, high: f64 },
    /// A length that is zero, negative or not finite.
    #[error("`{parameter}` is {value_um} µm; it must be finite and positive")]
    OutOfRange { parameter: &'static str, value_um: f64 },
    /// A length above the largest accepted one ([`MAX_LENGTH_UM`](crate::MAX_LENGTH_UM)). `what` is its name, such as
    /// "the range of heights".
    #[error(
        "{what} is {} µm, more than the largest accepted length, {limit_um} µm; lengths are in µm: was it given in \
         nm, or is the file's unit wrong?",
        concise(*value_um)
    )]
    TooLarge { what: &'static str, value_um: f64, limit_um: f64 },
    /// A pixel far smaller than an atom. `what` is the name of the length, such as "`pixel_size` along x".
    #[error(
        "{what} is {} µm, less than {limit_um} µm, far below the size of an atom; lengths are in µm: was it given in \
         m?",
        concise(*value_um)
    )]
    TooSmall { what: &'static str, value_um: f64, limit_um: f64 },
    /// A file cannot be opened or read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Read { path: PathBuf, reason: std::io::Error },
    /// A file cannot be written.
    #[error("{}: cannot be written: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
    /// An extension of no known format.
    #[error("{}: extension \"{found}\" is not supported; accepted: {accepted}", path.display())]
    Extension { path: PathBuf, found: String, accepted: &'static str },
    /// An instrument's format that the Python package converts. Its extra "formats" is a set of optional dependencies.
    #[error(
        "{}: \"{found}\" files are not read here; `python -m sunbeam_mitsuba.convert {} -o scan.gsf` (with the extra \
         \"formats\") or Gwyddion writes such a file's heights as .gsf",
        path.display(), shell_word(path)
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
    #[error(
        "{}: `{parameter}` is given as {} µm but the file says {} µm",
        path.display(), concise(*given_um), concise(*file_um)
    )]
    ScaleDisagrees { path: PathBuf, parameter: &'static str, given_um: f64, file_um: f64 },
    /// [`HeightFieldError::Holes`] for points of a file, in the order of the file.
    #[error(
        "{}: {count} of {total} points have no height (NaN, infinite, 1e30 or more in magnitude, or \
         masked{isolated_note}), the first at row {row}, column {column}; {}",
        path.display(), advice(*count, *total)
    )]
    Missing { path: PathBuf, count: usize, total: usize, row: usize, column: usize, isolated_note: String },
    /// A rectangle that extends beyond the field or contains no pixel's centre. `x_um` and `y_um` are its lowest
    /// coordinates, `size_x_um` and `size_y_um` its sides, `extent_x_um` and `extent_y_um` those of the field.
    #[error(
        "the rectangle at ({}, {}) µm of {} × {} µm does not lie within the field of {extent_x_um} × {extent_y_um} \
         µm, or contains no pixel's centre",
        concise(*x_um), concise(*y_um), concise(*size_x_um), concise(*size_y_um)
    )]
    Crop { x_um: f64, y_um: f64, size_x_um: f64, size_y_um: f64, extent_x_um: f64, extent_y_um: f64 },
    /// A strip for blending opposite edges ([`HeightField::made_tileable`](crate::HeightField::made_tileable)) that is
    /// narrower than a pixel or wider than a third of the field. Wider strips could overlap (`tile.rs`).
    #[error(
        "a blend of {} µm along {axis} is not between one pixel and a third of the field's {extent_um} µm",
        concise(*width_um)
    )]
    Blend { axis: &'static str, width_um: f64, extent_um: f64 },
}

/// A number for messages: with an exponent where its plain decimals would be longer than about 16 digits.
fn concise(value: f64) -> String {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-16..1e16).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

/// A path as one word of a command: in double quotes if it contains blanks or other signs that a shell may interpret.
fn shell_word(path: &Path) -> String {
    let word = path.display().to_string();
    let is_plain = word.chars().all(|c| c.is_alphanumeric() || "/\\._-:".contains(c));
    if is_plain { word } else { format!("\"{word}\"") }
}

/// Advice for missing heights: `fill` computes them from the others, if there are any.
fn advice(missing: usize, total: usize) -> &'static str {
    if missing == total {
        "no point has a height, so there is nothing to fill them from"
    } else {
        "`fill` computes them from the known heights: laplace or mean"
    }
}
