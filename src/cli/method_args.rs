//! The arguments that choose a method of [`sunbeam::methods`] and tune it.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use std::error::Error;
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::SurfaceConfig;
use sunbeam::methods::{Method, MethodKind, MethodOptions, Repeats, build};
use sunbeam::transform::Series;

/// A method and its options.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Method")]
pub struct MethodArgs {
    /// Equal steps of the wavelength, the wavelengths of orders, a finite number of tiles, or one spacing
    #[arg(long = "method", value_name = "NAME", default_value = "flss", value_parser = kinds())]
    pub kind: MethodKind,
    /// Step between wavelengths in nm, 0.1 to 20, of flss and pq [default: 5]
    #[arg(long, value_name = "NM", allow_negative_numbers = true)]
    lambda_step: Option<f64>,
    /// Terms of the series [default: as many as --tolerance asks for]
    #[arg(long, value_name = "COUNT")]
    terms: Option<usize>,
    /// Orders summed along each axis, of flss and nmm; the sources have 3 [default: as --tolerance asks for]
    #[arg(long, value_name = "COUNT")]
    neighbourhood: Option<usize>,
    /// Series of the phase screen; the sources have taylor [default: chebyshev]
    #[arg(long, value_parser = series())]
    series: Option<Series>,
    /// Whether nmm weighs wavelengths by the part of the spectrum they stand for [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    weighted: Option<bool>,
    /// Tiles along both axes, or along x and y, of pq [default: so that peaks are as bright as flss's]
    #[arg(long, value_name = "P[,Q]", value_delimiter = ',', num_args = 1..=2)]
    repeats: Vec<u32>,
    /// Spacing in µm of stam [default: the dominant period along x]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    grating_period: Option<f64>,
}

/// The sum over wavelengths of a method that has equal steps.
#[derive(Clone, Debug, Serialize)]
pub struct Quadrature {
    wavelengths_nm: Vec<f64>,
    /// Linear sRGB; they sum to (1, 1, 1).
    weights: Vec<[f64; 3]>,
}

impl MethodArgs {
    /// The options that the arguments amount to; [`build`] validates them.
    pub fn options(&self) -> MethodOptions {
        let default = MethodOptions::default();
        MethodOptions {
            lambda_step_nm: self.lambda_step.unwrap_or(default.lambda_step_nm),
            terms: self.terms,
            neighbourhood: self.neighbourhood,
            series: self.series.unwrap_or(default.series),
            weighted: self.weighted.unwrap_or(default.weighted),
            repeats: match self.repeats[..] {
                [x, y] => Some(Repeats::Each([x, y])),
                [both] => Some(Repeats::Both(both)),
                _ => None,
            },
            period_um: self.grating_period,
        }
    }

    /// Makes the method for a surface.
    pub fn build(&self, surface: &SurfaceConfig) -> Result<Box<dyn Method>, Box<dyn Error>> {
        let field = surface.height_field()?;
        Ok(build(self.kind, &field, surface.coherence_length, surface.tolerance, &self.options())?)
    }

    /// The wavelengths and weights of the method; `None` where they depend on the directions.
    pub fn quadrature(&self) -> Option<Quadrature> {
        if !self.kind.options().contains(&"lambda_step_nm") {
            return None;
        }
        let sum = SpectralToRgb::visible(self.options().lambda_step_nm).ok()?;
        Some(Quadrature { wavelengths_nm: sum.wavelengths_nm().collect(), weights: sum.weights().to_vec() })
    }
}

fn kinds() -> impl TypedValueParser<Value = MethodKind> {
    let find = |name: String| MethodKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or("unknown method");
    PossibleValuesParser::new(MethodKind::ALL.map(MethodKind::name)).try_map(find)
}

fn series() -> impl TypedValueParser<Value = Series> {
    PossibleValuesParser::new(["chebyshev", "taylor"])
        .map(|name| if name == "taylor" { Series::Taylor } else { Series::Chebyshev })
}
