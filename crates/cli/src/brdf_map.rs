use super::encode;
use super::method_args::{Asked, Method, MethodArgs};
use super::output::{Output, output};
use super::reflector::Reflector;
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use serde::Serialize;
use std::error::Error;
use std::time::Instant;
use sunbeam::colour::{SpectralToRgb, automatic_exposure, srgb_bytes};
use sunbeam::scattering::{Vec3, map_direction};

/// Accepted sides of the map in pixels.
const SIZE: std::ops::RangeInclusive<usize> = 1..=16_384;

/// Write a map of the reflectance over the outgoing hemisphere, in colour
///
/// The hemisphere is seen from above: the pixel at (x, y) in the unit disc is the direction wo = (x, y, √(1−x²−y²)),
/// x right is +x, y up is +y (the top row is y = +1). Its value is Σ f_r(λ)·w(λ) in 1/sr over 380 to 780 nm, w the
/// weights of D65 and the CIE 1931 2° observer in linear sRGB that sum to (1, 1, 1): f_r alone, without the cosine, so
/// a white Lambertian surface would be 1/π everywhere. Black outside the disc. Colours outside the gamut keep their
/// negative components in the EXR; the PNG clips them. Prints what was written as JSON.
#[derive(clap::Args)]
pub struct BrdfMapArgs {
    /// The map: linear sRGB, 32-bit floats (.exr)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr"]))]
    output: Output,
    /// The map as a picture, sRGB (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Factor before the picture is encoded [default: so that 1 % of the disc's pixels are clipped]
    #[arg(long, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Angle of wi with the normal in degrees, in [0, 90)
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Azimuth of wi in degrees from +x towards +y
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    phi_i: f64,
    /// Where it is computed
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    backend: Backend,
    /// With --backend gpu the GPU, or the software adapter [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<sunbeam_realtime::AdapterChoice>,
    /// Pixels along each side
    #[arg(long, value_name = "PIXELS", default_value_t = 256)]
    size: usize,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Backend {
    Cpu,
    /// In single precision; the methods flss, nmm, pq, stam and table
    Gpu,
}

/// The values of pixels, black outside the disc.
struct Map {
    rgb: Vec<[f64; 3]>,
    /// `None` where they depend on the directions.
    wavelengths: Option<usize>,
    /// Seconds for all directions, when the method's data was there.
    seconds: f64,
    gpu: Option<GpuReport>,
}

/// What the GPU took.
#[derive(Serialize)]
struct GpuReport {
    adapter: String,
    gpu_ms: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    /// Of the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure: Option<f64>,
    size: usize,
    wi: Vec3,
    method: &'static str,
    /// `None` where they depend on the directions.
    #[serde(skip_serializing_if = "Option::is_none")]
    wavelengths: Option<usize>,
    /// Largest value of each channel, 1/sr.
    max: [f64; 3],
    seconds: f64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    gpu: Option<GpuReport>,
}

impl BrdfMapArgs {
    fn check(&self) -> Result<(), String> {
        let refuse = |name: &str, found: &dyn std::fmt::Display, accepted: &str| {
            Err(format!("parameter {name:?} is {found}, but must be {accepted}"))
        };
        if !(0.0..90.0).contains(&self.theta_i) {
            return refuse("theta-i", &self.theta_i, "in [0, 90) degrees");
        }
        if !self.phi_i.is_finite() {
            return refuse("phi-i", &self.phi_i, "finite");
        }
        if !SIZE.contains(&self.size) {
            return refuse("size", &self.size, "1 to 16384 pixels");
        }
        if self.method.is_gems() && self.surface.has_index() {
            return Err("--eta has no effect with --stam-form gems, whose colours are shown as they are".to_owned());
        }
        match self.exposure {
            Some(exposure) if !(exposure.is_finite() && exposure > 0.0) => {
                refuse("exposure", &exposure, "finite and positive")
            }
            _ => Ok(()),
        }
    }

    fn wi(&self) -> Vec3 {
        let ((sin, cos), (sin_phi, cos_phi)) = (self.theta_i.to_radians().sin_cos(), self.phi_i.to_radians().sin_cos());
        [sin * cos_phi, sin * sin_phi, cos]
    }
}

/// Runs `sunbeam brdf-map`.
pub fn run(args: &BrdfMapArgs) -> Outcome {
    args.check()?;
    let size = args.size;
    let pixels: Vec<Option<Vec3>> = (0..size * size).map(|i| map_direction(i % size, i / size, size)).collect();
    let Map { rgb: map, wavelengths, seconds, gpu } = match args.backend {
        Backend::Cpu => on_cpu(args, &pixels)?,
        Backend::Gpu => on_gpu(args, &pixels)?,
    };
    args.output.write(&encode::exr((size, size), |i| map[i].map(|value| value as f32))?)?;
    let mut exposure = None;
    if let Some(png) = &args.png {
        let inside = map.iter().zip(&pixels).filter(|(_, wo)| wo.is_some()).map(|(rgb, _)| *rgb);
        let factor = args.exposure.unwrap_or_else(|| automatic_exposure(inside));
        let bytes: Vec<u8> = map.iter().flat_map(|rgb| srgb_bytes(rgb.map(|value| value * factor))).collect();
        png.write(&encode::png((size, size), png::ColorType::Rgb, &bytes)?)?;
        exposure = Some(factor);
    }
    let max = map.iter().fold([0.0f64; 3], |max, rgb| std::array::from_fn(|c| max[c].max(rgb[c])));
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

fn on_cpu(args: &BrdfMapArgs, pixels: &[Option<Vec3>]) -> Result<Map, Box<dyn Error>> {
    let method = args.method.method();
    let options = args.method.options(Asked::Colour)?;
    let spectrum = SpectralToRgb::visible(options.lambda_step_nm)?;
    let reflector = Reflector::new(&args.surface, method, &options, false)?;
    let wi = args.wi();
    let start = Instant::now();
    let rgb = reflector.map(pixels, |wo| wo.map_or([0.0; 3], |wo| reflector.eval_rgb(wi, wo, &spectrum)));
    let seconds = start.elapsed().as_secs_f64();
    let steps = !matches!(method, Method::Realtime(kind) if !kind.options().contains(&"lambda_step_nm"));
    Ok(Map { rgb, wavelengths: steps.then(|| spectrum.weights().len()), seconds, gpu: None })
}

fn on_gpu(args: &BrdfMapArgs, pixels: &[Option<Vec3>]) -> Result<Map, Box<dyn Error>> {
    use super::realtime::{self, Realtime};
    use sunbeam_realtime::Query;

    let realtime = Realtime::new(&args.method, &args.surface)?;
    let index = args.surface.config()?.index();
    let gpu = realtime::open(args.adapter)?;
    let (shader, report) = realtime.build(&gpu, index)?;
    let single = |w: Vec3| w.map(|c| c as f32);
    let wi = single(args.wi());
    // Below the surface, which answers zero.
    let outside = [0.0, 0.0, -1.0];
    let start = Instant::now();
    let queries: Vec<Query> = pixels.iter().map(|wo| Query::new(wi, wo.map_or(outside, single))).collect();
    let answers = shader.evaluate(&gpu, &queries)?;
    Ok(Map {
        rgb: answers.reflectances.iter().map(|rgb| rgb.map(f64::from)).collect(),
        wavelengths: report.wavelengths(),
        seconds: start.elapsed().as_secs_f64(),
        gpu: Some(GpuReport { adapter: gpu.adapter(), gpu_ms: answers.gpu_ms }),
    })
}
