use super::method_args::MethodArgs;
use super::realtime::{self, MethodReport, Realtime};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use ndarray::Array3;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;
use sunbeam::colour::{srgb_encode, tone_map};
use sunbeam::gpu::{AdapterChoice, Blend, Camera, Light, Mesh, Query, Renderer, Scene, StageTimes, Target, View};
use sunbeam::reflectance::ComplexIndex;
use sunbeam::snake::{PigmentTexture, SnakeMesh, SnakeOptions, pigment_texture};

/// Refractive index of keratin, which scales are made of.
const KERATIN: ComplexIndex = ComplexIndex { eta: 1.56, k: 0.0 };
/// Pixels of the pigment texture along and around the body.
const PIGMENT_SIZE: (usize, usize) = (2048, 1024);

/// Draw the snake on the GPU, without a window
///
/// The snake lies on dark soil in the sun, with camera, light and pigment as in the Mitsuba scenes: 1 unit is 1 cm, z is
/// up. Light is direct sunlight alone, with sharp shadows and no sky. Without --eta the skin is keratin, 1.56. The picture is linear sRGB; a white diffuse plane that faces the sun is 1. Prints the adapter, what
/// it took and what was drawn as JSON.
#[derive(clap::Args)]
pub struct RenderArgs {
    /// The picture: linear sRGB, 32-bit floats (.exr)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The picture for the screen, sRGB with highlights compressed (.png)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Brightens the PNG, in stops
    #[arg(long, value_name = "STOPS", default_value_t = 2.0, allow_negative_numbers = true)]
    exposure: f64,
    /// What each pixel's centre sees, as float32 (height, width, 8) (.npy): unit vectors to the sun and to the camera in
    /// the grating's frame, 1 where the sun is seen from there, the cosine of the sun's angle; 0 off the mesh
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "384x256")]
    size: Size,
    /// Rays along each side of a pixel, 1 to 64; their mean is the pixel
    #[arg(long, value_name = "COUNT", default_value_t = 1)]
    supersample: u32,
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

/// What is seen, from where, in which light.
#[derive(clap::Args)]
#[command(next_help_heading = "Scene")]
struct SceneArgs {
    /// Another mesh than the snake: triangles with normals and texture coordinates (.ply)
    #[arg(long, value_name = "FILE", conflicts_with = "resolution")]
    mesh: Option<PathBuf>,
    /// Times the cells of the snake in each direction
    #[arg(long, value_name = "FACTOR", default_value_t = 4.0, allow_negative_numbers = true)]
    resolution: f64,
    /// Whether there is a ground
    #[arg(long, value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    ground: bool,
    /// How the pigment below the relief shows: physical (diffuse, weighted by what is not reflected), sources (mixed with
    /// the diffraction colour at a fixed --share), none
    #[arg(long, value_name = "MODE", default_value = "physical")]
    blend: Blend,
    /// Share of the diffraction colour with --blend sources, 0 to 1 [default: 0.5]
    #[arg(long, allow_negative_numbers = true)]
    share: Option<f32>,
    /// Turns the grating against the tangent
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    rotation: f64,
    /// Where the camera is
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    camera_origin: Option<Point>,
    /// What is in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    camera_target: Option<Point>,
    /// Horizontal field of view
    #[arg(long, value_name = "DEGREES", default_value_t = 30.0, allow_negative_numbers = true)]
    fov: f64,
    /// Where the sun is, counter-clockwise seen from above, from +x
    #[arg(long, value_name = "DEGREES", default_value_t = -150.0, allow_negative_numbers = true)]
    light_azimuth: f64,
    /// How high the sun is above the ground
    #[arg(long, value_name = "DEGREES", default_value_t = 40.0, allow_negative_numbers = true)]
    light_elevation: f64,
    /// The direction to the sun, instead of the two angles
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, conflicts_with_all = ["light_azimuth", "light_elevation"])]
    light_from: Option<Point>,
}

#[derive(Clone, Copy)]
struct Size(u32, u32);

impl FromStr for Size {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        sides.map(|(width, height)| Self(width, height)).ok_or("it must be two whole numbers, such as 384x256")
    }
}

#[derive(Clone, Copy)]
struct Point([f64; 3]);

impl FromStr for Point {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
        let point = numbers.and_then(|numbers| numbers.try_into().ok());
        point.map(Self).ok_or("it must be three numbers, such as 1,0,2.5")
    }
}

impl SceneArgs {
    fn view(&self, supersample: u32) -> Result<View, Box<dyn std::error::Error>> {
        let camera = Camera::default();
        let blend = match (self.blend, self.share) {
            (Blend::Sources { .. }, Some(share)) => Blend::Sources { share },
            (_, Some(_)) => return Err("parameter \"share\" needs --blend sources".into()),
            (blend, None) => blend,
        };
        Ok(View {
            camera: Camera {
                origin: self.camera_origin.map_or(camera.origin, |point| point.0),
                target: self.camera_target.map_or(camera.target, |point| point.0),
                fov_deg: self.fov,
            },
            light: match self.light_from {
                Some(point) => Light::from_direction(point.0)?,
                None => Light::from_angles(self.light_azimuth, self.light_elevation)?,
            },
            blend,
            ground: self.ground,
            rotation_deg: self.rotation,
            supersample,
        })
    }

    /// The mesh, and the snake's pigment for its texture coordinates.
    fn mesh(&self) -> Result<(Mesh, PigmentTexture), Box<dyn std::error::Error>> {
        if !(self.resolution.is_finite() && self.resolution > 0.0) {
            let found = self.resolution;
            return Err(format!("parameter \"resolution\" is {found}, but must be finite and positive").into());
        }
        let options = SnakeOptions::default().with_resolution(self.resolution);
        let pigment = pigment_texture(&options, PIGMENT_SIZE.0, PIGMENT_SIZE.1)?;
        let mesh = match &self.mesh {
            Some(path) => Mesh::read_ply(path)?,
            None => Mesh::from(&SnakeMesh::build(&options)?),
        };
        Ok((mesh, pigment))
    }
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pairs: &'a Option<PathBuf>,
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
    let index = args.surface.index()?.unwrap_or(KERATIN);
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
    let drawn = renderer.draw(&gpu, &scene, &shader, &target, &view)?;

    let picture = target.read_picture(&gpu)?;
    write(args, &picture)?;
    if let Some(path) = &args.pairs {
        write_pairs(path, args.size, &target.read_queries(&gpu)?)?;
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
        gpu_ms: drawn.gpu_ms.total(),
        gpu_stages_ms: drawn.gpu_ms,
        gpu_clock: if gpu.has_timestamps() { "timestamps" } else { "wall clock" },
        answered: drawn.answered,
        submissions: drawn.submissions,
        method,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Writes the EXR, and the PNG where one is wanted.
fn write(args: &RenderArgs, picture: &[[f32; 3]]) -> Outcome {
    let (width, height) = (args.size.0 as usize, args.size.1 as usize);
    exr::prelude::write_rgb_file(&args.output, width, height, |x, y| picture[y * width + x].into())
        .map_err(|error| format!("{}: cannot be written: {error}", args.output.display()))?;
    if let Some(path) = &args.png {
        let shown = |pixel: &[f32; 3]| srgb_encode(tone_map(pixel.map(f64::from), args.exposure));
        let bytes: Vec<u8> = picture.iter().flat_map(shown).map(|value| (255.0 * value).round() as u8).collect();
        super::png::write(path, (width, height), png::ColorType::Rgb, &bytes)?;
    }
    Ok(())
}

fn write_pairs(path: &Path, Size(width, height): Size, queries: &[Query]) -> Outcome {
    let (width, height) = (width as usize, height as usize);
    let pairs = Array3::from_shape_fn((height, width, 8), |(y, x, i)| {
        let query = &queries[y * width + x];
        match i {
            _ if query.kind != Query::SKIN => 0.0,
            0..3 => query.wi[i],
            3..6 => query.wo[i - 3],
            6 => query.lit as f32,
            _ => query.wi[2],
        }
    });
    ndarray_npy::write_npy(path, &pairs)
        .map_err(|error| format!("{}: cannot be written: {error}", path.display()).into())
}
