//! Batches of evaluations, densities and samples.
//!
//! A batch has `count` items. Item i of each array is a group of floats at `data + i·stride` (`foreign.rs`): three for
//! a direction, `wavelength_count` for wavelengths and for values at them, one for a density. Directions are unit
//! vectors away from the surface, `wi` to the light and `wo` to the viewer, with z along the normal. Wavelengths are in
//! nm, `f` and densities in 1/sr.
//!
//! A bad item has a direction that is no unit vector, a wavelength out of range, or a random number out of range. Its
//! results are zeros. The other items are computed, and the call reports the first bad one ([`BadItems`]).

use super::foreign::{Floats, FloatsOut, Input, Output, reference};
use super::handle::SurfaceHandle;
use super::status::{CallError, Status, call};
use sunbeam::scattering::{Vec3, unit_vector};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Largest number of wavelengths of an item, stated in the header. It limits the memory that a wrong count can
/// allocate; useful spectra have fewer.
const WAVELENGTHS_MAX: usize = 4096;

/// Bad items of a batch.
#[derive(Default)]
struct BadItems {
    /// Number of bad items.
    bad: usize,
    /// Index and error of the first bad item.
    first: Option<(usize, String)>,
}

impl BadItems {
    /// Counts item `i` as bad if its outcome is an error.
    fn note<T>(&mut self, i: usize, outcome: Result<T, String>) {
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

/// Direction of item `i` as a unit vector; `argument` is the name of `items` in the error.
fn direction(argument: &str, items: &Input, i: usize) -> Result<Vec3, String> {
    unit_vector(items.three(i)).map_err(|error| format!("`{argument}` {error}"))
}

/// Wavelengths of all items, and a buffer for the wavelengths of one item.
struct Wavelengths {
    items: Input,
    buffer_nm: Vec<f64>,
}

impl Wavelengths {
    /// Checks an array of `count` items of `wavelength_count` wavelengths in nm.
    ///
    /// # Safety
    /// The contract of [`Input::new`].
    unsafe fn new(wavelength_nm: Floats, wavelength_count: usize, count: usize) -> Result<Self, CallError> {
        if !(1..=WAVELENGTHS_MAX).contains(&wavelength_count) {
            let accepted = format!("1 to {WAVELENGTHS_MAX}");
            return Err(CallError::Size { argument: "wavelength_count", found: wavelength_count, accepted });
        }
        // SAFETY: by the contract above.
        let items = unsafe { Input::new("wavelength_nm", wavelength_nm, wavelength_count, count)? };
        Ok(Self { items, buffer_nm: vec![0.0; wavelength_count] })
    }

    /// Wavelengths of item `i` in nm; an error if one is out of range.
    fn item(&mut self, i: usize) -> Result<&[f64], String> {
        for (k, nm) in self.buffer_nm.iter_mut().enumerate() {
            *nm = f64::from(self.items.at(i, k));
            if !(WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm) {
                return Err(format!(
                    "`wavelength_nm` is {nm}; it must be in [{WAVELENGTH_MIN_NM}, {WAVELENGTH_MAX_NM}]"
                ));
            }
        }
        Ok(&self.buffer_nm)
    }
}

/// Checked inputs of a batch of evaluations.
struct Queries {
    count: usize,
    wi: Input,
    wo: Input,
    wavelengths: Wavelengths,
}

impl Queries {
    /// Checks the inputs of `count` evaluations.
    ///
    /// # Safety
    /// The contract of [`Input::new`] for each array.
    unsafe fn new(
        count: usize,
        wi: Floats,
        wo: Floats,
        wavelength_count: usize,
        wavelength_nm: Floats,
    ) -> Result<Self, CallError> {
        // SAFETY: by the contract above.
        unsafe {
            Ok(Self {
                count,
                wi: Input::new("wi", wi, 3, count)?,
                wo: Input::new("wo", wo, 3, count)?,
                wavelengths: Wavelengths::new(wavelength_nm, wavelength_count, count)?,
            })
        }
    }
}

impl SurfaceHandle {
    /// Evaluates a batch. `f` receives the BSDF at each wavelength, `pdf` the mean density over the wavelengths.
    /// Either is `None` if the caller does not need it.
    fn eval(&self, mut queries: Queries, f: Option<Output>, pdf: Option<Output>) -> Result<(), CallError> {
        let mut bad_items = BadItems::default();
        for i in 0..queries.count {
            let outcome = self.eval_item(&mut queries, i, f, pdf);
            if outcome.is_err() {
                [f, pdf].iter().flatten().for_each(|output| output.clear(i));
            }
            bad_items.note(i, outcome);
        }
        bad_items.into_result(queries.count)
    }

    /// Evaluates item `i` of [`SurfaceHandle::eval`] and writes its results. A bad item is an error, and nothing is
    /// written.
    fn eval_item(&self, queries: &mut Queries, i: usize, f: Option<Output>, pdf: Option<Output>) -> Result<(), String> {
        let (wi, wo) = (direction("wi", &queries.wi, i)?, direction("wo", &queries.wo, i)?);
        let wavelengths_nm = queries.wavelengths.item(i)?;
        let write_value = |k, value: f64| {
            if let Some(f) = f {
                f.set(i, k, value as f32);
            }
        };
        match pdf {
            None => self.surface.eval(wi, wo, wavelengths_nm, write_value),
            Some(pdf) => pdf.set(i, 0, self.surface.eval_pdf(wi, wo, wavelengths_nm, write_value) as f32),
        }
        Ok(())
    }

    /// Samples item `i` of a batch. Returns its direction and density, and writes its weight at each wavelength to
    /// `weights`. `None` if `wi` or the sampled direction lies beyond the horizon, or the density is 0. A bad item is
    /// an error.
    fn sample_item(
        &self,
        wi: &Input,
        wavelengths: &mut Wavelengths,
        u: &Input,
        i: usize,
        weights: &mut [f64],
    ) -> Result<Option<(Vec3, f64)>, String> {
        let (wi, u) = (direction("wi", wi, i)?, u.three(i));
        let wavelengths_nm = wavelengths.item(i)?;
        if let Some(outside) = u.iter().find(|number| !(0.0..1.0).contains(*number)) {
            return Err(format!("`u` holds {outside}; all must be in [0, 1)"));
        }
        let Some(wo) = self.surface.sample_direction(wi, wavelengths_nm, u) else { return Ok(None) };
        // A weight is f·|cosθo|/pdf. With a density of 0 there is no sample, and the weights are not used.
        let pdf = self.surface.eval_pdf(wi, wo, wavelengths_nm, |k, f| weights[k] = f * wo[2].abs());
        weights.iter_mut().for_each(|weight| *weight /= pdf);
        Ok((pdf > 0.0).then_some((wo, pdf)))
    }
}

/// Evaluates the BSDF for `count` pairs of directions, each at `wavelength_count` wavelengths.
///
/// - Item `i` of `wi` is the direction to the light, item `i` of `wo` that to the viewer. Both point away from the
///   surface: three floats, of length 1 within 1e-3, in the surface's frame (z is the normal, x runs along the rows of
///   the relief).
/// - Item `i` of `wavelength_nm` holds `wavelength_count` wavelengths (1 to 4096), each in [360, 830] nm.
/// - Item `i` of `f` receives the BRDF at each wavelength in 1/sr, without the cosine. It includes the Fresnel factor
///   if the configuration has `eta`. It is zero unless both directions lie above the surface.
///
/// With `transmission`, directions may lie on either side of the surface. Below an interface they are directions in
/// the medium. `f` is then the BSDF of light from `wi` to `wo`: its power per solid angle, divided by |cos(theta_o)|.
///
/// An item with a value out of these ranges is bad: its results are zeros, and all other items are computed. The
/// call then returns `SUNBEAM_STATUS_BAD_VALUE` with a message about the first bad item.
///
/// # Safety
/// `surface` must not have been freed. All items of inputs must be readable. All items of outputs must be writable,
/// and nothing else may access them during the call.
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
    call(|| {
        // SAFETY: by the contract above.
        let (surface, queries, f) = unsafe {
            (
                reference("surface", surface)?,
                Queries::new(count, wi, wo, wavelength_count, wavelength_nm)?,
                Output::new("f", f, wavelength_count, count)?,
            )
        };
        surface.eval(queries, Some(f), None)
    })
}

/// Computes the density in 1/sr with which `sunbeam_surface_sample` samples the direction `wo`.
///
/// Item `i` of `pdf` receives one float, the mean density over the wavelengths of the item. It is zero unless both
/// directions lie above the surface, or the configuration has `transmission`. Other arguments are those of
/// `sunbeam_surface_eval`.
///
/// # Safety
/// The requirements of `sunbeam_surface_eval` apply.
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
    call(|| {
        // SAFETY: by the contract above.
        let (surface, queries, pdf) = unsafe {
            (
                reference("surface", surface)?,
                Queries::new(count, wi, wo, wavelength_count, wavelength_nm)?,
                Output::new("pdf", pdf, 1, count)?,
            )
        };
        surface.eval(queries, None, Some(pdf))
    })
}

/// Combines `sunbeam_surface_eval` and `sunbeam_surface_pdf`, at the cost of the latter.
///
/// # Safety
/// The requirements of `sunbeam_surface_eval` apply.
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
    call(|| {
        // SAFETY: by the contract above.
        let (surface, queries, f, pdf) = unsafe {
            (
                reference("surface", surface)?,
                Queries::new(count, wi, wo, wavelength_count, wavelength_nm)?,
                Output::new("f", f, wavelength_count, count)?,
                Output::new("pdf", pdf, 1, count)?,
            )
        };
        surface.eval(queries, Some(f), Some(pdf))
    })
}

/// Samples `count` outgoing directions, each for all wavelengths of its item.
///
/// - Item `i` of `u` holds three random numbers in [0, 1).
/// - Item `i` of `wo` receives the direction: three floats.
/// - Item `i` of `pdf` receives its density, one float, as `sunbeam_surface_pdf` computes it.
/// - Item `i` of `weight` receives `f |cos(theta_o)| / pdf` at each wavelength.
///
/// With `transmission`, `wi` and the samples may lie on either side of the surface. All results of an item are zeros
/// if the direction drawn lies beyond the horizon of its side or has density 0, or if `wi` lies below the surface
/// without `transmission`. Such a sample is valid and contributes nothing. Other arguments and the treatment of bad
/// items are those of `sunbeam_surface_eval`.
///
/// # Safety
/// The requirements of `sunbeam_surface_eval` apply.
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
        // SAFETY: by the contract above.
        let (surface, wi, mut wavelengths, u, wo, pdf, weight) = unsafe {
            (
                reference("surface", surface)?,
                Input::new("wi", wi, 3, count)?,
                Wavelengths::new(wavelength_nm, wavelength_count, count)?,
                Input::new("u", u, 3, count)?,
                Output::new("wo", wo, 3, count)?,
                Output::new("pdf", pdf, 1, count)?,
                Output::new("weight", weight, wavelength_count, count)?,
            )
        };
        let mut weights = vec![0.0; wavelength_count];
        let mut bad_items = BadItems::default();
        for i in 0..count {
            let outcome = surface.sample_item(&wi, &mut wavelengths, &u, i, &mut weights);
            match &outcome {
                Ok(Some((sampled, density))) => {
                    (0..3).for_each(|k| wo.set(i, k, sampled[k] as f32));
                    pdf.set(i, 0, *density as f32);
                    weights.iter().enumerate().for_each(|(k, value)| weight.set(i, k, *value as f32));
                }
                Ok(None) | Err(_) => [wo, pdf, weight].iter().for_each(|output| output.clear(i)),
            }
            bad_items.note(i, outcome);
        }
        bad_items.into_result(count)
    })
}
