//! A method on the GPU, for the subcommands that draw pictures or evaluate maps there.

use super::method_args::{MethodArgs, Quantity};
use super::progress::{BUILDING, with_bar};
use super::surface_args::SurfaceArgs;
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::SurfaceConfig;
use sunbeam::methods::{MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, Options, SpectralIndex};
use sunbeam_realtime::{AdapterChoice, Gpu, Optics, Shader};

/// Opens the adapter that the argument `--adapter` chooses, else the variable `SUNBEAM_ADAPTER`, else any adapter.
///
/// # Errors
/// No such adapter, or a wrong value of the variable.
pub fn open(adapter: Option<AdapterChoice>) -> Result<Gpu, Box<dyn Error>> {
    Ok(Gpu::open(adapter.map_or_else(AdapterChoice::from_env, Ok)?)?)
}

/// The clock of an adapter's times: `timestamps` of the GPU, or `wall clock` around each submission.
pub(crate) fn clock(gpu: &Gpu) -> &'static str {
    if gpu.has_timestamps() { "timestamps" } else { "wall clock" }
}

/// A method on the GPU with its options, and the surface that it evaluates.
pub struct Realtime {
    kind: MethodKind,
    options: MethodOptions,
    config: SurfaceConfig,
    cache: Cache,
}

/// The method in a report.
#[derive(Serialize)]
pub struct MethodReport {
    method: &'static str,
    options: MethodOptions,
    /// Wall-clock time to compute the method's data, or to read it from the cache.
    build_seconds: f64,
    /// Size of the data on the GPU in bytes.
    method_bytes: u64,
    /// The sum over wavelengths; `None` for methods without uniform steps between wavelengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    quadrature: Option<Quadrature>,
}

/// The sum over wavelengths of a method with uniform steps between them.
#[derive(Serialize)]
struct Quadrature {
    wavelengths_nm: Vec<f64>,
    /// Weight of each wavelength in linear sRGB; the weights sum to (1, 1, 1).
    weights: Vec<[f64; 3]>,
}

impl MethodReport {
    /// The number of wavelengths that a colour sums; `None` for methods without uniform steps between wavelengths.
    pub(crate) fn wavelengths(&self) -> Option<usize> {
        self.quadrature.as_ref().map(|quadrature| quadrature.wavelengths_nm.len())
    }
}

impl Realtime {
    /// The method and the surface of the arguments, validated.
    ///
    /// # Errors
    /// A method that the GPU does not have, or an argument that is out of range, contradictory or without effect.
    pub fn new(method: &MethodArgs, surface: &SurfaceArgs) -> Result<Self, Box<dyn Error>> {
        let Some(kind) = method.method().on_gpu() else {
            let available = MethodKind::ALL.map(MethodKind::name).join(", ");
            return Err(format!("--method {} is not on the GPU, which has {available}", method.method().name()).into());
        };
        let options = method.options(Quantity::ColourOnGpu)?;
        let config = surface.colour_config(kind, &options)?;
        // Not every method shows a surface that transmits.
        kind.accept(config.body())?;
        Ok(Self { kind, options, config, cache: surface.cache()? })
    }

    /// The method, its options, the surface and the cache, for a caller that builds the method itself.
    pub fn into_parts(self) -> (MethodKind, MethodOptions, SurfaceConfig, Cache) {
        (self.kind, self.options, self.config, self.cache)
    }

    /// Computes the method's data and uploads it. `index` replaces the refractive index of the surface's arguments;
    /// without it the surface reflects everything.
    ///
    /// # Errors
    /// A relief that cannot be read, a method that cannot be built, or a shader or data that the GPU refuses.
    pub(crate) fn build(
        &self,
        gpu: &Gpu,
        index: Option<ComplexIndex>,
    ) -> Result<(Shader, MethodReport), Box<dyn Error>> {
        let Self { kind, options, config, cache } = self;
        let start = Instant::now();
        let spectral_index = index.map(SpectralIndex::Constant);
        let method = with_bar(BUILDING, |progress| {
            config.build_method(*kind, options, spectral_index.as_ref(), cache, progress)
        })?;
        let build_seconds = start.elapsed().as_secs_f64();
        // The automatic choice of the obliquity factor depends on the index, which may differ from the configuration's.
        let Options { obliquity, shadowing, .. } = config.options_for(spectral_index.as_ref());
        let optics = Optics { index, cover: config.cover(), obliquity, shadowing };
        let shader = Shader::new(gpu, &*method, &optics)?;
        let report = MethodReport {
            method: kind.name(),
            options: options.clone(),
            build_seconds,
            method_bytes: shader.bytes(),
            quadrature: self.quadrature()?,
        };
        Ok((shader, report))
    }

    /// The sum over wavelengths, if the method reads the option `lambda_step_nm`: its steps are then uniform.
    fn quadrature(&self) -> Result<Option<Quadrature>, Box<dyn Error>> {
        if !self.kind.options().contains(&"lambda_step_nm") {
            return Ok(None);
        }
        let to_rgb = SpectralToRgb::visible(self.options.lambda_step_nm)?;
        Ok(Some(Quadrature { wavelengths_nm: to_rgb.wavelengths_nm().collect(), weights: to_rgb.weights().to_vec() }))
    }
}
