//! Calls without long computations: settings, exports of a picture, and conversions of colours.
//!
//! - `json` is the page's settings as a JSON object ([`Settings`]). Settings are returned as JSON with all fields.
//! - Errors are JavaScript `Error`s with a `kind` ([`thrown`]).
//! - `right` and `down` are the components of a drag in CSS pixels, the points of [`DEGREES_PER_POINT`]. They are
//!   negative to the left and upwards. Drags of the camera are `f32`, the type that [`Orbit`] takes. Drags of the sun
//!   are `f64`, the type of its angles.
//! - `rgb` is linear sRGB, three numbers per pixel. A map has `side`² pixels, row by row from the top. Another number
//!   of pixels is an error.

use super::report::thrown;
use crate::settings::{CameraSettings, SUN_ELEVATION_DEG, Settings, SunSettings};
use crate::{image, share};
use sha2::{Digest, Sha256};
use sunbeam_realtime::{DEGREES_PER_POINT, Orbit};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// The settings of a JSON object, checked.
pub(super) fn read(json: &str) -> Result<Settings, JsValue> {
    Settings::from_json(json).map_err(thrown)
}

/// The default settings, with all fields.
#[wasm_bindgen]
pub fn default_settings() -> String {
    Settings::default().to_json()
}

/// The settings, checked and with all fields.
#[wasm_bindgen]
pub fn complete_settings(json: &str) -> Result<String, JsValue> {
    Ok(read(json)?.to_json())
}

/// The fields of the settings that differ from the defaults.
#[wasm_bindgen]
pub fn compact_settings(json: &str) -> Result<String, JsValue> {
    Ok(read(json)?.to_compact_json())
}

/// Keys of heights, method and scene ([`Keys`](crate::Keys)), as JSON. The page builds each again when its key changes.
#[wasm_bindgen]
pub fn keys(json: &str) -> Result<String, JsValue> {
    // Text always converts to JSON, so the default is never taken.
    Ok(serde_json::to_string(&read(json)?.keys()).unwrap_or_default())
}

/// The `sunbeam render` command line for the picture ([`share::command`]). The picture has `width` × `height` pixels,
/// each averaged over `supersample`² rays.
#[wasm_bindgen]
pub fn share_command(json: &str, width: u32, height: u32, supersample: u32) -> Result<String, JsValue> {
    Ok(share::command(&read(json)?, (width, height), supersample))
}

/// Mitsuba's XML scene for the picture of `width` × `height` pixels ([`share::xml`]).
#[wasm_bindgen]
pub fn share_xml(json: &str, width: u32, height: u32) -> Result<String, JsValue> {
    Ok(share::xml(&read(json)?, (width, height)))
}

/// Entries of the page's lists, as JSON ([`crate::catalogue()`]).
#[wasm_bindgen]
pub fn catalogue() -> String {
    crate::catalogue().to_string()
}

/// The SHA-256 of a file's bytes, as 64 hexadecimal digits.
#[wasm_bindgen]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The settings after a change of the camera's orbit.
fn with_orbit(json: &str, change: impl FnOnce(&mut Orbit)) -> Result<String, JsValue> {
    let mut settings = read(json)?;
    let mut orbit = settings.camera.orbit();
    change(&mut orbit);
    settings.camera = CameraSettings::from(&orbit);
    Ok(settings.to_json())
}

/// The settings after a drag that turns the camera about its target, so that the scene follows the pointer. A drag to
/// the right decreases the camera's azimuth, and a drag downwards raises the camera.
#[wasm_bindgen]
pub fn turned(json: &str, right: f32, down: f32) -> Result<String, JsValue> {
    with_orbit(json, |orbit| orbit.turn(right, down))
}

/// The settings after the camera's distance is multiplied by `factor` and clamped to [`Orbit::DISTANCE_CM`]. Factors
/// below 1 move the camera nearer; factors of 0 or less move it to the smallest distance. A factor that is not finite
/// changes nothing.
#[wasm_bindgen]
pub fn zoomed(json: &str, factor: f64) -> Result<String, JsValue> {
    with_orbit(json, |orbit| orbit.zoom(if factor.is_finite() { factor } else { 1.0 }))
}

/// The settings after a drag that moves the camera with its target, so that the scene follows the pointer. The picture
/// is `width` CSS pixels wide.
#[wasm_bindgen]
pub fn panned(json: &str, right: f32, down: f32, width: f32) -> Result<String, JsValue> {
    with_orbit(json, |orbit| orbit.pan(right, down, width))
}

/// The settings after a drag that turns the sun: the azimuth grows to the right, the elevation upwards. The azimuth is
/// wrapped to [−180°, 180°), the elevation clamped to its accepted range.
#[wasm_bindgen]
pub fn sunned(json: &str, right: f64, down: f64) -> Result<String, JsValue> {
    let mut settings = read(json)?;
    let azimuth_deg = (settings.sun.azimuth_deg + DEGREES_PER_POINT * right + 180.0).rem_euclid(360.0) - 180.0;
    let elevation_deg = settings.sun.elevation_deg - DEGREES_PER_POINT * down;
    let (lowest, highest) = SUN_ELEVATION_DEG.into_inner();
    settings.sun = SunSettings { azimuth_deg, elevation_deg: elevation_deg.clamp(lowest, highest) };
    Ok(settings.to_json())
}

/// A BRDF map as RGBA bytes ([`image::map_picture`]). `exposure` is a linear factor; without it, a factor is chosen at
/// which few pixels clip.
#[wasm_bindgen]
pub fn map_picture(rgb: &[f32], side: usize, exposure: Option<f64>) -> Result<Vec<u8>, JsValue> {
    image::map_picture(pixels(rgb), side, exposure).map_err(thrown)
}

/// A BRDF map as an OpenEXR file ([`image::map_exr`]).
#[wasm_bindgen]
pub fn map_exr(rgb: &[f32], side: usize) -> Result<Vec<u8>, JsValue> {
    image::map_exr(pixels(rgb), side).map_err(thrown)
}

/// Three bytes of sRGB for the first pixel of `rgb`, multiplied by 2^`stops` and tone-mapped. Without a pixel, the
/// result is empty.
#[wasm_bindgen]
pub fn to_srgb(rgb: &[f32], stops: f64) -> Vec<u8> {
    pixels(rgb).first().map_or_else(Vec::new, |pixel| image::tone_mapped_bytes(*pixel, stops).to_vec())
}

/// Groups numbers into colours of three channels. A remainder of one or two numbers is dropped.
fn pixels(rgb: &[f32]) -> &[[f32; 3]] {
    rgb.as_chunks::<3>().0
}
