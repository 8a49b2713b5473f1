//! Advice in the message of a refused build: changes that would bring its cost below the limit.

use super::estimate::{BUILD_LIMIT, BuildDemand, Estimate};

/// Range of heights in µm from which the advice asks whether they are in nm. Reliefs that diffract are far shallower.
const DEEP_UM: f64 = 10.0;
/// Tolerances that may be advised.
const TOLERANCES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Coherence lengths in µm that may be advised: round numbers and the default.
const COHERENCE_LENGTHS_UM: [f64; 10] = [3e4, 1e4, 3e3, 1e3, 300.0, 100.0, 65.0, 30.0, 10.0, 3.0];
/// Fewest pixels along the longer side that may be advised.
const PIXELS_MIN: usize = 64;

impl BuildDemand {
    /// Names the changes that, each alone, bring the build below the limit.
    pub(super) fn advice(&self, estimate: Estimate, build_limit: f64) -> String {
        let fits = |changed: &Self| changed.estimate().limit() <= build_limit;
        let mut changes = Vec::new();
        let looser = TOLERANCES.into_iter().filter(|tolerance| *tolerance > self.tolerance);
        let looser = looser.map(|tolerance| Self { tolerance, ..self.clone() }).find(fits);
        changes.extend(looser.map(|changed| format!("a tolerance of {}", changed.tolerance)));
        let shorter = COHERENCE_LENGTHS_UM.into_iter().filter(|length_um| *length_um < self.coherence_length_um);
        let shorter = shorter.map(|coherence_length_um| Self { coherence_length_um, ..self.clone() }).find(fits);
        changes.extend(shorter.map(|changed| format!("a coherence length of {} µm", changed.coherence_length_um)));
        // The pixels of a grating, one row or column, cost little.
        if self.size.0.min(self.size.1) > 1 {
            let coarser = std::iter::successors(Some(self.coarser()), |changed| Some(changed.coarser()))
                .take_while(|changed| changed.size.0.max(changed.size.1) >= PIXELS_MIN)
                .find(fits);
            changes.extend(coarser.map(|changed| format!("{} × {} pixels", changed.size.0, changed.size.1)));
        }
        let limit = estimate.limit();
        if limit <= *BUILD_LIMIT.end() {
            changes.push(format!("a build_limit of {}", rounded_up(limit)));
        }
        let mut advice = match changes.pop() {
            None => "nothing but another relief would do".to_owned(),
            Some(last) if changes.is_empty() => format!("{last} would do"),
            Some(last) => format!("{} or {last} would do", changes.join(", ")),
        };
        let in_nm = Self { range_um: self.range_um * 1e-3, ..self.clone() };
        if self.range_um >= DEEP_UM && fits(&in_nm) {
            let (found, meant) = (four_digits(self.range_um), four_digits(in_nm.range_um));
            advice += &format!(". Is the height in µm? It is {found} µm; {meant} µm would do");
        }
        advice
    }

    /// The relief in pixels of twice the size.
    fn coarser(&self) -> Self {
        let halved = |count: usize, pixel_um: f64| {
            let half = count.div_ceil(2);
            (half, pixel_um * count as f64 / half as f64)
        };
        let (x, y) = (halved(self.size.0, self.pixel_um.0), halved(self.size.1, self.pixel_um.1));
        Self { size: (x.0, y.0), pixel_um: (x.1, y.1), ..self.clone() }
    }
}

/// Rounds up to two digits.
fn rounded_up(value: f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    // Below ten in tenths, where a product with the unit would show its rounding.
    if unit >= 1.0 { (value / unit).ceil() * unit } else { (value * 10.0).ceil() / 10.0 }
}

/// Formats a positive number with four significant digits, without trailing zeros.
fn four_digits(value: f64) -> String {
    let decimals = (3.0 - value.log10().floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

/// A number of any size with few digits, for messages; at least 0.1.
pub(super) struct RoundNumber(pub f64);

impl std::fmt::Display for RoundNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            value if value.is_nan() || value > 1e15 => f.write_str("more than 1e15"),
            value if value >= 1e5 => write!(f, "{value:.0e}"),
            value if value >= 10.0 => write!(f, "{value:.0}"),
            value => write!(f, "{:.1}", value.max(0.1)),
        }
    }
}
