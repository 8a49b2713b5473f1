//! The arguments that describe a surface, shared by the subcommands.
//!
//! [`SurfaceArgs`] becomes a [`SurfaceConfig`] of the library, which has the defaults and the checks. Terms of the help
//! texts, as in docs/glossary.md:
//!
//! - tile: the rectangle of relief that a preset or a file gives;
//! - phase screen: the scalar theory's model of a relief, which changes only the phase of the light;
//! - coherence window: the Gaussian within which light interferes. *Patch* is one window at a fixed position,
//!   *ensemble* the mean over all positions;
//! - albedo: the reflected fraction of the light from one direction.

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
use sunbeam::scattering::Transmission;
use sunbeam::table::{Model, Tiling};

/// A surface: its relief, its material, and the model of diffraction.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Surface")]
pub struct SurfaceArgs {
    /// Built-in surface [default: elaphe when there is no --height-field]
    #[arg(long, value_name = "NAME", value_parser = preset_names())]
    preset: Option<Preset>,
    /// Period along x in µm of the presets blazed, sinusoidal and lamellar [default: 2.5]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    period: Option<f64>,
    /// Height from valley to peak in µm of blazed, sinusoidal and lamellar [default: 0.25, lamellar 0.125]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    height: Option<f64>,
    /// Edge in µm of the sub-regions of the presets elaphe and xenopeltis; needs --region-spread [default: no
    /// sub-regions]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    region_size: Option<f64>,
    /// Relative deviation of the spatial frequency, up and down in alternate sub-regions, 0 to 0.1; needs --region-size
    /// [default: no sub-regions]
    #[arg(long, value_name = "FRACTION", allow_negative_numbers = true)]
    region_spread: Option<f64>,
    /// File with a height field: .gwy, .gsf, .spm, .sdf, .x3p, .tif, .exr, .png, .npy, .xyz, .txt, .csv, .asc, .dat or
    /// .grd
    #[arg(long, value_name = "FILE")]
    height_field: Option<PathBuf>,
    /// Edge of a pixel of the file in µm [default: the file's own]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    pixel_size: Option<f64>,
    /// Height in µm of the file's largest value [default: the file's own]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    max_height: Option<f64>,
    /// Channel of a file that holds several (.gwy, .spm, .tif, .x3p, NanoScope's text), by number or title [default:
    /// the first height]
    #[arg(long, value_name = "CHANNEL")]
    channel: Option<String>,
    /// Heights in place of the missing points of the file [default: none, a file with missing points is refused]
    #[arg(long, value_parser = names::<Fill, _>(Fill::ALL.map(Fill::name)))]
    fill: Option<Fill>,
    /// Size of the pattern along x and y relative to the relief given, 1e-3 to 1 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    scale: Option<f64>,
    /// Heights relative to the relief given, 1e-3 to 1 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    depth: Option<f64>,
    /// Theory of diffraction: scalar is a phase screen; rigorous solves Maxwell's equations for a relief that varies
    /// along x alone [default: scalar]
    #[arg(long, value_parser = names::<Theory, _>(Theory::ALL.map(Theory::name)))]
    theory: Option<Theory>,
    /// Four standard deviations of the coherence window in µm [default: 65]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    coherence_length: Option<f64>,
    /// Coherence window: ensemble is the mean over all its positions, patch one fixed window [default: ensemble]
    #[arg(long, value_parser = names::<Model, 2>(["ensemble", "patch"]))]
    model: Option<Model>,
    /// Obliquity factor; auto is small_slope where --eta is given and --k is at most a tenth of
    /// it, else stam [default: auto]
    #[arg(long, value_parser = names::<ObliquityChoice, _>(ObliquityChoice::ALL.map(ObliquityChoice::name)))]
    obliquity: Option<ObliquityChoice>,
    /// Continuation of the tile: periodic repeats it, aperiodic is a single scan with tapered edges [default: aperiodic
    /// for files by the scalar theory, else periodic]
    #[arg(long, value_parser = names::<Tiling, 2>(["periodic", "aperiodic"]))]
    tiling: Option<Tiling>,
    /// Form that is subtracted from the heights [default: none for presets, plane for files]
    #[arg(long, value_parser = names::<Level, _>(Level::ALL.map(Level::name)))]
    level: Option<Level>,
    /// Divide the reflectance by the larger of both directions' albedos where it exceeds 1 [default: true for ensemble,
    /// false for patch]
    #[arg(long, value_name = "BOOL")]
    conserve_energy: Option<bool>,
    /// Apply V-cavity shadowing and masking [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    shadowing: Option<bool>,
    /// Real part of the refractive index; without --k the surface is a dielectric [default: the surface reflects
    /// everything]
    #[arg(long, allow_negative_numbers = true)]
    eta: Option<f64>,
    /// Imaginary part of the refractive index, of a conductor; needs --eta
    #[arg(long, allow_negative_numbers = true)]
    k: Option<f64>,
    /// Index of a flat clear layer over the relief, 1 to 2.6 [default: no layer]
    #[arg(long, value_name = "ETA", allow_negative_numbers = true)]
    cover_eta: Option<f64>,
    /// Fate of the light that passes the relief of a dielectric: film lets it leave through a flat side below,
    /// interface lets it go on in the medium; needs --eta [default: none]
    #[arg(long, value_parser = names::<Transmission, _>(Transmission::ALL.map(Transmission::name)))]
    transmission: Option<Transmission>,
    /// Largest relative error of the tables [default: 1e-3]
    #[arg(long, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Factor on the limits of building tables, 8 GB and two minutes on two cores [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    build_limit: Option<f64>,
    /// Build the tables without reading or writing the cache
    #[arg(long)]
    no_cache: bool,
}

impl SurfaceArgs {
    /// The validated configuration.
    ///
    /// # Errors
    /// An argument out of range, or arguments that contradict each other.
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
            scale: self.scale.unwrap_or(default.scale),
            depth: self.depth.unwrap_or(default.depth),
            theory: self.theory.unwrap_or_default(),
            coherence_length: self.coherence_length.unwrap_or(default.coherence_length),
            model: self.model.unwrap_or(default.model),
            obliquity: self.obliquity.unwrap_or(default.obliquity),
            conserve_energy: self.conserve_energy,
            shadowing: self.shadowing.unwrap_or(default.shadowing),
            // No argument sets sizes, which renderers take from textures.
            sizes: None,
            eta: self.eta,
            k: self.k,
            cover_eta: self.cover_eta,
            transmission: self.transmission.unwrap_or_default(),
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            build_limit: self.build_limit.unwrap_or(default.build_limit),
        };
        config.validate()?;
        Ok(config)
    }

    /// The cache of tables that environment variables configure, or an inactive one with `--no-cache`.
    ///
    /// # Errors
    /// An environment variable with a wrong value.
    pub fn cache(&self) -> Result<Cache, CacheError> {
        if self.no_cache { Ok(Cache::off()) } else { Cache::from_env() }
    }

    /// The validated configuration for a method that computes colours.
    ///
    /// - The published methods ([`MethodKind::is_patch_only`]) assume a phase screen and one fixed coherence window
    ///   over a periodic tile, and do not conserve energy. The arguments have these values by default, and others are
    ///   refused.
    /// - The colour table ([`MethodKind::Table`]) has all theories, models and tilings. It conserves energy with
    ///   `--conserve-energy true`, for the ensemble model of the scalar theory alone.
    ///
    /// # Errors
    /// The errors of [`SurfaceArgs::config`], and an argument that contradicts the method or has no effect with it.
    pub fn colour_config(&self, kind: MethodKind, options: &MethodOptions) -> Result<SurfaceConfig, Box<dyn Error>> {
        self.refuse_contradiction(kind)?;
        if self.theory == Some(Theory::Rigorous) {
            // The method is the colour table, since `refuse_contradiction` refuses the published methods.
            if options.resolution != MethodOptions::default().resolution {
                let reason = "whose tables have other axes";
                return Err(format!("--table-resolution has no effect with --theory rigorous, {reason}").into());
            }
            // `conserve_energy` stays as given, while below a missing value becomes `false`. The rigorous theory
            // conserves energy by itself, and the library refuses `false` for it.
            return Ok(self.config()?);
        }
        if kind == MethodKind::Stam && options.stam_form == StamForm::Gems {
            let factors = [("--obliquity", self.obliquity.is_some()), ("--shadowing", self.shadowing == Some(true))];
            if let Some((flag, _)) = factors.iter().find(|(_, is_given)| *is_given) {
                return Err(no_effect_with_gems(flag).into());
            }
        }
        // The configuration's default would conserve energy for the ensemble model. Methods that compute colours do so
        // only on request.
        let mut args = Self { conserve_energy: Some(self.conserve_energy == Some(true)), ..self.clone() };
        if kind.is_patch_only() {
            (args.model, args.tiling) = (Some(Model::Patch), Some(Tiling::Periodic));
        }
        Ok(args.config()?)
    }

    /// Refuses an argument that contradicts a method that computes colours. The message names the first.
    fn refuse_contradiction(&self, kind: MethodKind) -> Result<(), String> {
        let is_patch_only = kind.is_patch_only();
        let conserves_energy = self.conserve_energy == Some(true);
        // A reason with the method as its subject, the flag, and the only accepted value of the flag.
        let (reason, flag, accepted) = if is_patch_only && self.theory == Some(Theory::Rigorous) {
            ("assumes a phase screen", "--theory", "scalar")
        } else if is_patch_only && self.model == Some(Model::Ensemble) {
            ("assumes one fixed coherence window", "--model", "patch")
        } else if is_patch_only && self.tiling == Some(Tiling::Aperiodic) {
            ("assumes a periodic tile", "--tiling", "periodic")
        } else if is_patch_only && conserves_energy {
            ("has no albedo", "--conserve-energy", "false")
        } else if conserves_energy && self.model == Some(Model::Patch) {
            ("has no albedo of a patch", "--conserve-energy", "false")
        } else {
            return Ok(());
        };
        Err(format!("--method {kind} {reason}: {flag} must be {accepted}"))
    }

    /// The first given flag of the refractive index, `--eta` or `--k`.
    pub(crate) fn index_flag(&self) -> Option<&'static str> {
        let flags = [("--eta", self.eta.is_some()), ("--k", self.k.is_some())];
        flags.into_iter().find(|(_, is_given)| *is_given).map(|(flag, _)| flag)
    }

    /// Whether the arguments give the height of a preset.
    pub fn has_height(&self) -> bool {
        self.height.is_some()
    }

    /// Whether the arguments name a relief, a preset or a file.
    pub fn names_relief(&self) -> bool {
        self.preset.is_some() || self.height_field.is_some()
    }

    /// Copies of these arguments, one with each preset.
    pub fn with_presets(&self, presets: &[Preset]) -> Vec<Self> {
        presets.iter().map(|preset| Self { preset: Some(*preset), ..self.clone() }).collect()
    }

    /// Refuses the arguments that `sunbeam bench --what methods` chooses itself.
    ///
    /// The benchmark compares each method with a reference under the method's own assumptions, on a periodic tile, by
    /// scalar theory, without Fresnel factor, cover and energy conservation.
    ///
    /// # Errors
    /// A message that names the first such argument.
    pub fn refuse_bench_choices(&self) -> Result<(), String> {
        let flags = [
            ("--model", self.model.is_some()),
            ("--tiling", self.tiling.is_some()),
            ("--conserve-energy", self.conserve_energy.is_some()),
            ("--eta", self.eta.is_some()),
            ("--k", self.k.is_some()),
            ("--cover-eta", self.cover_eta.is_some()),
            ("--transmission", self.transmission.is_some()),
            // `--theory scalar` is accepted, since the benchmark uses it.
            ("--theory", self.theory == Some(Theory::Rigorous)),
        ];
        match flags.iter().find(|(_, is_given)| *is_given) {
            Some((flag, _)) => Err(format!("{flag} has no effect here: each method is compared with its own model")),
            None => Ok(()),
        }
    }
}

/// Error message for a flag, such as `--obliquity`, that sets a factor of the reflectance. No factor multiplies the
/// colours of `--stam-form gems`, those of the shader in the book GPU Gems.
pub(crate) fn no_effect_with_gems(flag: &str) -> String {
    format!("{flag} has no effect with --stam-form gems, whose colours no factor multiplies")
}

/// A parser for the name of a preset.
fn preset_names() -> impl TypedValueParser<Value = Preset> {
    names(Preset::ALL.map(Preset::name))
}

/// A parser for one of the `accepted` names. It turns the name into a `T` as the library reads it from JSON.
pub fn names<T, const N: usize>(accepted: [&'static str; N]) -> impl TypedValueParser<Value = T>
where
    T: for<'de> Deserialize<'de> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(accepted).try_map(|name: String| -> Result<T, NameError> {
        let reader: StrDeserializer<'_, NameError> = name.as_str().into_deserializer();
        T::deserialize(reader)
    })
}
