//! The response over wavelength and angle as a picture, with the curves over it.

use super::Response;
use plotters::prelude::*;

/// Width and height of the drawing.
const SIZE: (u32, u32) = (900, 600);
/// Most cells along each axis: a response may have millions of values.
const CELLS: usize = 150;

/// Draws the response as SVG, each wavelength against its own maximum, with the angles of its peaks and of the grating
/// equation.
pub(super) fn svg(response: &Response, peaks_deg: &[f64], grating_deg: &[f64]) -> Result<String, DrawingError> {
    let mut text = String::new();
    draw(&mut text, response, peaks_deg, grating_deg)?;
    Ok(text)
}

type DrawingError = DrawingAreaErrorKind<std::io::Error>;

fn draw(text: &mut String, response: &Response, peaks_deg: &[f64], grating_deg: &[f64]) -> Result<(), DrawingError> {
    let (wavelengths, angles) = (&response.wavelengths_nm, &response.angles_deg);
    let (first, last) = (wavelengths[0], wavelengths[wavelengths.len() - 1]);
    let (low, high) = (angles[0], angles[angles.len() - 1]);
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(45)
        .y_label_area_size(60)
        .build_cartesian_2d(first..last, low..high)?;
    let (columns, rows) = (wavelengths.len().min(CELLS), angles.len().min(CELLS));
    for column in 0..columns {
        let span = column * wavelengths.len() / columns..(column + 1) * wavelengths.len() / columns;
        let brightest = response.values[span.clone()].iter().flatten().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        let x = |i: usize| first + (last - first) * i as f64 / columns as f64;
        let y = |i: usize| low + (high - low) * i as f64 / rows as f64;
        let cells = (0..rows).filter_map(|row| {
            let part = row * angles.len() / rows..(row + 1) * angles.len() / rows;
            let values = response.values[span.clone()].iter().flat_map(|values| &values[part.clone()]);
            // The square root brings up what is faint.
            let share = (values.fold(0.0f64, |a, b| a.max(*b)) / brightest).sqrt();
            let grey = 255 - (200.0 * share) as u8;
            (share > 0.01).then(|| {
                Rectangle::new([(x(column), y(row)), (x(column + 1), y(row + 1))], RGBColor(grey, grey, 255).filled())
            })
        });
        chart.draw_series(cells)?;
    }
    let curve = |values: &[f64]| wavelengths.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    chart
        .draw_series(LineSeries::new(curve(peaks_deg), RED.stroke_width(2)))?
        .label("brightest angle")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], RED.stroke_width(2)));
    chart
        .draw_series(LineSeries::new(curve(grating_deg), BLACK.stroke_width(1)))?
        .label("grating equation, mean spacing")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], BLACK));
    chart.configure_mesh().x_desc("wavelength in nm").y_desc("angle of view in degrees").draw()?;
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).background_style(WHITE.mix(0.8)).draw()?;
    root.present()
}
