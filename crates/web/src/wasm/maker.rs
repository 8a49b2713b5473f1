//! Calls that read files and build methods and scenes: the exports for the page's *makers*, Web Workers that may block.
//!
//! `README.md` of this crate documents every call. The *artist* is the worker that draws with WebGPU (`artist.rs`).
//!
//! - `json` is the page's settings as a JSON object ([`Settings`](crate::Settings)), which [`read`] checks.
//! - `listener` is a JavaScript function that receives the progress, a fraction from 0 to 1, or any other value for
//!   none. [`progress`] registers the function and returns a guard. The variable `_listening` keeps the guard alive;
//!   its drop at the end of the call removes the function.
//! - Errors are JavaScript `Error`s with a `kind` ([`thrown`]). [`WebError::Internal`] is a wrong call by the page.
//! - Results of plain numbers and text always convert to JSON, so `unwrap_or_default` never takes the default.

use super::quick::read;
use super::report::{progress, thrown};
use crate::reflectance::direction;
use crate::{Reflectance, Relief, Spectra, WebError, image};
use sunbeam::scattering::Vec3;
use sunbeam_realtime::SceneData;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// A relief; see [`Relief`].
#[wasm_bindgen(js_name = Relief)]
pub struct JsRelief(Relief);

#[wasm_bindgen(js_class = Relief)]
impl JsRelief {
    /// Reads and levels the relief of the settings: a preset, or the file whose contents are `bytes`.
    #[wasm_bindgen(constructor)]
    pub fn new(json: &str, bytes: Option<Vec<u8>>) -> Result<JsRelief, JsValue> {
        Ok(Self(Relief::new(&read(json)?, bytes.as_deref()).map_err(thrown)?))
    }

    /// Size, range, roughness and periods of the relief ([`Relief::facts`]), as JSON. Of the settings only the tiling
    /// is used, on which the periods depend.
    pub fn facts(&self, json: &str) -> Result<String, JsValue> {
        Ok(serde_json::to_string(&self.0.facts(&read(json)?)).unwrap_or_default())
    }

    /// A grey picture of the relief with at most `side_max` pixels along each side.
    pub fn picture(&self, side_max: usize) -> JsReliefPicture {
        JsReliefPicture(image::relief_picture(self.0.field(), side_max))
    }

    /// Builds the settings' method and packs it into bytes for the artist ([`Relief::method_data`]).
    pub fn method(&self, json: &str, listener: &JsValue) -> Result<Vec<u8>, JsValue> {
        let (progress, _listening) = progress(listener);
        self.0.method_data(&read(json)?, &progress).map_err(thrown)
    }

    /// Builds the settings' method as an evaluator of colours on the CPU.
    pub fn reflectance(&self, json: &str, listener: &JsValue) -> Result<JsReflectance, JsValue> {
        let (progress, _listening) = progress(listener);
        Ok(JsReflectance(self.0.reflectance(&read(json)?, &progress).map_err(thrown)?))
    }

    /// Builds an evaluator of spectra for the settings' method on the CPU.
    pub fn spectra(&self, json: &str, listener: &JsValue) -> Result<JsSpectra, JsValue> {
        let (progress, _listening) = progress(listener);
        Ok(JsSpectra(self.0.spectra(&read(json)?, &progress).map_err(thrown)?))
    }
}

/// A picture of a relief.
#[wasm_bindgen(js_name = ReliefPicture)]
pub struct JsReliefPicture(image::ReliefPicture);

#[wasm_bindgen(js_class = ReliefPicture)]
impl JsReliefPicture {
    /// Width in pixels.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.0.size.0
    }

    /// Height in pixels.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.0.size.1
    }

    /// Size of the picture's pixels in µm.
    #[wasm_bindgen(getter)]
    pub fn um_per_pixel(&self) -> f64 {
        self.0.um_per_pixel
    }

    /// Length of the scale bar in µm.
    #[wasm_bindgen(getter)]
    pub fn bar_um(&self) -> f64 {
        self.0.bar_um
    }

    /// RGBA bytes, rows from the top.
    #[wasm_bindgen(getter)]
    pub fn rgba(&self) -> Vec<u8> {
        self.0.rgba.clone()
    }
}

/// `f_r` in linear sRGB, evaluated on the CPU; see [`Reflectance`].
#[wasm_bindgen(js_name = Reflectance)]
pub struct JsReflectance(Reflectance);

#[wasm_bindgen(js_class = Reflectance)]
impl JsReflectance {
    /// Replaces the refractive index by that of other settings ([`Reflectance::set_index`]).
    pub fn set_index(&mut self, json: &str) -> Result<(), JsValue> {
        self.0.set_index(&read(json)?);
        Ok(())
    }

    /// BRDF map for light at the angle `theta_deg` to the normal and the azimuth `phi_deg`, from the relief's +x
    /// towards +y. The result is `f_r` in 1/sr as linear sRGB, three numbers for each of `side`² pixels, rows from the
    /// top ([`Reflectance::map`]).
    ///
    /// A pixel stands for the outgoing direction whose x and y are its position in [−1, 1]², x right and y up. Pixels
    /// outside the unit disc are 0.
    pub fn map(&self, theta_deg: f64, phi_deg: f64, side: usize, listener: &JsValue) -> Vec<f32> {
        let (progress, _listening) = progress(listener);
        self.0.map(direction(theta_deg, phi_deg), side, &progress).as_flattened().to_vec()
    }

    /// `f_r` in 1/sr as linear sRGB. `wi` is the direction to the light and `wo` that to the viewer, of three numbers
    /// each and any positive length.
    pub fn rgb(&self, wi: &[f32], wo: &[f32]) -> Result<Vec<f32>, JsValue> {
        Ok(self.0.rgb(unit(wi)?, unit(wo)?).map(|value| value as f32).to_vec())
    }
}

/// `f_r` by wavelength, evaluated on the CPU; see [`Spectra`].
#[wasm_bindgen(js_name = Spectra)]
pub struct JsSpectra(Spectra);

#[wasm_bindgen(js_class = Spectra)]
impl JsSpectra {
    /// Replaces the refractive index by that of other settings ([`Spectra::set_index`]).
    pub fn set_index(&mut self, json: &str) -> Result<(), JsValue> {
        self.0.set_index(&read(json)?);
        Ok(())
    }

    /// `f_r` in 1/sr at 380, 385, …, 780 nm; empty if the method has no values by wavelength. `wi` is the direction to
    /// the light and `wo` that to the viewer, of three numbers each and any positive length.
    pub fn spectrum(&self, wi: &[f32], wo: &[f32]) -> Result<Vec<f32>, JsValue> {
        Ok(self.0.spectrum(unit(wi)?, unit(wo)?))
    }
}

/// The unit vector along `direction`, normalised in double precision. Refuses other than three numbers, and a length of
/// zero.
fn unit(direction: &[f32]) -> Result<Vec3, JsValue> {
    let refused = || thrown(WebError::Internal("a direction is three numbers, not all of them 0".to_owned()));
    let direction: [f32; 3] = direction.try_into().map_err(|_| refused())?;
    let unit = glam::DVec3::from(direction.map(f64::from)).try_normalize().ok_or_else(refused)?;
    Ok(unit.to_array())
}

/// Builds the scene and packs it into bytes for the artist: the mesh, its bounding volume hierarchy, and the texture of
/// the pigment. A draft is coarser ([`Settings::draft_scene`](crate::Settings::draft_scene)).
#[wasm_bindgen]
pub fn make_scene(json: &str, is_draft: bool, listener: &JsValue) -> Result<Vec<u8>, JsValue> {
    let settings = read(json)?;
    let (progress, _listening) = progress(listener);
    let (mesh, pigment) = if is_draft { settings.draft_scene() } else { settings.scene() }.map_err(thrown)?;
    // Roughly: mesh and pigment take 60 % of the time, the hierarchy the rest.
    progress.report(0.6);
    let data = SceneData::new(&mesh, &pigment).map_err(thrown)?;
    progress.report(1.0);
    Ok(data.into_bytes())
}
