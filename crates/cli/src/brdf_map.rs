//! `sunbeam brdf-map`: the reflectance over the outgoing hemisphere as a picture.
//!
//! wi is the direction to the light, one for the whole map; wo is the outgoing direction of a pixel. `f_r` is the
//! reflectance in 1/sr.

use super::arguments::{direction_from_degrees, out_of_range};
use super::encode;
use super::method_args::{Method, MethodArgs, Quantity};
use super::output::{Output, output};
use super::realtime::{self, Realtime};
use super::reflector::{Purpose, Reflector, single};
use super::surface_args::{SurfaceArgs, no_effect_with_gems};
use super::{Outcome, print_json};
use serde::Serialize;
use std::error::Error;
use std::ops::RangeInclusive;
use std::time::Instant;
use sunbeam::colour::{SpectralToRgb, automatic_exposure, srgb_bytes};
use sunbeam::scattering::{Vec3, map_direction};
use sunbeam_realtime::{AdapterChoice, Query};

/// Accepted numbers of pixels along a side of the map. The largest map takes 6.4 GB, 24 bytes a pixel: 12 for the
/// colour, and up to 12 for the encoded EXR, or afterwards for the automatic exposure.
const SIDE_PIXELS: RangeInclusive<usize> = 1..=16_384;
/// Largest number of directions in one call of the GPU. Their queries (pairs of directions) take 50 MB. Larger values
/// need more memory; smaller ones take more calls.
const DIRECTIONS_MAX: usize = 1 << 20;
/// Direction of the pixels outside the disc. Any direction below the surface would do: the reflectance there is 0.
const OUTSIDE: [f32; 3] = [0.0, 0.0, -1.0];

/// Write a colour map of the reflectance over the outgoing hemisphere
///
/// The hemisphere is seen from above: the pixel at (x, y) of the unit disc is the direction wo = (x, y, √(1−x²−y²)), x
/// to the right, y up. Pixels outside the disc are black.
///
/// A pixel is Σ f_r(λ)·w(λ) in 1/sr over 380 to 780 nm. The weights w are those of D65 and the CIE 1931 2° observer in
/// linear sRGB, and sum to (1, 1, 1). f_r has no cosine, so a white Lambertian surface is 1/π everywhere. Out-of-gamut
/// colours keep their negative components in the EXR; the PNG clips them. Prints a report as JSON.
#[derive(clap::Args)]
pub(crate) struct BrdfMapArgs {
    /// File for the map: linear sRGB, 32-bit floats (.exr)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr"]))]
    output: Output,
    /// File for the map as an sRGB picture (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Factor on the colours of the picture [default: the factor that clips 1 % of the pixels that are not
    /// black]; needs --png
    #[arg(long, requires = "png", allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Angle of wi with the normal in degrees, in [0, 90)
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Azimuth of wi in degrees from +x towards +y
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    phi_i: f64,
    /// Processor that computes the map
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    backend: Backend,
    /// Adapter for --backend gpu: any prefers a GPU, software is the software adapter [default: SUNBEAM_ADAPTER, else
    /// any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
    /// Pixels along each side
    #[arg(long, value_name = "PIXELS", default_value_t = 256, allow_negative_numbers = true)]
    size: usize,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// The processor that computes a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Backend {
    /// All methods
    Cpu,
    /// All methods except exact, in single precision
    Gpu,
}

/// A computed map.
struct Map {
    /// Linear sRGB of `f_r` in 1/sr for each pixel, by rows from the top; black outside the disc.
    rgb: Vec<[f32; 3]>,
    /// Number of wavelengths that a colour sums; `None` for methods without a fixed number.
    wavelengths: Option<usize>,
    /// Seconds for all directions, without building the method's data.
    seconds: f64,
    /// Adapter and its time; `None` for a map by the CPU.
    gpu: Option<GpuReport>,
}

/// The adapter and its time.
#[derive(Serialize)]
struct GpuReport {
    adapter: String,
    /// Time for all directions: by timestamps of the GPU where it has them, else by the wall clock.
    gpu_ms: f64,
}

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    /// Factor on the colours of the PNG; `None` without a PNG.
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure: Option<f64>,
    size: usize,
    wi: Vec3,
    method: &'static str,
    /// Number of wavelengths that a colour sums, as in [`Map`].
    #[serde(skip_serializing_if = "Option::is_none")]
    wavelengths: Option<usize>,
    /// Largest value of each channel in 1/sr, at least 0.
    max: [f32; 3],
    /// Seconds for all directions, as in [`Map`].
    seconds: f64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    gpu: Option<GpuReport>,
}

impl BrdfMapArgs {
    /// Refuses arguments out of range or without effect.
    fn check(&self) -> Result<(), String> {
        if !(0.0..90.0).contains(&self.theta_i) {
            return Err(out_of_range("theta-i", self.theta_i, "in [0, 90) degrees"));
        }
        if !self.phi_i.is_finite() {
            return Err(out_of_range("phi-i", self.phi_i, "finite"));
        }
        if !SIDE_PIXELS.contains(&self.size) {
            let accepted = format!("{} to {} pixels", SIDE_PIXELS.start(), SIDE_PIXELS.end());
            return Err(out_of_range("size", self.size, &accepted));
        }
        if self.adapter.is_some() && self.backend == Backend::Cpu {
            return Err("--adapter has no effect with --backend cpu; --backend gpu has one".to_owned());
        }
        // The colours of --stam-form gems are not multiplied by a Fresnel factor.
        if let Some(flag) = self.surface.index_flag().filter(|_| self.method.is_gems()) {
            return Err(no_effect_with_gems(flag));
        }
        match self.exposure {
            Some(exposure) if !(exposure.is_finite() && exposure > 0.0) => {
                Err(out_of_range("exposure", exposure, "finite and positive"))
            }
            _ => Ok(()),
        }
    }

    /// Unit vector towards the light.
    fn wi(&self) -> Vec3 {
        direction_from_degrees(self.theta_i, self.phi_i)
    }

    /// The number of pixels.
    fn pixel_count(&self) -> usize {
        self.size * self.size
    }

    /// The outgoing direction of the pixel with index `i` by rows from the top; `None` outside the disc.
    fn wo(&self, i: usize) -> Option<Vec3> {
        map_direction(i % self.size, i / self.size, self.size)
    }
}

/// Runs `sunbeam brdf-map`.
pub(crate) fn run(args: &BrdfMapArgs) -> Outcome {
    args.check()?;
    let size = args.size;
    let Map { rgb: colours, wavelengths, seconds, gpu } = match args.backend {
        Backend::Cpu => on_cpu(args)?,
        Backend::Gpu => on_gpu(args)?,
    };
    args.output.write(&encode::exr((size, size), |i| colours[i])?)?;
    let mut exposure = None;
    if let Some(file) = &args.png {
        // The library converts colours in double precision.
        let doubles = || colours.iter().map(|rgb| rgb.map(f64::from));
        let factor = args.exposure.unwrap_or_else(|| automatic_exposure(doubles()));
        let bytes: Vec<u8> = doubles().flat_map(|rgb| srgb_bytes(rgb.map(|value| value * factor))).collect();
        file.write(&encode::png((size, size), png::ColorType::Rgb, &bytes)?)?;
        exposure = Some(factor);
    }
    let max = colours.iter().fold([0.0f32; 3], |max, rgb| std::array::from_fn(|c| max[c].max(rgb[c])));
    print_json(&Report {
        output: &args.output,
        png: &args.png,
        exposure,
        size,
        wi: args.wi(),
        method: args.method.method().name(),
        wavelengths,
        max,
        seconds,
        gpu,
    })
}

/// Evaluates the colours of the outgoing directions on the CPU.
fn on_cpu(args: &BrdfMapArgs) -> Result<Map, Box<dyn Error>> {
    let method = args.method.method();
    let options = args.method.options(Quantity::Colour)?;
    let spectrum = SpectralToRgb::visible(options.lambda_step_nm)?;
    let reflector = Reflector::new(&args.surface, method, &options, Purpose::Map)?;
    let wi = args.wi();
    let start = Instant::now();
    let colour = |wo| reflector.eval_rgb(wi, wo, &spectrum).map(|value| value as f32);
    let rgb = reflector.map_indices(args.pixel_count(), |i| args.wo(i).map_or([0.0; 3], colour));
    let seconds = start.elapsed().as_secs_f64();
    // The methods exact, table, flss and pq sum over fixed steps between wavelengths. nmm and stam choose the
    // wavelengths of each pair of directions, and a colour table has summed over them before.
    let has_fixed_steps = match method {
        Method::Exact | Method::Table => true,
        Method::Colour(kind) => kind.options().contains(&"lambda_step_nm"),
    };
    Ok(Map { rgb, wavelengths: has_fixed_steps.then(|| spectrum.weights().len()), seconds, gpu: None })
}

/// Evaluates the colours of the outgoing directions on the GPU.
fn on_gpu(args: &BrdfMapArgs) -> Result<Map, Box<dyn Error>> {
    let realtime = Realtime::new(&args.method, &args.surface)?;
    let config = args.surface.config()?;
    // Refused here for the GPU, as `Reflector::new` does for the CPU.
    config.refuse_transmission("maps and peaks")?;
    let index = config.index();
    let gpu = realtime::open(args.adapter)?;
    let (shader, report) = realtime.build(&gpu, index)?;
    let wi = single(args.wi());
    let start = Instant::now();
    let (mut rgb, mut gpu_ms) = (Vec::with_capacity(args.pixel_count()), 0.0);
    for first in (0..args.pixel_count()).step_by(DIRECTIONS_MAX) {
        let indices = first..args.pixel_count().min(first + DIRECTIONS_MAX);
        let queries: Vec<Query> = indices.map(|i| Query::new(wi, args.wo(i).map_or(OUTSIDE, single))).collect();
        let answers = shader.evaluate(&gpu, &queries)?;
        rgb.extend(answers.reflectances);
        gpu_ms += answers.gpu_ms;
    }
    Ok(Map {
        rgb,
        wavelengths: report.wavelengths(),
        seconds: start.elapsed().as_secs_f64(),
        gpu: Some(GpuReport { adapter: gpu.adapter(), gpu_ms }),
    })
}
