//! Advice in the message of a refused build: changes that would bring its cost within the limit.
//!
//! A *build limit* is a factor, at least 1, on the default limits of memory and time ([`BuildDemand::check`]). Users
//! set it by the parameter `build_limit`. [`Estimate::limit`] is the smallest build limit that allows a build. Lengths
//! in a [`BuildDemand`] are `magnification` times those that the user gave; advice states the user's.

use super::estimate::{BUILD_LIMIT, BuildDemand, Estimate};

/// Peak-to-valley height in µm from which on the advice asks whether the given heights are in nm. Chosen: reliefs that
/// diffract are much shallower. Larger values miss mistakes; smaller ones ask about reliefs that are merely deep.
const DEEP_UM: f64 = 10.0;
/// Relative errors of the tables (`tolerance`) that may be advised, ascending. Chosen: round numbers.
const TOLERANCES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Coherence lengths in µm that may be advised, descending. Chosen: round numbers, and the default, 65.
const COHERENCE_LENGTHS_UM: [f64; 10] = [3e4, 1e4, 3e3, 1e3, 300.0, 100.0, 65.0, 30.0, 10.0, 3.0];
/// Smallest number of pixels along the longer side that may be advised. Chosen: fewer pixels rarely represent a
/// relief; a larger number would keep helpful advice back.
const PIXELS_MIN: usize = 64;

impl BuildDemand {
    /// Text that names changes, any one of which is enough for the build to be allowed at `build_limit`. `estimate` is
    /// the cost of the refused build.
    pub(super) fn advice(&self, estimate: Estimate, build_limit: f64) -> String {
        let fits = |changed: &Self| changed.estimate().limit() <= build_limit;
        let mut changes = Vec::new();
        // The smallest tolerance above the given one, and the longest coherence length below the given one, that fit.
        let looser = TOLERANCES
            .into_iter()
            .filter(|&tolerance| tolerance > self.tolerance)
            .find(|&tolerance| fits(&Self { tolerance, ..self.clone() }));
        changes.extend(looser.map(|tolerance| format!("a tolerance of {tolerance}")));
        let shorter_um = COHERENCE_LENGTHS_UM.into_iter().find(|length_um| {
            let coherence_length_um = length_um * self.magnification;
            coherence_length_um < self.coherence_length_um && fits(&Self { coherence_length_um, ..self.clone() })
        });
        changes.extend(shorter_um.map(|length_um| format!("a coherence length of {length_um} µm")));
        // Fewer pixels would save little of the cost of a grating, which has one row or column of them.
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
        // The relief that the user meant, if its heights are in nm but were read in µm.
        let thousandth = Self { range_um: self.range_um * 1e-3, ..self.clone() };
        let height_um = self.range_um / self.magnification;
        if height_um >= DEEP_UM && fits(&thousandth) {
            let (given, meant) = (four_digits(height_um), four_digits(height_um * 1e-3));
            advice += &format!(". Is the height in µm? It is {given} µm; {meant} µm would do");
        }
        advice
    }

    /// Demand of an equally large relief with half as many pixels along each axis, rounded up.
    fn coarser(&self) -> Self {
        let halved = |count: usize, pixel_um: f64| {
            let half = count.div_ceil(2);
            (half, pixel_um * count as f64 / half as f64)
        };
        let ((nx, dx_um), (ny, dy_um)) = (halved(self.size.0, self.pixel_um.0), halved(self.size.1, self.pixel_um.1));
        Self { size: (nx, ny), pixel_um: (dx_um, dy_um), ..self.clone() }
    }
}

/// Rounds a build limit, at least 1, up to two significant digits.
fn rounded_up(limit: f64) -> f64 {
    let unit = 10f64.powf(limit.log10().floor() - 1.0);
    // Tenths are divided by 10, since a product with the unit 0.1 may print as 1.2000000000000002.
    if unit >= 1.0 { (limit / unit).ceil() * unit } else { (limit * 10.0).ceil() / 10.0 }
}

/// Formats a positive number with at least four significant digits, without trailing zeros after the decimal point.
fn four_digits(value: f64) -> String {
    let decimals = (3.0 - value.log10().floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}
