//! The arguments that describe a surface, the same for every subcommand.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error as NameError, StrDeserializer};
use std::error::Error;
use std::path::PathBuf;
use sunbeam::cache::{Cache, CacheError};
use sunbeam::config::{ConfigError, ObliquityChoice, SurfaceConfig, Theory};
use sunbeam::height_field::{Fill, Level, Preset};
use sunbeam::methods::{MethodKind, MethodOptions, StamForm};
use sunbeam::table::{Model, Tiling};

/// A surface: its relief and how it answers to light.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Surface")]
pub struct SurfaceArgs {
    /// Built-in surface [default: elaphe when there is no --height-field]
    #[arg(long, value_name = "NAME", value_parser = preset_names())]
    preset: Option<Preset>,
    /// Period along x in µm, of the presets blazed, sinusoidal and lamellar [default: 2.5]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    period: Option<f64>,
    /// Height from valley to peak in µm, of the same presets [default: 0.25, lamellar 0.125]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    height: Option<f64>,
    /// Edge in µm of the sub-regions of the presets elaphe and xenopeltis; needs --region-spread [default: none]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    region_size: Option<f64>,
    /// By how much the frequency lies above and below the skin's in alternate sub-regions, relative, 0 to 0.1; needs
    /// --region-size [default: none]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    region_spread: Option<f64>,
    /// Height field: .gwy, .gsf, .spm, .sdf, .x3p, .tif, .exr, .png, .npy, .xyz, .txt, .csv, .asc, .dat or .grd
    #[arg(long, value_name = "FILE")]
    height_field: Option<PathBuf>,
    /// Edge of a pixel of the file in µm [default: the file's own]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    pixel_size: Option<f64>,
    /// Height in µm of the file's largest value [default: the file's own]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    max_height: Option<f64>,
    /// Channel of a file that holds several (.gwy, .spm, .tif, .x3p, NanoScope's text), by number or title [default: the first
    /// height]
    #[arg(long, value_name = "CHANNEL")]
    channel: Option<String>,
    /// What is put where the file has no height [default: none, such a file is refused]
    #[arg(long, value_parser = names::<Fill, _>(Fill::ALL.map(Fill::name)))]
    fill: Option<Fill>,
    /// By which theory the relief diffracts: a phase screen, or Maxwell's equations for one that varies along x alone
    /// [default: scalar]
    #[arg(long, value_parser = names::<Theory, _>(Theory::ALL.map(Theory::name)))]
    theory: Option<Theory>,
    /// Four standard deviations of the coherence window in µm [default: 65]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    coherence_length: Option<f64>,
    /// Mean over all places of the window, or one window in a fixed place [default: ensemble]
    #[arg(long, value_parser = names::<Model, 2>(["ensemble", "patch"]))]
    model: Option<Model>,
    /// Obliquity factor; auto is small_slope with a k of at most a tenth of eta, else stam [default: auto]
    #[arg(long, value_parser = names::<ObliquityChoice, _>(ObliquityChoice::ALL.map(ObliquityChoice::name)))]
    obliquity: Option<ObliquityChoice>,
    /// Whether the tile repeats [default: periodic for presets, aperiodic for files]
    #[arg(long, value_parser = names::<Tiling, 2>(["periodic", "aperiodic"]))]
    tiling: Option<Tiling>,
    /// What is taken off the heights [default: none for presets, plane for files]
    #[arg(long, value_parser = names::<Level, _>(Level::ALL.map(Level::name)))]
    level: Option<Level>,
    /// Divide by the larger of both directions' albedos where they exceed 1 [default: true for ensemble, false for patch]
    #[arg(long, value_name = "BOOL")]
    conserve_energy: Option<bool>,
    /// V-cavity shadowing and masking [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    shadowing: Option<bool>,
    /// Real part of the refractive index; with --eta alone the surface is a dielectric, with neither it reflects
    /// everything
    #[arg(long, allow_negative_numbers = true)]
    eta: Option<f64>,
    /// Imaginary part of the refractive index; needs --eta
    #[arg(long, allow_negative_numbers = true)]
    k: Option<f64>,
    /// Relative error that the tables are built to [default: 1e-3]
    #[arg(long, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Factor on what building the tables may take, 8 GB and two minutes on two cores [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    build_limit: Option<f64>,
    /// Build the tables even if the cache has them, and do not keep them
    #[arg(long)]
    no_cache: bool,
}

impl SurfaceArgs {
    /// The configuration that the arguments amount to, validated.
    pub fn config(&self) -> Result<SurfaceConfig, ConfigError> {
        let default = SurfaceConfig::default();
        let config = SurfaceConfig {
            preset: self.preset,
            period: self.period,
            height: self.height,
            region_size: self.region_size,
            region_spread: self.region_spread,
            filename: self.height_field.clone(),
            pixel_size: self.pixel_size,
            max_height: self.max_height,
            channel: self.channel.clone(),
            fill: self.fill,
            level: self.level,
            tiling: self.tiling,
            theory: self.theory.unwrap_or_default(),
            coherence_length: self.coherence_length.unwrap_or(default.coherence_length),
            model: self.model.unwrap_or(default.model),
            obliquity: self.obliquity.unwrap_or(default.obliquity),
            conserve_energy: self.conserve_energy,
            shadowing: self.shadowing.unwrap_or(default.shadowing),
            eta: self.eta,
            k: self.k,
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            build_limit: self.build_limit.unwrap_or(default.build_limit),
        };
        config.validate()?;
        Ok(config)
    }

    /// Where tables are kept: what the environment says, unless the arguments say nowhere.
    pub fn cache(&self) -> Result<Cache, CacheError> {
        if self.no_cache { Ok(Cache::off()) } else { Cache::from_env() }
    }

    /// As [`SurfaceArgs::config`] for a method of colours. The colour table knows both theories, and conserves energy where that is
    /// asked for; the published methods never do, and know a phase screen with one window in a fixed place over a tile that repeats:
    /// these are the defaults, and what asks for anything else is refused. So are factors that the colours of GPU Gems are not
    /// multiplied by, and samples of a table that a grating does not have.
    pub fn realtime_config(&self, kind: MethodKind, options: &MethodOptions) -> Result<SurfaceConfig, Box<dyn Error>> {
        let (patch, conserve) = (kind.is_patch_only(), self.conserve_energy == Some(true));
        let rigorous = self.theory == Some(Theory::Rigorous);
        let wrong = [
            (patch && rigorous, "a phase screen", "--theory", "scalar"),
            (patch && self.model == Some(Model::Ensemble), "one window in a fixed place", "--model", "patch"),
            (patch && self.tiling == Some(Tiling::Aperiodic), "a tile that repeats", "--tiling", "periodic"),
            (conserve && patch, "no albedo", "--conserve-energy", "false"),
            (conserve && self.model == Some(Model::Patch), "no albedo of a patch", "--conserve-energy", "false"),
        ];
        if let Some((_, knows, flag, value)) = wrong.iter().find(|(wrong, ..)| *wrong) {
            return Err(format!("--method {kind} knows {knows}: {flag} must be {value}").into());
        }
        if rigorous {
            if options.resolution != MethodOptions::default().resolution {
                return Err(
                    "--table-resolution has no effect with --theory rigorous, whose tables are made otherwise".into()
                );
            }
            return Ok(self.config()?);
        }
        let gems = kind == MethodKind::Stam && options.stam_form == StamForm::Gems;
        let factors = [("--obliquity", self.obliquity.is_some()), ("--shadowing", self.shadowing == Some(true))];
        if let Some((flag, _)) = factors.iter().find(|(_, given)| gems && *given) {
            return Err(
                format!("{flag} has no effect with --stam-form gems, whose colours are shown as they are").into()
            );
        }
        let asked = Self { conserve_energy: Some(conserve), ..self.clone() };
        if patch {
            return Ok(Self { model: Some(Model::Patch), tiling: Some(Tiling::Periodic), ..asked }.config()?);
        }
        Ok(asked.config()?)
    }

    /// Whether the arguments give a refractive index.
    pub fn has_index(&self) -> bool {
        self.eta.is_some() || self.k.is_some()
    }

    /// Whether the arguments name a surface.
    pub fn is_given(&self) -> bool {
        self.preset.is_some() || self.height_field.is_some()
    }

    /// The same arguments for each of the presets.
    pub fn presets(&self, presets: &[Preset]) -> Vec<Self> {
        presets.iter().map(|preset| Self { preset: Some(*preset), ..self.clone() }).collect()
    }

    /// Refuses what does not leave the methods comparable: each is held against its own model, on a tile that repeats,
    /// without Fresnel reflectance, energy not conserved.
    pub fn refuse_what_methods_differ_in(&self) -> Result<(), String> {
        let given = [
            ("--model", self.model.is_some()),
            ("--tiling", self.tiling.is_some()),
            ("--conserve-energy", self.conserve_energy.is_some()),
            ("--eta", self.eta.is_some()),
            ("--k", self.k.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((flag, _)) => {
                Err(format!("{flag} has no effect here: each method is measured with the model it knows"))
            }
            None => Ok(()),
        }
    }
}

fn preset_names() -> impl TypedValueParser<Value = Preset> {
    names(Preset::ALL.map(Preset::name))
}

/// A parser for a choice among names that the library reads too.
pub fn names<T, const N: usize>(accepted: [&'static str; N]) -> impl TypedValueParser<Value = T>
where
    T: for<'de> Deserialize<'de> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(accepted).try_map(|name: String| -> Result<T, NameError> {
        let reader: StrDeserializer<'_, NameError> = name.as_str().into_deserializer();
        T::deserialize(reader)
    })
}
