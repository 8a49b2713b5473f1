//! The methods of realtime evaluation (docs/realtime.md), each once in Rust, the truth, and once in WGSL, its twin of the
//! same name in the file beside it.
//!
//! A [`Method`] answers a pair of directions in linear sRGB in 1/sr, and [`Method::answers`] says what: the whole reflectance, or what
//! the relief alone does. The latter is a [`Relief`], a function of `q = wi + wo = (u, v, w)`:
//! `∫ S(f; κ)/λ² · weight(λ) dλ`, where a `S/λ²` of 1 at every wavelength is (1, 1, 1). What does not depend on the relief (`R·O·M` of
//! docs/model.md#the-reflectance) is then the caller's. Single precision throughout, as on the GPU; the oracle is
//! [`crate::lobe::Exact`].
//!
//! [`build`] makes one of a height field. The published methods evaluate a single window in a fixed place over a tile that repeats
//! (`model = patch`, `tiling = periodic`); they know no other. Ours, [`ColourTable`], knows both models and tilings, and alone
//! conserves energy where it is asked to. A grating by Maxwell's equations, `GratingColourSurface`, is a method, too.

mod bessel;
mod build;
mod colours;
mod flss;
#[cfg(feature = "rigorous")]
mod grating;
mod nmm;
mod options;
mod order_grid;
mod orders;
mod pq;
#[cfg(test)]
mod shader_layout_tests;
mod stam;
mod stam_gems;
mod table;
mod term_weights;

pub use crate::colour_table::{ColourTable, ColourTableOptions, ColourTableReport, RESOLUTION};
pub use bessel::TERMS_MAX;
pub use build::{build, build_watched};
pub use flss::Flss;
pub use nmm::Nmm;
pub use options::{
    GEMS_SHARPNESS, LAMBDA_STEP_NM, MethodError, MethodKind, MethodOptions, NEIGHBOURHOOD_MAX, REPEATS_MAX, Repeats,
    StamForm,
};
pub use orders::{ORDERS_BYTES_MAX, OrderCounts, TAYLOR_KAPPA_H_MAX};
pub use pq::Pq;
pub use stam::Stam;
pub use stam_gems::StamGems;

use crate::colour_table::SUM_SQUARED_MAX;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What the answer of a method is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnswerKind {
    /// What the relief alone does. The caller multiplies it by Fresnel's reflectance, obliquity and shadowing, `R·O·M`.
    Relief,
    /// `f_r` with all that belongs to it, which is multiplied by nothing.
    Reflectance,
}

/// One way to evaluate a surface in colour.
pub trait Method: Send + Sync {
    /// What the method answers for light from `wi` that leaves to `wo`, integrated over the visible wavelengths: linear sRGB in
    /// 1/sr, without the cosine, of what [`Method::answers`] says. Out-of-gamut colours keep their negative components. The caller
    /// sees to it that both directions lie above the surface.
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3];

    /// The same at one wavelength in nm, in 1/sr: zero outside 380 to 780 nm; `None` where the method has no value by wavelength.
    fn answer_spectral(&self, wi: [f32; 3], wo: [f32; 3], wavelength_nm: f32) -> Option<f32>;

    /// What the answers are.
    fn answers(&self) -> AnswerKind;

    /// The twin in WGSL with its data.
    fn shader(&self) -> MethodShader<'_>;
}

/// A [`Method`] whose answer is what the relief alone does, which depends on `wi + wo` alone.
pub trait Relief: Send + Sync {
    /// What the relief answers for `q = [u, v, w]`, integrated over the visible wavelengths: linear sRGB in 1/sr, with
    /// neither Fresnel reflectance, obliquity, shadowing nor cosine. Zero unless `q` is finite, `w > 0`, and `q` the sum of two unit
    /// vectors.
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3];

    /// The same at one wavelength in nm, `S/λ²` in 1/sr: zero outside 380 to 780 nm and where [`Relief::relief_rgb`] is; `None`
    /// where the method has no value by wavelength.
    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32>;

    /// The twin in WGSL, which defines `fn relief_rgb(q: vec3<f32>) -> vec3<f32>` in place of `answer_rgb`, with its data.
    fn relief_shader(&self) -> MethodShader<'_>;
}

impl<R: Relief> Method for R {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        self.relief_rgb(sum(wi, wo))
    }

    fn answer_spectral(&self, wi: [f32; 3], wo: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        self.relief_spectral(sum(wi, wo), wavelength_nm)
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Relief
    }

    fn shader(&self) -> MethodShader<'_> {
        self.relief_shader().and(include_str!("relief.wgsl"))
    }
}

/// `wi + wo`.
fn sum(wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| wi[c] + wo[c])
}

/// A method's WGSL and what it binds.
///
/// The sources declare, in group 1, a uniform struct at binding 0 and one read-only storage buffer for each entry of
/// `storage` from binding 1 on, and define `fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>`, the twin of
/// [`Method::answer_rgb`], which heeds `answer_part` and `answer_parts` of [`COMMON_WGSL`]: over all parts its results add up to the
/// answer. They are compiled together with the files of [`COMMON_WGSL`] and of whoever calls them; groups 0 and 2 are theirs.
pub struct MethodShader<'a> {
    /// The method's name, for labels and messages.
    pub name: &'a str,
    /// The sources, one after the other.
    pub wgsl: Vec<&'a str>,
    /// Bytes of the uniform struct.
    pub uniform: Vec<u8>,
    /// Bytes of the storage buffers.
    pub storage: Vec<Cow<'a, [u8]>>,
}

impl MethodShader<'_> {
    /// With one more source.
    fn and(mut self, wgsl: &'static str) -> Self {
        self.wgsl.push(wgsl);
        self
    }
}

/// WGSL that the methods' sources may use; compiled before them.
pub const COMMON_WGSL: &str = include_str!("common.wgsl");

const WAVELENGTH_MIN_UM: f32 = 0.38;
const WAVELENGTH_MAX_UM: f32 = 0.78;
/// What a cosine is divided by at least, as in [`crate::scattering::Pair`].
const COSINE_MIN: f32 = crate::scattering::COSINE_MIN as f32;

/// Whether `q` can be a sum of two directions above the surface. Nothing that is not finite can.
fn is_query(q: [f32; 3]) -> bool {
    q[2] > 0.0 && q.iter().map(|c| c * c).sum::<f32>() <= SUM_SQUARED_MAX
}

/// A wavelength in µm, where the methods have data for it.
fn spectral_range_um(wavelength_nm: f32) -> Option<f32> {
    (380.0..=780.0).contains(&wavelength_nm).then_some(wavelength_nm * 1e-3)
}
