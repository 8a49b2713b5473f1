//! The arguments that say how a surface is evaluated, the same for every subcommand that does.

use super::surface_args::names;
use std::str::FromStr;
use sunbeam::methods::{LAMBDA_STEP_NM, MethodKind, MethodOptions, RESOLUTION, Repeats, StamForm};
use sunbeam::transform::Series;

/// How the reflectance is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The direct double-precision sum.
    Exact,
    /// The spectral tables; on the GPU the colour table.
    Table,
    /// A method of colours in single precision: one of the published ones, or the colour table.
    Realtime(MethodKind),
}

impl Method {
    /// The name by which it is asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Table => "table",
            Self::Realtime(MethodKind::Table) => "colour-table",
            Self::Realtime(kind) => kind.name(),
        }
    }

    /// The method of that name on the GPU; `None` where it has none.
    pub fn on_gpu(self) -> Option<MethodKind> {
        match self {
            Self::Exact => None,
            Self::Table => Some(MethodKind::Table),
            Self::Realtime(kind) => Some(kind),
        }
    }

    fn all() -> impl Iterator<Item = Self> {
        [Self::Exact, Self::Table].into_iter().chain(MethodKind::ALL.map(Self::Realtime))
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

/// What a method is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Values at given wavelengths.
    Spectrum,
    /// Colours, for which it has wavelengths of its own.
    Colour,
    /// Colours, on the GPU.
    ColourOnGpu,
}

/// The method and its options.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Method")]
pub struct MethodArgs {
    /// exact (direct double-precision sum), table (on the GPU that of colours), colour-table (the same on the CPU), or
    /// one of the published methods in single precision, which know a single window in a fixed place over a tile that
    /// repeats: flss, nmm, pq, stam
    #[arg(long, value_name = "NAME", default_value = "table")]
    method: Method,
    /// Step between wavelengths in nm, 0.1 to 100; not of nmm and stam [default: 5]
    #[arg(long, value_name = "NM", allow_negative_numbers = true)]
    lambda_step: Option<f64>,
    /// Terms of the series of flss, nmm and pq, 1 to 256 [default: as many as the tolerance asks for]
    #[arg(long, value_name = "COUNT")]
    terms: Option<usize>,
    /// Orders that flss and nmm sum along each axis, 1 to 64; Single 2014 has 3 [default: as many as the tolerance asks
    /// for]
    #[arg(long, value_name = "COUNT")]
    neighbourhood: Option<usize>,
    /// Series of flss, nmm and pq; Single 2014 has taylor [default: chebyshev]
    #[arg(long, value_parser = names::<Series, 2>(["chebyshev", "taylor"]))]
    series: Option<Series>,
    /// Let the wavelengths that nmm picks count by their distance, which Single 2014 does not [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    weighted: Option<bool>,
    /// How often the tile of pq repeats: one number, or two as in 26,1 for x and y [default: peaks as bright as those of
    /// the coherence window]
    #[arg(long, value_name = "P[,Q]", value_parser = repeats)]
    repeats: Option<Repeats>,
    /// Spacing of stam in µm [default: the dominant period along x]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    period_um: Option<f64>,
    /// Form of stam: spacing, a reflectance, or gems, the colours of the shader in GPU Gems, chapter 8, which nothing is
    /// multiplied by [default: spacing]
    #[arg(long, value_parser = names::<StamForm, 2>(["spacing", "gems"]))]
    stam_form: Option<StamForm>,
    /// How narrow the highlight of --stam-form gems is, its r, 0 to 10000 per µm [default: 50]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    gems_sharpness: Option<f64>,
    /// Linear sRGB of the highlight of --stam-form gems, each 0 to 100 [default: 1,0.7,0.3]
    #[arg(long, value_name = "R,G,B", value_parser = highlight, allow_hyphen_values = true)]
    gems_highlight: Option<[f64; 3]>,
    /// Times the samples of the colour table along each axis, 0.25 to 4 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    table_resolution: Option<f64>,
}

impl MethodArgs {
    /// The method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Whether the colours are those of GPU Gems, which no factor of the surface multiplies.
    pub fn is_gems(&self) -> bool {
        self.method == Method::Realtime(MethodKind::Stam) && self.stam_form == Some(StamForm::Gems)
    }

    /// The options that the arguments amount to, validated; an argument without effect is refused.
    pub fn options(&self, asked: Asked) -> Result<MethodOptions, String> {
        let given = [
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
        if self.method == Method::Realtime(MethodKind::Table) && asked == Asked::Spectrum {
            return Err("--method colour-table has no values by wavelength; use table".to_owned());
        }
        let heeded = match (self.method, asked) {
            (Method::Table, Asked::ColourOnGpu) => MethodKind::Table.options(),
            (Method::Exact | Method::Table, _) => &["lambda_step_nm"],
            (Method::Realtime(kind), _) => kind.options(),
        };
        let heeds = |field: &str| {
            let colour_only = ["lambda_step_nm", "weighted"].contains(&field);
            let gems_only = field.starts_with("gems_");
            heeded.contains(&field) && (asked != Asked::Spectrum || !colour_only) && (self.is_gems() || !gems_only)
        };
        if let Some((_, flag, _)) = given.iter().find(|(field, _, given)| *given && !heeds(field)) {
            let takes: Vec<_> = given.iter().filter(|(field, _, _)| heeds(field)).map(|(_, flag, _)| *flag).collect();
            let takes = if takes.is_empty() { "none of its kind".to_owned() } else { takes.join(", ") };
            return Err(format!("{flag} has no effect here with --method {}, which takes {takes}", self.method.name()));
        }
        if self.is_gems() && asked == Asked::Spectrum {
            return Err("--stam-form gems has no values by wavelength; use spacing".to_owned());
        }
        // Under the name that users gave it by; the others are called alike.
        if let Some(step) = self.lambda_step.filter(|step| !LAMBDA_STEP_NM.contains(step)) {
            return Err(format!("parameter \"lambda-step\" is {step}, but must be 0.1 to 100 nm"));
        }
        if let Some(factor) = self.table_resolution.filter(|factor| !RESOLUTION.contains(factor)) {
            return Err(format!("parameter \"table-resolution\" is {factor}, but must be 0.25 to 4"));
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
}

fn repeats(text: &str) -> Result<Repeats, String> {
    let number = |part: &str| part.trim().parse().map_err(|_| format!("{part:?} is not a whole number"));
    match text.split_once(',') {
        None => number(text).map(Repeats::Both),
        Some((x, y)) => Ok(Repeats::Each([number(x)?, number(y)?])),
    }
}

fn highlight(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|part| part.trim().parse()).collect::<Result<Vec<f64>, _>>();
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| format!("{text:?} is not three numbers"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_one_number_or_two() {
        assert_eq!(repeats("26"), Ok(Repeats::Both(26)));
        assert_eq!(repeats("26, 1"), Ok(Repeats::Each([26, 1])));
        for wrong in ["", "x", "1,", "1,2,3", "-1", "1.5"] {
            assert!(repeats(wrong).unwrap_err().contains("whole number"), "{wrong}");
        }
    }
}
