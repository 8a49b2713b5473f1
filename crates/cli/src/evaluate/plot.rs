//! The plot of `sunbeam evaluate`: the response over wavelength and angle as shades, with the curves of its peaks and
//! of the grating equation.

use super::Response;
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};

/// Width and height of the drawing in pixels.
const SIZE: (u32, u32) = (900, 600);
/// Largest number of cells along each axis. A response may have millions of values, which would make the file large.
const CELLS_MAX: usize = 150;
/// Shade, from 0 to 1, below which a cell is left white.
const SHADE_MIN: f64 = 0.01;

/// Draws the response as SVG, with the angles of its peaks and of the grating equation, one for each wavelength.
///
/// A cell has the shade of its largest value, relative to the largest value of the cells above and below it.
pub(super) fn svg(response: &Response, peaks_deg: &[f64], grating_deg: &[f64]) -> String {
    let (wavelengths, angles) = (&response.wavelengths_nm, &response.angles_deg);
    let (x_range, y_range) = (ends(wavelengths), ends(angles));
    let (x, y) = (Axis::linear("wavelength in nm", x_range), Axis::linear("angle of view in degrees", y_range));
    let mut chart = Chart::new(SIZE, "", x, y);
    let (columns, rows) = (wavelengths.len().min(CELLS_MAX), angles.len().min(CELLS_MAX));
    // The i-th of `count` equal steps along a range.
    let at = |(first, last): (f64, f64), i: usize, count: usize| first + (last - first) * i as f64 / count as f64;
    for column in 0..columns {
        // The values at the wavelengths of this column, `[wavelength][angle]`.
        let spectra = &response.values[part(column, columns, wavelengths.len())];
        let brightest = spectra.iter().flatten().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        for row in 0..rows {
            let cell_angles = part(row, rows, angles.len());
            let in_cell = spectra.iter().flat_map(|values| &values[cell_angles.clone()]);
            // The square root lifts faint values.
            let shade = (in_cell.fold(0.0f64, |a, b| a.max(*b)) / brightest).sqrt();
            if shade > SHADE_MIN {
                // From white to a strong blue.
                let level = 255 - (200.0 * shade) as u8;
                let colour = format!("#{level:02x}{level:02x}ff");
                let corner = |column, row| (at(x_range, column, columns), at(y_range, row, rows));
                chart.cell(corner(column, row), corner(column + 1, row + 1), &colour);
            }
        }
    }
    let curves =
        [("brightest angle", peaks_deg, "red", 2.0), ("grating equation, mean spacing", grating_deg, "black", 1.0)];
    for (text, values, colour, width) in curves {
        chart.curve(wavelengths.iter().copied().zip(values.iter().copied()), Stroke::solid(colour, width));
        chart.explain_stroke(Stroke::solid(colour, width), text);
    }
    drawing(vec![chart.into_group(Corner::UpperLeft)], SIZE, 1)
}

/// The first and the last of at least one value.
fn ends(values: &[f64]) -> (f64, f64) {
    (values[0], values[values.len() - 1])
}

/// The indices of the `i`-th of `parts` parts of `count` values, which are equal to rounding.
fn part(i: usize, parts: usize, count: usize) -> std::ops::Range<usize> {
    i * count / parts..(i + 1) * count / parts
}
