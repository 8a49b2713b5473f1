//! Time against error of every method: one chart for each surface.

use crate::benchmarks::methods::{Entry, front, noticed};
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};
use sunbeam::table::Model;
use svg::node::element::Group;

/// Width and height of a chart in pixels.
const SIZE: (u32, u32) = (560, 420);
/// Charts in a row.
const COLUMNS: usize = 2;
/// Range of ΔE₂₀₀₀ that is drawn; errors outside are drawn at its ends. An observer just notices 1.
const DELTA_E: (f64, f64) = (0.01, 100.0);
/// Methods and their colours, those of matplotlib's "tab10".
const METHODS: [(&str, &str); 6] = [
    ("flss", "#1f77b4"),
    ("nmm", "#ff7f0e"),
    ("pq", "#2ca02c"),
    ("stam", "#7f7f7f"),
    ("colour-table", "#d62728"),
    ("spectral-table", "#9467bd"),
];

/// Draws the entries of each surface as SVG.
///
/// An entry is a disc, hollow where its model is a patch. A ring marks a method's default parameters, and the line
/// joins the entries that no other beats.
pub(super) fn svg(surfaces: &[(&str, &[Entry])]) -> String {
    drawing(surfaces.iter().map(|(name, entries)| chart(name, entries)).collect(), SIZE, COLUMNS)
}

fn chart(name: &str, entries: &[Entry]) -> Group {
    let times = entries.iter().map(|entry| entry.cpu.microseconds);
    let (least, most) = times.fold((f64::INFINITY, 0.0f64), |(a, b), time| (a.min(time), b.max(time)));
    // The margins keep the discs inside.
    let x = Axis::logarithmic("µs per colour on one core", (0.7 * least, 1.4 * most));
    let y = Axis::logarithmic("ΔE₂₀₀₀, 99 % of the directions", (0.8 * DELTA_E.0, 1.3 * DELTA_E.1));
    let mut chart = Chart::new(SIZE, name, x, y);
    chart.curve(front_points(entries), Stroke::solid("#999", 1.0));
    for (method, colour) in METHODS {
        let shown: Vec<&Entry> = entries.iter().filter(|entry| entry.method == method).collect();
        for entry in &shown {
            match entry.model {
                Model::Patch => chart.circle(point(entry), 4.0, Stroke::solid(colour, 1.0)),
                Model::Ensemble => chart.disc(point(entry), 4.0, colour),
            }
            if entry.is_default {
                chart.circle(point(entry), 8.0, Stroke::solid(colour, 2.0));
            }
        }
        if !shown.is_empty() {
            chart.explain_disc(colour, method);
        }
    }
    chart.into_group(Corner::LowerLeft)
}

/// Time in µs and ΔE₂₀₀₀ of an entry.
fn point(entry: &Entry) -> (f64, f64) {
    (entry.cpu.microseconds, entry.errors.delta_e_p99.clamp(DELTA_E.0, DELTA_E.1))
}

/// The points of the entries that no other beats, in order of their times.
fn front_points(entries: &[Entry]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = entries.iter().map(point).collect();
    let on_front = front(&points.iter().map(|(time, error)| (*time, [noticed(*error)])).collect::<Vec<_>>());
    let mut kept: Vec<_> = points.into_iter().zip(on_front).filter(|(_, on)| *on).map(|(point, _)| point).collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept
}
