//! `sunbeam bench`: speed against error of every method, numerical stability, and the sampler's weights.
//!
//! The measurements are in [`crate::benchmarks`]. This module has the arguments, the choice of surfaces and the
//! reports.

mod plot;

use super::output::{Output, output};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use crate::benchmarks::INCIDENT_DEG;
use crate::benchmarks::methods::{self, SurfaceFigures};
use crate::benchmarks::sampler::{SamplerRow, weight_statistics};
use crate::benchmarks::stability::{self, StabilityFigures};
use clap::ValueEnum;
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::config::{Source, SurfaceConfig, Theory};
use sunbeam::height_field::Preset;
use sunbeam_realtime::{Gpu, GpuError};

/// Presets whose methods are measured unless a surface is given.
const METHOD_PRESETS: [Preset; 3] = [Preset::Blazed, Preset::Elaphe, Preset::Xenopeltis];
/// Presets whose samplers are measured unless a surface is given.
const SAMPLER_PRESETS: [Preset; 6] =
    [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar, Preset::Cd, Preset::Elaphe, Preset::Xenopeltis];
/// Samples for each direction of the incident light and each wavelength. About 100 of them lie above the 99.9th
/// percentile; with more samples the percentile would be more certain.
const SAMPLES: usize = 100_000;
/// Samples with `--quick`, where the 99.9th percentile is the largest sample.
const QUICK_SAMPLES: usize = 1000;

/// The subject of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Subject {
    /// Time, memory and error of every method and parameter set
    Methods,
    /// Errors at deep relief and grazing directions, and answers to random queries
    Stability,
    /// Statistics of the weights of importance sampling
    Sampler,
}

/// Measure speed against error of every method, numerical stability, or the sampler
///
/// --what methods measures each method with each set of parameters: the time of a colour on one core and on the GPU,
/// memory, build time, and the error against the direct double-precision sum of the same model. Light comes from four
/// directions, on the presets blazed, elaphe and xenopeltis or on the given surface.
///
/// --what stability measures errors as the relief grows deep and the directions graze, and checks reflectances,
/// densities and samples of random surfaces in random directions.
///
/// --what sampler measures the standard deviation, the 99.9th percentile and the largest of the weight f_r·cosθo/pdf,
/// for angles of incidence from 0° to 85°, three azimuths and three wavelengths.
#[derive(clap::Args)]
pub(crate) struct BenchArgs {
    /// Subject of the measurement
    #[arg(long, value_enum, default_value_t = Subject::Methods)]
    what: Subject,
    /// File for the figures as JSON (.json); "-" is stdout
    #[arg(long, value_name = "FILE", default_value = "-", value_parser = output(&["json"]).or_stdout())]
    json: Output,
    /// File for a plot of time against error with the Pareto front, one chart for each surface (.svg); with --what
    /// methods
    #[arg(long, value_name = "FILE", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// Measure fewer directions, parameter sets, repetitions, queries or samples: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Measure no times of the GPU; with --what methods
    #[arg(long)]
    cpu_only: bool,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// The JSON of `--what methods`.
#[derive(Serialize)]
struct MethodsReport {
    what: Subject,
    quick: bool,
    /// The adapter of the GPU times; `None` where these are not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    adapter: Option<AdapterReport>,
    /// The reason why GPU times are not measured: an adapter is missing, or `--cpu-only` leaves them out. `None` where
    /// they are measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    no_adapter: Option<String>,
    effort: methods::Effort,
    /// Angle with the normal and azimuth of each direction of the incident light, in degrees.
    incident_deg: [(f64, f64); 4],
    surfaces: Vec<Named<SurfaceFigures>>,
    /// Wall-clock time of the run in s.
    seconds: f64,
}

/// The adapter of the GPU times.
#[derive(Serialize)]
struct AdapterReport {
    name: String,
    /// Whether the adapter renders in software, on the CPU.
    software: bool,
}

/// A surface's name ([`surface_name`]) and figures.
#[derive(Serialize)]
struct Named<T> {
    name: String,
    #[serde(flatten)]
    figures: T,
}

/// The JSON of `--what stability`.
#[derive(Serialize)]
struct StabilityReport {
    what: Subject,
    quick: bool,
    effort: stability::Effort,
    #[serde(flatten)]
    figures: StabilityFigures,
    /// Wall-clock time of the run in s.
    seconds: f64,
}

/// The JSON of `--what sampler`.
#[derive(Serialize)]
struct SamplerReport {
    what: Subject,
    quick: bool,
    /// Samples for each direction of the incident light and each wavelength.
    samples: usize,
    surfaces: Vec<Named<SamplerFigures>>,
    /// Wall-clock time of the run in s.
    seconds: f64,
}

/// Data size and statistics of one surface's sampler.
#[derive(Serialize)]
struct SamplerFigures {
    /// Size of the sampler's data in bytes, without the table of the power spectrum.
    bytes: usize,
    /// Statistics for each direction of the incident light and each wavelength.
    rows: Vec<SamplerRow>,
}

/// Runs `sunbeam bench`.
pub(crate) fn run(args: &BenchArgs) -> Outcome {
    match args.what {
        Subject::Methods => bench_methods(args),
        Subject::Stability => bench_stability(args),
        Subject::Sampler => bench_sampler(args),
    }
}

/// Runs `--what methods`: measures the methods on each surface, draws the plot and writes the report.
fn bench_methods(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    // Refuses arguments that the benchmark sets itself, such as --model and --tiling.
    args.surface.refuse_bench_choices()?;
    let effort = if args.quick { methods::Effort::QUICK } else { methods::Effort::FULL };
    let gpu = if args.cpu_only { Err("left out".to_owned()) } else { open_gpu()? };
    if let Err(reason) = &gpu {
        eprintln!("no times of a GPU: {reason}");
    }
    let mut surfaces = Vec::new();
    for surface_args in args.surfaces(&METHOD_PRESETS) {
        let config = surface_args.config()?;
        let name = surface_name(&config);
        let mut progress = |stage: &str| log(start, &format!("{name}: {stage}"));
        let field = config.height_field()?;
        let figures = methods::measure(&field, &config.options(), &effort, gpu.as_ref().ok(), &mut progress)?;
        surfaces.push(Named { name, figures });
    }
    let report = MethodsReport {
        what: args.what,
        quick: args.quick,
        adapter: gpu.as_ref().ok().map(|gpu| AdapterReport { name: gpu.adapter(), software: gpu.is_software() }),
        no_adapter: gpu.err(),
        effort,
        incident_deg: INCIDENT_DEG,
        surfaces,
        seconds: start.elapsed().as_secs_f64(),
    };
    if let Some(file) = &args.plot {
        let surfaces: Vec<_> =
            report.surfaces.iter().map(|s| (s.name.as_str(), s.figures.entries.as_slice())).collect();
        file.write(plot::svg(&surfaces).as_bytes())?;
    }
    write_json(&args.json, &report)
}

/// Runs `--what stability`, whose surfaces are fixed.
fn bench_stability(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    if args.surface.config()? != SurfaceConfig::default() || args.plot.is_some() || args.cpu_only {
        return Err("--what stability accepts no argument of a surface, no --plot and no --cpu-only".into());
    }
    let effort = if args.quick { stability::Effort::QUICK } else { stability::Effort::FULL };
    let figures = stability::measure(&effort, &mut |stage: &str| log(start, stage))?;
    let seconds = start.elapsed().as_secs_f64();
    write_json(&args.json, &StabilityReport { what: args.what, quick: args.quick, effort, figures, seconds })
}

/// Runs `--what sampler` on each surface.
fn bench_sampler(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    if args.plot.is_some() || args.cpu_only {
        return Err("--what sampler accepts no --plot and no --cpu-only".into());
    }
    let samples = if args.quick { QUICK_SAMPLES } else { SAMPLES };
    let mut surfaces = Vec::new();
    for surface_args in args.surfaces(&SAMPLER_PRESETS) {
        let config = surface_args.config()?;
        if config.theory == Theory::Rigorous {
            return Err("--what sampler measures the sampler of scalar theory, so --theory must be scalar".into());
        }
        let name = surface_name(&config);
        log(start, &name);
        // Without a cache the tables are always built, so their origin is not reported.
        let (surface, _origin) = config.build(&Cache::off())?;
        let figures = SamplerFigures { bytes: surface.sampler().bytes(), rows: weight_statistics(&surface, samples) };
        surfaces.push(Named { name, figures });
    }
    let seconds = start.elapsed().as_secs_f64();
    write_json(&args.json, &SamplerReport { what: args.what, quick: args.quick, samples, surfaces, seconds })
}

impl BenchArgs {
    /// The given surface; without one, each of `presets` with the other arguments of the surface.
    fn surfaces(&self, presets: &[Preset]) -> Vec<SurfaceArgs> {
        if self.surface.names_relief() { vec![self.surface.clone()] } else { self.surface.with_presets(presets) }
    }
}

/// Prints a line on stderr, preceded by the seconds since `start`.
fn log(start: Instant, text: &str) {
    eprintln!("[{:4.0} s] {text}", start.elapsed().as_secs_f64());
}

/// Name of a surface in the report: the name of its preset, or of its file without the extension.
fn surface_name(config: &SurfaceConfig) -> String {
    match config.source() {
        Source::Preset(preset) => preset.name().to_owned(),
        Source::File(path) => path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
    }
}

/// Opens the GPU. On a machine without an adapter, the inner error is the reason as a text.
///
/// # Errors
/// Any other failure to open the adapter.
fn open_gpu() -> Result<Result<Gpu, String>, Box<dyn Error>> {
    // Without an argument, the environment chooses the adapter.
    match super::realtime::open(None) {
        Ok(gpu) => Ok(Ok(gpu)),
        Err(error) => match error.downcast_ref::<GpuError>() {
            Some(GpuError::NoAdapter { .. }) => Ok(Err(error.to_string())),
            _ => Err(error),
        },
    }
}

/// Writes a report as indented JSON to a file or to stdout.
fn write_json(file: &Output, report: &impl Serialize) -> Outcome {
    if file.is_stdout() {
        return print_json(report);
    }
    let text = serde_json::to_string_pretty(report)? + "\n";
    Ok(file.write(text.as_bytes())?)
}
