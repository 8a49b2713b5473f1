//! `sunbeam orders`: directions and efficiencies of a grating's orders, for one incidence (a direction and a wavelength
//! of the light), or along a curve on which one quantity varies.
//!
//! The relief varies along x, across the grooves; y is along them. The magnetic field H of TE light has no component
//! Hy, the electric field E of TM light no component Ey.

mod both_sides;
mod plot;
mod screen;
mod solve;

use super::arguments::out_of_range;
use super::output::{Output, output};
use super::progress::with_bar;
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use clap::ValueEnum;
use rayon::prelude::*;
use serde::Serialize;
use solve::{Incidence, SolvedOrders};
use std::error::Error;
use std::io::Write;
use std::ops::RangeInclusive;
use sunbeam::config::{BuildError, SurfaceConfig};
use sunbeam::scattering::Transmission;

/// Accepted wavelengths in nm, from X-rays to a millimetre: a wrong unit is refused.
const WAVELENGTH_NM: RangeInclusive<f64> = 1.0..=1e6;
/// Wavelength in nm without `--wavelength`: green, near the middle of the visible range.
const WAVELENGTH_DEFAULT_NM: f64 = 550.0;
/// Largest number of points of a curve. Each may take a minute, and more would not show in a plot 900 pixels wide.
const POINTS_MAX: usize = 2000;

/// Compute the orders of a grating: directions, efficiencies and absorption
///
/// The relief must vary along x alone. Light comes from wi = (sinθ cosφ, sinθ sinφ, cosθ), given by --theta-i and
/// --phi-i. An efficiency is the fraction of the incident power in an order: te for light whose magnetic field has no
/// component along the grooves, tm for light whose electric field has none, mean for unpolarised light.
///
/// --theory rigorous solves Maxwell's equations. --theory scalar, the default, is the phase screen, which has the mean
/// only and does not conserve energy.
///
/// With --transmission film or interface the orders below the relief are listed, too. Orders below an interface have
/// their directions within the medium, orders below a film those behind its flat side. A trapped order stays within the
/// film and has its direction there. Both theories have te and tm then, the scalar theory only where light arrives
/// across the grooves.
///
/// Prints a table. --json adds the Jones matrices and the errors of energy balance and reciprocity. A Jones matrix has
/// real and imaginary parts; its rows are the outgoing states without Hy and without Ey, its columns the incident ones.
#[derive(clap::Args)]
pub(crate) struct OrdersArgs {
    /// Angle of incidence with the normal in degrees, in [0, 90) [default: 0]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    theta_i: Option<f64>,
    /// Azimuth of incidence in degrees; 0 is +x, across the grooves [default: 0]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    phi_i: Option<f64>,
    /// Wavelength in nm, 1 to 1e6 [default: 550]
    #[arg(long, value_name = "NM", allow_negative_numbers = true)]
    wavelength: Option<f64>,
    /// Print JSON in place of the table
    #[arg(long)]
    json: bool,
    /// File for a plot of the efficiencies of the strongest orders along the curve (.svg)
    #[arg(long, value_name = "FILE", requires = "over", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// Quantity that varies along a curve, in place of its own argument
    #[arg(long, value_enum, requires = "range")]
    over: Option<Over>,
    /// First value, last value and number of points (2 to 2000) of the curve
    #[arg(long, value_name = "FROM,TO,COUNT", requires = "over", value_parser = Range::parse)]
    #[arg(allow_hyphen_values = true)]
    range: Option<Range>,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// The quantity that varies along a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Over {
    /// The wavelength in nm
    Wavelength,
    /// The angle of incidence in degrees
    ThetaI,
    /// The azimuth of incidence in degrees
    PhiI,
    /// The height of a preset in µm
    Height,
}

impl Over {
    /// Label of the plot's axis.
    fn axis(self) -> &'static str {
        match self {
            Self::Wavelength => "wavelength in nm",
            Self::ThetaI => "angle of incidence in degrees",
            Self::PhiI => "azimuth of incidence in degrees",
            Self::Height => "height in µm",
        }
    }
}

/// Uniformly spaced values of the quantity that varies.
#[derive(Clone, Copy)]
struct Range {
    from: f64,
    /// The last value, which may be smaller than the first.
    to: f64,
    /// Number of values, 2 to [`POINTS_MAX`].
    count: usize,
}

impl Range {
    /// Parses `FROM,TO,COUNT`.
    fn parse(text: &str) -> Result<Self, String> {
        let parts: Vec<_> = text.split(',').map(str::trim).collect();
        let parsed = || -> Option<Self> {
            let [from, to, count] = parts[..] else { return None };
            Some(Self { from: from.parse().ok()?, to: to.parse().ok()?, count: count.parse().ok()? })
        };
        parsed()
            .filter(|range| range.from.is_finite() && range.to.is_finite() && (2..=POINTS_MAX).contains(&range.count))
            .ok_or_else(|| format!("it must be two finite numbers and a count from 2 to {POINTS_MAX}: FROM,TO,COUNT"))
    }

    /// Value `i`, counted from 0.
    fn value(&self, i: usize) -> f64 {
        self.from + (self.to - self.from) * i as f64 / (self.count - 1) as f64
    }
}

/// The orders along a curve.
#[derive(Serialize)]
struct Curve {
    over: Over,
    points: Vec<Point>,
}

/// The orders at one value of the quantity that varies.
#[derive(Serialize)]
struct Point {
    /// The value, in the unit of [`Over`].
    at: f64,
    #[serde(flatten)]
    solved: SolvedOrders,
}

/// Runs `sunbeam orders`.
pub(crate) fn run(args: &OrdersArgs) -> Outcome {
    if let (Some(over), Some(range)) = (args.over, args.range) {
        return run_along_curve(args, over, range);
    }
    let (config, incidence) = args.problem(None)?;
    let solved = SolvedOrders::new(&config, &incidence)?;
    if args.json { print_json(&solved) } else { print_table(&solved, config.transmission) }
}

/// Solves the points of a curve, draws it to `--plot`, and prints it as JSON.
fn run_along_curve(args: &OrdersArgs, over: Over, range: Range) -> Outcome {
    args.refuse_replaced(over)?;
    let problems =
        (0..range.count).map(|i| args.problem(Some((over, range.value(i))))).collect::<Result<Vec<_>, _>>()?;
    // A point may take a minute, so the sizes of all problems are checked before the first is solved.
    for (config, incidence) in &problems {
        SolvedOrders::check(config, incidence)?;
    }
    let points = with_bar("solving", |progress| {
        let steps = progress.of_steps(range.count);
        let solve = |(i, (config, incidence)): (usize, &(SurfaceConfig, Incidence))| {
            let solved = SolvedOrders::new(config, incidence)?;
            steps.one();
            Ok(Point { at: range.value(i), solved })
        };
        problems.par_iter().enumerate().map(solve).collect::<Result<Vec<_>, BuildError>>()
    })?;
    let curve = Curve { over, points };
    if let Some(file) = &args.plot {
        file.write(plot::svg(&curve).as_bytes())?;
    }
    print_json(&curve)
}

impl OrdersArgs {
    /// Refuses the argument of the quantity that varies along a curve: the range replaces it.
    fn refuse_replaced(&self, over: Over) -> Result<(), String> {
        let (flag, is_given) = match over {
            Over::Wavelength => ("--wavelength", self.wavelength.is_some()),
            Over::ThetaI => ("--theta-i", self.theta_i.is_some()),
            Over::PhiI => ("--phi-i", self.phi_i.is_some()),
            Over::Height => ("--height", self.surface.has_height()),
        };
        if !is_given {
            return Ok(());
        }
        let name = flag.trim_start_matches('-');
        Err(format!("{flag} has no effect with --over {name}, whose values --range gives: leave it out"))
    }

    /// The surface and the incidence to solve. `varied` is the quantity that varies along a curve, with its value.
    ///
    /// # Errors
    /// A quantity out of range, or arguments of the surface that contradict each other.
    fn problem(&self, varied: Option<(Over, f64)>) -> Result<(SurfaceConfig, Incidence), Box<dyn Error>> {
        // The value that varies, else the argument, else the default.
        let value = |over: Over, argument: Option<f64>, default: f64| match varied {
            Some((which, at)) if which == over => at,
            _ => argument.unwrap_or(default),
        };
        let incidence = Incidence {
            theta_i_deg: value(Over::ThetaI, self.theta_i, 0.0),
            phi_i_deg: value(Over::PhiI, self.phi_i, 0.0),
            wavelength_nm: value(Over::Wavelength, self.wavelength, WAVELENGTH_DEFAULT_NM),
        };
        if !(0.0..90.0).contains(&incidence.theta_i_deg) {
            return Err(out_of_range("theta-i", incidence.theta_i_deg, "in [0, 90) degrees").into());
        }
        if !incidence.phi_i_deg.is_finite() {
            return Err(out_of_range("phi-i", incidence.phi_i_deg, "finite").into());
        }
        if !WAVELENGTH_NM.contains(&incidence.wavelength_nm) {
            return Err(out_of_range("wavelength", incidence.wavelength_nm, "in [1, 1e6] nm").into());
        }
        let mut config = self.surface.config()?;
        if let Some((Over::Height, at)) = varied {
            config.height = Some(at);
            config.validate()?;
        }
        Ok((config, incidence))
    }
}

/// Prints a line for each order, with efficiencies in percent, and a line for the light that is in none of the orders.
fn print_table(solved: &SolvedOrders, transmission: Transmission) -> Outcome {
    let mut out = std::io::stdout().lock();
    let percent =
        |fraction: Option<f64>| fraction.map_or("–".to_owned(), |fraction| format!("{:.3}", 100.0 * fraction));
    // Titles of the column of sides, and of the line for the light that is in none of the orders; an empty title omits
    // its column or line. `absorbed` has that light if it is known. At an interface it is 0: the medium absorbs
    // nothing, and the orders below are listed.
    let (side_title, rest_title) = match transmission {
        Transmission::None => ("", "absorbed or transmitted"),
        Transmission::Film => ("side", "left inside the film"),
        Transmission::Interface => ("side", ""),
    };
    // An entry of the column of sides.
    let side_column = |side: &str| if side_title.is_empty() { String::new() } else { format!("{side:>8} ") };
    let side = side_column(side_title);
    writeln!(out, "{side}{:>5} {:>9} {:>9} {:>9} {:>9} {:>9}", "order", "theta", "phi", "te %", "tm %", "mean %")?;
    for order in &solved.orders {
        let [te, tm] = [order.te, order.tm].map(percent);
        let (side, mean) = (side_column(order.side.name()), percent(Some(order.mean)));
        let (number, theta, phi) = (order.order, order.theta_deg, order.phi_deg);
        writeln!(out, "{side}{number:>5} {theta:>8.3}° {phi:>8.3}° {te:>9} {tm:>9} {mean:>9}")?;
    }
    if let Some([te, tm]) = solved.absorbed.filter(|_| !rest_title.is_empty()) {
        let [te, tm, mean] = [te, tm, 0.5 * (te + tm)].map(|fraction| percent(Some(fraction)));
        // The title fills the columns of side, order, theta and phi. Without the side these have 25 characters, 5, 9
        // and 9 with a gap between them.
        let width = 25 + side_column("").len();
        writeln!(out, "{rest_title:>width$} {te:>9} {tm:>9} {mean:>9}")?;
    }
    Ok(())
}
