//! Draws the page's pictures natively: for tests, and for the pictures of the examples.
//!
//!     page_twin settings.json --size 384x256 -o picture.npy [--file scan.gsf] [--png picture.png] [--map 64]
//!     page_twin --examples crates/web/examples.json --scans FOLDER -o target/web/examples
//!     page_twin --programs -o programs.json
//!
//! The first form draws the picture or BRDF map of the page's settings (src/settings/). The second writes the page's
//! examples: files and pictures of the surfaces that a visitor can select. The third writes the source of every WGSL
//! program, for a test that compiles them in a browser.

use clap::Parser;
use ndarray::Array3;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use sunbeam::height_field::Preset;
use sunbeam::table::Progress;
use sunbeam_realtime::{AdapterChoice, Gpu, Renderer, Scene, SceneData, Shader, Target};
use sunbeam_web::{MethodData, Relief, Settings, direction, image};

/// Width and height of the examples' pictures in pixels.
const THUMBNAIL_SIZE: (u32, u32) = (288, 192);
/// Rays along each side of a pixel of the examples' pictures. More rays make edges smoother and take longer.
const THUMBNAIL_SUPERSAMPLE: u32 = 3;

/// Draws the page's pictures natively.
#[derive(Parser)]
struct Args {
    /// The page's settings (.json)
    #[arg(required_unless_present_any = ["examples", "programs"])]
    settings: Option<PathBuf>,
    /// Width and height of the picture in pixels; a map has its own side
    #[arg(long, value_parser = size, default_value = "384x256")]
    size: (u32, u32),
    /// Rays along each side of a pixel
    #[arg(long, default_value_t = 1)]
    supersample: u32,
    /// The file that the settings name, as if it was dropped on the page
    #[arg(long)]
    file: Option<PathBuf>,
    /// Draw the BRDF map of the settings' light, with this side in pixels, instead of a picture
    #[arg(long)]
    map: Option<usize>,
    /// Also write the tone-mapped picture (.png)
    #[arg(long)]
    png: Option<PathBuf>,
    /// Linear sRGB, float32 (height, width, 3) (.npy); with --examples a folder
    #[arg(short, long)]
    output: PathBuf,
    /// Write the examples of this list with their pictures
    #[arg(long, conflicts_with = "settings")]
    examples: Option<PathBuf>,
    /// Folder of the examples' scans; examples whose scans are missing are left out
    #[arg(long, requires = "examples")]
    scans: Option<PathBuf>,
    /// Write the source of every WGSL program by name instead of a picture (.json)
    #[arg(long, conflicts_with_all = ["settings", "examples"])]
    programs: bool,
}

/// Reads a size in pixels, such as `384x256`.
fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    sides.ok_or_else(|| "it must be two whole numbers, such as 384x256".to_owned())
}

fn main() -> ExitCode {
    // SAFETY: the call sets an environment variable, and no other thread exists yet.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("page_twin: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the form of the command that the arguments select.
fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    if let Some(list) = &args.examples {
        // Pictures are optional, so any error of opening the GPU leaves them out.
        let gpu = open_gpu().inspect_err(|error| eprintln!("page_twin: {error}: the examples get no pictures")).ok();
        return examples(gpu.as_ref(), list, args.scans.as_deref(), &args.output);
    }
    if args.programs {
        let programs: BTreeMap<_, _> = sunbeam_realtime::every_program()?.into_iter().collect();
        return Ok(std::fs::write(&args.output, serde_json::to_string(&programs)?)?);
    }
    draw(args)
}

/// Opens the adapter that the environment selects.
fn open_gpu() -> Result<Gpu, Box<dyn Error>> {
    Ok(Gpu::open(AdapterChoice::from_env()?)?)
}

/// Draws the picture or BRDF map of the settings and writes its files.
fn draw(args: &Args) -> Result<(), Box<dyn Error>> {
    let path = args.settings.as_deref().ok_or("settings are missing")?;
    let settings = Settings::from_json(&std::fs::read_to_string(path)?)?;
    let bytes = args.file.as_ref().map(std::fs::read).transpose()?;
    let gpu = open_gpu()?;
    let drawing = Drawing::new(&gpu, &settings, bytes.as_deref())?;
    let (pixels, (width, height)) = match args.map {
        Some(side) => (drawing.map(side)?, (side as u32, side as u32)),
        None => (drawing.picture(args.size, args.supersample)?, args.size),
    };
    if let Some(path) = &args.png {
        std::fs::write(path, image::picture_png(&pixels, (width, height), settings.exposure)?)?;
    }
    let flat = pixels.as_flattened().to_vec();
    let array = Array3::from_shape_vec((height as usize, width as usize, 3), flat)?;
    Ok(ndarray_npy::write_npy(&args.output, &array)?)
}

/// Settings, with the GPU and the method's shader that draw them.
struct Drawing<'a> {
    gpu: &'a Gpu,
    settings: &'a Settings,
    shader: Shader,
}

impl<'a> Drawing<'a> {
    /// Builds the method for the relief of the settings: a preset, or the file whose contents are `file`.
    fn new(gpu: &'a Gpu, settings: &'a Settings, file: Option<&[u8]>) -> Result<Self, Box<dyn Error>> {
        let relief = Relief::new(settings, file)?;
        // The method passes through the bytes that the page's workers exchange, so these are tested, too.
        let data = MethodData::from_bytes(relief.method_data(settings, &Progress::none())?)?;
        let shader = Shader::of(gpu, &data.shader(), data.answers(), &settings.optics())?;
        Ok(Self { gpu, settings, shader })
    }

    /// The picture of `width` × `height` pixels with `supersample` rays along each side of a pixel: linear sRGB, rows
    /// from the top.
    fn picture(&self, (width, height): (u32, u32), supersample: u32) -> Result<Vec<[f32; 3]>, Box<dyn Error>> {
        let (mesh, pigment) = self.settings.scene()?;
        let scene = Scene::of(self.gpu, &SceneData::new(&mesh, &pigment)?)?;
        let target = Target::new(self.gpu, width, height)?;
        let view = self.settings.view(supersample)?;
        Renderer::new(self.gpu)?.draw(self.gpu, &scene, &self.shader, &target, &view)?;
        Ok(target.read_picture(self.gpu)?)
    }

    /// The BRDF map of the settings' light, of `side`² pixels: `f_r` in 1/sr as linear sRGB, rows from the top, 0
    /// outside the disc.
    fn map(&self, side: usize) -> Result<Vec<[f32; 3]>, Box<dyn Error>> {
        let map = self.settings.map;
        let wi = direction(map.theta_deg, map.phi_deg).map(|component| component as f32);
        let pixels = self.shader.brdf_map(self.gpu, wi, side)?;
        Ok(pixels.into_iter().map(Option::unwrap_or_default).collect())
    }
}

/// Writes index.json, the files and the pictures of the examples in the file `list` (crates/web/examples.json) into
/// `folder`. Without a `gpu` there are no pictures.
///
/// The surface of an example is a preset, unless the example names a file ([`file_contents`]).
fn examples(gpu: Option<&Gpu>, list: &Path, scans: Option<&Path>, folder: &Path) -> Result<(), Box<dyn Error>> {
    let list: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(list)?)?;
    std::fs::create_dir_all(folder)?;
    let mut index = Vec::new();
    for mut example in list {
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let name = text(&example["name"]).ok_or("an example has no name")?;
        let mut bytes = None;
        if let Some(file) = text(&example["file"]) {
            let Some(found) = file_contents(&mut example, &file, scans, folder)? else {
                eprintln!("page_twin: no scan {file}: the example {name} is left out");
                continue;
            };
            std::fs::write(folder.join(&file), &found)?;
            example["bytes"] = json!(found.len());
            example["sha256"] = json!(format!("{:x}", Sha256::digest(&found)));
            bytes = Some(found);
        }
        let settings = Settings::from_json(&example["settings"].to_string())?;
        if let Some(gpu) = gpu {
            let drawing = Drawing::new(gpu, &settings, bytes.as_deref())?;
            let pixels = drawing.picture(THUMBNAIL_SIZE, THUMBNAIL_SUPERSAMPLE)?;
            let picture = format!("{name}.png");
            std::fs::write(folder.join(&picture), image::picture_png(&pixels, THUMBNAIL_SIZE, settings.exposure)?)?;
            example["thumbnail"] = json!(picture);
        }
        index.push(example);
    }
    Ok(std::fs::write(folder.join("index.json"), serde_json::to_string_pretty(&index)?)?)
}

/// Contents of the file that an example names: a scan in the folder `scans` or else in `folder`. If the example has a
/// cut, the file is made in `folder` from the corner of a preset instead ([`write_cut`]). `None` where the scan is
/// missing or unreadable.
fn file_contents(
    example: &mut Value,
    file: &str,
    scans: Option<&Path>,
    folder: &Path,
) -> Result<Option<Vec<u8>>, Box<dyn Error>> {
    // The cut is removed from the entry, since the page needs only the file.
    if let Some(cut) = example.as_object_mut().and_then(|example| example.remove("cut")) {
        write_cut(&cut, &folder.join(file))?;
        return Ok(Some(std::fs::read(folder.join(file))?));
    }
    // An earlier run may have copied the scan to `folder`.
    Ok([scans, Some(folder)].into_iter().flatten().find_map(|folder| std::fs::read(folder.join(file)).ok()))
}

/// Writes the cut of an example to a file: the lower left corner of the preset `cut["preset"]`, a square with sides of
/// `cut["side_um"]` µm.
fn write_cut(cut: &Value, path: &Path) -> Result<(), Box<dyn Error>> {
    let preset: Preset = cut["preset"].as_str().unwrap_or_default().parse()?;
    let side_um = cut["side_um"].as_f64().ok_or("the cut of an example has no side_um")?;
    Ok(preset.build(None, None)?.cropped(0.0, 0.0, side_um, side_um)?.write(path)?)
}
