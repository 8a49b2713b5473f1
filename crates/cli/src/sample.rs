//! `sunbeam sample`: a service that samples outgoing directions for JSON lines.

use super::Outcome;
use super::method_args::Method;
use super::query::{Numbers, direction, parse, unit_cube};
use super::reflector::{Purpose, Reflector};
use super::service::serve;
use super::surface_args::SurfaceArgs;
use serde::{Deserialize, Serialize};
use sunbeam::methods::MethodOptions;
use sunbeam::scattering::Vec3;

/// Sample outgoing directions for JSON lines on stdin
///
/// Answers each line {"wi":[x,y,z],"wavelength":nm,"u":[a,b,c]} by a line {"wo":[x,y,z],"pdf":…,"weight":…}, in order.
///
/// u holds three random numbers in [0, 1). pdf is the density per solid angle, as from `sunbeam eval`. weight is
/// f·|cosθo|/pdf, with the Fresnel factor where --eta is given. A sample below the horizon counts as zero:
/// {"wo":null,"pdf":0,"weight":0}. With --transmission, wo may lie below the surface.
///
/// For an array of wavelengths, one direction is sampled for all of them: pdf is the mean over the wavelengths (hero
/// wavelength, balance heuristic), and weight is an array.
///
/// A bad or empty line gives {"error":…} in its place.
#[derive(clap::Args)]
pub(crate) struct SampleArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// A line of the input. Direction and random numbers are vectors, so that a message can name one of the wrong length.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Query {
    wi: Vec<f64>,
    /// One or several wavelengths in nm.
    wavelength: Numbers,
    /// Three random numbers in [0, 1).
    u: Vec<f64>,
}

/// A line of the output.
#[derive(Serialize)]
struct Answer {
    /// The sampled direction; `None` for a sample below the horizon, or one that the cover reflects totally.
    wo: Option<Vec3>,
    /// Density in 1/sr, the mean over the wavelengths.
    pdf: f64,
    /// Weight at each wavelength.
    weight: Numbers,
}

/// Runs `sunbeam sample`.
pub(crate) fn run(args: &SampleArgs) -> Outcome {
    // Only the tables can be sampled, so there is no choice of a method.
    let reflector = Reflector::new(&args.surface, Method::Table, &MethodOptions::default(), Purpose::Service)?;
    serve(&reflector, |line| answer(&reflector, line))
}

/// Answers one line, or returns the message for the line.
fn answer(reflector: &Reflector, line: &[u8]) -> Result<Answer, String> {
    let query: Query = parse(line)?;
    let wi = direction("wi", &query.wi)?;
    let u = unit_cube("u", &query.u)?;
    let wavelengths = query.wavelength.as_slice();
    reflector.check_wavelengths(wavelengths)?;
    Ok(match reflector.sample(wi, wavelengths, u) {
        Some(sample) => Answer {
            wo: Some(sample.wo),
            pdf: sample.pdf,
            // `sample.weight` is not used: it is for the first wavelength alone, and tables of phase screens lack the
            // Fresnel factor, which `eval` contains.
            weight: query.wavelength.map(|nm| reflector.eval(wi, sample.wo, nm) * sample.wo[2].abs() / sample.pdf),
        },
        None => Answer { wo: None, pdf: 0.0, weight: query.wavelength.map(|_| 0.0) },
    })
}
