//! The arguments that choose the method of evaluation and its options.
//!
//! An option is refused where it has no effect. That depends on the method and on the [`Quantity`] that a command
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
    /// The spectral tables; on the GPU, the colour table.
    Table,
    /// A method of `sunbeam::methods`, in single precision: a published one, which also has values by wavelength, or
    /// the colour table.
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
    /// exact is the direct double-precision sum. table looks spectra up, on the GPU colours; colour-table looks colours
    /// up on the CPU. flss, nmm, pq and stam are published methods in single precision: they assume one fixed coherence
    /// window over a periodic tile.
    #[arg(long, value_name = "NAME", default_value = "table")]
    method: Method,
    /// Step between wavelengths in nm, 0.1 to 100; not with nmm and stam [default: 5]
    #[arg(long, value_name = "NM", allow_negative_numbers = true)]
    lambda_step: Option<f64>,
    /// Number of terms of the series of flss, nmm and pq, 1 to 256 [default: the number that --tolerance needs]
    #[arg(long, value_name = "COUNT")]
    terms: Option<usize>,
    /// Number of orders that flss and nmm sum along each axis, 1 to 64; 3 in Single 2014 [default: the number that
    /// --tolerance needs]
    #[arg(long, value_name = "COUNT")]
    neighbourhood: Option<usize>,
    /// Series of flss, nmm and pq; taylor in Single 2014 [default: chebyshev]
    #[arg(long, value_parser = names::<Series, 2>(["chebyshev", "taylor"]))]
    series: Option<Series>,
    /// Weight the wavelengths of nmm by their spacing; false in Single 2014 [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    weighted: Option<bool>,
    /// Number of repeats of the tile of pq: one number, or two as in 26,1 for x and y [default: the numbers that give
    /// peaks as bright as with the coherence window]
    #[arg(long, value_name = "P[,Q]", value_parser = parse_repeats)]
    repeats: Option<Repeats>,
    /// Spacing of stam along x in µm [default: the dominant period along x]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    period_um: Option<f64>,
    /// Form of stam: spacing is a reflectance; gems are the colours of the shader in GPU Gems, chapter 8, without any
    /// factor of the surface [default: spacing]
    #[arg(long, value_parser = names::<StamForm, 2>(["spacing", "gems"]))]
    stam_form: Option<StamForm>,
    /// Narrowness r of the highlight of --stam-form gems, 0 to 10000 per µm [default: 50]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    gems_sharpness: Option<f64>,
    /// Linear sRGB of the highlight of --stam-form gems, each channel 0 to 100 [default: 1,0.7,0.3]
    #[arg(long, value_name = "R,G,B", value_parser = parse_highlight, allow_hyphen_values = true)]
    gems_highlight: Option<[f64; 3]>,
    /// Factor on the samples of the colour table along each axis, 0.25 to 4 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    table_resolution: Option<f64>,
}

impl MethodArgs {
    /// The method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Whether the colours are those of GPU Gems, which are not multiplied by Fresnel factor, obliquity and shadowing.
    pub fn is_gems(&self) -> bool {
        self.method == Method::Colour(MethodKind::Stam) && self.stam_form == Some(StamForm::Gems)
    }

    /// The validated options.
    ///
    /// # Errors
    /// An option out of range, or one without effect on this method and quantity.
    pub fn options(&self, quantity: Quantity) -> Result<MethodOptions, String> {
        self.refuse_without_effect(quantity)?;
        // The names of these two flags differ from the library's fields. They are checked here, so that the message has
        // the flag's name. The library checks the others.
        if let Some(step) = self.lambda_step.filter(|step| !LAMBDA_STEP_NM.contains(step)) {
            return Err(out_of_range("lambda-step", step, "0.1 to 100 nm"));
        }
        if let Some(factor) = self.table_resolution.filter(|factor| !RESOLUTION.contains(factor)) {
            return Err(out_of_range("table-resolution", factor, "0.25 to 4"));
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
        // The fields that the method reads.
        let fields = match (self.method, quantity) {
            (Method::Table, Quantity::ColourOnGpu) => MethodKind::Table.options(),
            // The step of the sum over wavelengths in a colour.
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

/// Parses `P` or `P,Q`, two whole numbers.
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
