//! The plot of `sunbeam evaluate`: the response over wavelength and angle of view as a map of blue cells.
//!
//! The response is the reflectance of the relief without its material, `S/λ²` in 1/sr (evaluate.rs). Two curves lie
//! over the map: the brightest angle at each wavelength, and the first order by the grating equation. Each column of
//! cells is relative to its own largest value, so that the peak shows at every wavelength.

use super::Response;
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};

/// Width and height of the drawing in pixels.
const SIZE: (u32, u32) = (900, 600);
/// Largest number of cells along each axis. A response may have millions of values, and the file grows with the square
/// of this number; with smaller ones narrow peaks look wide.
const CELLS_MAX: usize = 150;
/// Shade, from 0 to 1, up to which a cell is left out: it would look white. At this shade red and green differ by 2 of
/// 255 from white.
const SHADE_MIN: f64 = 0.01;

/// Draws the response as SVG, with the angles of its peaks and of the grating equation, one for each wavelength.
pub(super) fn svg(response: &Response, peaks_deg: &[f64], grating_deg: &[f64]) -> String {
    let wavelengths = &response.wavelengths_nm;
    let x = Axis::linear("wavelength in nm", ends(wavelengths));
    let y = Axis::linear("angle of view in degrees", ends(&response.angles_deg));
    // The axes have labels, so the only chart of the drawing needs no title.
    let (title, columns) = ("", 1);
    let mut chart = Chart::new(SIZE, title, x, y);
    draw_cells(&mut chart, response);
    let curves =
        [("brightest angle", peaks_deg, "red", 2.0), ("grating equation, mean spacing", grating_deg, "black", 1.0)];
    for (text, angles_deg, colour, width) in curves {
        let stroke = Stroke::solid(colour, width);
        chart.curve(wavelengths.iter().copied().zip(angles_deg.iter().copied()), stroke);
        chart.explain_stroke(stroke, text);
    }
    drawing(vec![chart.into_group(Corner::UpperLeft)], SIZE, columns)
}

/// Fills the plot area with cells of equal size, each of which stands for a block of values.
///
/// The shade of a cell is the square root of its largest value relative to the largest value of its column.
fn draw_cells(chart: &mut Chart, response: &Response) {
    let (wavelengths, angles) = (&response.wavelengths_nm, &response.angles_deg);
    let (x_range, y_range) = (ends(wavelengths), ends(angles));
    let (columns, rows) = (wavelengths.len().min(CELLS_MAX), angles.len().min(CELLS_MAX));
    // Start of the i-th of `count` equal intervals of a range. Cells are equal, since wavelengths and angles have equal
    // steps.
    let edge = |(first, last): (f64, f64), i: usize, count: usize| first + (last - first) * i as f64 / count as f64;
    for column in 0..columns {
        // The values at the wavelengths of this column, `[wavelength][angle]`.
        let values = &response.values[part(column, columns, wavelengths.len())];
        // At least the smallest positive number, so that a column of zeros has shade 0.
        let brightest = values.iter().flatten().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        for row in 0..rows {
            let cell_angles = part(row, rows, angles.len());
            let in_cell = values.iter().flat_map(|by_angle| &by_angle[cell_angles.clone()]);
            // The square root makes faint values visible.
            let shade = (in_cell.fold(0.0f64, |a, b| a.max(*b)) / brightest).sqrt();
            if shade > SHADE_MIN {
                // From white at shade 0 to blue, #3737ff, at shade 1.
                let red_and_green = 255 - (200.0 * shade) as u8;
                let colour = format!("#{red_and_green:02x}{red_and_green:02x}ff");
                let corner = |column, row| (edge(x_range, column, columns), edge(y_range, row, rows));
                chart.cell(corner(column, row), corner(column + 1, row + 1), &colour);
            }
        }
    }
}

/// The first and the last value of a slice that is not empty. A single value is the middle of a range of length 1.
fn ends(values: &[f64]) -> (f64, f64) {
    match values {
        [value] => (value - 0.5, value + 0.5),
        _ => (values[0], values[values.len() - 1]),
    }
}

/// Indices of the `i`-th part of `count` values in `parts` parts, at most `count`. Their sizes differ by at most 1.
fn part(i: usize, parts: usize, count: usize) -> std::ops::Range<usize> {
    i * count / parts..(i + 1) * count / parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_a_single_angle_have_a_height() {
        let (wavelengths_nm, angles_deg) = (vec![400.0, 500.0], vec![10.0]);
        let response = Response { wavelengths_nm, angles_deg, values: vec![vec![1.0], vec![2.0]] };
        let drawn = svg(&response, &[10.0; 2], &[10.0; 2]);
        assert!(drawn.contains("#3737ff") && !drawn.contains("height=\"0\""), "{drawn}");
    }
}
