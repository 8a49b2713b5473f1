//! Creation, description and destruction of surfaces.

use super::foreign::{Floats, Input, reference, reference_mut, utf8};
use super::status::{CallError, Status, call};
use ndarray::Array2;
use serde::Serialize;
use std::ffi::c_char;
use sunbeam::cache::{Cache, Origin};
use sunbeam::config::{BuildError, BuiltReport, BuiltSurface, SurfaceConfig};
use sunbeam::height_field::{FileField, HeightField, Provenance};
use sunbeam::table::{LIMIT_BYTES, Progress};

/// Least memory in bytes that a build needs for each height of an array: the height and two copies of it, in double
/// precision.
const HEIGHT_BYTES: f64 = 24.0;

/// A surface with its tables. It never changes after its creation, so any number of threads may use it at once.
pub struct SurfaceHandle {
    /// Evaluator of the BSDF, with its tables and refractive index.
    pub(super) surface: BuiltSurface,
    /// Parameters as given.
    config: SurfaceConfig,
    /// Origin of the tables: the cache or a build.
    origin: Origin,
    /// Interpretation of the height-field file; `None` for presets and arrays.
    file: Option<FileDescription>,
}

/// Interpretation of a height-field file.
#[derive(Serialize)]
struct FileDescription {
    /// Origin of size, unit, orientation, channel and missing points.
    provenance: Option<Provenance>,
    /// Warnings about implausible properties of the relief.
    doubts: Vec<String>,
}

impl FileDescription {
    /// Describes the file of a configuration; `None` for a preset. The build of the surface reads the file again.
    fn of(config: &SurfaceConfig) -> Result<Option<Self>, BuildError> {
        if config.filename.is_none() {
            return Ok(None);
        }
        let FileField { provenance, doubts, .. } = config.raw_height_field()?;
        Ok(Some(Self { provenance, doubts: doubts.iter().map(ToString::to_string).collect() }))
    }
}

/// The JSON object of `sunbeam_surface_describe`.
#[derive(Serialize)]
struct Description<'a> {
    /// Version of the library.
    version: &'static str,
    /// Parameters as given.
    config: &'a SurfaceConfig,
    /// Origin of the tables: the cache or a build.
    origin: &'a Origin,
    /// Interpretation of the height-field file; absent for presets and arrays.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a FileDescription>,
    /// Build time, memory and measured error; its keys are keys of this object.
    #[serde(flatten)]
    report: BuiltReport<'a>,
}

impl SurfaceHandle {
    /// Moves the surface to the heap, where the caller owns it until `sunbeam_surface_free`. `result` receives its
    /// address.
    fn publish(self, result: &mut *mut Self) {
        *result = Box::into_raw(Box::new(self));
    }
}

/// Creates a surface from a JSON object of parameters, such as
/// `{"preset": "blazed", "period": 2.5, "coherence_length": 65}`. All parameters have defaults. Lengths are in
/// micrometres.
///
/// Building the tables takes up to some seconds; reading them from the cache takes a fraction of a second. The
/// environment variables SUNBEAM_CACHE, SUNBEAM_CACHE_DIR and SUNBEAM_CACHE_LIMIT_MB control the cache.
///
/// `*surface` is null unless the call returns `SUNBEAM_STATUS_OK`. Free it with `sunbeam_surface_free`.
///
/// # Safety
/// `config_json` must be a string with a terminating NUL, and `surface` a valid pointer to a pointer.
#[unsafe(no_mangle)] // SAFETY: no other library has symbols with this prefix.
pub unsafe extern "C" fn sunbeam_surface_new(config_json: *const c_char, surface: *mut *mut SurfaceHandle) -> Status {
    call(|| {
        // SAFETY: by the contract above.
        let (result, json) = unsafe {
            let result = reference_mut("surface", surface)?;
            *result = std::ptr::null_mut();
            (result, utf8("config_json", config_json)?)
        };
        let config = SurfaceConfig::from_json(json).map_err(BuildError::from)?;
        let cache = Cache::from_env().map_err(BuildError::from)?;
        let file = FileDescription::of(&config)?;
        let (surface, origin) = config.build_by_theory(&cache, &Progress::none())?;
        SurfaceHandle { surface, config, origin, file }.publish(result);
        Ok(())
    })
}

/// Creates a surface from an array of heights: `ny` rows of `nx` heights in micrometres. Row `iy` begins at
/// `heights_um.data + iy * heights_um.stride` and lies at y = `iy * pixel_y_um`; height `ix` of a row lies at
/// x = `ix * pixel_x_um`. The heights are copied.
///
/// The configuration has the parameters of `sunbeam_surface_new`, except those of presets and files; `fill` is
/// accepted. `level` defaults to `plane` and `tiling` to `aperiodic`, as for files. With `theory` `rigorous` the
/// array is one period of a grating, and `aperiodic` is refused. Heights that are NaN, infinite or of magnitude
/// 1e30 or more are missing points. They are an error unless `fill` is `laplace` or `mean`. More heights than
/// `build_limit` allows are an error: each takes at least 24 bytes of `build_limit` times 8 GB.
///
/// `*surface` is null unless the call returns `SUNBEAM_STATUS_OK`. Free it with `sunbeam_surface_free`.
///
/// # Safety
/// The requirements of `sunbeam_surface_new` apply. `nx` floats must be readable from the beginning of each row.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_from_heights(
    config_json: *const c_char,
    heights_um: Floats,
    nx: usize,
    ny: usize,
    pixel_x_um: f64,
    pixel_y_um: f64,
    surface: *mut *mut SurfaceHandle,
) -> Status {
    call(|| {
        // An array without heights may be null, even if it has rows.
        let row_count = if nx == 0 { 0 } else { ny };
        // SAFETY: by the contract above.
        let (result, json, rows) = unsafe {
            let result = reference_mut("surface", surface)?;
            *result = std::ptr::null_mut();
            (result, utf8("config_json", config_json)?, Input::new("heights_um", heights_um, nx, row_count)?)
        };
        let config = SurfaceConfig::from_json_for_array(json).map_err(BuildError::from)?;
        let heights = copy_heights(&rows, nx, ny, config.build_limit)?;
        let fill = config.fill.unwrap_or_default();
        let field = HeightField::with_holes(heights, pixel_x_um, pixel_y_um, fill).map_err(BuildError::from)?;
        let (surface, origin) = config.build_of(&field, &Cache::from_env().map_err(BuildError::from)?)?;
        SurfaceHandle { surface, config, origin, file: None }.publish(result);
        Ok(())
    })
}

/// Copies `ny` rows of `nx` heights.
///
/// # Errors
/// More heights than `build_limit` (a factor on [`LIMIT_BYTES`]) allows, or more than fit memory.
fn copy_heights(rows: &Input, nx: usize, ny: usize, build_limit: f64) -> Result<Array2<f64>, CallError> {
    if nx == 0 || ny == 0 {
        // `HeightField::with_holes` refuses the empty array.
        return Ok(Array2::zeros((0, 0)));
    }
    let too_many = |accepted: String| CallError::Size { argument: "nx", found: nx, accepted };
    let count_max = build_limit * LIMIT_BYTES / HEIGHT_BYTES;
    if nx as f64 * ny as f64 > count_max {
        let advice = "a larger `build_limit` allows more";
        return Err(too_many(format!("such that nx * ny is at most {count_max:.0}, with `ny` {ny}; {advice}")));
    }
    let mut heights = Vec::new();
    let is_reserved = nx.checked_mul(ny).is_some_and(|count| heights.try_reserve_exact(count).is_ok());
    if !is_reserved {
        return Err(too_many(format!("such that nx * ny heights fit memory, with `ny` {ny}")));
    }
    heights.extend((0..ny).flat_map(|iy| (0..nx).map(move |ix| f64::from(rows.at(iy, ix)))));
    // The number of heights fits the shape, so the error does not occur.
    Array2::from_shape_vec((ny, nx), heights).map_err(|error| sunbeam_guard::Panic(error.to_string()).into())
}

/// Frees a surface. Null is ignored.
///
/// # Safety
/// `surface` must have been created by `sunbeam_surface_new` or `sunbeam_surface_from_heights`, not have been
/// freed before, and not be used afterwards.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_free(surface: *mut SurfaceHandle) {
    // The status is dropped: no caller could act on a surface that was not freed.
    call(|| {
        if !surface.is_null() {
            // SAFETY: by the contract above, it came from `Box::into_raw` and is not used again.
            drop(unsafe { Box::from_raw(surface) });
        }
        Ok(())
    });
}

/// Writes a JSON object with the configuration (key `config`), the size of the tables and their measured error. For a
/// surface from a file, its key `file` has the sources of size, unit, orientation and channel, the missing points, and
/// warnings.
///
/// `*needed` receives the size of the text in bytes, including the terminating NUL. If `capacity` is smaller,
/// nothing is written to `buffer`, and the call returns `SUNBEAM_STATUS_BUFFER_TOO_SMALL`. `buffer` may be null if
/// `capacity` is 0.
///
/// # Safety
/// `surface` must not have been freed, `buffer` must have room for `capacity` bytes, and `needed` must be a valid
/// pointer.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_describe(
    surface: *const SurfaceHandle,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> Status {
    call(|| {
        // SAFETY: by the contract above.
        let (handle, needed) = unsafe { (reference("surface", surface)?, reference_mut("needed", needed)?) };
        let version = env!("CARGO_PKG_VERSION");
        let description = Description {
            version,
            config: &handle.config,
            origin: &handle.origin,
            file: handle.file.as_ref(),
            report: handle.surface.report(),
        };
        // Serialisation fails only by a defect of the library, so its error is reported as a panic is.
        let json = serde_json::to_string(&description).map_err(|error| sunbeam_guard::Panic(error.to_string()))?;
        *needed = json.len() + 1;
        if capacity < *needed {
            return Err(CallError::BufferTooSmall { needed: *needed, capacity });
        }
        if buffer.is_null() {
            return Err(CallError::Null { argument: "buffer" });
        }
        // SAFETY: the buffer has room for the text and its terminating NUL.
        unsafe {
            std::ptr::copy_nonoverlapping(json.as_ptr().cast(), buffer, json.len());
            buffer.add(json.len()).write(0);
        }
        Ok(())
    })
}
