//! The plot of `sunbeam orders`: efficiencies (fractions of the incident power) of the strongest orders over the
//! quantity that varies, such as the wavelength. TE and TM light are defined in solve.rs.

use super::solve::{Order, Side};
use super::{Curve, Point};
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};
use std::collections::BTreeMap;

/// Width and height of the drawing in pixels.
const SIZE: (u32, u32) = (900, 600);
/// Colours of the orders that are drawn, the strongest first: the first four of matplotlib's "tab10". Weaker orders are
/// left out, since each order has up to three curves.
const COLOURS: [&str; 4] = ["#1f77b4", "#ff7f0e", "#2ca02c", "#d62728"];
/// Smallest upper end of the axis of efficiencies. It keeps the axis from being empty where all efficiencies are 0.
const TOP_MIN: f64 = 1e-6;

/// One order along a [`Curve`].
struct Line {
    /// Side of the relief on which the order leaves.
    side: Side,
    /// The number m of the order, [`Order::order`].
    number: i32,
    /// The largest of the order's efficiencies at all points, for TE, TM and unpolarised light.
    largest: f64,
}

/// Draws the strongest orders as SVG: the mean over polarisations as a thick line, TE dashed and TM dotted where they
/// are known.
pub(super) fn svg(curve: &Curve) -> String {
    let lines = by_strength(curve);
    let top = lines.iter().fold(TOP_MIN, |top, line| top.max(line.largest));
    // A curve has at least two points, whose values may descend.
    let (first, last) = (curve.points[0].at, curve.points[curve.points.len() - 1].at);
    let x = Axis::linear(curve.over.axis(), (first.min(last), first.max(last)));
    let is_polarised = curve.points.iter().flat_map(|point| &point.solved.orders).any(|order| order.te.is_some());
    let y_label = if is_polarised { "efficiency: mean, TE dashed, TM dotted" } else { "efficiency" };
    // Efficiencies are not negative, so the axis begins at 0. A margin above the highest curve keeps it off the frame.
    let y = Axis::linear(y_label, (0.0, 1.05 * top));
    // The axes have labels, so the only chart of the drawing needs no title.
    let (title, columns) = ("", 1);
    let mut chart = Chart::new(SIZE, title, x, y);
    for (line, colour) in lines.iter().zip(COLOURS) {
        // Widths and dashes are in pixels.
        let mean = Stroke::solid(colour, 3.0);
        chart.curve(line.values(curve, |order| Some(order.mean)), mean);
        chart.curve(line.values(curve, |order| order.te), Stroke { colour, width: 1.0, dashes: "8 4" });
        chart.curve(line.values(curve, |order| order.tm), Stroke { colour, width: 1.0, dashes: "2 3" });
        chart.explain_stroke(mean, line.explanation());
    }
    drawing(vec![chart.into_group(Corner::UpperRight)], SIZE, columns)
}

impl Line {
    /// Text in the legend, which names the side of orders below the relief.
    fn explanation(&self) -> String {
        match self.side {
            Side::Above => format!("order {}", self.number),
            side => format!("order {}, {}", self.number, side.name()),
        }
    }

    /// One efficiency over the quantity that varies, at the points at which the order propagates and the efficiency is
    /// known. Where the order vanishes in between, the drawn line joins the points on both sides of the gap.
    fn values(&self, curve: &Curve, efficiency: fn(&Order) -> Option<f64>) -> Vec<(f64, f64)> {
        let at_point = |point: &Point| {
            let is_this_order = |order: &&Order| order.side == self.side && order.order == self.number;
            Some((point.at, efficiency(point.solved.orders.iter().find(is_this_order)?)?))
        };
        curve.points.iter().filter_map(at_point).collect()
    }
}

/// All orders that propagate anywhere along the curve, the strongest first.
fn by_strength(curve: &Curve) -> Vec<Line> {
    let mut largest: BTreeMap<(Side, i32), f64> = BTreeMap::new();
    for order in curve.points.iter().flat_map(|point| &point.solved.orders) {
        let efficiency = [Some(order.mean), order.te, order.tm].into_iter().flatten().fold(0.0, f64::max);
        let entry = largest.entry((order.side, order.order)).or_default();
        *entry = entry.max(efficiency);
    }
    let mut lines: Vec<_> =
        largest.into_iter().map(|((side, number), largest)| Line { side, number, largest }).collect();
    // The sort is stable: equally strong orders keep the sequence of the map's keys, so the drawing is reproducible.
    lines.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    lines
}
