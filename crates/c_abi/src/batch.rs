//! Batches of evaluations, densities and samples.
//!
//! A batch has `count` items. Item i of each argument is a group of floats at `data + i·stride` (`foreign.rs`): a
//! direction has three, the wavelengths and the values at them `wavelength_count`. Directions are unit vectors away
//! from the surface, z along its normal; wavelengths are in nm, `f` in 1/sr, densities per solid angle.
//!
//! A bad item (a direction without unit length, a wavelength out of range) yields zeros. The other items are computed,
//! and the call reports the first bad one ([`Refused`]).

use super::foreign::{Floats, FloatsOut, Input, Output, reference};
use super::handle::SurfaceHandle;
use super::status::{CallError, Status, call};
use sunbeam::scattering::{Pair, Vec3, unit_vector};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Most wavelengths of an item. Chosen: it bounds the buffer of a false count.
const WAVELENGTHS_MAX: usize = 4096;

/// Bad items of a batch: their number, and index and error of the first.
#[derive(Default)]
struct Refused {
    bad: usize,
    first: Option<(usize, String)>,
}

impl Refused {
    /// Records the outcome of item `i`; an `Err` says why it is not usable.
    fn note(&mut self, i: usize, outcome: Result<(), String>) {
        if let Err(reason) = outcome {
            self.bad += 1;
            self.first.get_or_insert((i, reason));
        }
    }

    /// An error if any of the `count` items was bad.
    fn into_result(self, count: usize) -> Result<(), CallError> {
        match self.first {
            None => Ok(()),
            Some((first, reason)) => Err(CallError::Items { bad: self.bad, count, first, reason }),
        }
    }
}

/// Unit vector of item `i`.
fn direction(name: &str, items: &Input, i: usize) -> Result<Vec3, String> {
    unit_vector(items.three(i)).map_err(|error| format!("`{name}` {error}"))
}

/// Reads the wavelengths of item `i` into `carried`.
fn wavelengths(items: &Input, i: usize, carried: &mut [f64]) -> Result<(), String> {
    for (k, nm) in carried.iter_mut().enumerate() {
        *nm = f64::from(items.at(i, k));
        if !(WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm) {
            return Err(format!("`wavelength_nm` is {nm}; it must be in [{WAVELENGTH_MIN_NM}, {WAVELENGTH_MAX_NM}]"));
        }
    }
    Ok(())
}

/// A buffer for the wavelengths of one item; refuses a count out of range.
fn carried(wavelength_count: usize) -> Result<Vec<f64>, CallError> {
    if !(1..=WAVELENGTHS_MAX).contains(&wavelength_count) {
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
    /// Evaluates a batch: `values` receives `f_r` in 1/sr at each wavelength, `pdf` the mean density over the
    /// wavelengths. `carried` is a buffer for the wavelengths of one item.
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
                // Directions below the surface are valid: the result is zero.
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
/// - Item `i` of `wi` and of `wo` is a direction away from the surface: three floats, of length 1 within 1e-3,
///   in the surface's frame (z is the normal, x runs along the rows of the relief).
/// - Item `i` of `wavelength_nm` holds `wavelength_count` wavelengths in [360, 830].
/// - Item `i` of `f` receives the reflectance at each wavelength in 1/sr, without the cosine, and with the Fresnel
///   factor if the configuration has `eta`. It is zero unless both directions lie above the surface.
///
/// For an item that is not usable the results are zeros; all other items are computed. The call then returns
/// `SUNBEAM_STATUS_BAD_VALUE` with a message about the first bad item.
///
/// # Safety
/// `surface` must not have been freed. All items of the inputs must be readable. Those of `f` must be writable, and
/// not be accessed by others during the call.
#[unsafe(no_mangle)] // SAFETY: no other library has symbols with this prefix.
pub unsafe extern "C" fn sunbeam_surface_eval(
    surface: *const SurfaceHandle,
    count: usize,
    wi: Floats,
    wo: Floats,
    wavelength_count: usize,
    wavelength_nm: Floats,
    f: FloatsOut,
) -> Status {
    // SAFETY: by the contract above.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), Some(f), None) }
}

/// Computes the density per solid angle with which `sunbeam_surface_sample` samples the direction `wo`.
///
/// Item `i` of `pdf` receives one float, the mean over the wavelengths of the item. Other arguments are those of
/// `sunbeam_surface_eval`.
///
/// # Safety
/// The pointers' conditions are those of `sunbeam_surface_eval`.
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
    // SAFETY: by the contract above.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), None, Some(pdf)) }
}

/// Combines `sunbeam_surface_eval` and `sunbeam_surface_pdf`, at the cost of the latter.
///
/// # Safety
/// The pointers' conditions are those of `sunbeam_surface_eval`.
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
    // SAFETY: by the contract above.
    unsafe { evaluate(surface, count, [wi, wo], (wavelength_count, wavelength_nm), Some(f), Some(pdf)) }
}

/// Samples `count` outgoing directions, each for all wavelengths of its item.
///
/// - Item `i` of `u` holds three random numbers in [0, 1).
/// - Item `i` of `wo` receives the direction, item `i` of `pdf` its density (that of `sunbeam_surface_pdf`).
/// - Item `i` of `weight` receives `f cos(theta_o) / pdf` at each wavelength.
///
/// A sample below the horizon is valid and has no contribution: all of its results are zeros. Other arguments and
/// the treatment of bad items are those of `sunbeam_surface_eval`.
///
/// # Safety
/// The pointers' conditions are those of `sunbeam_surface_eval`.
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
        // SAFETY: by the contract above.
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
    /// Direction and density of one sample, `None` below the horizon; `weights` receives its weight at each wavelength.
    fn sample(&self, wi: Vec3, carried: &[f64], u: [f64; 3], weights: &mut [f64]) -> Option<(Vec3, f64)> {
        let wo = self.surface.sample_direction(wi, carried, u)?;
        let pdf = self.surface.eval_pdf(wi, wo, carried, |k, f| weights[k] = f * wo[2]);
        weights.iter_mut().for_each(|weight| *weight /= pdf);
        (pdf > 0.0).then_some((wo, pdf))
    }
}

/// Body of the three functions that take two directions.
///
/// # Safety
/// The contracts of [`Input::new`] and [`Output::new`] hold, and `surface` must not have been freed.
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
        // SAFETY: by the contract above.
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
