//! Calls that take no time.

use super::report::thrown;
use crate::settings::{CameraSettings, Settings, SunSettings};
use crate::{catalogue as all, image, share};
use sha2::{Digest, Sha256};
use sunbeam_realtime::Orbit;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// Degrees that the sun moves for each pixel dragged.
const SUN_DEGREES_PER_PIXEL: f64 = 0.35;

pub(super) fn read(json: &str) -> Result<Settings, JsValue> {
    Settings::from_json(json).map_err(thrown)
}

/// All settings with their defaults.
#[wasm_bindgen]
pub fn default_settings() -> String {
    Settings::default().to_json()
}

/// The same settings, checked, all fields there.
#[wasm_bindgen]
pub fn complete_settings(json: &str) -> Result<String, JsValue> {
    Ok(read(json)?.to_json())
}

/// The same settings, only those that differ from the defaults.
#[wasm_bindgen]
pub fn compact_settings(json: &str) -> Result<String, JsValue> {
    Ok(read(json)?.to_compact_json())
}

/// Strings that change when something has to be made anew.
#[wasm_bindgen]
pub fn keys(json: &str) -> Result<String, JsValue> {
    Ok(serde_json::to_string(&read(json)?.keys()).unwrap_or_default())
}

/// The command that draws the same picture.
#[wasm_bindgen]
pub fn share_command(json: &str, width: u32, height: u32, supersample: u32) -> Result<String, JsValue> {
    Ok(share::command(&read(json)?, (width, height), supersample))
}

/// The same scene for Mitsuba.
#[wasm_bindgen]
pub fn share_xml(json: &str, width: u32, height: u32) -> Result<String, JsValue> {
    Ok(share::xml(&read(json)?, (width, height)))
}

/// What can be chosen.
#[wasm_bindgen]
pub fn catalogue() -> String {
    all().to_string()
}

/// The SHA-256 of a file's bytes in hexadecimal.
#[wasm_bindgen]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn moved(json: &str, change: impl FnOnce(&mut Orbit)) -> Result<String, JsValue> {
    let mut settings = read(json)?;
    let mut orbit = settings.camera.orbit();
    change(&mut orbit);
    settings.camera = CameraSettings::from(&orbit);
    Ok(settings.to_json())
}

/// The settings after the camera was dragged by so many pixels.
#[wasm_bindgen]
pub fn turned(json: &str, right: f32, down: f32) -> Result<String, JsValue> {
    moved(json, |orbit| orbit.turn(right, down))
}

/// The settings after zooming: nearer for factors below 1.
#[wasm_bindgen]
pub fn zoomed(json: &str, factor: f64) -> Result<String, JsValue> {
    moved(json, |orbit| orbit.zoom(if factor.is_finite() { factor } else { 1.0 }))
}

/// The settings after a shift by so many pixels, in a picture that is so many wide.
#[wasm_bindgen]
pub fn panned(json: &str, right: f32, down: f32, width: f32) -> Result<String, JsValue> {
    moved(json, |orbit| orbit.pan(right, down, width))
}

/// The settings after the sun was dragged by so many pixels.
#[wasm_bindgen]
pub fn sunned(json: &str, right: f64, down: f64) -> Result<String, JsValue> {
    let mut settings = read(json)?;
    let azimuth_deg = (settings.sun.azimuth_deg + SUN_DEGREES_PER_PIXEL * right + 180.0).rem_euclid(360.0) - 180.0;
    let elevation_deg = (settings.sun.elevation_deg - SUN_DEGREES_PER_PIXEL * down).clamp(0.5, 90.0);
    settings.sun = SunSettings { azimuth_deg, elevation_deg };
    Ok(settings.to_json())
}

/// A map for a canvas, RGBA.
#[wasm_bindgen]
pub fn map_picture(rgb: &[f32], side: usize, exposure: Option<f64>) -> Result<Vec<u8>, JsValue> {
    image::map_picture(pixels(rgb), side, exposure).map_err(thrown)
}

/// A map as an OpenEXR file.
#[wasm_bindgen]
pub fn map_exr(rgb: &[f32], side: usize) -> Result<Vec<u8>, JsValue> {
    image::map_exr(pixels(rgb), side).map_err(thrown)
}

/// Linear sRGB as three bytes for a screen.
#[wasm_bindgen]
pub fn to_srgb(rgb: &[f32], stops: f64) -> Vec<u8> {
    pixels(rgb).first().map_or_else(Vec::new, |pixel| image::shown(*pixel, stops).to_vec())
}

fn pixels(rgb: &[f32]) -> &[[f32; 3]] {
    rgb.as_chunks::<3>().0
}
