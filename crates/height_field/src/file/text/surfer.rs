//! Text grids of Surfer: `DSAA`, the numbers of nodes along x and y, the ranges of x, y and z (lowest and highest), and
//! the heights z row by row from the lowest y on. A node is a pixel's centre.
//!
//! Missing points are 1.70141e38, which `src/holes.rs` recognises by its magnitude.

use super::super::provenance::{Source, Understood};
use super::super::raw::FirstRow;
use super::super::{Meaning, Parsed, Raw};
use super::numbers::{self, Line};
use ndarray::Array2;

/// Whether the first line that is not blank marks a text grid of Surfer.
pub(super) fn is_grid(lines: &[Line]) -> bool {
    lines.iter().find(|(_, text)| !text.trim().is_empty()).is_some_and(|(_, text)| text.trim() == "DSAA")
}

/// Refuses Surfer's binary grids with a hint.
pub(super) fn refuse_binary(bytes: &[u8]) -> Result<(), String> {
    match bytes.get(..4) {
        Some(b"DSBB" | b"DSRB") => Err("it is a binary grid of Surfer; save it as a text grid (GS ASCII)".to_owned()),
        _ => Ok(()),
    }
}

/// Reads a grid that [`is_grid`] accepts. Ranges extend from the first node to the last. The format has no unit;
/// lengths are taken for µm. [`Raw`] refuses ranges that do not ascend.
pub(super) fn parse(lines: &[Line]) -> Parsed {
    // Everything after `DSAA` is numbers; line breaks do not matter.
    let lines: Vec<Line> = lines.iter().copied().filter(|(_, text)| !text.trim().is_empty()).skip(1).collect();
    let mut values = numbers::table(&lines)?.values.into_iter();
    let mut next = || values.next().ok_or_else(|| "it ends within its header".to_owned());
    let (nx, ny) = (next()?, next()?);
    let (x, y) = ([next()?, next()?], [next()?, next()?]);
    // The range of z is not needed.
    let _z = [next()?, next()?];
    // Two nodes are the fewest with a spacing. Counts below 1e9 fit into a `usize` of 32 bits.
    let count = |value: f64| (value.fract() == 0.0 && (2.0..1e9).contains(&value)).then_some(value as usize);
    let (Some(nx), Some(ny)) = (count(nx), count(ny)) else {
        return Err(format!("its size is {nx} × {ny}; whole numbers of nodes, at least 2 and below 1e9, are needed"));
    };
    let heights: Vec<f64> = values.collect();
    if nx.checked_mul(ny) != Some(heights.len()) {
        return Err(format!("{nx} × {ny} heights are promised, but {} follow", heights.len()));
    }
    let step = |range: [f64; 2], count: usize| (range[1] - range[0]) / (count - 1) as f64;
    let pixel_um = Some((step(x, nx), step(y, ny)));
    let heights = Array2::from_shape_vec((ny, nx), heights).map_err(|error| error.to_string())?;
    let unit = Understood::new(Source::Default, "µm");
    Ok(Raw::new(heights, Meaning::Lengths { unit_um: 1.0, unit }, FirstRow::Bottom).pixel(pixel_um))
}
