//! The plot of `sunbeam bench`: error over time of every method, one chart for each surface.

use crate::benchmarks::methods::{Entry, front, noticed};
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};
use sunbeam::table::Model;
use svg::node::element::Group;

/// Width and height of a chart in pixels.
const SIZE: (u32, u32) = (560, 420);
/// Charts in a row.
const COLUMNS: usize = 2;
/// Range of ΔE₂₀₀₀ that is drawn. Errors outside are drawn at its ends. A difference of 1 is just noticeable.
const DELTA_E_RANGE: (f64, f64) = (0.01, 100.0);
/// Radius in pixels of an entry's disc.
const DISC_RADIUS: f64 = 4.0;
/// Radius in pixels of the ring around a method's default parameters.
const RING_RADIUS: f64 = 8.0;
/// Methods by their names in the report, and their colours: those of matplotlib's "tab10".
const METHODS: [(&str, &str); 6] = [
    ("flss", "#1f77b4"),
    ("nmm", "#ff7f0e"),
    ("pq", "#2ca02c"),
    ("stam", "#7f7f7f"),
    ("colour-table", "#d62728"),
    ("spectral-table", "#9467bd"),
];

/// Draws the entries of each surface, `(name, entries)`, as SVG.
///
/// An entry is a disc, hollow where its model is a patch. A ring marks a method's default parameters. A grey line joins
/// the entries on the front ([`front_points`]).
pub(super) fn svg(surfaces: &[(&str, &[Entry])]) -> String {
    drawing(surfaces.iter().map(|(name, entries)| chart(name, entries)).collect(), SIZE, COLUMNS)
}

fn chart(name: &str, entries: &[Entry]) -> Group {
    let times = entries.iter().map(|entry| entry.cpu.microseconds);
    let (least, most) = times.fold((f64::INFINITY, 0.0f64), |(least, most), time| (least.min(time), most.max(time)));
    // The factors leave margins, so that no disc is cut off at the edge.
    let x = Axis::logarithmic("µs per colour on one core", (0.7 * least, 1.4 * most));
    let y = Axis::logarithmic("ΔE₂₀₀₀, 99 % of the directions", (0.8 * DELTA_E_RANGE.0, 1.3 * DELTA_E_RANGE.1));
    let mut chart = Chart::new(SIZE, name, x, y);
    chart.curve(front_points(entries), Stroke::solid("#999", 1.0));
    for (method, colour) in METHODS {
        let shown: Vec<&Entry> = entries.iter().filter(|entry| entry.method == method).collect();
        for entry in &shown {
            match entry.model {
                Model::Patch => chart.circle(point(entry), DISC_RADIUS, Stroke::solid(colour, 1.0)),
                Model::Ensemble => chart.disc(point(entry), DISC_RADIUS, colour),
            }
            if entry.is_default {
                chart.circle(point(entry), RING_RADIUS, Stroke::solid(colour, 2.0));
            }
        }
        if !shown.is_empty() {
            chart.explain_disc(colour, method);
        }
    }
    chart.into_group(Corner::LowerLeft)
}

/// Position of an entry: time in µs, and the 99th percentile of ΔE₂₀₀₀ within the drawn range.
fn point(entry: &Entry) -> (f64, f64) {
    (entry.cpu.microseconds, entry.errors.delta_e_p99.clamp(DELTA_E_RANGE.0, DELTA_E_RANGE.1))
}

/// Positions on the front of the two drawn quantities, in order of their times.
///
/// `Entry::on_front` counts the mean ΔE₂₀₀₀ as well, so it may hold for more entries.
fn front_points(entries: &[Entry]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = entries.iter().map(point).collect();
    let compared: Vec<_> = points.iter().map(|(time, error)| (*time, [noticed(*error)])).collect();
    let marked = points.into_iter().zip(front(&compared));
    let mut kept: Vec<_> = marked.filter(|(_, on_front)| *on_front).map(|(point, _)| point).collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept
}
