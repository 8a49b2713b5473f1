//! The plot of `sunbeam bench`: error over time of every method, one chart for each surface.

use crate::benchmarks::methods::{Cost, Entry, clamp_delta_e};
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};
use sunbeam::table::Model;
use svg::node::element::Group;

/// Width and height of a chart in pixels.
const SIZE: (u32, u32) = (560, 420);
/// Charts in a row.
const COLUMNS: usize = 2;
/// Range of the colour difference ΔE₂₀₀₀ (CIEDE2000) that is drawn. Errors outside the range are drawn at its ends. A
/// difference of 1 is just noticeable.
const DELTA_E_RANGE: (f64, f64) = (0.01, 100.0);
/// Radius in pixels of an entry's disc.
const DISC_RADIUS: f64 = 4.0;
/// Radius in pixels of the ring around a method's default parameters.
const RING_RADIUS: f64 = 8.0;
/// Methods by their names in the report, and their colours: those of matplotlib's "tab10". The legend has this order.
const METHODS: [(&str, &str); 6] = [
    ("flss", "#1f77b4"),
    ("nmm", "#ff7f0e"),
    ("pq", "#2ca02c"),
    ("stam", "#7f7f7f"),
    ("colour-table", "#d62728"),
    ("spectral-table", "#9467bd"),
];
/// Colour of all methods that are not in [`METHODS`]: brown of "tab10".
const OTHER_COLOUR: &str = "#8c564b";

/// Draws the entries of each surface, `(name, entries)` with at least one entry, as SVG.
///
/// An entry is a disc, hollow where its model is `patch`. A ring marks a method's default parameters. A grey line joins
/// the entries on the Pareto front of the two drawn quantities ([`front_points`]).
pub(super) fn svg(surfaces: &[(&str, &[Entry])]) -> String {
    drawing(surfaces.iter().map(|(name, entries)| surface_chart(name, entries)).collect(), SIZE, COLUMNS)
}

/// The chart of one surface.
fn surface_chart(name: &str, entries: &[Entry]) -> Group {
    let times = entries.iter().map(|entry| entry.cpu.microseconds);
    let (least, most) = times.fold((f64::INFINITY, 0.0f64), |(least, most), time| (least.min(time), most.max(time)));
    // Factors on the ends of a logarithmic axis are margins. They keep the discs at the ends from being cut off.
    let x = Axis::logarithmic("µs per colour on one core", (0.7 * least, 1.4 * most));
    let y = Axis::logarithmic("ΔE₂₀₀₀, 99 % of the directions", (0.8 * DELTA_E_RANGE.0, 1.3 * DELTA_E_RANGE.1));
    let mut chart = Chart::new(SIZE, name, x, y);
    chart.curve(front_points(entries), Stroke::solid("#999", 1.0));
    for (method, colour) in coloured_methods(entries) {
        for entry in entries.iter().filter(|entry| entry.method == method) {
            match entry.model {
                Model::Patch => chart.circle(point(entry), DISC_RADIUS, Stroke::solid(colour, 1.0)),
                Model::Ensemble => chart.disc(point(entry), DISC_RADIUS, colour),
            }
            if entry.is_default {
                chart.circle(point(entry), RING_RADIUS, Stroke::solid(colour, 2.0));
            }
        }
        chart.explain_disc(colour, method);
    }
    chart.into_group(Corner::LowerLeft)
}

/// Name and colour of each method of the entries: those of [`METHODS`] in their order, then any others.
fn coloured_methods(entries: &[Entry]) -> Vec<(&'static str, &'static str)> {
    let is_present = |method: &str| entries.iter().any(|entry| entry.method == method);
    let mut methods: Vec<_> = METHODS.into_iter().filter(|(method, _)| is_present(method)).collect();
    for entry in entries {
        if !methods.iter().any(|(method, _)| *method == entry.method) {
            methods.push((entry.method, OTHER_COLOUR));
        }
    }
    methods
}

/// Position of an entry: time in µs, and the 99th percentile of ΔE₂₀₀₀ within the drawn range.
fn point(entry: &Entry) -> (f64, f64) {
    (entry.cpu.microseconds, entry.errors.delta_e_p99.clamp(DELTA_E_RANGE.0, DELTA_E_RANGE.1))
}

/// Positions of the entries on the Pareto front of the two drawn quantities, in order of time: no other entry beats
/// them in both (methods/pareto.rs).
///
/// Colour differences that are too small to be seen count as equal ([`clamp_delta_e`]). [`Entry::on_front`] counts the
/// mean ΔE₂₀₀₀ as a third quantity, so it may hold for more entries.
fn front_points(entries: &[Entry]) -> Vec<(f64, f64)> {
    let cost = |(time_us, delta_e): (f64, f64)| Cost::new(time_us, [clamp_delta_e(delta_e)]);
    let points: Vec<(f64, f64)> = entries.iter().map(point).collect();
    let is_on_front = |at: &(f64, f64)| cost(*at).is_on_front(points.iter().copied().map(cost));
    let mut kept: Vec<(f64, f64)> = points.iter().copied().filter(is_on_front).collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmarks::methods::{Errors, Timing};

    fn entry(method: &'static str, microseconds: f64, delta_e: f64) -> Entry {
        Entry {
            method,
            model: Model::Ensemble,
            parameters: serde_json::Map::new(),
            is_default: false,
            bytes: 0,
            build_seconds: 0.0,
            cpu: Timing { microseconds, least_us: microseconds, most_us: microseconds, ratio: 1.0 },
            gpu: None,
            errors: Errors {
                spectral_rmse: None,
                xyz_rmse: 0.0,
                rgb_rmse: 0.0,
                delta_e_mean: delta_e,
                delta_e_p99: delta_e,
            },
            on_front: false,
            on_front_of_method: false,
        }
    }

    #[test]
    fn a_method_without_a_colour_of_its_own_is_drawn() {
        let entries = [entry("other", 1.0, 1.0), entry("flss", 2.0, 1.0)];
        assert_eq!(coloured_methods(&entries), [METHODS[0], ("other", OTHER_COLOUR)]);
        let drawn = svg(&[("surface", entries.as_slice())]);
        // Each method has a disc in the chart and one in the legend.
        assert_eq!(drawn.matches(OTHER_COLOUR).count(), 2);
        assert_eq!(drawn.matches(METHODS[0].1).count(), 2);
    }

    #[test]
    fn the_line_leaves_out_beaten_entries() {
        let entries = [entry("flss", 3.0, 0.5), entry("flss", 2.0, 2.0), entry("pq", 1.0, 1.0)];
        assert_eq!(front_points(&entries), [(1.0, 1.0), (3.0, 0.5)]);
    }
}
