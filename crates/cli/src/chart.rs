//! Charts as SVG: axes with ticks, curves, cells (filled rectangles), dots and a legend.
//!
//! A drawing has one or more charts. The plot area of a chart lies inside margins for title and labels. Title and
//! labels are placed by literal offsets in pixels, which fit the margins and [`FONT_SIZE`]. Positions are in pixels
//! with y downwards. An [`Axis`] maps a value to a fraction of the plot area's side. Cells, curves and dots outside the
//! plot area are clipped.

use svg::node::element::{Circle, Group, Line, Polyline, Rectangle, SVG, Text};
use svg::{Document, Node};

/// Space left of the plot area in pixels, for the tick labels and the label of the y axis.
const LEFT: f64 = 70.0;
/// Space right of the plot area in pixels.
const RIGHT: f64 = 20.0;
/// Space above the plot area in pixels, for the title.
const TOP: f64 = 34.0;
/// Space below the plot area in pixels, for the tick labels and the label of the x axis.
const BOTTOM: f64 = 48.0;
/// Height of the text in pixels.
const FONT_SIZE: f64 = 12.0;
/// Height of a line of the legend in pixels.
const LEGEND_LINE: f64 = 16.0;
/// Mean width of a character in pixels, from which the width of the legend is estimated.
const CHARACTER_WIDTH: f64 = 6.6;
/// Largest number of tick intervals of a linear axis. More would crowd the labels.
const TICKS_MAX: f64 = 9.0;

/// An axis with a label, from the value `first` (left or bottom) to the larger value `last` (right or top).
pub(crate) struct Axis {
    label: &'static str,
    first: f64,
    last: f64,
    is_logarithmic: bool,
}

impl Axis {
    /// A linear axis. A range of a single value is widened to a length of 1, with the value in the middle.
    pub(crate) fn linear(label: &'static str, (first, last): (f64, f64)) -> Self {
        let margin = if first == last { 0.5 } else { 0.0 };
        Self { label, first: first - margin, last: last + margin, is_logarithmic: false }
    }

    /// A logarithmic axis. Both ends of the range are positive and differ.
    pub(crate) fn logarithmic(label: &'static str, (first, last): (f64, f64)) -> Self {
        Self { label, first, last, is_logarithmic: true }
    }

    /// The position of a value on the axis: 0 at its first value, 1 at its last.
    fn fraction(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            (value / self.first).ln() / (self.last / self.first).ln()
        } else {
            (value - self.first) / (self.last - self.first)
        }
    }

    /// The values that have a tick, with their labels: powers of ten on a logarithmic axis, else multiples of a round
    /// step.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.is_logarithmic {
            let exponents = self.first.log10().ceil() as i32..=self.last.log10().floor() as i32;
            return exponents.map(|exponent| 10f64.powi(exponent)).map(|value| (value, value.to_string())).collect();
        }
        // The smallest step of 1, 2 or 5 times a power of ten with at most TICKS_MAX intervals.
        let span = self.last - self.first;
        let power = 10f64.powf((span / TICKS_MAX).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| span / step <= TICKS_MAX);
        // Ten times `power` exceeds span/TICKS_MAX, so only rounding could leave no step.
        let step = step.unwrap_or(span);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        // First and last tick as multiples of the step. The margin keeps ticks at the ends of the axis in spite of
        // rounding.
        const MARGIN: f64 = 1e-9;
        let (first, last) = ((self.first / step - MARGIN).ceil() as i64, (self.last / step + MARGIN).floor() as i64);
        (first..=last).map(|i| i as f64 * step).map(|value| (value, format!("{value:.decimals$}"))).collect()
    }
}

/// The stroke of a curve.
#[derive(Clone, Copy)]
pub(crate) struct Stroke {
    /// Colour in the notation of SVG.
    pub(crate) colour: &'static str,
    /// Width in pixels.
    pub(crate) width: f64,
    /// Lengths of dashes and gaps in pixels, as in `stroke-dasharray`; empty for a solid line.
    pub(crate) dashes: &'static str,
}

impl Stroke {
    /// A solid line.
    pub(crate) fn solid(colour: &'static str, width: f64) -> Self {
        Self { colour, width, dashes: "" }
    }
}

/// The corner of the plot area in which the legend lies.
#[derive(Clone, Copy)]
pub(crate) enum Corner {
    UpperLeft,
    UpperRight,
    LowerLeft,
}

/// A chart under construction. Later marks cover earlier ones.
pub(crate) struct Chart {
    x: Axis,
    y: Axis,
    /// Width and height of the plot area in pixels.
    area: (f64, f64),
    title: String,
    /// Filled rectangles, above the grid and below the marks, in pixels from the plot area's upper left corner.
    cells: Group,
    /// Curves and dots, in pixels from the plot area's upper left corner.
    marks: Group,
    /// Symbol and text of each line of the legend. Symbols extend from −10 to 10 pixels around their origin.
    legend: Vec<(Group, String)>,
}

impl Chart {
    /// An empty chart of `size` (width, height) in pixels, which is larger than the margins.
    pub(crate) fn new(size: (u32, u32), title: &str, x: Axis, y: Axis) -> Self {
        let area = (f64::from(size.0) - LEFT - RIGHT, f64::from(size.1) - TOP - BOTTOM);
        // Neighbouring cells must not show a seam.
        let cells = Group::new().set("shape-rendering", "crispEdges");
        Self { x, y, area, title: title.to_owned(), cells, marks: Group::new(), legend: Vec::new() }
    }

    /// Position in pixels of a point `(x, y)` in values of the axes, from the plot area's upper left corner. It is
    /// rounded to a hundredth of a pixel, since more digits would only make the file larger.
    fn to_pixels(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let round = |position: f64| (100.0 * position).round() / 100.0;
        (round(self.area.0 * self.x.fraction(x)), round(self.area.1 * (1.0 - self.y.fraction(y))))
    }

    /// Draws a curve through points in values of the axes.
    pub(crate) fn curve(&mut self, points: impl IntoIterator<Item = (f64, f64)>, stroke: Stroke) {
        let positions = points.into_iter().map(|point| self.to_pixels(point)).map(|(x, y)| format!("{x},{y}"));
        let line = Polyline::new().set("points", positions.collect::<Vec<_>>()).set("fill", "none");
        self.marks.append(stroked(line, stroke));
    }

    /// Fills the rectangle between two opposite corners, which are in values of the axes.
    pub(crate) fn cell(&mut self, corner: (f64, f64), opposite: (f64, f64), colour: &str) {
        let ((x0, y0), (x1, y1)) = (self.to_pixels(corner), self.to_pixels(opposite));
        let cell = Rectangle::new().set("x", x0.min(x1)).set("y", y0.min(y1));
        let cell = cell.set("width", (x1 - x0).abs()).set("height", (y1 - y0).abs()).set("fill", colour);
        self.cells.append(cell);
    }

    /// Draws a filled disc of `radius` pixels around a point in values of the axes.
    pub(crate) fn disc(&mut self, centre: (f64, f64), radius: f64, colour: &str) {
        self.marks.append(disc(self.to_pixels(centre), radius).set("fill", colour));
    }

    /// Draws a circle of `radius` pixels around a point in values of the axes.
    pub(crate) fn circle(&mut self, centre: (f64, f64), radius: f64, stroke: Stroke) {
        self.marks.append(stroked(disc(self.to_pixels(centre), radius).set("fill", "none"), stroke));
    }

    /// Adds a line to the legend: a stroke and its meaning.
    pub(crate) fn explain_stroke(&mut self, stroke: Stroke, text: impl Into<String>) {
        let sample = Line::new().set("x1", -10).set("x2", 10).set("y1", 0).set("y2", 0);
        self.legend.push((Group::new().add(stroked(sample, stroke)), text.into()));
    }

    /// Adds a line to the legend: a disc of a colour and its meaning.
    pub(crate) fn explain_disc(&mut self, colour: &str, text: impl Into<String>) {
        self.legend.push((Group::new().add(disc((0.0, 0.0), 4.0).set("fill", colour)), text.into()));
    }

    /// The whole chart, with its legend in a corner of the plot area.
    pub(crate) fn into_group(mut self, corner: Corner) -> Group {
        let legend = self.legend_box(corner);
        let (width, height) = self.area;
        let mut chart = Group::new().set("transform", format!("translate({LEFT} {TOP})"));
        chart.append(text_at(&self.title, (0.5 * width, -12.0)).set("font-size", 18));
        for (value, text) in self.x.ticks() {
            let x = self.to_pixels((value, self.y.first)).0;
            chart.append(grid_line((x, 0.0), (x, height + 5.0)));
            chart.append(text_at(&text, (x, height + 18.0)));
        }
        for (value, text) in self.y.ticks() {
            let y = self.to_pixels((self.x.first, value)).1;
            chart.append(grid_line((-5.0, y), (width, y)));
            chart.append(text_at(&text, (-9.0, y + 4.0)).set("text-anchor", "end"));
        }
        chart.append(text_at(self.x.label, (0.5 * width, height + 38.0)));
        let y_label = text_at(self.y.label, (0.0, 0.0));
        chart.append(y_label.set("transform", format!("translate(-52 {}) rotate(-90)", 0.5 * height)));
        let frame = Rectangle::new().set("width", width).set("height", height).set("fill", "none");
        // A nested `svg` element clips the marks to the plot area.
        let clipped = SVG::new().set("width", width).set("height", height);
        let clipped = clipped.add(self.cells).add(self.marks).add(legend);
        chart.add(clipped).add(frame.set("stroke", "black"))
    }

    /// Takes the legend out of the chart: a box with a pale background, 8 pixels from the edges of the plot area. A
    /// line has its symbol around x = 18 and its text from x = 34 on, in pixels from the left edge of the box.
    fn legend_box(&mut self, corner: Corner) -> Group {
        let lines = std::mem::take(&mut self.legend);
        let longest = lines.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
        let (width, height) = (40.0 + CHARACTER_WIDTH * longest as f64, 8.0 + LEGEND_LINE * lines.len() as f64);
        let x = if matches!(corner, Corner::UpperRight) { self.area.0 - width - 8.0 } else { 8.0 };
        let y = if matches!(corner, Corner::LowerLeft) { self.area.1 - height - 8.0 } else { 8.0 };
        let background = Rectangle::new().set("width", width).set("height", height).set("fill", "white");
        let mut legend = Group::new().set("transform", format!("translate({x} {y})"));
        legend.append(background.set("fill-opacity", 0.85).set("stroke", "#ccc"));
        for (i, (symbol, text)) in lines.into_iter().enumerate() {
            let middle = 4.0 + LEGEND_LINE * (i as f64 + 0.5);
            legend.append(symbol.set("transform", format!("translate(18 {middle})")));
            legend.append(text_at(&text, (34.0, middle + 4.0)).set("text-anchor", "start"));
        }
        legend
    }
}

/// The SVG of charts in rows of at most `columns` (1 or more). `size` is the width and height of each chart in pixels.
pub(crate) fn drawing(charts: Vec<Group>, size: (u32, u32), columns: usize) -> String {
    let columns = charts.len().clamp(1, columns);
    let rows = charts.len().div_ceil(columns);
    let (width, height) = (size.0 as usize * columns, size.1 as usize * rows);
    let mut document = Document::new().set("width", width).set("height", height);
    document.append(Rectangle::new().set("width", width).set("height", height).set("fill", "white"));
    for (i, chart) in charts.into_iter().enumerate() {
        let (x, y) = (i % columns * size.0 as usize, i / columns * size.1 as usize);
        document.append(Group::new().set("transform", format!("translate({x} {y})")).add(chart));
    }
    let document = document.set("font-family", "sans-serif").set("font-size", FONT_SIZE);
    document.set("text-anchor", "middle").to_string()
}

/// An SVG circle without fill and stroke, which callers set.
fn disc((x, y): (f64, f64), radius: f64) -> Circle {
    Circle::new().set("cx", x).set("cy", y).set("r", radius)
}

/// A text with the middle of its baseline at a position, since [`drawing`] sets the anchor to the middle. A text whose
/// baseline is 4 pixels below a line is centred on the line.
fn text_at(text: &str, (x, y): (f64, f64)) -> Text {
    Text::new(text).set("x", x).set("y", y)
}

/// A pale line.
fn grid_line((x1, y1): (f64, f64), (x2, y2): (f64, f64)) -> Line {
    Line::new().set("x1", x1).set("y1", y1).set("x2", x2).set("y2", y2).set("stroke", "#ccc")
}

/// The element with a stroke.
fn stroked<N: Node>(mut element: N, stroke: Stroke) -> N {
    element.assign("stroke", stroke.colour);
    element.assign("stroke-width", stroke.width);
    if !stroke.dashes.is_empty() {
        element.assign("stroke-dasharray", stroke.dashes);
    }
    element
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers() {
        assert_eq!(labels(&Axis::linear("", (380.0, 779.0))), ["400", "450", "500", "550", "600", "650", "700", "750"]);
        assert_eq!(labels(&Axis::linear("", (0.0, 0.31))), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(labels(&Axis::linear("", (-0.4, 0.4)))[..2], ["-0.4", "-0.3"]);
    }

    #[test]
    fn a_single_value_lies_in_the_middle_of_a_linear_axis() {
        let axis = Axis::linear("", (500.0, 500.0));
        assert_eq!(axis.fraction(500.0), 0.5);
        assert!(labels(&axis).contains(&"500.0".to_owned()), "{:?}", labels(&axis));
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        let axis = Axis::logarithmic("", (0.008, 130.0));
        assert_eq!(labels(&axis), ["0.01", "0.1", "1", "10", "100"]);
        // 1/0.008 = 125 and 130/0.008 = 16250.
        assert!((axis.fraction(1.0) - (125f64.ln() / 16250f64.ln())).abs() < 1e-12);
    }

    #[test]
    fn titles_are_escaped() {
        let chart = Chart::new((200, 200), "a < b", Axis::linear("x", (0.0, 1.0)), Axis::linear("y", (0.0, 1.0)));
        assert!(drawing(vec![chart.into_group(Corner::UpperLeft)], (200, 200), 1).contains("a &lt; b"));
    }
}
