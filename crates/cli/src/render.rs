//! `sunbeam render`: a picture of the snake by the realtime renderer, without a window.

use super::arguments::out_of_range;
use super::encode;
use super::method_args::MethodArgs;
use super::output::{Output, output};
use super::realtime::{self, MethodReport, Realtime};
use super::scene_args::{SceneArgs, Size};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use ndarray::Array3;
use serde::Serialize;
use std::time::Instant;
use sunbeam::scattering::Transmission;
use sunbeam_realtime::{AdapterChoice, Blend, Gpu, KERATIN, Query, Renderer, Scene, StageTimes, Target, View};

/// Draw the snake on the GPU, without a window
///
/// The snake lies on dark soil in the sun, with camera, light and pigment as in the Mitsuba scenes. One unit is 1 cm, z
/// is up. The only light is direct sunlight, with sharp shadows. Without --eta the skin is keratin, of index 1.56. With
/// --transmission film the mesh is a clear sheet, lit from both sides, through which the ground is seen.
///
/// The picture is linear sRGB; a white diffuse plane that faces the sun is 1. Prints the adapter, the times and the
/// method's data as JSON.
#[derive(clap::Args)]
pub(crate) struct RenderArgs {
    /// File for the picture: linear sRGB, 32-bit floats (.exr)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr"]))]
    output: Output,
    /// File for the picture as shown: sRGB with compressed highlights (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Exposure of the PNG in stops; needs --png
    #[arg(long, value_name = "STOPS", default_value_t = 2.0, requires = "png", allow_negative_numbers = true)]
    exposure: f64,
    /// File for the directions at each pixel's centre, as float32 (height, width, 8) (.npy)
    ///
    /// The components are the unit vectors to the sun and to the camera in the relief's frame, 1 where the sun is
    /// visible and 0 in shadow, and the cosine of the sun's angle. They are 0 off the mesh.
    #[arg(long, value_name = "FILE", value_parser = output(&["npy"]))]
    pairs: Option<Output>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "384x256")]
    size: Size,
    /// Rays along each side of a pixel, 1 to 64; the pixel is their mean
    #[arg(long, value_name = "COUNT", default_value_t = 1, allow_negative_numbers = true)]
    supersample: u32,
    /// Number of times that the picture is drawn; the times in the report are medians
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    #[arg(allow_negative_numbers = true)]
    repeat: u32,
    /// Adapter: any prefers a GPU, software is the software adapter [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// Number of components of a pixel in the file of `--pairs`.
const PAIR_COMPONENTS: usize = 8;

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pairs: &'a Option<Output>,
    /// Width and height in pixels.
    size: [u32; 2],
    supersample: u32,
    triangles: usize,
    adapter: String,
    /// Graphics interface of the adapter, for instance `vulkan`.
    backend: &'static str,
    /// Whether the adapter renders in software.
    software: bool,
    /// Time of all stages of the renderer ([`StageTimes`]): the sum of their medians.
    gpu_ms: f64,
    /// Median time of each stage over the repeated pictures.
    gpu_stages_ms: StageTimes,
    /// `timestamps` of the GPU, or `wall clock` around each submission.
    gpu_clock: &'static str,
    /// Number of queries that the method answered for the last picture: visible points of the mesh in the sun, one for
    /// each ray.
    answered: u64,
    /// Number of submissions of these queries.
    submissions: u32,
    #[serde(flatten)]
    method: MethodReport,
    /// Wall-clock time of the command.
    seconds: f64,
}

/// Runs `sunbeam render`.
pub(crate) fn run(args: &RenderArgs) -> Outcome {
    let start = Instant::now();
    if !args.exposure.is_finite() {
        return Err(out_of_range("exposure", args.exposure, "finite").into());
    }
    if args.pairs.is_some() && args.supersample != 1 {
        return Err("parameter \"pairs\" needs --supersample 1: its directions are those at the pixels' centres".into());
    }
    let realtime = Realtime::new(&args.method, &args.surface)?;
    // The configuration of `realtime` has the same index and transmission.
    let config = args.surface.config()?;
    let index = config.index().unwrap_or(KERATIN);
    let view = args.scene.view(args.supersample)?;
    if matches!(view.blend, Blend::FixedMix { .. }) && config.transmission != Transmission::None {
        return Err("--blend mix needs --transmission none: light passes a film, so that no pigment is below".into());
    }
    // The adapter is opened before the long work, so that its errors come at once.
    let gpu = realtime::open(args.adapter)?;
    let Size(width, height) = args.size;
    let target = Target::new(&gpu, width, height)?;

    let (shader, method) = realtime.build(&gpu, Some(index))?;
    let (mesh, pigment) = args.scene.mesh()?;
    let scene = Scene::new(&gpu, &mesh, &pigment)?;
    let renderer = Renderer::new(&gpu)?;
    // Drivers finish the compilation of a pipeline at its first use. An untimed picture of one pixel keeps that work
    // out of the times.
    renderer.draw(&gpu, &scene, &shader, &Target::new(&gpu, 1, 1)?, &View { supersample: 1, ..view })?;
    let reports = (0..args.repeat)
        .map(|_| renderer.draw(&gpu, &scene, &shader, &target, &view))
        .collect::<Result<Vec<_>, _>>()?;
    // `repeat` is at least 1.
    let last = reports[reports.len() - 1];
    let gpu_stages_ms = StageTimes::medians(&reports.iter().map(|report| report.gpu_ms).collect::<Vec<_>>());

    write_files(args, &gpu, &target)?;
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
        gpu_ms: gpu_stages_ms.total(),
        gpu_stages_ms,
        gpu_clock: realtime::clock(&gpu),
        answered: last.answered,
        submissions: last.submissions,
        method,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Writes the picture and the directions of the target to the files of the arguments.
fn write_files(args: &RenderArgs, gpu: &Gpu, target: &Target) -> Outcome {
    let size = (args.size.0 as usize, args.size.1 as usize);
    let picture = target.read_picture(gpu)?;
    args.output.write(&encode::exr(size, |i| picture[i])?)?;
    if let Some(file) = &args.png {
        file.write(&encode::tone_mapped_png(size, &picture, args.exposure)?)?;
    }
    if let Some(file) = &args.pairs {
        file.write(&encode::npy(&pair_components(size, &target.read_queries(gpu)?))?)?;
    }
    Ok(())
}

/// The array of `--pairs`, `[row, column, component]` with row 0 at the top; [`RenderArgs::pairs`] has the components.
/// `queries` has one for each pixel, by rows from the top.
fn pair_components((width, height): (usize, usize), queries: &[Query]) -> Array3<f32> {
    Array3::from_shape_fn((height, width, PAIR_COMPONENTS), |(y, x, i)| {
        let query = &queries[y * width + x];
        match i {
            // Only pixels on the mesh have the kind SKIN, whatever its shape.
            _ if query.kind != Query::SKIN => 0.0,
            0..3 => query.wi[i],
            3..6 => query.wo[i - 3],
            6 => query.lit as f32,
            // The sun's cosine, since z is the normal.
            _ => query.wi[2],
        }
    })
}
