//! Efficiencies over what varies.

use super::Curve;
use plotters::prelude::*;
use std::collections::BTreeMap;

/// Width and height of the drawing.
const SIZE: (u32, u32) = (900, 600);
/// Orders drawn at most, the strongest somewhere.
const ORDERS_MAX: usize = 4;

/// Draws the strongest orders as SVG: te dashed, tm dotted where they are known, and their mean.
pub(super) fn svg(curve: &Curve) -> Result<String, DrawingError> {
    let mut text = String::new();
    draw(&mut text, curve)?;
    Ok(text)
}

type DrawingError = DrawingAreaErrorKind<std::io::Error>;

fn draw(text: &mut String, curve: &Curve) -> Result<(), DrawingError> {
    let mut strongest: BTreeMap<i32, f64> = BTreeMap::new();
    let mut top = 0.0_f64;
    for order in curve.points.iter().flat_map(|point| &point.solved.orders) {
        let most = [Some(order.mean), order.te, order.tm].into_iter().flatten().fold(0.0, f64::max);
        let known = strongest.entry(order.order).or_default();
        *known = known.max(most);
    }
    let mut shown: Vec<_> = strongest.into_iter().collect();
    shown.sort_by(|a, b| b.1.total_cmp(&a.1));
    shown.truncate(ORDERS_MAX);
    top = shown.iter().fold(top, |top, (_, most)| top.max(*most)).max(1e-6);
    let (first, last) = (curve.points[0].at, curve.points[curve.points.len() - 1].at);
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(45)
        .y_label_area_size(60)
        .build_cartesian_2d(first.min(last)..first.max(last), 0.0..1.05 * top)?;
    chart.configure_mesh().x_desc(curve.over.axis()).y_desc("share of the light").draw()?;
    for (i, &(order, _)) in shown.iter().enumerate() {
        let colour = Palette99::pick(i).to_rgba();
        let line = |value: fn(&super::solve::Order) -> Option<f64>| -> Vec<(f64, f64)> {
            let of = |point: &super::Point| {
                let found = point.solved.orders.iter().find(|each| each.order == order)?;
                Some((point.at, value(found)?))
            };
            curve.points.iter().filter_map(of).collect()
        };
        chart
            .draw_series(LineSeries::new(line(|order| Some(order.mean)), colour.stroke_width(3)))?
            .label(format!("order {order}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(3)));
        chart.draw_series(DashedLineSeries::new(line(|order| order.te), 8, 4, colour.stroke_width(1)))?;
        chart.draw_series(DashedLineSeries::new(line(|order| order.tm), 2, 3, colour.stroke_width(1)))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    root.present()
}
