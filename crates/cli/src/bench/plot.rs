//! Time against error as a picture, one panel a surface.

use crate::benchmarks::methods::{Entry, front, noticed};
use plotters::prelude::*;
use sunbeam::table::Model;

/// Width and height of a panel.
const PANEL: (u32, u32) = (560, 420);
/// Errors below this are drawn on it: an eye notices 1.
const LEAST: f64 = 0.01;
/// Methods and their colours.
const METHODS: [(&str, RGBColor); 6] = [
    ("flss", RGBColor(31, 119, 180)),
    ("nmm", RGBColor(255, 127, 14)),
    ("pq", RGBColor(44, 160, 44)),
    ("stam", RGBColor(127, 127, 127)),
    ("colour-table", RGBColor(214, 39, 40)),
    ("spectral-table", RGBColor(148, 103, 189)),
];

/// Draws the entries of each surface as SVG: a disc each, hollow for a window in a fixed place; a ring marks defaults, the line
/// the front.
pub(super) fn svg(panels: &[(&str, &[Entry])]) -> Result<String, DrawingError> {
    let mut text = String::new();
    draw(&mut text, panels)?;
    Ok(text)
}

type DrawingError = DrawingAreaErrorKind<std::io::Error>;

fn point(entry: &Entry) -> (f64, f64) {
    (entry.cpu.microseconds, entry.errors.delta_e_p99.clamp(LEAST, 100.0))
}

fn draw(text: &mut String, panels: &[(&str, &[Entry])]) -> Result<(), DrawingError> {
    let columns = panels.len().clamp(1, 2);
    let rows = panels.len().div_ceil(columns).max(1);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, (name, entries)) in root.split_evenly((rows, columns)).iter().zip(panels) {
        panel(area, name, entries)?;
    }
    root.present()
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    name: &str,
    entries: &[Entry],
) -> Result<(), DrawingError> {
    let times = entries.iter().map(|entry| entry.cpu.microseconds);
    let (least, most) = times.fold((f64::INFINITY, 0.0f64), |(a, b), t| (a.min(t), b.max(t)));
    let mut chart = ChartBuilder::on(area)
        .caption(name, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(55)
        .build_cartesian_2d((0.7 * least..1.4 * most).log_scale(), (0.8 * LEAST..130.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("µs per colour on one core")
        .y_desc("ΔE₂₀₀₀, 99 % of the directions")
        .light_line_style(WHITE)
        .draw()?;
    let points: Vec<(f64, f64)> = entries.iter().map(point).collect();
    let seen: Vec<_> = points.iter().map(|(time, error)| (*time, [noticed(*error)])).collect();
    let mut line: Vec<(f64, f64)> =
        points.iter().zip(front(&seen)).filter(|(_, on)| *on).map(|(point, _)| *point).collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(line, BLACK.mix(0.4).stroke_width(1)))?;
    for (method, colour) in METHODS {
        let of = || entries.iter().filter(move |entry| entry.method == method);
        if of().next().is_none() {
            continue;
        }
        let disc = |entry: &Entry| {
            let hollow = entry.model == Model::Patch;
            Circle::new(point(entry), 4, if hollow { colour.stroke_width(1) } else { colour.filled() })
        };
        chart
            .draw_series(of().map(disc))?
            .label(method)
            .legend(move |at| Circle::new((at.0 + 10, at.1), 4, colour.filled()));
        let ring = |entry: &Entry| Circle::new(point(entry), 8, colour.stroke_width(2));
        chart.draw_series(of().filter(|entry| entry.is_default).map(ring))?;
    }
    chart.configure_series_labels().position(SeriesLabelPosition::LowerLeft).background_style(WHITE.mix(0.8)).draw()?;
    Ok(())
}
