//! The methods of realtime evaluation (docs/realtime.md), each once in Rust, the truth, and once in WGSL, its twin of the
//! same name in the file beside it.
//!
//! A method answers `∫ S(f; κ)/λ² · weight(λ) dλ` for `q = wi + wo = (u, v, w)` as linear sRGB in 1/sr: a `S/λ²` of 1 at
//! every wavelength is (1, 1, 1). What does not depend on the relief (`R·O·M` of docs/model.md#the-reflectance) is the caller's. Single
//! precision throughout, as on the GPU; the oracle is [`crate::reflectance::Exact`].
//!
//! [`build`] makes one. The published methods evaluate a single window in a fixed place over a tile that repeats (`model = patch`,
//! `tiling = periodic`); they know no other. Ours, [`ColourTable`], knows both models and tilings, and alone
//! conserves energy where it is asked to.

mod bessel;
mod build;
mod colours;
mod flss;
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
use std::borrow::Cow;

/// One way to evaluate a surface in colour.
pub trait Method: Send + Sync {
    /// What the relief alone answers for `q = [u, v, w]`, integrated over the visible wavelengths: linear sRGB in 1/sr, with
    /// neither Fresnel reflectance, obliquity, shadowing nor cosine. Out-of-gamut colours keep their negative components. Zero
    /// unless `q` is finite, `w > 0`, and `q` the sum of two unit vectors.
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3];

    /// The same at one wavelength in nm, `S/λ²` in 1/sr: zero outside 380 to 780 nm and where [`Method::relief_rgb`] is; `None`
    /// where the method has no value by wavelength.
    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32>;

    /// What the answer is multiplied by so that no energy is made, red, green and blue, for directions above the surface.
    fn conserving(&self, _wi: [f32; 3], _wo: [f32; 3]) -> [f32; 3] {
        [1.0; 3]
    }

    /// Whether [`Method::relief_rgb`] is a colour over π that is to be shown as it is. Then `f_r` is that over cosθi,
    /// with neither Fresnel reflectance, obliquity nor shadowing.
    fn is_shown_as_it_is(&self) -> bool {
        false
    }

    /// The twin in WGSL with its data.
    fn shader(&self) -> MethodShader<'_>;
}

/// A method's WGSL and what it binds.
///
/// The source declares, in group 1, a uniform struct at binding 0 and one read-only storage buffer for each entry of
/// `storage` from binding 1 on, and defines `fn relief_rgb(q: vec3<f32>) -> vec3<f32>`, the twin of [`Method::relief_rgb`],
/// which heeds `relief_part` and `relief_parts` of [`COMMON_WGSL`]: over all parts its results add up to the answer.
/// It is compiled together with the files of [`COMMON_WGSL`] and of whoever calls it; groups 0 and 2 are theirs.
pub struct MethodShader<'a> {
    /// The method's name, for labels and messages.
    pub name: &'a str,
    /// The source.
    pub wgsl: &'a str,
    /// Defines `fn conserving(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>`, the twin of [`Method::conserving`].
    pub conserving: &'a str,
    /// Bytes of the uniform struct.
    pub uniform: Vec<u8>,
    /// Bytes of the storage buffers.
    pub storage: Vec<Cow<'a, [u8]>>,
}

/// The twin of a [`Method::conserving`] that is one.
pub const NOTHING_CONSERVED_WGSL: &str =
    "fn conserving(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> { return vec3<f32>(1.0); }";

/// WGSL that the methods' sources may use; compiled before them.
pub const COMMON_WGSL: &str = include_str!("common.wgsl");

const WAVELENGTH_MIN_UM: f32 = 0.38;
const WAVELENGTH_MAX_UM: f32 = 0.78;

/// Whether `q` can be a sum of two directions above the surface. Nothing that is not finite can.
fn is_query(q: [f32; 3]) -> bool {
    q[2] > 0.0 && q.iter().map(|c| c * c).sum::<f32>() <= SUM_SQUARED_MAX
}

/// A wavelength in µm, where the methods have data for it.
fn spectral_range_um(wavelength_nm: f32) -> Option<f32> {
    (380.0..=780.0).contains(&wavelength_nm).then_some(wavelength_nm * 1e-3)
}
