use super::{Outcome, print_json, realtime};
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::grating::{GratingColourSurface, GratingSurface, preset_profile};
use sunbeam::height_field::Preset;
use sunbeam::methods::{Method, MethodKind, MethodOptions, StamForm, build};
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Progress};
use sunbeam_realtime::{AdapterChoice, Gpu, Optics, Query, Renderer, Shader, TonePass};

/// Period and height of the grating in µm: one order, which is solved in a tenth of a second.
const GRATING_UM: (f64, f64) = (0.3, 0.05);
/// Coherence length of the grating, the default of every surface.
const GRATING_COHERENCE_UM: f64 = 65.0;
/// Relative error of the grating's table, the loosest: its shader is compiled, and its colours are not looked at.
const GRATING_TOLERANCE: f64 = 1.0;
/// Format of the window's texture, which the tone pass draws to.
const WINDOW_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Describe the GPU adapter, compile every shader on it, and lose its device
///
/// Opens the adapter that render and view would take, compiles each of their shaders, and then destroys the device, as a
/// driver's reset would. Prints as JSON the adapter with its driver, the milliseconds of each shader, and the error that
/// work on the lost device ends with. A shader that the driver refuses is an error that names it.
#[derive(clap::Args)]
pub struct AdapterArgs {
    /// The GPU, or the software adapter [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
}

#[derive(Serialize)]
struct Report {
    adapter: String,
    backend: &'static str,
    software: bool,
    driver: String,
    /// `timestamps` of the GPU, or `wall clock` around each submission.
    clock: &'static str,
    /// Largest storage buffer that a shader can bind, in bytes.
    storage_buffer_bytes_max: u64,
    shaders: Vec<CompiledShader>,
    /// The error of work that was submitted to the lost device.
    lost_device: String,
}

#[derive(Serialize)]
struct CompiledShader {
    name: String,
    /// Compilation and a first answer, during which drivers finish it.
    ms: f64,
}

/// Runs `sunbeam adapter`.
pub fn run(args: &AdapterArgs) -> Outcome {
    let gpu = realtime::open(args.adapter)?;
    let (shaders, last) = compile_all(&gpu)?;
    let info = gpu.device().adapter_info();
    print_json(&Report {
        adapter: gpu.adapter(),
        backend: gpu.backend(),
        software: gpu.is_software(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        clock: realtime::clock(&gpu),
        storage_buffer_bytes_max: gpu.device().limits().max_storage_buffer_binding_size,
        shaders,
        lost_device: lose(&gpu, &last)?,
    })
}

/// Compiles the renderer's own shaders and that of each method; the last one is returned to be asked again.
fn compile_all(gpu: &Gpu) -> Result<(Vec<CompiledShader>, Shader), Box<dyn Error>> {
    let mut compiled = Vec::new();
    timed(&mut compiled, "raster, shadow, locate, resolve", || Ok(Renderer::new(gpu)?))?;
    timed(&mut compiled, "tone", || {
        TonePass::new(gpu.device(), WINDOW_FORMAT);
        Ok(gpu.check()?)
    })?;
    let field = Preset::Sinusoidal.build(None, None)?;
    let bare = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    let mut shade = |name: &str, method: &dyn Method| {
        timed(&mut compiled, &format!("shade, {name}"), || Ok(Shader::new(gpu, method, &Optics::default())?))
    };
    for kind in MethodKind::ALL {
        shade(kind.name(), &*build(kind, &field, &bare, &MethodOptions::default())?)?;
    }
    let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
    shade("stam of GPU Gems", &*build(MethodKind::Stam, &field, &bare, &gems)?)?;
    let keeps_energy = build(MethodKind::Table, &field, &Options::default(), &MethodOptions::default())?;
    shade("table that keeps energy", &*keeps_energy)?;
    let last = shade("grating by Maxwell's equations", &grating()?)?;
    Ok((compiled, last))
}

/// A grating in a perfect conductor.
fn grating() -> Result<GratingColourSurface, Box<dyn Error>> {
    let (period, height) = GRATING_UM;
    let profile = preset_profile(Preset::Sinusoidal, Some(period), Some(height))?.ok_or("a sinusoid is a grating")?;
    let surface = GratingSurface::new(&profile, None, GRATING_COHERENCE_UM, GRATING_TOLERANCE, &Progress::none())?;
    Ok(GratingColourSurface::new(surface))
}

/// Runs a compilation, and adds its time to the list or its name to the error.
fn timed<T>(
    compiled: &mut Vec<CompiledShader>,
    name: &str,
    compile: impl FnOnce() -> Result<T, Box<dyn Error>>,
) -> Result<T, Box<dyn Error>> {
    let start = Instant::now();
    let made = compile().map_err(|error| format!("shader {name:?}: {error}"))?;
    compiled.push(CompiledShader { name: name.to_owned(), ms: start.elapsed().as_secs_f64() * 1e3 });
    Ok(made)
}

/// Destroys the device and returns the message of the error that the next work ends with.
fn lose(gpu: &Gpu, shader: &Shader) -> Result<String, Box<dyn Error>> {
    gpu.device().destroy();
    match shader.evaluate(gpu, &[Query::default()]) {
        Ok(_) => Err(format!("the GPU adapter {} answers although its device was destroyed", gpu.adapter()).into()),
        Err(error) => Ok(error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")),
    }
}
