//! [`Raw`]: the contents of a file as a parser found them, and their conversion to a height field.
//!
//! Every format has a parser that returns a [`Raw`]. [`Raw::into_field`] then does the rest for all formats: it marks
//! and fills missing points (*holes*, holes.rs), combines the file's scale with the caller's options, and collects
//! warnings (*doubts*, doubts.rs). Among the holes are *isolated* numbers, far from all heights, such as −9999
//! (isolated.rs). For each property the value and its [`Source`] (provenance.rs) are recorded as [`Understood`].

use super::doubts::{self, Doubt};
use super::provenance::{Provenance, Source, Understood};
use super::{FileField, FileScale, ReadOptions};
use crate::holes::Holes;
use crate::{Fill, HeightField, HeightFieldError};
use ndarray::{Array2, Axis};
use std::path::Path;

/// Largest relative difference between the option's scale and the file's that counts as agreement. Rounding to seven
/// decimal digits changes less, as does rounding to whole pixels per metre in a PNG for pixels of up to 2 µm. Larger
/// values overlook contradictions; smaller ones refuse rounded options.
const AGREEMENT: f64 = 1e-6;

/// Meaning of the stored numbers.
pub(super) enum Meaning {
    /// Heights in a unit of `unit_um` µm; `unit` has its name, and whether file or format gives it.
    Lengths { unit_um: f64, unit: Understood },
    /// Fractions of full scale: the number 0 is height 0, the number `full` is the largest height. `max_height_um` is
    /// this height, if the file gives it.
    FullScale { full: f64, max_height_um: Option<f64> },
    /// Heights in an unknown unit: the lowest becomes 0, the highest the option `max_height`.
    Unknown,
}

impl Meaning {
    /// Heights in a unit named by the file, of `unit_um` µm.
    pub(super) fn in_unit(unit: &str, unit_um: f64) -> Self {
        Self::Lengths { unit_um, unit: Understood::new(Source::File, unit) }
    }

    /// Heights in µm by definition of the format.
    pub(super) fn micrometres() -> Self {
        Self::Lengths { unit_um: 1.0, unit: Understood::new(Source::Format, "µm") }
    }
}

/// Place of a file's first row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FirstRow {
    /// Largest y.
    Top,
    /// y = 0.
    Bottom,
}

/// Pixel size according to a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Pixel {
    /// Pixel size along x and y, in µm.
    Um(f64, f64),
    /// No size, or an ambiguous one. The text completes the message "the file does not say its …".
    Unknown(String),
}

/// Contents of a file, in the order of its rows. Points that the format marks as missing are NaN.
pub(super) struct Raw {
    /// Stored numbers, `[[row, column]]` in the order of the file.
    values: Array2<f64>,
    /// Conversion from stored numbers to heights.
    meaning: Meaning,
    /// Place of the first row.
    first_row: FirstRow,
    /// Source of the first row's place.
    first_row_source: Source,
    /// Pixel size.
    pixel: Pixel,
    /// Source of the pixel size, if it is known.
    pixel_source: Source,
    /// Name of the channel, for formats with several.
    channel: Option<Understood>,
}

/// Result of a parser. The error completes "not a usable … height field: ".
pub(super) type Parsed = Result<Raw, String>;

/// Equality to within [`AGREEMENT`].
fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= AGREEMENT * a.abs().max(b.abs())
}

/// A number rounded to seven digits, for messages. 0, and numbers near the ends of the range of f64, are returned
/// unchanged.
pub(super) fn rounded(value: f64) -> f64 {
    let factor = 10_f64.powi(6_i32.saturating_sub(value.abs().log10().floor() as i32));
    let result = (value * factor).round() / factor;
    if result.is_finite() { result } else { value }
}

impl Raw {
    /// Contents of a file whose format fixes the first row, with an unknown pixel size and a single channel.
    pub(super) fn new(values: Array2<f64>, meaning: Meaning, first_row: FirstRow) -> Self {
        Self {
            values,
            meaning,
            first_row,
            first_row_source: Source::Format,
            pixel: Pixel::Unknown("pixel size".to_owned()),
            pixel_source: Source::File,
            channel: None,
        }
    }

    /// Sets the pixel size in µm along x and y, if the file says it.
    pub(super) fn pixel(self, pixel_um: Option<(f64, f64)>) -> Self {
        match pixel_um {
            Some((dx, dy)) => self.pixel_or_reason(Pixel::Um(dx, dy)),
            None => self,
        }
    }

    /// Sets the pixel size, or the reason why it is unknown.
    pub(super) fn pixel_or_reason(self, pixel: Pixel) -> Self {
        Self { pixel, ..self }
    }

    /// Sets the source of the pixel size; the default is the file.
    pub(super) fn pixel_from(self, pixel_source: Source) -> Self {
        Self { pixel_source, ..self }
    }

    /// Sets the source of the first row's place; the default is the format.
    pub(super) fn rows_from(self, first_row_source: Source) -> Self {
        Self { first_row_source, ..self }
    }

    /// Sets the name of the channel. `channel_option` chose it; `None` means the default channel.
    pub(super) fn channel(self, name: impl Into<String>, channel_option: Option<&str>) -> Self {
        let source = if channel_option.is_some() { Source::Option } else { Source::Default };
        Self { channel: Some(Understood::new(source, name)), ..self }
    }

    /// Refuses empty contents and impossible pixel sizes. `Format::read` calls it before [`Raw::into_field`], because
    /// it reports these errors with the format's name, as those of the parser.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.values.is_empty() {
            return Err("it holds no points".to_owned());
        }
        match self.pixel {
            Pixel::Um(dx, dy) if !(dx.is_finite() && dx > 0.0 && dy.is_finite() && dy > 0.0) => {
                Err(format!("its pixels are {dx} × {dy} µm; both must be finite and positive"))
            }
            _ => Ok(()),
        }
    }

    /// Converts to a height field: scales to µm, puts the bottom row first, and fills missing points.
    ///
    /// # Errors
    /// Missing points without a known height or with [`Fill::None`]; a scale that is missing or contradictory; the
    /// errors of [`HeightField::new`].
    pub(super) fn into_field(mut self, path: &Path, options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        // Unit of the values in µm, for the detection of missing points; 1 if the unit is unknown.
        let unit_um = if let Meaning::Lengths { unit_um, .. } = self.meaning { unit_um } else { 1.0 };
        let holes = Holes::mark(&mut self.values, unit_um);
        let (count, total) = (holes.count, self.values.len());
        // Without a known point there is nothing to fill from.
        if let Some((row, column)) = holes.first.filter(|_| options.fill == Fill::None || count == total) {
            let (path, isolated_note) = (path.to_owned(), holes.isolated_note());
            return Err(HeightFieldError::Missing { path, count, total, row, column, isolated_note });
        }
        let (dx_um, dy_um) = self.pixel_size(path, &options.scale)?;
        let height_unit = self.scale_heights(path, &options.scale)?;
        if self.first_row == FirstRow::Top {
            self.values.invert_axis(Axis(0));
            self.values = self.values.as_standard_layout().into_owned();
        }
        options.fill.apply(&mut self.values, dx_um, dy_um);
        let rows = match self.first_row {
            FirstRow::Top => "first row at the top",
            FirstRow::Bottom => "first row at the bottom",
        };
        let pixel_source = if let Pixel::Um(..) = self.pixel { self.pixel_source } else { Source::Option };
        let provenance = Provenance {
            pixel_size: Understood::new(pixel_source, format!("{} × {} µm", rounded(dx_um), rounded(dy_um))),
            height_unit,
            rows: Understood::new(self.first_row_source, rows),
            channel: self.channel.clone(),
            holes: understood_holes(&holes, total, options.fill),
        };
        let field = HeightField::new(self.values, dx_um, dy_um)?;
        let mut doubts = doubts::about(&field);
        doubts.extend(holes.isolated.iter().map(|&(value, count)| Doubt::Isolated { value, count }));
        let channel = self.channel.map(|channel| channel.value);
        Ok(FileField { field, channel, filled: count, provenance: Some(provenance), doubts })
    }

    /// Pixel size along x and y in µm, from the file or the option. The option means square pixels.
    fn pixel_size(&self, path: &Path, scale: &FileScale) -> Result<(f64, f64), HeightFieldError> {
        let (parameter, path) = ("pixel_size", path.to_owned());
        match (&self.pixel, scale.pixel_size_um) {
            (Pixel::Unknown(what), None) => Err(HeightFieldError::MissingScale { path, parameter, what: what.clone() }),
            (Pixel::Unknown(_), Some(given_um)) => Ok((given_um, given_um)),
            (Pixel::Um(dx, dy), None) => Ok((*dx, *dy)),
            (&Pixel::Um(dx, dy), Some(given_um)) => match [dx, dy].into_iter().find(|own| !agree(*own, given_um)) {
                Some(file_um) => Err(HeightFieldError::ScaleDisagrees { path, parameter, given_um, file_um }),
                None => Ok((dx, dy)),
            },
        }
    }

    /// Converts the values to µm; returns the unit or scale that they had, and its source.
    ///
    /// # Errors
    /// A missing scale, or an option `max_height` that contradicts the file.
    fn scale_heights(&mut self, path: &Path, scale: &FileScale) -> Result<Understood, HeightFieldError> {
        let parameter = "max_height";
        let missing = |what: &str| {
            let what = what.to_owned();
            HeightFieldError::MissingScale { path: path.to_owned(), parameter, what }
        };
        // The option, if given, must agree with one of `accepted_um`, the values of `max_height` that fit the file. The
        // message names the first of them.
        let check_option = |accepted_um: &[f64]| match scale.max_height_um {
            Some(given_um) if !accepted_um.iter().any(|value| agree(*value, given_um)) => {
                let file_um = accepted_um[0];
                Err(HeightFieldError::ScaleDisagrees { path: path.to_owned(), parameter, given_um, file_um })
            }
            _ => Ok(()),
        };
        // Lowest and highest value; missing points are ignored.
        let range_of = |values: &Array2<f64>| {
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)))
        };
        match &self.meaning {
            Meaning::Lengths { unit_um, unit } => {
                self.values.mapv_inplace(|value| value * unit_um);
                let (low, high) = range_of(&self.values);
                // `max_height` may be the highest value, or the range.
                check_option(&[high, high - low])?;
                Ok(unit.clone())
            }
            Meaning::FullScale { full, max_height_um } => {
                if let Some(own) = max_height_um {
                    check_option(&[*own])?;
                }
                let source = if max_height_um.is_some() { Source::File } else { Source::Option };
                let top = max_height_um.or(scale.max_height_um).ok_or_else(|| missing("height of full scale"))?;
                self.values.mapv_inplace(|v| v / full * top);
                Ok(Understood::new(source, format!("full scale is {top} µm")))
            }
            Meaning::Unknown => {
                let top = scale.max_height_um.ok_or_else(|| missing("unit of height"))?;
                let (low, high) = range_of(&self.values);
                // Equal values become 0.
                let range = if high > low { high - low } else { 1.0 };
                self.values.mapv_inplace(|v| (v - low) / range * top);
                Ok(Understood::new(Source::Option, format!("the highest value is {top} µm, the lowest 0")))
            }
        }
    }
}

/// Description of the missing points among `total` points, and its source.
fn understood_holes(holes: &Holes, total: usize, fill: Fill) -> Understood {
    if holes.count == 0 {
        return Understood::new(Source::File, "none");
    }
    // Isolated numbers are recognised by their values alone (isolated.rs): a guess. The file counts as the source if it
    // marks at least one point.
    let guessed: usize = holes.isolated.iter().map(|(_, count)| count).sum();
    let source = if guessed == holes.count { Source::Guess } else { Source::File };
    let note = holes.isolated_note();
    Understood::new(source, format!("{} of {total} points, filled by {fill}{note}", holes.count))
}
