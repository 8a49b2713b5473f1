//! `sunbeam eval`: a service that evaluates the BSDF for JSON lines.

use super::Outcome;
use super::method_args::{MethodArgs, Quantity};
use super::query::{Numbers, direction, parse};
use super::reflector::{Purpose, Reflector};
use super::service::serve;
use super::surface_args::SurfaceArgs;
use serde::{Deserialize, Serialize};

/// Evaluate the BSDF for JSON lines on stdin
///
/// Answers each line {"wi":[x,y,z],"wo":[x,y,z],"wavelength":nm} by a line {"f":…,"pdf":…}, in order.
///
/// f is the reflectance f_r in 1/sr without the cosine, with the Fresnel factor where --eta is given. It is 0 unless
/// both directions are above the surface. With --transmission both may also be below: f is then the power per solid
/// angle and |cosθo| of light from wi to wo, and directions below an interface are those in the medium. flss, nmm, pq
/// and stam answer for 380 to 780 nm.
///
/// pdf is the density of `sunbeam sample` per solid angle, with every method. It is null for wavelengths outside the
/// range of the tables, 360 to 830 nm, and for --method exact with --theory rigorous, which has no tables.
///
/// For an array of wavelengths, f is an array and pdf is the mean over the wavelengths, since one direction is sampled
/// for all of them (hero wavelength, balance heuristic).
///
/// Directions must have unit length to 1e-3 and are normalised. A bad or empty line gives {"error":…} in its place.
#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// A line of the input. The directions are vectors, so that a message can name one with a wrong number of components.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Query {
    wi: Vec<f64>,
    wo: Vec<f64>,
    /// One or several wavelengths in nm.
    wavelength: Numbers,
}

/// A line of the output.
#[derive(Serialize)]
struct Answer {
    /// `f_r` in 1/sr at each wavelength.
    f: Numbers,
    /// Mean density per solid angle over the wavelengths; `None` for a wavelength outside the tables' range, and for a
    /// grating that is solved for each query.
    pdf: Option<f64>,
}

/// Runs `sunbeam eval`.
pub(crate) fn run(args: &EvalArgs) -> Outcome {
    let options = args.method.options(Quantity::Spectrum)?;
    let reflector = Reflector::new(&args.surface, args.method.method(), &options, Purpose::Service)?;
    serve(&reflector, |line| answer(&reflector, line))
}

/// Answers one line, or returns the message for the line.
fn answer(reflector: &Reflector, line: &[u8]) -> Result<Answer, String> {
    let query: Query = parse(line)?;
    let (wi, wo) = (direction("wi", &query.wi)?, direction("wo", &query.wo)?);
    let wavelengths = query.wavelength.as_slice();
    reflector.check_wavelengths(wavelengths)?;
    let f = query.wavelength.try_map(|nm| reflector.try_eval(wi, wo, nm))?;
    Ok(Answer { f, pdf: reflector.pdf(wi, wo, wavelengths) })
}
