//! Speed against error of every method, numerical stability, and the sampler.

mod plot;

use super::output::{Output, output};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use crate::benchmarks::INCIDENT_DEG;
use crate::benchmarks::methods::{self, SurfaceFigures};
use crate::benchmarks::sampler::{SamplerRow, sampler};
use crate::benchmarks::stability::{self, StabilityFigures};
use clap::ValueEnum;
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::config::{Source, SurfaceConfig};
use sunbeam::height_field::Preset;
use sunbeam_realtime::{Gpu, GpuError};

/// The surfaces that are measured unless one is given: with every method, and by the sampler.
const PRESETS: [Preset; 3] = [Preset::Blazed, Preset::Elaphe, Preset::Xenopeltis];
const SAMPLED_PRESETS: [Preset; 6] =
    [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar, Preset::Cd, Preset::Elaphe, Preset::Xenopeltis];
/// Samples of each incidence and wavelength, in full and quickly.
const SAMPLES: (usize, usize) = (100_000, 1000);

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum What {
    /// Time, memory and error of every method and parameter set
    Methods,
    /// Deep relief, grazing directions and random questions
    Stability,
    /// How evenly importance sampling weighs what it finds
    Sampler,
}

/// Measure speed against error of every method, numerical stability, or the sampler
///
/// methods: for each method and set of parameters the time of a colour on one core and on the GPU, memory, build time,
/// and the error against the direct double-precision sum of the same model, over four directions of incidence, on the presets
/// blazed, elaphe and xenopeltis or on the surface given. stability: errors as the relief grows deep and directions grazing,
/// and random questions that must not break anything. sampler: deviation, 99.9th percentile and largest of the weight
/// f_r cosθo / pdf over incidences from 0° to 85°, three azimuths and three wavelengths.
#[derive(clap::Args)]
pub struct BenchArgs {
    /// What is measured
    #[arg(long, value_enum, default_value_t = What::Methods)]
    what: What,
    /// Where the figures go as JSON (.json); "-" is stdout
    #[arg(long, value_name = "FILE", default_value = "-", value_parser = output(&["json"]).or_stdout())]
    json: Output,
    /// Time against error, with the front, one panel a surface (.svg); of --what methods
    #[arg(long, value_name = "FILE", value_parser = output(&["svg"]))]
    plot: Option<Output>,
    /// Few directions, parameters and repetitions: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Leave the GPU out
    #[arg(long)]
    cpu_only: bool,
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Serialize)]
struct MethodsReport {
    what: What,
    quick: bool,
    /// Of the adapter that ran the methods' twins; without one there are no times of a GPU.
    #[serde(skip_serializing_if = "Option::is_none")]
    adapter: Option<AdapterReport>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    no_adapter: Option<String>,
    effort: methods::Effort,
    /// Angle with the normal and azimuth of each direction of incidence.
    incident_deg: [(f64, f64); 4],
    surfaces: Vec<Named<SurfaceFigures>>,
    seconds: f64,
}

#[derive(Serialize)]
struct AdapterReport {
    name: String,
    software: bool,
}

#[derive(Serialize)]
struct Named<T> {
    name: String,
    #[serde(flatten)]
    figures: T,
}

#[derive(Serialize)]
struct StabilityReport {
    what: What,
    quick: bool,
    effort: stability::Effort,
    #[serde(flatten)]
    figures: StabilityFigures,
    seconds: f64,
}

#[derive(Serialize)]
struct SamplerReport {
    what: What,
    quick: bool,
    /// Samples of each incidence and wavelength.
    samples: usize,
    surfaces: Vec<Named<SamplerFigures>>,
    seconds: f64,
}

#[derive(Serialize)]
struct SamplerFigures {
    /// What the sampler keeps beside the table of `S`.
    bytes: usize,
    rows: Vec<SamplerRow>,
}

/// Runs `sunbeam bench`.
pub fn run(args: &BenchArgs) -> Outcome {
    match args.what {
        What::Methods => bench_methods(args),
        What::Stability => bench_stability(args),
        What::Sampler => bench_sampler(args),
    }
}

fn bench_methods(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    args.surface.refuse_bench_choices()?;
    let effort = if args.quick { methods::Effort::QUICK } else { methods::Effort::FULL };
    let (adapter, no_adapter) = if args.cpu_only { (None, Some("left out".to_owned())) } else { adapter()? };
    if let Some(reason) = &no_adapter {
        eprintln!("no times of a GPU: {reason}");
    }
    let given = if args.surface.is_given() { vec![args.surface.clone()] } else { args.surface.presets(&PRESETS) };
    let mut surfaces = Vec::new();
    for surface in given {
        let config = surface.config()?;
        let name = name(&config);
        let mut progress = |stage: &str| eprintln!("[{:4.0} s] {name}: {stage}", start.elapsed().as_secs_f64());
        let field = config.height_field()?;
        let figures = methods::measure(&field, &config.options(), &effort, adapter.as_ref(), &mut progress)?;
        surfaces.push(Named { name, figures });
    }
    let report = MethodsReport {
        what: args.what,
        quick: args.quick,
        adapter: adapter.as_ref().map(adapter_report),
        no_adapter,
        effort,
        incident_deg: INCIDENT_DEG,
        surfaces,
        seconds: start.elapsed().as_secs_f64(),
    };
    if let Some(file) = &args.plot {
        let panels: Vec<_> = report.surfaces.iter().map(|s| (s.name.as_str(), s.figures.entries.as_slice())).collect();
        file.write(plot::svg(&panels).as_bytes())?;
    }
    write_json(&args.json, &report)
}

fn bench_stability(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    if args.surface.is_given() || args.plot.is_some() {
        return Err("--what stability has surfaces of its own and no plot".into());
    }
    let effort = if args.quick { stability::Effort::QUICK } else { stability::Effort::FULL };
    let mut progress = |stage: &str| eprintln!("[{:4.0} s] {stage}", start.elapsed().as_secs_f64());
    let figures = stability::measure(&effort, &mut progress)?;
    let seconds = start.elapsed().as_secs_f64();
    write_json(&args.json, &StabilityReport { what: args.what, quick: args.quick, effort, figures, seconds })
}

fn bench_sampler(args: &BenchArgs) -> Outcome {
    let start = Instant::now();
    if args.plot.is_some() {
        return Err("--what sampler has no plot".into());
    }
    let samples = if args.quick { SAMPLES.1 } else { SAMPLES.0 };
    let given =
        if args.surface.is_given() { vec![args.surface.clone()] } else { args.surface.presets(&SAMPLED_PRESETS) };
    let mut surfaces = Vec::new();
    for surface in given {
        let config = surface.config()?;
        let name = name(&config);
        eprintln!("[{:4.0} s] {name}", start.elapsed().as_secs_f64());
        let (surface, _) = config.build(&Cache::off())?;
        let figures = SamplerFigures { bytes: surface.sampler().bytes(), rows: sampler(&surface, samples) };
        surfaces.push(Named { name, figures });
    }
    let seconds = start.elapsed().as_secs_f64();
    write_json(&args.json, &SamplerReport { what: args.what, quick: args.quick, samples, surfaces, seconds })
}

/// What a surface is called: its preset or its file.
fn name(config: &SurfaceConfig) -> String {
    match config.source() {
        Source::Preset(preset) => preset.name().to_owned(),
        Source::File(path) => path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
    }
}

/// The adapter, or why there is none.
fn adapter() -> Result<(Option<Gpu>, Option<String>), Box<dyn Error>> {
    match super::realtime::open(None) {
        Ok(gpu) => Ok((Some(gpu), None)),
        Err(error) => match error.downcast_ref::<GpuError>() {
            Some(GpuError::NoAdapter { .. }) => Ok((None, Some(error.to_string()))),
            _ => Err(error),
        },
    }
}

fn adapter_report(gpu: &Gpu) -> AdapterReport {
    AdapterReport { name: gpu.adapter(), software: gpu.is_software() }
}

fn write_json(file: &Output, report: &impl Serialize) -> Outcome {
    if file.is_stdout() {
        return print_json(report);
    }
    let text = serde_json::to_string_pretty(report)? + "\n";
    Ok(file.write(text.as_bytes())?)
}
