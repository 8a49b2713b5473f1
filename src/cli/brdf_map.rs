use super::reflector::{Method, Reflector};
use super::surface_args::SurfaceArgs;
use super::{Outcome, print_json};
use serde::Serialize;
use std::path::{Path, PathBuf};
use sunbeam::colour::{SpectralToRgb, srgb_encode};
use sunbeam::reflectance::Vec3;

/// Accepted sides of the map in pixels.
const SIZE: std::ops::RangeInclusive<usize> = 1..=16_384;
/// Accepted steps in nm: coarser ones do not make white, finer ones only take time.
const LAMBDA_STEP_NM: std::ops::RangeInclusive<f64> = 0.1..=20.0;
/// Share of the disc's pixels that may be clipped in the picture, unless the exposure is given.
const CLIPPED: f64 = 0.01;

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
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The map as a picture, sRGB (.png)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Factor before the picture is encoded [default: so that 1 % of the disc's pixels are clipped]
    #[arg(long, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// exact (direct double-precision sum) or table; flss, nmm, pq and stam are not available yet
    #[arg(long, default_value = "table")]
    method: Method,
    /// Angle of wi with the normal in degrees, in [0, 90)
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Azimuth of wi in degrees from +x towards +y
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    phi_i: f64,
    /// Pixels along each side
    #[arg(long, value_name = "PIXELS", default_value_t = 256)]
    size: usize,
    /// Step between wavelengths in nm, 0.1 to 20
    #[arg(long, value_name = "NM", default_value_t = 5.0, allow_negative_numbers = true)]
    lambda_step: f64,
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<PathBuf>,
    /// Of the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure: Option<f64>,
    size: usize,
    wi: Vec3,
    wavelengths: usize,
    /// Largest value of each channel, 1/sr.
    max: [f64; 3],
    seconds: f64,
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
        if !LAMBDA_STEP_NM.contains(&self.lambda_step) {
            return refuse("lambda-step", &self.lambda_step, "0.1 to 20 nm");
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
    let spectrum = SpectralToRgb::visible(args.lambda_step)?;
    let reflector = Reflector::new(&args.surface, args.method)?;
    let start = std::time::Instant::now();
    let (wi, size) = (args.wi(), args.size);
    let pixels: Vec<Option<Vec3>> = (0..size * size).map(|i| outgoing(i % size, i / size, size)).collect();
    let map = reflector.map(&pixels, |wo| wo.map_or([0.0; 3], |wo| spectrum.rgb_of(|nm| reflector.f(wi, wo, nm))));
    let seconds = start.elapsed().as_secs_f64();
    write_exr(&args.output, size, &map)?;
    let mut exposure = None;
    if let Some(path) = &args.png {
        let inside = map.iter().zip(&pixels).filter(|(_, wo)| wo.is_some()).map(|(rgb, _)| *rgb);
        let factor = args.exposure.unwrap_or_else(|| automatic_exposure(inside));
        let bytes: Vec<u8> = map
            .iter()
            .flat_map(|rgb| srgb_encode(rgb.map(|value| value * factor)))
            .map(|value| (255.0 * value).round() as u8)
            .collect();
        super::png::write(path, (size, size), png::ColorType::Rgb, &bytes)?;
        exposure = Some(factor);
    }
    let max = map.iter().fold([0.0f64; 3], |max, rgb| std::array::from_fn(|c| max[c].max(rgb[c])));
    print_json(&Report {
        output: &args.output,
        png: &args.png,
        exposure,
        size,
        wi,
        wavelengths: spectrum.weights().len(),
        max,
        seconds,
    })
}

/// The direction at the middle of a pixel, `None` outside the disc. Row 0 is the top.
pub fn outgoing(column: usize, row: usize, size: usize) -> Option<Vec3> {
    let place = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
    let (x, y) = (place(column), -place(row));
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 0.0).then(|| [x, y, z_squared.sqrt()])
}

/// The exposure at which [`CLIPPED`] of the pixels exceed 1 in some channel; 1 for a black map.
pub fn automatic_exposure(map: impl Iterator<Item = [f64; 3]>) -> f64 {
    let mut largest: Vec<f64> = map.map(|rgb| rgb[0].max(rgb[1]).max(rgb[2])).filter(|v| *v > 0.0).collect();
    largest.sort_by(f64::total_cmp);
    let at = ((1.0 - CLIPPED) * largest.len() as f64) as usize;
    largest.get(at).map_or(1.0, |value| 1.0 / value)
}

fn write_exr(path: &Path, size: usize, map: &[[f64; 3]]) -> Result<(), String> {
    let pixel = |x: usize, y: usize| {
        let [r, g, b] = map[y * size + x].map(|value| value as f32);
        (r, g, b)
    };
    exr::prelude::write_rgb_file(path, size, size, pixel)
        .map_err(|error| format!("{}: cannot be written: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x_is_right_and_y_is_up() {
        assert_eq!(outgoing(0, 0, 8), None);
        let [x, y, _] = outgoing(7, 3, 8).unwrap();
        assert!(x == 0.875 && y == 0.125);
        let [x, y, _] = outgoing(4, 0, 8).unwrap();
        assert!(x == 0.125 && y == 0.875);
    }

    #[test]
    fn one_pixel_in_a_hundred_is_clipped() {
        let factor = automatic_exposure((1..=1000).map(|i| [0.0, i as f64, -1.0]));
        assert_eq!(factor, 1.0 / 991.0);
        assert_eq!(automatic_exposure(std::iter::once([0.0; 3])), 1.0);
    }
}
