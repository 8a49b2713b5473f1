//! The check of a method in Single 2014: the angle at which each wavelength is brightest against the grating equation.

mod plot;

use super::encode;
use super::method_args::{Asked, Method, MethodArgs};
use super::output::{Output, output};
use super::reflector::Reflector;
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use ndarray::Array2;
use serde::Serialize;
use sunbeam::methods::MethodKind;
use sunbeam::table::Tiling;
use sunbeam::transform::periods;

/// Accepted steps between angles in degrees.
const ANGLE_STEP_DEG: std::ops::RangeInclusive<f64> = 1e-4..=1.0;
/// How far, in degrees, the angles searched go beyond those of the first order.
const MARGIN_DEG: f64 = 1.0;
/// Most values of the relief that are computed.
const VALUES_MAX: f64 = 1e8;

/// Find the spacing of a grating from the angles at which its colours are brightest
///
/// Light comes in at --theta-i in the plane of x; the first order leaves on the other side of the normal. For each
/// wavelength from 380 to below 780 nm the angle θr of the largest S/λ² is found, and the grating equation gives the spacing
/// d = λ/(sin θi + sin θr). Prints the mean and the variance of d over the wavelengths as JSON, with the curve of peaks.
/// The method nmm answers only where its wavelengths fall: at the angles at which λ = |u|L/n for a whole n, L the tile's
/// length and u = sin θi + sin θr.
#[derive(clap::Args)]
pub struct EvaluateArgs {
    /// Angle of the incident light with the normal in degrees, in [0, 90)
    #[arg(long, value_name = "DEGREES", default_value_t = 75.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// First angle of view in degrees and the end of the angles, which is left out; negative on the far side of the normal
    /// from where order zero leaves [default: those of the first order of the dominant period along x]
    #[arg(long, value_name = "MIN,MAX", allow_hyphen_values = true, value_parser = range)]
    angles: Option<(f64, f64)>,
    /// Step between angles in degrees, 0.0001 to 1
    #[arg(long, value_name = "DEGREES", default_value_t = 0.01, allow_negative_numbers = true)]
    angle_step: f64,
    /// Step between wavelengths in nm, 0.1 to 20
    #[arg(long, value_name = "NM", default_value_t = 1.0, allow_negative_numbers = true)]
    wavelength_step: f64,
    /// The response over wavelength and angle, with the peaks and the grating equation (.svg)
    #[arg(long, value_name = "FILE", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// The response as float32 (wavelengths, angles) in 1/sr (.npy)
    #[arg(long, value_name = "FILE", value_parser = output(&["npy"]))]
    response: Option<Output>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Serialize)]
struct Report<'a> {
    method: &'static str,
    theta_i_deg: f64,
    angles_deg: (f64, f64),
    angle_step_deg: f64,
    /// Of the spacing, over the wavelengths.
    mean_nm: f64,
    variance_nm2: f64,
    /// The dominant period of the heights along x, which the method does not know.
    period_nm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plot: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    response: &'a Option<Output>,
    wavelengths_nm: &'a [f64],
    /// Angle of the brightest response at each wavelength.
    peaks_deg: Vec<f64>,
    /// Angle that the grating equation gives for the mean spacing.
    grating_deg: Vec<f64>,
    seconds: f64,
}

/// The responses of one method over angles and wavelengths.
struct Response {
    wavelengths_nm: Vec<f64>,
    angles_deg: Vec<f64>,
    /// `S/λ²` in 1/sr, `[wavelength][angle]`.
    values: Vec<Vec<f64>>,
}

impl Response {
    /// The angle of the largest value at each wavelength.
    fn peaks_deg(&self) -> Vec<f64> {
        let peak = |row: &Vec<f64>| row.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        self.values.iter().map(|row| self.angles_deg[peak(row)]).collect()
    }

    /// In single precision, `[wavelength, angle]`.
    fn array(&self) -> Array2<f32> {
        let shape = (self.wavelengths_nm.len(), self.angles_deg.len());
        Array2::from_shape_fn(shape, |(i, j)| self.values[i][j] as f32)
    }
}

/// Runs `sunbeam evaluate`.
pub fn run(args: &EvaluateArgs) -> Outcome {
    let start = std::time::Instant::now();
    args.check()?;
    let options = args.method.options(Asked::Spectrum)?;
    let config = args.surface.config()?;
    let field = config.height_field()?;
    let period = periods(&field, config.tiling() == Tiling::Periodic).x;
    let (low, high) = match (args.angles, &period) {
        (Some(angles), _) => angles,
        (None, Some(period)) => first_order(args.theta_i, period.period_um),
        (None, None) => return Err("the surface has no period along x: parameter \"angles\" is needed".into()),
    };
    let wavelengths_nm: Vec<f64> = steps(380.0, 780.0, args.wavelength_step);
    let angles_deg = steps(low, high, args.angle_step);
    if (wavelengths_nm.len() * angles_deg.len()) as f64 > VALUES_MAX {
        return Err("that is more than 1e8 angles and wavelengths together: use larger steps".into());
    }
    let reflector = Reflector::new(&args.surface, args.method.method(), &options, false)?;
    let (sin_i, cos_i) = args.theta_i.to_radians().sin_cos();
    let nmm = matches!(args.method.method(), Method::Realtime(MethodKind::Nmm));
    // A tile of one pixel along x has no order but 0, and so no wavelengths.
    let tile_um = (nmm && field.size().0 > 1).then(|| field.extent_um().0);
    let values: Vec<Vec<f64>> = reflector.map(&wavelengths_nm, |nm| {
        let value = |angle: &f64| {
            let (sin, cos) = angle.to_radians().sin_cos();
            reflector.relief_spectral([sin_i, 0.0, cos_i], [sin, 0.0, cos], *nm)
        };
        if !nmm {
            return angles_deg.iter().map(value).collect();
        }
        let mut row = vec![0.0; angles_deg.len()];
        let sines = tile_um.into_iter().flat_map(|um| order_sines(1e-3 * nm / um, sin_i));
        for i in sines.filter_map(|sin| nearest(&angles_deg, args.angle_step, sin.asin().to_degrees())) {
            row[i] = value(&angles_deg[i]);
        }
        row
    });
    if let Some(dark) = values.iter().position(|row| row.iter().all(|value| *value == 0.0)) {
        return Err(
            format!("nothing leaves at {} nm: parameter \"angles\" must reach further", wavelengths_nm[dark]).into()
        );
    }
    let response = Response { wavelengths_nm, angles_deg, values };
    let peaks_deg = response.peaks_deg();
    let spacings: Vec<f64> = response
        .wavelengths_nm
        .iter()
        .zip(&peaks_deg)
        .map(|(nm, peak)| nm / (sin_i + peak.to_radians().sin()))
        .collect();
    let mean_nm = spacings.iter().sum::<f64>() / spacings.len() as f64;
    let variance_nm2 = spacings.iter().map(|d| (d - mean_nm).powi(2)).sum::<f64>() / spacings.len() as f64;
    let grating = |nm: &f64| (nm / mean_nm - sin_i).clamp(-1.0, 1.0).asin().to_degrees();
    let grating_deg: Vec<f64> = response.wavelengths_nm.iter().map(grating).collect();
    if let Some(file) = &args.plot {
        file.write(plot::svg(&response, &peaks_deg, &grating_deg).as_bytes())?;
    }
    if let Some(file) = &args.response {
        file.write(&encode::npy(&response.array())?)?;
    }
    print_json(&Report {
        method: args.method.method().name(),
        theta_i_deg: args.theta_i,
        angles_deg: (low, high),
        angle_step_deg: args.angle_step,
        mean_nm,
        variance_nm2,
        period_nm: period.map(|period| 1e3 * period.period_um),
        plot: &args.plot,
        response: &args.response,
        wavelengths_nm: &response.wavelengths_nm,
        peaks_deg,
        grating_deg,
        seconds: start.elapsed().as_secs_f64(),
    })
}

impl EvaluateArgs {
    fn check(&self) -> Result<(), String> {
        let refuse = |name: &str, found: f64, accepted: &str| {
            Err(format!("parameter {name:?} is {found}, but must be {accepted}"))
        };
        if !(0.0..90.0).contains(&self.theta_i) {
            return refuse("theta-i", self.theta_i, "in [0, 90) degrees");
        }
        if !ANGLE_STEP_DEG.contains(&self.angle_step) {
            return refuse("angle-step", self.angle_step, "0.0001 to 1 degrees");
        }
        if !(0.1..=20.0).contains(&self.wavelength_step) {
            return refuse("wavelength-step", self.wavelength_step, "0.1 to 20 nm");
        }
        Ok(())
    }
}

/// `low`, `low + step`, … below `high`: Single 2014's grid of `⌈(high − low)/step⌉` places, which leaves out its end.
fn steps(low: f64, high: f64, step: f64) -> Vec<f64> {
    // What rounding puts above a whole number is that number.
    let count = ((high - low) / step - 1e-9).ceil() as usize;
    (0..count).map(|i| low + i as f64 * step).collect()
}

/// The sines of the angles of view at which `sin θi + sin θr` is a whole multiple of `spacing`, the wavelength over the
/// tile's length. The multiple 0 is left out: it has no wavelength.
fn order_sines(spacing: f64, sin_i: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (((sin_i - 1.0) / spacing).ceil() as i64, ((sin_i + 1.0) / spacing).floor() as i64);
    (first..=last).filter(|n| *n != 0).map(move |n| n as f64 * spacing - sin_i)
}

/// The place of the angle nearest to `angle_deg` in equal steps, where that is within half a step.
fn nearest(angles_deg: &[f64], step_deg: f64, angle_deg: f64) -> Option<usize> {
    let place = ((angle_deg - angles_deg[0]) / step_deg).round();
    (place >= 0.0 && place < angles_deg.len() as f64).then_some(place as usize)
}

/// The angles at which the first order of a spacing leaves, over the visible wavelengths, as whole degrees with a margin.
fn first_order(theta_i_deg: f64, spacing_um: f64) -> (f64, f64) {
    let angle = |um: f64| (um / spacing_um - theta_i_deg.to_radians().sin()).clamp(-1.0, 1.0).asin().to_degrees();
    ((angle(0.38) - MARGIN_DEG).floor().max(-89.0), (angle(0.78) + MARGIN_DEG).ceil().min(89.0))
}

fn range(text: &str) -> Result<(f64, f64), &'static str> {
    let number = |part: &str| part.trim().parse().ok().filter(|angle: &f64| angle.abs() < 90.0);
    let ends = text.split_once(',').and_then(|(low, high)| Some((number(low)?, number(high)?)));
    ends.filter(|(low, high)| low < high).ok_or("it must be two angles within ±90 degrees, such as -55,-40")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_angles_hold_the_first_order_of_the_blazed_grating() {
        // asin(0.38/2.5 − sin 75°) = −54.5° and asin(0.78/2.5 − sin 75°) = −40.8°.
        let (low, high) = first_order(75.0, 2.5);
        assert!((-57.0..=-54.0).contains(&low) && (-42.0..=-39.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn steps_leave_out_their_end() {
        let angles = steps(-55.0, -40.0, 0.01);
        assert_eq!(angles.len(), 1500);
        assert!((angles[1499] + 40.01).abs() < 1e-9);
        assert_eq!(steps(380.0, 780.0, 1.0).len(), 400);
        // 13.33 steps need 14 places.
        assert_eq!(steps(380.0, 780.0, 30.0).last(), Some(&770.0));
    }

    #[test]
    fn nmm_looks_where_the_grating_equation_has_an_order() {
        // A tile of 5 µm at 500 nm: u is a multiple of 0.1, between sin 30° − 1 and sin 30° + 1 and not 0.
        let u: Vec<i64> = order_sines(0.1, 0.5).map(|sin| ((sin + 0.5) * 10.0).round() as i64).collect();
        assert_eq!(u, (-5..=15).filter(|n| *n != 0).collect::<Vec<_>>());
        let angles = steps(-30.0, 30.0, 0.5);
        assert_eq!(nearest(&angles, 0.5, 0.2), Some(60));
        assert_eq!(nearest(&angles, 0.5, 0.3), Some(61));
        assert_eq!((nearest(&angles, 0.5, -31.0), nearest(&angles, 0.5, 29.9)), (None, None));
    }
}
