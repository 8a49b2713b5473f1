//! A method on the GPU, for the subcommands that have one there.

use super::method_args::{Asked, MethodArgs};
use super::progress::{BUILDING, with_bar};
use super::surface_args::SurfaceArgs;
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::SurfaceConfig;
use sunbeam::methods::{MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, SpectralIndex};
use sunbeam_realtime::{AdapterChoice, Gpu, Optics, Shader};

/// The adapter that is asked for, or that the environment names.
pub fn open(adapter: Option<AdapterChoice>) -> Result<Gpu, Box<dyn Error>> {
    Ok(Gpu::open(adapter.map_or_else(AdapterChoice::from_env, Ok)?)?)
}

/// The clock of an adapter's times: `timestamps` of the GPU, or `wall clock` around each submission.
pub fn clock(gpu: &Gpu) -> &'static str {
    if gpu.has_timestamps() { "timestamps" } else { "wall clock" }
}

/// A method that the GPU has, with its options and the surface it is for.
pub struct Realtime {
    kind: MethodKind,
    options: MethodOptions,
    config: SurfaceConfig,
    cache: Cache,
}

/// What a method was and took.
#[derive(Serialize)]
pub struct MethodReport {
    method: &'static str,
    options: MethodOptions,
    /// Seconds to make the method's data.
    build_seconds: f64,
    /// Bytes of that data on the GPU.
    method_bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    quadrature: Option<Quadrature>,
}

/// The sum over wavelengths of a method that has equal steps.
#[derive(Serialize)]
struct Quadrature {
    wavelengths_nm: Vec<f64>,
    /// Linear sRGB; they sum to (1, 1, 1).
    weights: Vec<[f64; 3]>,
}

impl MethodReport {
    /// How many wavelengths are summed; `None` where they depend on the directions.
    pub fn wavelengths(&self) -> Option<usize> {
        self.quadrature.as_ref().map(|sum| sum.wavelengths_nm.len())
    }
}

impl Realtime {
    /// What the arguments amount to, validated.
    pub fn new(method: &MethodArgs, surface: &SurfaceArgs) -> Result<Self, Box<dyn Error>> {
        let Some(kind) = method.method().on_gpu() else {
            let has = MethodKind::ALL.map(MethodKind::name).join(", ");
            return Err(format!("--method {} is not on the GPU, which has {has}", method.method().name()).into());
        };
        let options = method.options(Asked::ColourOnGpu)?;
        let config = surface.realtime_config(kind, &options)?;
        Ok(Self { kind, options, config, cache: surface.cache()? })
    }

    /// What is to be built, for who builds it later, and other things after it.
    pub fn into_parts(self) -> (MethodKind, MethodOptions, SurfaceConfig, Cache) {
        (self.kind, self.options, self.config, self.cache)
    }

    /// Makes the method's data and uploads it. `index` is the refractive index, `None` to reflect everything.
    pub fn build(&self, gpu: &Gpu, index: Option<ComplexIndex>) -> Result<(Shader, MethodReport), Box<dyn Error>> {
        let Self { kind, options, config, cache } = self;
        let start = Instant::now();
        let material = index.map(SpectralIndex::Constant);
        let method =
            with_bar(BUILDING, |progress| config.build_method(*kind, options, material.as_ref(), cache, progress))?;
        let build_seconds = start.elapsed().as_secs_f64();
        let surface = config.options_for(material.as_ref());
        let optics = Optics { index, obliquity: surface.obliquity, shadowing: surface.shadowing };
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

    /// `None` where the wavelengths depend on the directions.
    fn quadrature(&self) -> Result<Option<Quadrature>, Box<dyn Error>> {
        if !self.kind.options().contains(&"lambda_step_nm") {
            return Ok(None);
        }
        let sum = SpectralToRgb::visible(self.options.lambda_step_nm)?;
        Ok(Some(Quadrature { wavelengths_nm: sum.wavelengths_nm().collect(), weights: sum.weights().to_vec() }))
    }
}
