//! Batches of evaluations, densities and samples.

use super::foreign::{Floats, FloatsOut, Input, Output, reference};
use super::handle::SurfaceHandle;
use super::status::{CallError, Status, call};
use sunbeam::scattering::{Pair, Vec3, unit_vector};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Most wavelengths that an item carries.
const CARRIED_MAX: usize = 4096;

/// What of a batch could not be answered.
#[derive(Default)]
struct Refused {
    bad: usize,
    first: Option<(usize, String)>,
}

impl Refused {
    /// Takes the outcome of item `i`; `Err` is why it is not usable.
    fn note(&mut self, i: usize, outcome: Result<(), String>) {
        if let Err(reason) = outcome {
            self.bad += 1;
            self.first.get_or_insert((i, reason));
        }
    }

    fn into_result(self, count: usize) -> Result<(), CallError> {
        match self.first {
            None => Ok(()),
            Some((first, reason)) => Err(CallError::Items { bad: self.bad, count, first, reason }),
        }
    }
}

fn direction(name: &str, items: &Input, i: usize) -> Result<Vec3, String> {
    unit_vector(items.three(i)).map_err(|error| format!("`{name}` {error}"))
}

/// The wavelengths of item `i`, into `carried`.
fn wavelengths(items: &Input, i: usize, carried: &mut [f64]) -> Result<(), String> {
    for (k, nm) in carried.iter_mut().enumerate() {
        *nm = f64::from(items.at(i, k));
        if !(WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm) {
            return Err(format!("`wavelength_nm` is {nm}; it must be in [{WAVELENGTH_MIN_NM}, {WAVELENGTH_MAX_NM}]"));
        }
    }
    Ok(())
}

fn carried(wavelength_count: usize) -> Result<Vec<f64>, CallError> {
    if !(1..=CARRIED_MAX).contains(&wavelength_count) {
        let (argument, accepted) = ("wavelength_count", "1 to 4096");
        return Err(CallError::Size { argument, found: wavelength_count, accepted });
    }
    Ok(vec![0.0; wavelength_count])
}

/// Directions and wavelengths of a batch of evaluations.
struct Queries {
    count: usize,
    wi: Input,
    wo: Input,
    wavelength_nm: Input,
}

impl SurfaceHandle {
    /// Evaluates a batch. Values are `f_r` in 1/sr at each wavelength, densities the mean over the wavelengths carried.
    fn eval(
        &self,
        queries: &Queries,
        mut carried: Vec<f64>,
        values: Option<Output>,
        pdf: Option<Output>,
    ) -> Result<(), CallError> {
        let mut refused = Refused::default();
        for i in 0..queries.count {
            let outcome = (|| {
                let (wi, wo) = (direction("wi", &queries.wi, i)?, direction("wo", &queries.wo, i)?);
                wavelengths(&queries.wavelength_nm, i, &mut carried)?;
                // Below the surface nothing is reflected, which is an answer.
                if Pair::new(wi, wo).is_none() {
                    return Ok(false);
                }
                let value = |k, f: f64| {
                    if let Some(values) = values {
                        values.set(i, k, f as f32);
                    }
                };
                match pdf {
                    None => self.surface.eval(wi, wo, &carried, value),
                    Some(pdf) => pdf.set(i, 0, self.surface.eval_pdf(wi, wo, &carried, value) as f32),
                }
                Ok(true)
            })();
            if outcome != Ok(true) {
                [values, pdf].iter().flatten().for_each(|output| output.clear(i));
            }
            refused.note(i, outcome.map(|_| ()));
        }
        refused.into_result(queries.count)
    }
}

/// Evaluates the BSDF for `count` pairs of directions, each at `wavelength_count` wavelengths.
///
/// Item `i` of `wi` and `wo` is a direction: three floats, of length 1 to 1e-3, in the surface's frame (z its normal, x along
/// the relief's rows), both pointing away from it. Item `i` of `wavelength_nm` is `wavelength_count` floats in [360, 830].
/// Item `i` of `f` receives as many: the reflectance in 1/sr, without the cosine and with the Fresnel reflectance where the
/// configuration has `eta`; zeros unless both directions lie above the surface.
///
/// An item that is not usable is answered with zeros, the others are answered all the same, and the call returns
/// `SUNBEAM_STATUS_BAD_VALUE` with a message about the first such item.
///
/// # Safety
/// `surface` must be alive; every item of the arrays must be readable, those of `f` writable, by this call alone.
#[unsafe(no_mangle)] // SAFETY: the prefix keeps it from meeting a symbol of others.
pub unsafe extern "C" fn sunbeam_surface_eval(
    surface: *const SurfaceHandle,
    count: usize,
    wi: Floats,
    wo: Floats,
    wavelength_count: usize,
    wavelength_nm: Floats,
    f: FloatsOut,
) -> Status {
    // SAFETY: as the caller vouches.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), Some(f), None) }
}

/// The density with which `sunbeam_surface_sample` finds the direction `wo`, per solid angle: one float an item, the mean over
/// the wavelengths that it carries. The arguments are those of `sunbeam_surface_eval`.
///
/// # Safety
/// As `sunbeam_surface_eval`.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_pdf(
    surface: *const SurfaceHandle,
    count: usize,
    wi: Floats,
    wo: Floats,
    wavelength_count: usize,
    wavelength_nm: Floats,
    pdf: FloatsOut,
) -> Status {
    // SAFETY: as the caller vouches.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), None, Some(pdf)) }
}

/// `sunbeam_surface_eval` and `sunbeam_surface_pdf` in one, for the cost of the latter.
///
/// # Safety
/// As `sunbeam_surface_eval`.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_eval_pdf(
    surface: *const SurfaceHandle,
    count: usize,
    wi: Floats,
    wo: Floats,
    wavelength_count: usize,
    wavelength_nm: Floats,
    f: FloatsOut,
    pdf: FloatsOut,
) -> Status {
    // SAFETY: as the caller vouches.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), Some(f), Some(pdf)) }
}

/// Samples `count` outgoing directions, one for all the wavelengths that an item carries.
///
/// Item `i` of `u` is three random numbers in [0, 1). Item `i` of `wo` receives the direction, of `pdf` its density (that of
/// `sunbeam_surface_pdf`), of `weight` for each wavelength `f cos(theta_o) / pdf`. A sample that falls below the horizon counts
/// as zero: all of its results are zeros. Else the arguments, and what happens to items that are not usable, are as for
/// `sunbeam_surface_eval`.
///
/// # Safety
/// As `sunbeam_surface_eval`.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_sample(
    surface: *const SurfaceHandle,
    count: usize,
    wi: Floats,
    wavelength_count: usize,
    wavelength_nm: Floats,
    u: Floats,
    wo: FloatsOut,
    pdf: FloatsOut,
    weight: FloatsOut,
) -> Status {
    call(|| {
        let mut carried = carried(wavelength_count)?;
        // SAFETY: as the caller vouches.
        let (surface, wi, wavelength_nm, u, wo, pdf, weight) = unsafe {
            (
                reference("surface", surface)?,
                Input::new("wi", wi, count)?,
                Input::new("wavelength_nm", wavelength_nm, count)?,
                Input::new("u", u, count)?,
                Output::new("wo", wo, 3, count)?,
                Output::new("pdf", pdf, 1, count)?,
                Output::new("weight", weight, wavelength_count, count)?,
            )
        };
        let mut weights = vec![0.0; wavelength_count];
        let mut refused = Refused::default();
        for i in 0..count {
            let outcome = (|| {
                let (from, random) = (direction("wi", &wi, i)?, u.three(i));
                wavelengths(&wavelength_nm, i, &mut carried)?;
                if let Some(outside) = random.iter().find(|u| !(0.0..1.0).contains(*u)) {
                    return Err(format!("`u` holds {outside}; all must be in [0, 1)"));
                }
                Ok(surface.sample(from, &carried, random, &mut weights))
            })();
            match &outcome {
                Ok(Some((to, density))) => {
                    (0..3).for_each(|k| wo.set(i, k, to[k] as f32));
                    pdf.set(i, 0, *density as f32);
                    weights.iter().enumerate().for_each(|(k, value)| weight.set(i, k, *value as f32));
                }
                _ => [wo, pdf, weight].iter().for_each(|output| output.clear(i)),
            }
            refused.note(i, outcome.map(|_| ()));
        }
        refused.into_result(count)
    })
}

impl SurfaceHandle {
    /// Direction and density of one sample; its weight at each of the wavelengths goes to `weights`.
    fn sample(&self, wi: Vec3, carried: &[f64], u: [f64; 3], weights: &mut [f64]) -> Option<(Vec3, f64)> {
        let wo = self.surface.sample_direction(wi, carried, u)?;
        let pdf = self.surface.eval_pdf(wi, wo, carried, |k, f| weights[k] = f * wo[2]);
        weights.iter_mut().for_each(|weight| *weight /= pdf);
        (pdf > 0.0).then_some((wo, pdf))
    }
}

/// What the three functions of two directions share.
///
/// # Safety
/// As for [`Input::new`] and [`Output::new`], and `surface` must be alive.
unsafe fn evaluate(
    surface: *const SurfaceHandle,
    count: usize,
    [wi, wo]: [Floats; 2],
    (wavelength_count, wavelength_nm): (usize, Floats),
    f: Option<FloatsOut>,
    pdf: Option<FloatsOut>,
) -> Status {
    call(|| {
        let carried = carried(wavelength_count)?;
        // SAFETY: as the caller vouches.
        let (surface, queries, f, pdf) = unsafe {
            (
                reference("surface", surface)?,
                Queries {
                    count,
                    wi: Input::new("wi", wi, count)?,
                    wo: Input::new("wo", wo, count)?,
                    wavelength_nm: Input::new("wavelength_nm", wavelength_nm, count)?,
                },
                f.map(|f| Output::new("f", f, wavelength_count, count)).transpose()?,
                pdf.map(|pdf| Output::new("pdf", pdf, 1, count)).transpose()?,
            )
        };
        surface.eval(&queries, carried, f, pdf)
    })
}
