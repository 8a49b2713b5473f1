use super::Outcome;
use super::method_args::Method;
use super::query::{Numbers, direction, parse, unit_cube};
use super::reflector::Reflector;
use super::service::serve;
use super::surface_args::SurfaceArgs;
use serde::{Deserialize, Serialize};
use sunbeam::methods::MethodOptions;
use sunbeam::scattering::Vec3;

/// Sample outgoing directions for JSON lines on stdin
///
/// Each line {"wi":[x,y,z],"wavelength":nm,"u":[a,b,c]}, with three random numbers in [0, 1), is answered by
/// {"wo":[x,y,z],"pdf":…,"weight":…} in order. pdf is per solid angle and that of `sunbeam eval`; weight is
/// f·cosθo/pdf, with the Fresnel reflectance where --eta is given. A sample that falls below the horizon counts as
/// zero: {"wo":null,"pdf":0,"weight":0}.
///
/// With an array of wavelengths one direction is sampled for all of them: pdf is the mean over the wavelengths
/// (hero wavelength, balance heuristic) and weight an array, one for each.
///
/// A bad line, an empty one included, gives {"error":…} in its place and the rest go on.
#[derive(clap::Args)]
pub struct SampleArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Query {
    wi: Vec<f64>,
    wavelength: Numbers,
    u: Vec<f64>,
}

#[derive(Serialize)]
struct Answer {
    wo: Option<Vec3>,
    pdf: f64,
    weight: Numbers,
}

/// Runs `sunbeam sample`.
pub fn run(args: &SampleArgs) -> Outcome {
    let reflector = Reflector::new(&args.surface, Method::Table, &MethodOptions::default(), true)?;
    serve(&reflector, |line| answer(&reflector, line))
}

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
            weight: query.wavelength.map(|nm| reflector.eval(wi, sample.wo, nm) * sample.wo[2] / sample.pdf),
        },
        None => Answer { wo: None, pdf: 0.0, weight: query.wavelength.map(|_| 0.0) },
    })
}
