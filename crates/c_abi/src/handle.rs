//! The life of a surface: made, described, freed.

use super::foreign::{Floats, Input, place, reference, text};
use super::status::{CallError, Status, call};
use ndarray::Array2;
use serde::Serialize;
use std::ffi::c_char;
use sunbeam::cache::{Cache, Origin};
use sunbeam::config::{BuildError, BuiltReport, BuiltSurface, SurfaceConfig};
use sunbeam::height_field::{FileField, HeightField, Provenance};
use sunbeam::table::Progress;

/// A surface with its tables. It is never changed after it was made, so any number of threads may use it at once.
pub struct SurfaceHandle {
    pub(super) surface: BuiltSurface,
    config: SurfaceConfig,
    origin: Origin,
    file: Option<FileDescription>,
}

/// How a file of heights was understood.
#[derive(Serialize)]
struct FileDescription {
    provenance: Option<Provenance>,
    /// Properties that no relief has.
    doubts: Vec<String>,
}

impl FileDescription {
    /// Reads the file that a configuration names; `None` for a preset.
    fn of(config: &SurfaceConfig) -> Result<Option<Self>, BuildError> {
        if config.filename.is_none() {
            return Ok(None);
        }
        let FileField { provenance, doubts, .. } = config.raw_height_field()?;
        Ok(Some(Self { provenance, doubts: doubts.iter().map(ToString::to_string).collect() }))
    }
}

/// What `sunbeam_surface_describe` tells.
#[derive(Serialize)]
struct Description<'a> {
    version: &'static str,
    config: &'a SurfaceConfig,
    /// Where the tables came from.
    origin: &'a Origin,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a FileDescription>,
    #[serde(flatten)]
    report: BuiltReport<'a>,
}

impl SurfaceHandle {
    fn publish(self, place: &mut *mut Self) {
        *place = Box::into_raw(Box::new(self));
    }
}

/// Makes a surface from a JSON object whose keys are the parameters' names, such as
/// `{"preset": "blazed", "period": 2.5, "coherence_length": 65}`; all have defaults. Lengths are in micrometres.
///
/// It takes up to some seconds, or a fraction of one where the tables are in the cache (environment variables SUNBEAM_CACHE,
/// SUNBEAM_CACHE_DIR and SUNBEAM_CACHE_LIMIT_MB). `*surface` is null unless this returns `SUNBEAM_STATUS_OK`; give it back with
/// `sunbeam_surface_free`.
///
/// # Safety
/// `config_json` must be a string with a terminating NUL, `surface` a place for a pointer.
#[unsafe(no_mangle)] // SAFETY: the prefix keeps it from meeting a symbol of others.
pub unsafe extern "C" fn sunbeam_surface_new(config_json: *const c_char, surface: *mut *mut SurfaceHandle) -> Status {
    call(|| {
        // SAFETY: as the caller vouches.
        let (place, json) = unsafe {
            let place = place("surface", surface)?;
            *place = std::ptr::null_mut();
            (place, text("config_json", config_json)?)
        };
        let config = SurfaceConfig::from_json(json).map_err(BuildError::from)?;
        let cache = Cache::from_env().map_err(BuildError::from)?;
        let file = FileDescription::of(&config)?;
        let (surface, origin) = config.build_by_theory(&cache, &Progress::none())?;
        SurfaceHandle { surface, config, origin, file }.publish(place);
        Ok(())
    })
}

/// Makes a surface from heights in memory: `ny` rows of `nx` heights in micrometres, row `iy` beginning at
/// `heights_um.data + iy * heights_um.stride` and lying at y = `iy * pixel_y_um`.
///
/// The configuration is as for `sunbeam_surface_new` without what is about presets and files; as for files, `level` is
/// `plane` and `tiling` is `aperiodic` unless it says otherwise. Heights that are NaN, infinite or from ±1e30 on are holes:
/// they are refused unless `fill` is `laplace` or `mean`. The heights are copied.
///
/// # Safety
/// As `sunbeam_surface_new`, and `nx` floats must be readable from the beginning of each row.
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
        // SAFETY: as the caller vouches.
        let (place, json, rows) = unsafe {
            let place = place("surface", surface)?;
            *place = std::ptr::null_mut();
            let count = if nx == 0 { 0 } else { ny };
            (place, text("config_json", config_json)?, Input::new("heights_um", heights_um, count)?)
        };
        if nx.checked_mul(ny).is_none_or(|n| n > isize::MAX as usize / size_of::<f64>()) {
            return Err(CallError::Size {
                argument: "nx",
                found: nx,
                accepted: "such that nx * ny heights fit memory",
            });
        }
        let config = SurfaceConfig::from_json_for_array(json).map_err(BuildError::from)?;
        let heights = Array2::from_shape_fn((ny, nx), |(iy, ix)| f64::from(rows.at(iy, ix)));
        let fill = config.fill.unwrap_or_default();
        let field = HeightField::with_holes(heights, pixel_x_um, pixel_y_um, fill).map_err(BuildError::from)?;
        let (surface, origin) = config.build_of(&field, &Cache::from_env().map_err(BuildError::from)?)?;
        SurfaceHandle { surface, config, origin, file: None }.publish(place);
        Ok(())
    })
}

/// Gives a surface back. Null is fine; nothing may use it afterwards.
///
/// # Safety
/// `surface` must come from one of the two functions that make one, and not have been given back.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_free(surface: *mut SurfaceHandle) {
    call(|| {
        if !surface.is_null() {
            // SAFETY: as the caller vouches, it came from `Box::into_raw` and this is its end.
            drop(unsafe { Box::from_raw(surface) });
        }
        Ok(())
    });
}

/// Writes a JSON object that tells the configuration, the size of the tables and their measured error; for a file of heights
/// also, under `file`, what its size, unit, orientation, channel and holes were taken from.
///
/// `*needed` is the size of the text with its terminating NUL, so a first call with `capacity` 0 asks for it (and returns
/// `SUNBEAM_STATUS_BUFFER_TOO_SMALL`); `buffer` may then be null.
///
/// # Safety
/// `surface` must be alive, `buffer` have room for `capacity` bytes, and `needed` be a place for a size.
#[unsafe(no_mangle)] // SAFETY: as above.
pub unsafe extern "C" fn sunbeam_surface_describe(
    surface: *const SurfaceHandle,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> Status {
    call(|| {
        // SAFETY: as the caller vouches.
        let (handle, needed) = unsafe { (reference("surface", surface)?, place("needed", needed)?) };
        let version = env!("CARGO_PKG_VERSION");
        let description = Description {
            version,
            config: &handle.config,
            origin: &handle.origin,
            file: handle.file.as_ref(),
            report: handle.surface.report(),
        };
        let text = serde_json::to_string(&description).map_err(|error| sunbeam_guard::Panic(error.to_string()))?;
        *needed = text.len() + 1;
        if capacity < *needed {
            return Err(CallError::BufferTooSmall { needed: *needed, capacity });
        }
        if buffer.is_null() {
            return Err(CallError::Null { argument: "buffer" });
        }
        // SAFETY: the buffer has room for the text and its end.
        unsafe {
            std::ptr::copy_nonoverlapping(text.as_ptr().cast(), buffer, text.len());
            buffer.add(text.len()).write(0);
        }
        Ok(())
    })
}
