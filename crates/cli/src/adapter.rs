//! `sunbeam adapter`: a check of the GPU adapter, its driver and its shader compiler.

use super::{Outcome, print_json, realtime};
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::grating::{GratingColourSurface, GratingSurface, preset_profile};
use sunbeam::height_field::Preset;
use sunbeam::methods::{Method, MethodKind, MethodOptions, StamForm, build};
use sunbeam::scattering::{Options, TransparentBody};
use sunbeam::table::{Model, Progress};
use sunbeam_realtime::{AdapterChoice, Gpu, Optics, Query, Renderer, Shader, TonePass};

/// Period of the grating in µm. Short periods have few orders, so the table is built fast. The shader is the same for
/// all.
const GRATING_PERIOD_UM: f64 = 0.3;
/// Height of the grating in µm. Shallow gratings are solved faster.
const GRATING_HEIGHT_UM: f64 = 0.05;
/// Format of the texture into which the tone pass draws: the format that `sunbeam view` uses.
const TONE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Check the GPU adapter: compile every shader on it, then lose its device
///
/// Opens the adapter that `sunbeam render` and `sunbeam view` open, and compiles each of their shaders. Then destroys
/// the device, as a driver's reset does, and submits work to it. Prints as JSON the adapter, its driver, the
/// compilation time of each shader in ms, and the error of the lost device. A shader that does not compile is an error
/// that names it.
#[derive(clap::Args)]
pub(crate) struct AdapterArgs {
    /// Adapter: any prefers a GPU, software is the software adapter [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
}

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report {
    /// Name of the adapter.
    adapter: String,
    /// Graphics interface, for instance `vulkan`.
    backend: &'static str,
    /// Whether it renders in software.
    software: bool,
    /// Name and version of the driver.
    driver: String,
    /// `timestamps` of the GPU, or `wall clock` around each submission.
    clock: &'static str,
    /// Largest storage buffer of a shader in bytes.
    storage_buffer_bytes_max: u64,
    shaders: Vec<CompiledShader>,
    /// Error message of a query (a pair of directions) on the destroyed device.
    lost_device: String,
}

/// A shader and the time of its compilation.
#[derive(Serialize)]
struct CompiledShader {
    name: String,
    /// Wall-clock time of the compilation in ms. A method's includes the first query, which `Shader::new` submits:
    /// drivers finish compiling during it.
    ms: f64,
}

/// Runs `sunbeam adapter`.
pub(crate) fn run(args: &AdapterArgs) -> Outcome {
    let gpu = realtime::open(args.adapter)?;
    let (shaders, last_shader) = compile_all(&gpu)?;
    let info = gpu.device().adapter_info();
    // Fields are evaluated in this order: the device is destroyed last.
    print_json(&Report {
        adapter: gpu.adapter(),
        backend: gpu.backend(),
        software: gpu.is_software(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        clock: realtime::clock(&gpu),
        storage_buffer_bytes_max: gpu.device().limits().max_storage_buffer_binding_size,
        shaders,
        lost_device: lose_device(&gpu, &last_shader)?,
    })
}

/// Compiles the renderer's shaders and those of each method. Returns the compilation times, and the shader that was
/// compiled last.
fn compile_all(gpu: &Gpu) -> Result<(Vec<CompiledShader>, Shader), Box<dyn Error>> {
    let mut compiled = Vec::new();
    timed(&mut compiled, "raster, shadow, locate, resolve", || Ok(Renderer::new(gpu)?))?;
    timed(&mut compiled, "tone", || {
        // `new` returns no error; `check` returns that of the compilation.
        TonePass::new(gpu.device(), TONE_FORMAT);
        Ok(gpu.check()?)
    })?;
    let field = Preset::Sinusoidal.build(None, None)?;
    // The published methods accept neither the other model nor energy conservation.
    let patch = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    // Compiles the shader of one method.
    let mut shade = |name: &str, method: &dyn Method| {
        timed(&mut compiled, &format!("shade, {name}"), || Ok(Shader::new(gpu, method, &Optics::default())?))
    };
    for kind in MethodKind::ALL {
        shade(kind.name(), &*build(kind, &field, &patch, &MethodOptions::default())?)?;
    }
    // Further shaders: Stam's method has one for the option `gems`, the colour table has others for energy conservation
    // and for films.
    let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
    shade("stam of GPU Gems", &*build(MethodKind::Stam, &field, &patch, &gems)?)?;
    let conserving = build(MethodKind::Table, &field, &Options::default(), &MethodOptions::default())?;
    shade("table that keeps energy", &*conserving)?;
    // Heights of a film must be magnified by its index. `field` is not, since the shader does not depend on heights.
    let is_film = true;
    let film = Options { body: Some(TransparentBody::new(1.5, is_film, patch.coherence_length_um)), ..patch };
    shade("table of a film", &*build(MethodKind::Table, &field, &film, &MethodOptions::default())?)?;
    let last_shader = shade("grating by Maxwell's equations", &grating()?)?;
    Ok((compiled, last_shader))
}

/// A sinusoidal grating in a perfect conductor.
fn grating() -> Result<GratingColourSurface, Box<dyn Error>> {
    let profile = preset_profile(Preset::Sinusoidal, Some(GRATING_PERIOD_UM), Some(GRATING_HEIGHT_UM))?
        .ok_or("the preset \"sinusoidal\" has no profile")?;
    let Options { coherence_length_um, build_limit, .. } = Options::default();
    let surface = GratingSurface::new(&profile, None, coherence_length_um, build_limit, &Progress::none())?;
    Ok(GratingColourSurface::new(surface))
}

/// Runs `compile`, appends its time to `compiled` and returns its result. The name of the shader is added to an error.
fn timed<T>(
    compiled: &mut Vec<CompiledShader>,
    name: &str,
    compile: impl FnOnce() -> Result<T, Box<dyn Error>>,
) -> Result<T, Box<dyn Error>> {
    let start = Instant::now();
    let result = compile().map_err(|error| format!("shader {name:?}: {error}"))?;
    compiled.push(CompiledShader { name: name.to_owned(), ms: start.elapsed().as_secs_f64() * 1e3 });
    Ok(result)
}

/// Destroys the device and submits a query, which must fail. Returns the query's error message on one line.
///
/// # Errors
/// A query that is answered although the device is destroyed.
fn lose_device(gpu: &Gpu, shader: &Shader) -> Result<String, Box<dyn Error>> {
    gpu.device().destroy();
    match shader.evaluate(gpu, &[Query::default()]) {
        Ok(_) => Err(format!("the GPU adapter {} answers although its device was destroyed", gpu.adapter()).into()),
        Err(error) => Ok(error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")),
    }
}
