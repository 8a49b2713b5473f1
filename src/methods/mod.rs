//! The methods of realtime evaluation (docs/realtime.md). Each exists twice: in Rust, which is the definition, and in
//! WGSL for the GPU, in the file of the same name.
//!
//! A [`Method`] evaluates a pair of directions in linear sRGB in 1/sr: the unit vectors wi to the light and wo to the
//! viewer. [`AnswerKind`] says whether the answer is the relief's factor of the reflectance, or the whole reflectance,
//! or the scattering function of a film. The relief's factor is a [`Relief`]. It depends on the scattering vector
//! `q = wi + wo = (u, v, w)` alone:
//!
//! `relief_rgb(q) = ∫ S(f; κ)/λ² · weight(λ) dλ`, with the frequency `f = (u, v)/λ` and the phase rate `κ = 2πw/λ`.
//!
//! S is the power spectrum of the phase screen `exp(iκh)` in µm², with the heights h of the relief. The weights of
//! linear sRGB are scaled so that `S/λ² = 1` at every wavelength gives (1, 1, 1). The caller multiplies by the factors
//! that do not depend on the relief: Fresnel's reflectance R, obliquity O and shadowing M
//! (docs/model.md#the-reflectance).
//!
//! Methods compute in single precision throughout, as on the GPU. Tests compare them with [`crate::lobe::Exact`].
//!
//! [`build`] builds a method for a height field. The published methods, [`Flss`], [`Nmm`], [`Pq`], [`Stam`] and
//! [`StamGems`], support only a single coherence window at a fixed position over a tile that repeats (`model = patch`,
//! `tiling = periodic`). The [`ColourTable`] supports both models and tilings, and the option
//! `conserve_energy`. `grating::GratingColourSurface`, a grating by Maxwell's equations, is also a method.
//!
//! Some private modules serve several methods: tables of orders and their sums (`orders`, `order_grid`),
//! weights of series (`term_weights`), Bessel functions, and colours of the observer.

mod bessel;
mod build;
mod colours;
mod film;
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
mod wgsl;

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
#[doc(hidden)]
pub use wgsl::{code, code_length, utf8};

use crate::colour::OBSERVER_RANGE_NM;
use crate::colour_table::SUM_SQUARED_MAX;
// The macro of the module `wgsl`, which embeds a source without its comments.
use crate::wgsl;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Meaning of a method's answer, its value for a pair of directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum AnswerKind {
    /// The relief's factor of the reflectance, divided by the albedo where energy is conserved. The caller multiplies
    /// the answer by Fresnel factor, obliquity and shadowing, `R·O·M`.
    Relief,
    /// The whole `f_r`, all factors included.
    Reflectance,
    /// The whole scattering function of a film, which reflects and transmits. Directions may lie on either side.
    Film {
        /// Refractive index of the film.
        eta: f32,
    },
}

/// An evaluator of a surface's colour.
///
/// `wi` points to the light and `wo` to the viewer, both unit vectors above the surface; on either side of a film
/// ([`AnswerKind::Film`]). Answers do not include the cosine. [`build`] has an example.
pub trait Method: Send + Sync {
    /// The answer integrated over the visible wavelengths, linear sRGB in 1/sr. Colours outside sRGB have negative
    /// channels.
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3];

    /// The answer at one wavelength in nm, in 1/sr; 0 outside 380 to 780 nm. `None` for a method that has colours only,
    /// such as a table of them.
    fn answer_spectral(&self, wi: [f32; 3], wo: [f32; 3], wavelength_nm: f32) -> Option<f32>;

    /// The meaning of the answers.
    fn answers(&self) -> AnswerKind;

    /// The method in WGSL, with its data.
    fn shader(&self) -> MethodShader<'_>;
}

/// A [`Method`] whose answer is the relief's factor of the reflectance, which depends on `q = wi + wo` alone.
pub trait Relief: Send + Sync {
    /// The relief's factor for `q = [u, v, w]`, integrated over the visible wavelengths, linear sRGB in 1/sr.
    ///
    /// Fresnel factor, obliquity, shadowing and cosine are not included. It is 0 unless `q` is finite, `w > 0`, and `q`
    /// is the sum of two unit vectors.
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3];

    /// The relief's factor at one wavelength in nm, `S/λ²` in 1/sr; 0 outside 380 to 780 nm, and for every `q` at which
    /// [`Relief::relief_rgb`] must be 0. `None` for a method that has colours only.
    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32>;

    /// The method in WGSL, with its data. It defines `fn relief_rgb(q: vec3<f32>) -> vec3<f32>` in place of
    /// `answer_rgb`.
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
        self.relief_shader().and(wgsl!("relief.wgsl"))
    }
}

/// `wi + wo`.
fn sum(wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| wi[c] + wo[c])
}

/// The WGSL of a method and the data that it binds.
///
/// The sources declare a uniform struct at binding 0 of group 1, and from binding 1 on a read-only storage buffer for
/// each entry of `storage`. They define `fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>`, the counterpart of
/// [`Method::answer_rgb`]. A caller may divide long loops: `answer_rgb` computes the part `answer_part` of
/// `answer_parts` parts ([`COMMON_WGSL`]), and the sum of all parts is the answer.
///
/// The sources are compiled after [`COMMON_WGSL`] and together with those of the caller, which binds groups 0 and 2.
pub struct MethodShader<'a> {
    /// The method's name, for labels and messages.
    pub name: &'a str,
    /// The sources, in the order of their concatenation.
    pub wgsl: Vec<&'a str>,
    /// Bytes of the uniform struct.
    pub uniform: Vec<u8>,
    /// Bytes of the storage buffers, in the order of their bindings.
    pub storage: Vec<Cow<'a, [u8]>>,
}

impl MethodShader<'_> {
    /// Appends a source.
    fn and(mut self, wgsl: &'static str) -> Self {
        self.wgsl.push(wgsl);
        self
    }
}

/// WGSL that the sources of all methods use.
pub const COMMON_WGSL: &str = wgsl!("common.wgsl");

/// Shortest wavelength of the published methods in µm. In single precision, like all numbers of methods.
const WAVELENGTH_MIN_UM: f32 = (1e-3 * OBSERVER_RANGE_NM.0) as f32;
/// Longest wavelength of the published methods in µm.
const WAVELENGTH_MAX_UM: f32 = (1e-3 * OBSERVER_RANGE_NM.1) as f32;
/// Smallest cosine by which answers are divided, and smallest argument of Bessel functions. About the rounding error of
/// a number near 1 in single precision.
const DIVISOR_MIN: f32 = crate::scattering::COSINE_MIN as f32;

/// Whether `q` can be the sum of two unit vectors above the surface, with room for rounding. False where it is not
/// finite.
fn is_query(q: [f32; 3]) -> bool {
    q[2] > 0.0 && q.iter().map(|c| c * c).sum::<f32>() <= SUM_SQUARED_MAX
}

/// The wavelength in µm; `None` outside [`OBSERVER_RANGE_NM`]. The comparison is in nm, since single precision rounds
/// both ends in µm.
fn visible_um(wavelength_nm: f32) -> Option<f32> {
    let (min_nm, max_nm) = OBSERVER_RANGE_NM;
    (min_nm..=max_nm).contains(&f64::from(wavelength_nm)).then_some(wavelength_nm * 1e-3)
}
