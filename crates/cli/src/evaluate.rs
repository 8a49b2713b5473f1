//! `sunbeam evaluate`: a check of a method, in which the brightest angles are compared with the grating equation.
//!
//! The check follows Single 2014 (M. Single, *An Interactive Shader for Natural Diffraction Gratings*, Bern).
//!
//! Symbols:
//!
//! - θi, θr: the angles of incidence and of view with the normal, both in the xz plane, positive on the side of +x;
//! - λ: the wavelength;
//! - d: the spacing of the grating;
//! - S/λ²: the *response* of the relief in 1/sr, with its power spectrum S in µm². It is the reflectance `f_r` without
//!   the Fresnel, obliquity and shadowing factors.
//!
//! The first order of the grating leaves where λ = d·(sin θi + sin θr); order zero is the mirror direction. The relief
//! is given as a *tile*, a rectangle that may hold many grooves. A repeated tile has its own orders, which are denser
//! than those of the grating. The *dominant period* is the strongest in the power spectrum of the heights along x.

mod plot;

use super::arguments::{VISIBLE_NM, out_of_range};
use super::encode;
use super::method_args::{Method, MethodArgs, Quantity};
use super::output::{Output, output};
use super::reflector::{Purpose, Reflector};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use ndarray::Array2;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::time::Instant;
use sunbeam::config::{SurfaceConfig, Theory};
use sunbeam::methods::MethodKind;
use sunbeam::scattering::ComplexIndex;
use sunbeam::table::Tiling;
use sunbeam::transform::periods;

/// Accepted steps between angles, in degrees. Coarser steps blur the angles of the peaks; finer ones only cost time.
const ANGLE_STEP_DEG: RangeInclusive<f64> = 1e-4..=1.0;
/// Accepted steps between wavelengths, in nm. Coarser steps leave few wavelengths for the mean; finer ones only cost
/// time.
const WAVELENGTH_STEP_NM: RangeInclusive<f64> = 0.1..=20.0;
/// Margin of the default range of angles beyond the angles of the first order, in degrees. It shows both sides of the
/// peaks, while larger margins could include other orders.
const MARGIN_DEG: f64 = 1.0;
/// Largest angle of the default range, in degrees: the horizon is left out.
const ANGLE_MAX_DEG: f64 = 89.0;
/// Largest number of values that are computed: 800 MB in double precision, and twice that while --response is written.
const VALUES_MAX: f64 = 1e8;

/// Find the spacing of a grating from the angles at which its colours are brightest
///
/// Light comes in at --theta-i in the plane of x. The first order leaves at sin θr = λ/d − sin θi, which is negative on
/// the side opposite the light. For each wavelength λ from 380 to below 780 nm, θr is the angle of the largest
/// response, and the spacing is d = λ/(sin θi + sin θr). Prints the mean and the variance of d over the wavelengths as
/// JSON, with the angles.
///
/// The method nmm has values only at the angles at which λ = |u|L/n for a whole n, with the tile's length L and
/// u = sin θi + sin θr.
#[derive(clap::Args)]
pub(crate) struct EvaluateArgs {
    /// Angle of incidence with the normal in degrees, in [0, 90)
    #[arg(long, value_name = "DEGREES", default_value_t = 75.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Range of the angles of view in degrees, MAX excluded; negative opposite the incident light, where order zero
    /// leaves [default: the first order of the dominant period along x]
    #[arg(long, value_name = "MIN,MAX", allow_hyphen_values = true, value_parser = range)]
    angles: Option<(f64, f64)>,
    /// Step between angles in degrees, 0.0001 to 1
    #[arg(long, value_name = "DEGREES", default_value_t = 0.01, allow_negative_numbers = true)]
    angle_step: f64,
    /// Step between wavelengths in nm, 0.1 to 20
    #[arg(long, value_name = "NM", default_value_t = 1.0, allow_negative_numbers = true)]
    wavelength_step: f64,
    /// File for a plot of the response over wavelength and angle, with the brightest angles and the grating equation
    /// (.svg)
    #[arg(long, value_name = "FILE", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// File for the response as float32 (wavelengths, angles) in 1/sr (.npy)
    #[arg(long, value_name = "FILE", value_parser = output(&["npy"]))]
    response: Option<Output>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report<'a> {
    method: &'static str,
    theta_i_deg: f64,
    /// Range of the angles of view, the end excluded.
    angles_deg: (f64, f64),
    angle_step_deg: f64,
    #[serde(flatten)]
    spacing: Spacing,
    /// The dominant period of the heights along x, to be compared with the spacing; `None` where there is none.
    period_nm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plot: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    response: &'a Option<Output>,
    wavelengths_nm: &'a [f64],
    /// Angle of view with the largest response at each wavelength.
    peaks_deg: Vec<f64>,
    /// Angle of view at which the first order of the mean spacing leaves, at each wavelength.
    grating_deg: Vec<f64>,
    /// Wall-clock time of the command.
    seconds: f64,
}

/// Mean and variance of the spacing d over the wavelengths.
#[derive(Clone, Copy, Serialize)]
struct Spacing {
    mean_nm: f64,
    variance_nm2: f64,
}

impl Spacing {
    /// The spacing by the grating equation, from the angle of the peak at each wavelength. At least one wavelength is
    /// needed; [`steps`] always gives one. `sin_i` is sin θi. The divisor is 0 at order zero, θr = −θi;
    /// [`EvaluateArgs::check_peaks`] refuses peaks there.
    fn new(wavelengths_nm: &[f64], peaks_deg: &[f64], sin_i: f64) -> Self {
        let spacing = |(nm, peak): (&f64, &f64)| nm / (sin_i + peak.to_radians().sin());
        let spacings: Vec<f64> = wavelengths_nm.iter().zip(peaks_deg).map(spacing).collect();
        let mean_nm = spacings.iter().sum::<f64>() / spacings.len() as f64;
        let variance_nm2 = spacings.iter().map(|d| (d - mean_nm).powi(2)).sum::<f64>() / spacings.len() as f64;
        Self { mean_nm, variance_nm2 }
    }

    /// The angle of view in degrees at which the first order of the mean spacing leaves; ±90° if that order is
    /// evanescent.
    fn angle_deg(&self, wavelength_nm: f64, sin_i: f64) -> f64 {
        (wavelength_nm / self.mean_nm - sin_i).clamp(-1.0, 1.0).asin().to_degrees()
    }
}

/// The response of a method over wavelengths and angles.
struct Response {
    wavelengths_nm: Vec<f64>,
    angles_deg: Vec<f64>,
    /// `S/λ²` in 1/sr, `[wavelength][angle]`.
    values: Vec<Vec<f64>>,
}

impl Response {
    /// The angle of view with the largest value at each wavelength.
    fn peaks_deg(&self) -> Vec<f64> {
        let peak = |row: &Vec<f64>| row.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        self.values.iter().map(|row| self.angles_deg[peak(row)]).collect()
    }

    /// The values in single precision, `[wavelength, angle]`.
    fn array(&self) -> Array2<f32> {
        let shape = (self.wavelengths_nm.len(), self.angles_deg.len());
        Array2::from_shape_fn(shape, |(i, j)| self.values[i][j] as f32)
    }
}

/// Runs `sunbeam evaluate`.
pub(crate) fn run(args: &EvaluateArgs) -> Outcome {
    let start = Instant::now();
    args.check()?;
    let options = args.method.options(Quantity::Spectrum)?;
    let config = args.surface.config()?;
    let field = config.height_field()?;
    let period_um = periods(&field, config.tiling() == Tiling::Periodic).x.map(|period| period.period_um);
    let (low_deg, high_deg) = args.range_deg(period_um)?;
    let wavelengths_nm = steps(*VISIBLE_NM.start(), *VISIBLE_NM.end(), args.wavelength_step);
    let angles_deg = steps(low_deg, high_deg, args.angle_step);
    if (wavelengths_nm.len() * angles_deg.len()) as f64 > VALUES_MAX {
        return Err("there are more than 1e8 pairs of an angle and a wavelength: use larger steps".into());
    }
    refuse_without_interface(&config)?;
    let reflector = Reflector::new(&args.surface, args.method.method(), &options, Purpose::Map)?;
    let values = args.response_values(&reflector, field.size().0, field.extent_um().0, &wavelengths_nm, &angles_deg);
    let response = Response { wavelengths_nm, angles_deg, values };
    let peaks_deg = response.peaks_deg();
    args.check_peaks(&response, &peaks_deg)?;
    let sin_i = args.theta_i.to_radians().sin();
    let spacing = Spacing::new(&response.wavelengths_nm, &peaks_deg, sin_i);
    let grating_deg: Vec<f64> = response.wavelengths_nm.iter().map(|nm| spacing.angle_deg(*nm, sin_i)).collect();
    if let Some(file) = &args.plot {
        file.write(plot::svg(&response, &peaks_deg, &grating_deg).as_bytes())?;
    }
    if let Some(file) = &args.response {
        file.write(&encode::npy(&response.array())?)?;
    }
    print_json(&Report {
        method: args.method.method().name(),
        theta_i_deg: args.theta_i,
        angles_deg: (low_deg, high_deg),
        angle_step_deg: args.angle_step,
        spacing,
        period_nm: period_um.map(|um| 1e3 * um),
        plot: &args.plot,
        response: &args.response,
        wavelengths_nm: &response.wavelengths_nm,
        peaks_deg,
        grating_deg,
        seconds: start.elapsed().as_secs_f64(),
    })
}

impl EvaluateArgs {
    /// Refuses arguments out of range.
    fn check(&self) -> Result<(), String> {
        if !(0.0..90.0).contains(&self.theta_i) {
            return Err(out_of_range("theta-i", self.theta_i, "in [0, 90) degrees"));
        }
        if !ANGLE_STEP_DEG.contains(&self.angle_step) {
            return Err(out_of_range("angle-step", self.angle_step, "0.0001 to 1 degrees"));
        }
        if !WAVELENGTH_STEP_NM.contains(&self.wavelength_step) {
            return Err(out_of_range("wavelength-step", self.wavelength_step, "0.1 to 20 nm"));
        }
        Ok(())
    }

    /// Range of the angles of view in degrees: the given one, or that of the first order of the dominant period along
    /// x in µm.
    fn range_deg(&self, period_um: Option<f64>) -> Result<(f64, f64), String> {
        match (self.angles, period_um) {
            (Some(angles), _) => Ok(angles),
            (None, Some(um)) => first_order_range(self.theta_i, um).ok_or_else(|| {
                format!("no visible first order of the period of {um} µm leaves: parameter \"angles\" is needed")
            }),
            (None, None) => Err("the surface has no period along x: parameter \"angles\" is needed".to_owned()),
        }
    }

    /// Refuses a response that is dark at a wavelength, and one that is brightest in order zero.
    fn check_peaks(&self, response: &Response, peaks_deg: &[f64]) -> Result<(), String> {
        if let Some(row) = response.values.iter().position(|row| row.iter().all(|value| *value == 0.0)) {
            let nm = response.wavelengths_nm[row];
            return Err(format!("no light leaves at {nm} nm: parameter \"angles\" needs a wider range"));
        }
        let is_order_zero = |peak_deg: &f64| (peak_deg + self.theta_i).abs() < 0.5 * self.angle_step;
        if let Some(row) = peaks_deg.iter().position(is_order_zero) {
            let nm = response.wavelengths_nm[row];
            let advice = "which leaves there at every wavelength: parameter \"angles\" must leave it out";
            return Err(format!("the brightest angle at {nm} nm is {}°, that of order zero, {advice}", -self.theta_i));
        }
        Ok(())
    }

    /// `S/λ²` in 1/sr, `[wavelength][angle of view]`. Along x, the tile has `pixels_x` pixels and the length `tile_um`.
    ///
    /// The method nmm has values only where an order of the tile leaves. Its rows are 0 except at the angles nearest to
    /// these orders.
    fn response_values(
        &self,
        reflector: &Reflector,
        pixels_x: usize,
        tile_um: f64,
        wavelengths_nm: &[f64],
        angles_deg: &[f64],
    ) -> Vec<Vec<f64>> {
        let (sin_i, cos_i) = self.theta_i.to_radians().sin_cos();
        let is_nmm = matches!(self.method.method(), Method::Colour(MethodKind::Nmm));
        reflector.map(wavelengths_nm, |nm| {
            let value = |angle_deg: &f64| {
                let (sin_r, cos_r) = angle_deg.to_radians().sin_cos();
                reflector.relief_spectral([sin_i, 0.0, cos_i], [sin_r, 0.0, cos_r], *nm)
            };
            if !is_nmm {
                return angles_deg.iter().map(value).collect();
            }
            let mut row = vec![0.0; angles_deg.len()];
            // A tile of one pixel along x has none of the orders below. It has order zero alone, which leaves at every
            // wavelength, so nmm selects none.
            if pixels_x > 1 {
                for sin_r in order_sines(1e-3 * nm / tile_um, sin_i) {
                    if let Some(i) = nearest(angles_deg, self.angle_step, sin_r.asin().to_degrees()) {
                        row[i] = value(&angles_deg[i]);
                    }
                }
            }
            row
        })
    }
}

/// Refuses the rigorous theory for a material with the index of the medium above it: the response is 0 everywhere. By
/// the scalar theory, the response S/λ² does not depend on the index.
fn refuse_without_interface(config: &SurfaceConfig) -> Result<(), String> {
    let has_no_interface = config.index_inside().is_some_and(|index| index == ComplexIndex { eta: 1.0, k: 0.0 });
    if config.theory == Theory::Rigorous && has_no_interface {
        let eta = config.eta.unwrap_or(1.0);
        return Err(format!(
            "parameter \"eta\" is {eta}, the index of the medium above the relief, and nothing is reflected: --theory \
             scalar or another index would do"
        ));
    }
    Ok(())
}

/// The values `low`, `low + step`, … below `high`, which is larger than `low`. Their number is `⌈(high − low)/step⌉`,
/// as in Single 2014.
fn steps(low: f64, high: f64, step: f64) -> Vec<f64> {
    // The subtraction keeps rounding from adding a step where the quotient is a whole number. `low` is always a value.
    let count = ((high - low) / step - 1e-9).ceil().max(1.0) as usize;
    (0..count).map(|i| low + i as f64 * step).collect()
}

/// The values sin θr of the orders of the tile, except for order zero. For order n, `sin θi + sin θr` is `n·sine_step`,
/// where `sine_step` is the wavelength over the tile's length.
fn order_sines(sine_step: f64, sin_i: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (((sin_i - 1.0) / sine_step).ceil() as i64, ((sin_i + 1.0) / sine_step).floor() as i64);
    (first..=last).filter(|n| *n != 0).map(move |n| n as f64 * sine_step - sin_i)
}

/// The index of the angle nearest to `angle_deg` in the uniform grid `angles_deg`; `None` for an angle that lies more
/// than half a step outside the grid.
fn nearest(angles_deg: &[f64], step_deg: f64, angle_deg: f64) -> Option<usize> {
    let index = ((angle_deg - angles_deg[0]) / step_deg).round();
    (index >= 0.0 && index < angles_deg.len() as f64).then_some(index as usize)
}

/// Range of the angles of view of the first order over the visible wavelengths, in whole degrees with a margin of at
/// least [`MARGIN_DEG`]. `None` for a spacing whose first order leaves at no visible wavelength.
fn first_order_range(theta_i_deg: f64, spacing_um: f64) -> Option<(f64, f64)> {
    let angle = |nm: f64| {
        let sin = 1e-3 * nm / spacing_um - theta_i_deg.to_radians().sin();
        // An evanescent order counts as ±90°. The range is empty if the order is evanescent at all wavelengths.
        sin.clamp(-1.0, 1.0).asin().to_degrees()
    };
    let (low, high) = (angle(*VISIBLE_NM.start()) - MARGIN_DEG, angle(*VISIBLE_NM.end()) + MARGIN_DEG);
    let (low, high) = (low.floor().max(-ANGLE_MAX_DEG), high.ceil().min(ANGLE_MAX_DEG));
    (low < high).then_some((low, high))
}

/// Parses `MIN,MAX`, two angles within ±90°.
fn range(text: &str) -> Result<(f64, f64), &'static str> {
    let number = |part: &str| part.trim().parse().ok().filter(|angle: &f64| angle.abs() < 90.0);
    let ends = text.split_once(',').and_then(|(low, high)| Some((number(low)?, number(high)?)));
    ends.filter(|(low, high)| low < high).ok_or("it must be two angles within ±90 degrees, such as -55,-40")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_angles_include_the_first_order_of_the_blazed_grating() {
        // asin(0.38/2.5 − sin 75°) = −54.5° and asin(0.78/2.5 − sin 75°) = −40.8°, each with a margin of 1°.
        assert_eq!(first_order_range(75.0, 2.5), Some((-56.0, -39.0)));
        // At normal incidence, periods below the shortest wavelength have no first order.
        assert_eq!(first_order_range(0.0, 0.3), None);
    }

    #[test]
    fn steps_exclude_their_end() {
        let angles = steps(-55.0, -40.0, 0.01);
        assert_eq!(angles.len(), 1500);
        assert!((angles[1499] + 40.01).abs() < 1e-9);
        assert_eq!(steps(380.0, 780.0, 1.0).len(), 400);
        // 13.33 steps give 14 values.
        assert_eq!(steps(380.0, 780.0, 30.0).last(), Some(&770.0));
        // A range far below a step has one value.
        assert_eq!(steps(-45.0, -45.0 + 1e-13, 0.01), [-45.0]);
    }

    #[test]
    fn nmm_angles_satisfy_the_grating_equation() {
        // A tile of 5 µm at 500 nm: u is a multiple of 0.1 other than 0, between sin 30° − 1 and sin 30° + 1.
        let u: Vec<i64> = order_sines(0.1, 0.5).map(|sin| ((sin + 0.5) * 10.0).round() as i64).collect();
        assert_eq!(u, (-5..=15).filter(|n| *n != 0).collect::<Vec<_>>());
        // Index 60 is 0°, and the last index is 29.5°.
        let angles = steps(-30.0, 30.0, 0.5);
        assert_eq!(nearest(&angles, 0.5, 0.2), Some(60));
        assert_eq!(nearest(&angles, 0.5, 0.3), Some(61));
        assert_eq!((nearest(&angles, 0.5, -31.0), nearest(&angles, 0.5, 29.9)), (None, None));
    }
}
