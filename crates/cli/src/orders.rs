//! The orders of a grating, as a spectroscopist asks for them.

mod plot;
mod solve;

use super::output::{Output, output};
use super::progress::with_bar;
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use clap::ValueEnum;
use rayon::prelude::*;
use serde::Serialize;
use solve::{Asked, Solved};
use std::error::Error;
use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use sunbeam::config::{BuildError, SurfaceConfig};

/// Accepted wavelengths in nm.
const WAVELENGTH_NM: std::ops::RangeInclusive<f64> = 1.0..=1e6;
/// Most points of a curve.
const POINTS_MAX: usize = 2000;

/// Tell the orders of a grating: directions, efficiencies, and what is absorbed
///
/// The relief must vary along x alone. Light comes from --theta-i, --phi-i: wi = (sinθ cosφ, sinθ sinφ, cosθ). te is the share of
/// the power of light whose magnetic field has no component along the grooves that goes into an order, tm the same for its
/// electric field, mean that of unpolarised light. With --theory rigorous the orders are those of Maxwell's equations;
/// with scalar (the default) the phase screen's, which knows their mean alone, and energy is not limited.
///
/// Prints a table; with --json also the Jones matrices (real and imaginary parts; rows: what leaves without Hy, without Ey;
/// columns: what comes in) and how well power is kept.
#[derive(clap::Args)]
pub struct OrdersArgs {
    /// Angle of the incident light with the normal in degrees, 0 to below 90
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Azimuth of the incident light in degrees: 0 is +x, across the grooves
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    phi_i: f64,
    /// Wavelength in nm
    #[arg(long, value_name = "NM", default_value_t = 550.0, allow_negative_numbers = true)]
    wavelength: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Draw efficiencies of the strongest orders over --over (.svg); the JSON has all of them
    #[arg(long, value_name = "FILE", requires = "over", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// What varies
    #[arg(long, value_enum, requires = "range")]
    over: Option<Over>,
    /// From, to and the number of points (2 to 2000) of what varies
    #[arg(long, value_name = "FROM,TO,COUNT", requires = "over", value_parser = range, allow_hyphen_values = true)]
    range: Option<(f64, f64, usize)>,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// What varies in a plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Over {
    /// The wavelength in nm
    Wavelength,
    /// The angle of incidence in degrees
    ThetaI,
    /// Its azimuth in degrees
    PhiI,
    /// The height of a preset in µm
    Height,
}

impl Over {
    fn axis(self) -> &'static str {
        match self {
            Self::Wavelength => "wavelength in nm",
            Self::ThetaI => "angle of incidence in degrees",
            Self::PhiI => "azimuth of incidence in degrees",
            Self::Height => "height in µm",
        }
    }
}

/// The orders along what varies.
#[derive(Serialize)]
struct Curve {
    over: Over,
    points: Vec<Point>,
}

#[derive(Serialize)]
struct Point {
    at: f64,
    #[serde(flatten)]
    solved: Solved,
}

/// Runs `sunbeam orders`.
pub fn run(args: &OrdersArgs) -> Outcome {
    let (Some(over), Some((from, to, count))) = (args.over, args.range) else {
        let (config, asked) = args.question(None)?;
        let solved = Solved::new(&config, &asked)?;
        return if args.json { print_json(&solved) } else { print_table(&solved) };
    };
    let at = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
    let questions = (0..count).map(|i| args.question(Some((over, at(i))))).collect::<Result<Vec<_>, _>>()?;
    // Checks every point before the first is solved, which may take a minute.
    for (config, asked) in &questions {
        Solved::check(config, asked)?;
    }
    let points = with_bar("solving", |progress| {
        let done = AtomicUsize::new(0);
        let solve = |(i, (config, asked)): (usize, &(SurfaceConfig, Asked))| {
            let solved = Solved::new(config, asked)?;
            progress.report((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
            Ok(Point { at: at(i), solved })
        };
        questions.par_iter().enumerate().map(solve).collect::<Result<Vec<_>, BuildError>>()
    })?;
    let curve = Curve { over, points };
    if let Some(file) = &args.plot {
        file.write(plot::svg(&curve).as_bytes())?;
    }
    print_json(&curve)
}

impl OrdersArgs {
    /// The surface and the light, with one of the numbers replaced.
    fn question(&self, varied: Option<(Over, f64)>) -> Result<(SurfaceConfig, Asked), Box<dyn Error>> {
        let of = |over: Over, given: f64| varied.filter(|(which, _)| *which == over).map_or(given, |(_, at)| at);
        let asked = Asked {
            theta_i_deg: of(Over::ThetaI, self.theta_i),
            phi_i_deg: of(Over::PhiI, self.phi_i),
            wavelength_nm: of(Over::Wavelength, self.wavelength),
        };
        if !(0.0..90.0).contains(&asked.theta_i_deg) {
            return Err(format!("--theta-i is {}; it must be in [0, 90)", asked.theta_i_deg).into());
        }
        if !asked.phi_i_deg.is_finite() {
            return Err(format!("--phi-i is {}; it must be finite", asked.phi_i_deg).into());
        }
        if !WAVELENGTH_NM.contains(&asked.wavelength_nm) {
            return Err(format!("--wavelength is {}; it must be in [1, 1e6] nm", asked.wavelength_nm).into());
        }
        let mut config = self.surface.config()?;
        if let Some((Over::Height, at)) = varied {
            config.height = Some(at);
            config.validate()?;
        }
        Ok((config, asked))
    }
}

/// A line an order, for reading.
fn print_table(solved: &Solved) -> Outcome {
    let mut out = std::io::stdout().lock();
    let percent = |share: Option<f64>| share.map_or("–".to_owned(), |share| format!("{:.3}", 100.0 * share));
    writeln!(out, "{:>5} {:>9} {:>9} {:>9} {:>9} {:>9}", "order", "theta", "phi", "te %", "tm %", "mean %")?;
    for order in &solved.orders {
        let [te, tm] = [order.te, order.tm].map(percent);
        let mean = percent(Some(order.mean));
        writeln!(
            out,
            "{:>5} {:>8.3}° {:>8.3}° {te:>9} {tm:>9} {mean:>9}",
            order.order, order.theta_deg, order.phi_deg
        )?;
    }
    if let Some([te, tm]) = solved.absorbed {
        let [te, tm, mean] = [te, tm, 0.5 * (te + tm)].map(|share| percent(Some(share)));
        writeln!(out, "{:>25} {te:>9} {tm:>9} {mean:>9}", "absorbed or transmitted")?;
    }
    Ok(())
}

fn range(text: &str) -> Result<(f64, f64, usize), String> {
    let parts: Vec<_> = text.split(',').map(str::trim).collect();
    let numbers = || -> Option<(f64, f64, usize)> {
        let [from, to, count] = parts[..] else { return None };
        Some((from.parse().ok()?, to.parse().ok()?, count.parse().ok()?))
    };
    match numbers() {
        Some((from, to, count)) if from.is_finite() && to.is_finite() && (2..=POINTS_MAX).contains(&count) => {
            Ok((from, to, count))
        }
        _ => Err(format!("two finite numbers and a count from 2 to {POINTS_MAX} are needed: FROM,TO,COUNT")),
    }
}
