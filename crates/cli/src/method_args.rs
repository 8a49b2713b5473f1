//! The arguments that choose the method of evaluation and its options.
//!
//! `exact` is the direct sum over the relief; `table` and `colour-table` read tables. The other methods are published
//! (docs/realtime.md). They assume a tile (the given rectangle of relief) that repeats:
//!
//! - `flss`: full lambda spectral sampling, sums over diffraction orders at equal steps of the wavelength;
//! - `nmm`: such sums, only at the wavelengths of which an order leaves towards the viewer;
//! - `pq`: a finite number of repeats of the tile, P along x and Q along y;
//! - `stam`: Stam's model, which knows only the spacing of the grooves along x.
//!
//! The first three expand the phase screen in a series, `--series` (docs/model.md#the-two-expansions). `--tolerance`,
//! an argument of the surface (surface_args.rs), sets the default numbers of terms and of summed orders. Single 2014 is
//! M. Single's thesis on these methods.
//!
//! An option without effect is refused. The effect depends on the method and on the [`Quantity`] that a command
//! computes.

use super::arguments::out_of_range;
use super::surface_args::names;
use std::str::FromStr;
use sunbeam::methods::{LAMBDA_STEP_NM, MethodKind, MethodOptions, RESOLUTION, Repeats, StamForm};
use sunbeam::transform::Series;

/// A method of evaluation: a value of `--method`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The direct double-precision sum. It does not run on the GPU.
    Exact,
    /// The spectral tables, with values by wavelength; on the GPU, the colour table.
    Table,
    /// A method of `sunbeam::methods` that computes colours in single precision: a published one, or the colour table.
    /// The published ones have values by wavelength, too, except for `--stam-form gems`.
    Colour(MethodKind),
}

impl Method {
    /// The value of `--method`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Table => "table",
            Self::Colour(MethodKind::Table) => "colour-table",
            Self::Colour(kind) => kind.name(),
        }
    }

    /// The method as it runs on the GPU; `None` where it does not.
    pub fn on_gpu(self) -> Option<MethodKind> {
        match self {
            Self::Exact => None,
            Self::Table => Some(MethodKind::Table),
            Self::Colour(kind) => Some(kind),
        }
    }

    /// All methods, in the order in which messages list them.
    fn all() -> impl Iterator<Item = Self> {
        [Self::Exact, Self::Table].into_iter().chain(MethodKind::ALL.map(Self::Colour))
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::all().find(|method| method.name() == name).ok_or_else(|| {
            let available: Vec<_> = Self::all().map(Self::name).collect();
            format!("unknown; available: {}", available.join(", "))
        })
    }
}

/// The quantity that a command computes with a method. It decides which options have an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Values at wavelengths that the command gives.
    Spectrum,
    /// Colours, for which the method chooses wavelengths.
    Colour,
    /// Colours, computed on the GPU.
    ColourOnGpu,
}

/// The method and its options.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Method")]
pub struct MethodArgs {
    /// Method of evaluation
    ///
    /// exact is the direct double-precision sum. table looks up spectra on the CPU and colours on the GPU; colour-table
    /// looks up colours on both. flss, nmm, pq and stam are published methods in single precision: they assume one
    /// fixed coherence window over a periodic tile.
    #[arg(long, value_name = "NAME", default_value = "table")]
    method: Method,
    /// Step in nm between the wavelengths that a colour sums, 0.1 to 100; of exact, table (on the CPU), flss and pq
    /// [default: 5]
    #[arg(long, value_name = "NM", allow_negative_numbers = true)]
    lambda_step: Option<f64>,
    /// Number of terms of the series of flss, nmm and pq, 1 to 256 [default: the number that --tolerance needs]
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    terms: Option<usize>,
    /// Number of orders that flss and nmm sum along each axis, 1 to 64; 3 in Single 2014 [default: the number that
    /// --tolerance needs]
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    neighbourhood: Option<usize>,
    /// Series of flss, nmm and pq; taylor in Single 2014 [default: chebyshev]
    #[arg(long, value_parser = names::<Series, 2>(["chebyshev", "taylor"]))]
    series: Option<Series>,
    // Without a value the flag is true. A positional argument after it would be taken for its value, but no command
    // with these arguments has one.
    /// Weight the wavelengths of nmm by the distance between them; false in Single 2014 [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    weighted: Option<bool>,
    /// Number of repeats of the tile of pq: one number for both axes, or two as in 26,1 for x and y [default: the
    /// numbers that give peaks as bright as with the coherence window]
    #[arg(long, value_name = "P[,Q]", value_parser = parse_repeats, allow_hyphen_values = true)]
    repeats: Option<Repeats>,
    /// Spacing of the grooves along x for stam, in µm [default: the dominant period along x]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    period_um: Option<f64>,
    /// Form of stam: spacing is a reflectance; gems has the colours of the shader in GPU Gems, chapter 8, without any
    /// factor of the surface [default: spacing]
    #[arg(long, value_parser = names::<StamForm, 2>(["spacing", "gems"]))]
    stam_form: Option<StamForm>,
    /// Narrowness r of the highlight of --stam-form gems, 0 to 10000 per µm [default: 50]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    gems_sharpness: Option<f64>,
    /// Linear sRGB of the highlight of --stam-form gems, each channel 0 to 100 [default: 1,0.7,0.3]
    #[arg(long, value_name = "R,G,B", value_parser = parse_highlight, allow_hyphen_values = true)]
    gems_highlight: Option<[f64; 3]>,
    /// Factor on the number of samples of the colour table along each axis, 0.25 to 4 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    table_resolution: Option<f64>,
}

impl MethodArgs {
    /// The method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Whether the method is `--stam-form gems`, whose colours no Fresnel, obliquity or shadowing factor multiplies.
    pub fn is_gems(&self) -> bool {
        self.method == Method::Colour(MethodKind::Stam) && self.stam_form == Some(StamForm::Gems)
    }

    /// The validated options.
    ///
    /// # Errors
    /// An option out of range, or one without effect on this method and quantity.
    pub fn options(&self, quantity: Quantity) -> Result<MethodOptions, String> {
        self.refuse_without_effect(quantity)?;
        // The library checks all ranges (`validate` below). Its messages name its own fields, `lambda_step_nm` and
        // `resolution`, so these two options are checked here first, under the names of their flags.
        if let Some(step) = self.lambda_step.filter(|step| !LAMBDA_STEP_NM.contains(step)) {
            let accepted = format!("{} to {} nm", LAMBDA_STEP_NM.start(), LAMBDA_STEP_NM.end());
            return Err(out_of_range("lambda-step", step, &accepted));
        }
        if let Some(factor) = self.table_resolution.filter(|factor| !RESOLUTION.contains(factor)) {
            let accepted = format!("{} to {}", RESOLUTION.start(), RESOLUTION.end());
            return Err(out_of_range("table-resolution", factor, &accepted));
        }
        let default = MethodOptions::default();
        let options = MethodOptions {
            lambda_step_nm: self.lambda_step.unwrap_or(default.lambda_step_nm),
            terms: self.terms,
            neighbourhood: self.neighbourhood,
            series: self.series.unwrap_or(default.series),
            weighted: self.weighted.unwrap_or(default.weighted),
            repeats: self.repeats,
            period_um: self.period_um,
            stam_form: self.stam_form.unwrap_or(default.stam_form),
            gems_sharpness: self.gems_sharpness.unwrap_or(default.gems_sharpness),
            gems_highlight: self.gems_highlight.unwrap_or(default.gems_highlight),
            resolution: self.table_resolution.unwrap_or(default.resolution),
        };
        options.validate().map_err(|error| error.to_string())?;
        Ok(options)
    }

    /// Refuses a quantity that the method cannot compute, and an option without effect.
    ///
    /// `--method exact` on the GPU passes here: `Realtime::new` refuses it before it reads the options.
    fn refuse_without_effect(&self, quantity: Quantity) -> Result<(), String> {
        if self.method == Method::Colour(MethodKind::Table) && quantity == Quantity::Spectrum {
            return Err("--method colour-table has no values by wavelength; use table".to_owned());
        }
        // Field of `MethodOptions`, its flag, and whether the flag is given.
        let flags = [
            ("lambda_step_nm", "--lambda-step", self.lambda_step.is_some()),
            ("terms", "--terms", self.terms.is_some()),
            ("neighbourhood", "--neighbourhood", self.neighbourhood.is_some()),
            ("series", "--series", self.series.is_some()),
            ("weighted", "--weighted", self.weighted.is_some()),
            ("repeats", "--repeats", self.repeats.is_some()),
            ("period_um", "--period-um", self.period_um.is_some()),
            ("stam_form", "--stam-form", self.stam_form.is_some()),
            ("gems_sharpness", "--gems-sharpness", self.gems_sharpness.is_some()),
            ("gems_highlight", "--gems-highlight", self.gems_highlight.is_some()),
            ("resolution", "--table-resolution", self.table_resolution.is_some()),
        ];
        // The fields that the method reads. `exact` and the spectral tables have no options of their own; their colours
        // are sums over wavelengths in steps.
        let fields = match (self.method, quantity) {
            (Method::Table, Quantity::ColourOnGpu) => MethodKind::Table.options(),
            (Method::Exact | Method::Table, _) => &["lambda_step_nm"],
            (Method::Colour(kind), _) => kind.options(),
        };
        let has_effect = |field: &str| {
            // A spectrum is computed at the command's wavelengths, without steps and weights of wavelengths.
            let for_colours_only = ["lambda_step_nm", "weighted"].contains(&field);
            let for_gems_only = field.starts_with("gems_");
            fields.contains(&field)
                && (quantity != Quantity::Spectrum || !for_colours_only)
                && (self.is_gems() || !for_gems_only)
        };
        if let Some((_, flag, _)) = flags.iter().find(|(field, _, is_given)| *is_given && !has_effect(field)) {
            let accepted: Vec<_> =
                flags.iter().filter(|(field, _, _)| has_effect(field)).map(|(_, flag, _)| *flag).collect();
            let accepted = if accepted.is_empty() { "no option".to_owned() } else { accepted.join(", ") };
            let method = self.method.name();
            return Err(format!("{flag} has no effect here with --method {method}, which accepts {accepted}"));
        }
        if self.is_gems() && quantity == Quantity::Spectrum {
            return Err("--stam-form gems has no values by wavelength; use spacing".to_owned());
        }
        Ok(())
    }
}

/// Parses `P` or `P,Q`, one or two whole numbers that are not negative.
fn parse_repeats(text: &str) -> Result<Repeats, String> {
    let number = |part: &str| part.trim().parse().map_err(|_| format!("{part:?} is not a whole number"));
    match text.split_once(',') {
        None => number(text).map(Repeats::Both),
        Some((x, y)) => Ok(Repeats::Each([number(x)?, number(y)?])),
    }
}

/// Parses `R,G,B`, three numbers.
fn parse_highlight(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|part| part.trim().parse()).collect::<Result<Vec<f64>, _>>();
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| format!("{text:?} is not three numbers"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_parse_one_number_or_two() {
        assert_eq!(parse_repeats("26"), Ok(Repeats::Both(26)));
        assert_eq!(parse_repeats("26, 1"), Ok(Repeats::Each([26, 1])));
        for wrong in ["", "x", "1,", "1,2,3", "-1", "1.5"] {
            assert!(parse_repeats(wrong).unwrap_err().contains("whole number"), "{wrong}");
        }
    }
}
