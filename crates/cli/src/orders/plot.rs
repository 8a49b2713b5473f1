//! The plot of `sunbeam orders`: efficiencies of the strongest orders over the quantity that varies.

use super::Curve;
use super::solve::{Order, Side};
use crate::chart::{Axis, Chart, Corner, Stroke, drawing};
use std::collections::BTreeMap;

/// Width and height of the drawing in pixels.
const SIZE: (u32, u32) = (900, 600);
/// Colours of the orders that are drawn, the strongest first: the first four of matplotlib's "tab10". Weaker orders are
/// left out.
const COLOURS: [&str; 4] = ["#1f77b4", "#ff7f0e", "#2ca02c", "#d62728"];

/// Top of the axis where every efficiency is 0.
const TOP_MIN: f64 = 1e-6;

/// Draws the strongest orders as SVG: the mean as a thick line, TE dashed and TM dotted where they are known.
pub(super) fn svg(curve: &Curve) -> String {
    let strongest = by_strength(curve);
    let top = strongest.iter().fold(TOP_MIN, |top, (_, efficiency)| top.max(*efficiency));
    let (first, last) = (curve.points[0].at, curve.points[curve.points.len() - 1].at);
    let x = Axis::linear(curve.over.axis(), (first.min(last), first.max(last)));
    let is_polarised = curve.points.iter().flat_map(|point| &point.solved.orders).any(|order| order.te.is_some());
    let y_label = if is_polarised { "efficiency: mean, TE dashed, TM dotted" } else { "efficiency" };
    let mut chart = Chart::new(SIZE, "", x, Axis::linear(y_label, (0.0, 1.05 * top)));
    for (((side, order), _), colour) in strongest.into_iter().zip(COLOURS) {
        let mean = Stroke::solid(colour, 3.0);
        chart.curve(values(curve, (side, order), |order| Some(order.mean)), mean);
        chart.curve(values(curve, (side, order), |order| order.te), Stroke { colour, width: 1.0, dashes: "8 4" });
        chart.curve(values(curve, (side, order), |order| order.tm), Stroke { colour, width: 1.0, dashes: "2 3" });
        chart.explain_stroke(mean, explanation(side, order));
    }
    drawing(vec![chart.into_group(Corner::UpperRight)], SIZE, 1)
}

/// Explanation of an order's line. Reflected orders have no side in it.
fn explanation(side: Side, order: i32) -> String {
    if side == Side::Above { format!("order {order}") } else { format!("order {order}, {}", side.name()) }
}

/// All orders of the curve with their largest efficiencies along it, the strongest first.
fn by_strength(curve: &Curve) -> Vec<((Side, i32), f64)> {
    let mut largest: BTreeMap<(Side, i32), f64> = BTreeMap::new();
    for order in curve.points.iter().flat_map(|point| &point.solved.orders) {
        let efficiency = [Some(order.mean), order.te, order.tm].into_iter().flatten().fold(0.0, f64::max);
        let entry = largest.entry((order.side, order.order)).or_default();
        *entry = entry.max(efficiency);
    }
    let mut sorted: Vec<_> = largest.into_iter().collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted
}

/// One efficiency of an order over the quantity that varies, at the points at which the order propagates.
fn values(curve: &Curve, (side, order): (Side, i32), efficiency: fn(&Order) -> Option<f64>) -> Vec<(f64, f64)> {
    let at_point = |point: &super::Point| {
        let found = point.solved.orders.iter().find(|each| (each.side, each.order) == (side, order))?;
        Some((point.at, efficiency(found)?))
    };
    curve.points.iter().filter_map(at_point).collect()
}
