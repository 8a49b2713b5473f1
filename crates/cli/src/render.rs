use super::encode;
use super::method_args::MethodArgs;
use super::output::{Output, output};
use super::realtime::{self, MethodReport, Realtime};
use super::scene_args::{KERATIN, SceneArgs, Size};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use ndarray::Array3;
use serde::Serialize;
use std::time::Instant;
use sunbeam_realtime::{AdapterChoice, Query, Renderer, Scene, StageTimes, Target, View};

/// Draw the snake on the GPU, without a window
///
/// The snake lies on dark soil in the sun, with camera, light and pigment as in the Mitsuba scenes: 1 unit is 1 cm, z is
/// up. Light is direct sunlight alone, with sharp shadows and no sky. Without --eta the skin is keratin, 1.56. The picture
/// is linear sRGB; a white diffuse plane that faces the sun is 1. Prints the adapter, what it took and what was drawn as
/// JSON.
#[derive(clap::Args)]
pub struct RenderArgs {
    /// The picture: linear sRGB, 32-bit floats (.exr)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr"]))]
    output: Output,
    /// The picture for the screen, sRGB with highlights compressed (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Brightens the PNG, in stops
    #[arg(long, value_name = "STOPS", default_value_t = 2.0, allow_negative_numbers = true)]
    exposure: f64,
    /// What each pixel's centre sees, as float32 (height, width, 8) (.npy): unit vectors to the sun and to the camera in
    /// the grating's frame, 1 where the sun is seen from there, the cosine of the sun's angle; 0 off the mesh
    #[arg(long, value_name = "FILE", value_parser = output(&["npy"]))]
    pairs: Option<Output>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "384x256")]
    size: Size,
    /// Rays along each side of a pixel, 1 to 64; their mean is the pixel
    #[arg(long, value_name = "COUNT", default_value_t = 1)]
    supersample: u32,
    /// Draws the picture this often and gives the medians of the times
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: u32,
    /// The GPU, or the software adapter [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pairs: &'a Option<Output>,
    size: [u32; 2],
    supersample: u32,
    triangles: usize,
    adapter: String,
    backend: &'static str,
    software: bool,
    /// All stages.
    gpu_ms: f64,
    gpu_stages_ms: StageTimes,
    /// `timestamps` of the GPU, or `wall clock` around each submission.
    gpu_clock: &'static str,
    /// Queries that the method answered, and in how many submissions.
    answered: u64,
    submissions: u32,
    #[serde(flatten)]
    method: MethodReport,
    /// Wall clock of everything.
    seconds: f64,
}

/// Runs `sunbeam render`.
pub fn run(args: &RenderArgs) -> Outcome {
    let start = Instant::now();
    if !args.exposure.is_finite() {
        return Err(format!("parameter \"exposure\" is {}, but must be finite", args.exposure).into());
    }
    if args.pairs.is_some() && args.supersample != 1 {
        return Err("parameter \"pairs\" needs --supersample 1: it is about the pixels' centres".into());
    }
    let realtime = Realtime::new(&args.method, &args.surface)?;
    let index = args.surface.config()?.index().unwrap_or(KERATIN);
    let view = args.scene.view(args.supersample)?;
    // Before what takes longer.
    let gpu = realtime::open(args.adapter)?;
    let Size(width, height) = args.size;
    let target = Target::new(&gpu, width, height)?;

    let (shader, method) = realtime.build(&gpu, Some(index))?;
    let (mesh, pigment) = args.scene.mesh()?;
    let scene = Scene::new(&gpu, &mesh, &pigment)?;
    let renderer = Renderer::new(&gpu)?;
    // Drivers finish compiling when a pipeline is first used; a picture of one pixel keeps that out of the times.
    renderer.draw(&gpu, &scene, &shader, &Target::new(&gpu, 1, 1)?, &View { supersample: 1, ..view })?;
    let reports = (0..args.repeat)
        .map(|_| renderer.draw(&gpu, &scene, &shader, &target, &view))
        .collect::<Result<Vec<_>, _>>()?;
    let drawn = reports[reports.len() - 1];
    let gpu_ms = StageTimes::medians(&reports.iter().map(|report| report.gpu_ms).collect::<Vec<_>>());

    let picture = target.read_picture(&gpu)?;
    let size = (width as usize, height as usize);
    args.output.write(&encode::exr(size, |i| picture[i])?)?;
    if let Some(file) = &args.png {
        file.write(&encode::tone_mapped_png(size, &picture, args.exposure)?)?;
    }
    if let Some(file) = &args.pairs {
        file.write(&encode::npy(&pairs(size, &target.read_queries(&gpu)?))?)?;
    }
    print_json(&Report {
        output: &args.output,
        png: &args.png,
        pairs: &args.pairs,
        size: [width, height],
        supersample: args.supersample,
        triangles: mesh.triangles.len(),
        adapter: gpu.adapter(),
        backend: gpu.backend(),
        software: gpu.is_software(),
        gpu_ms: gpu_ms.total(),
        gpu_stages_ms: gpu_ms,
        gpu_clock: realtime::clock(&gpu),
        answered: drawn.answered,
        submissions: drawn.submissions,
        method,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Contents of `--pairs`, `[row, column, component]`.
fn pairs((width, height): (usize, usize), queries: &[Query]) -> Array3<f32> {
    Array3::from_shape_fn((height, width, 8), |(y, x, i)| {
        let query = &queries[y * width + x];
        match i {
            _ if query.kind != Query::SKIN => 0.0,
            0..3 => query.wi[i],
            3..6 => query.wo[i - 3],
            6 => query.lit as f32,
            _ => query.wi[2],
        }
    })
}
