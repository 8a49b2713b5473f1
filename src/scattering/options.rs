//! Parameters of the scalar model, and the build of the spectral table from them. The scalar model treats the relief as
//! a phase screen: the reflectance is `R·O·M·S(f; κ)/λ²`, with the symbols of docs/model.md#the-reflectance.

use super::geometry::angular_factor;
use super::small_slope::small_slope;
use super::{ComplexIndex, Obliquity, Pair, SizeRange, SpectralIndex, TransparentBody};
use crate::height_field::HeightField;
use crate::numeric::Real;
use crate::table::{
    BuildDemand, Built, CoherenceWindow, Model, Progress, Purpose, Spectrum, TableError, Tiling, build,
};
use serde::{Deserialize, Serialize};

/// Parameters of the scalar model (docs/model.md#the-reflectance). The defaults are those of a preset without a
/// refractive index in every user interface; [`SurfaceConfig`](crate::SurfaceConfig) takes them from here.
///
/// ```
/// use sunbeam::Options;
///
/// let options = Options { coherence_length_um: 20.0, tolerance: 1e-2, ..Options::default() };
/// assert!(options.conserve_energy);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Four standard deviations of the coherence window, in µm (default: 65, filtered sunlight).
    pub coherence_length_um: f64,
    /// The coherence model (default: ensemble).
    pub model: Model,
    /// Continuation of the relief beyond the tile (default: periodic).
    pub tiling: Tiling,
    /// The obliquity factor (default: Stam's).
    pub obliquity: Obliquity,
    /// Refractive index in the small-slope factor Q, which the albedo includes; `None` for a perfect conductor
    /// (default). With other obliquity factors it has no effect, since their albedo excludes the Fresnel reflectance.
    pub index: Option<SpectralIndex>,
    /// Whether the reflectance is divided so that the albedo is at most one (default: true).
    pub conserve_energy: bool,
    /// Whether the factor M of shadowing and masking by V-shaped grooves applies (default: false).
    pub shadowing: bool,
    /// Largest sine of the angle from the normal, in the medium above the relief, of light that leaves (default: 1).
    /// Under a cover of index n it is 1/n, beyond which light is totally reflected ([`Cover`](super::Cover)). The
    /// sampler draws no light beyond.
    pub reach: f64,
    /// Relative sizes at which the surface is evaluated; `None` for the relief's own size (default).
    pub sizes: Option<SizeRange>,
    /// Transparent body below the relief; `None` for a surface that reflects only (default). With a body, the given
    /// height field is the relief magnified by the body's index, and albedos are those of reflection and transmission
    /// together.
    pub body: Option<TransparentBody>,
    /// Largest relative error of the tables (default: 1e-3). Smaller values take more memory and time.
    pub tolerance: f64,
    /// Factor on the limits of memory and time of a build, at least 1 (default: 1). Tables do not depend on it.
    #[serde(skip, default = "default_build_limit")]
    pub build_limit: f64,
}

/// Default of `build_limit`, which is not serialised.
fn default_build_limit() -> f64 {
    1.0
}

impl Default for Options {
    fn default() -> Self {
        Self {
            coherence_length_um: 65.0,
            model: Model::Ensemble,
            tiling: Tiling::Periodic,
            obliquity: Obliquity::Stam,
            index: None,
            conserve_energy: true,
            shadowing: false,
            reach: 1.0,
            sizes: None,
            body: None,
            tolerance: 1e-3,
            build_limit: default_build_limit(),
        }
    }
}

impl Options {
    /// Sizes and options that determine the memory and time to build a surface of `field`. Builds nothing.
    pub fn demand(&self, field: &HeightField) -> BuildDemand {
        let (low, high) = field.range_um();
        // A single row or column of pixels. The albedo of such a grating has ridges, which take more work.
        let (nx, ny) = field.size();
        let is_grating = nx == 1 || ny == 1;
        // Factor on the time to build the albedo table, which exists only where energy is conserved.
        let energy = if self.conserve_energy {
            self.sizes.map_or(1.0, |sizes| sizes.albedo_cost_factor(high - low, is_grating))
        } else {
            0.0
        };
        BuildDemand {
            size: field.size(),
            pixel_um: (field.dx_um(), field.dy_um()),
            range_um: high - low,
            model: self.model,
            tiling: self.tiling,
            coherence_length_um: self.coherence_length_um,
            // The index of the body, or of a cover: the reach under a cover of index n is 1/n. A body has no cover.
            magnification: self.body.map_or(1.0 / self.reach, |body| body.eta),
            tolerance: self.tolerance,
            purpose: Purpose::Surface { energy },
        }
    }

    /// `O·M` of a pair of directions: the obliquity factor (1 with Q), times M if shadowing applies.
    pub fn angular_factor(&self, pair: &Pair) -> f64 {
        angular_factor(self.obliquity, self.shadowing, [pair.u, pair.v, pair.w], [pair.cos_i, pair.cos_o])
    }

    /// Factor on `S/λ²` in the integrand of the albedo: `O·M`, or `Q·M` with the small-slope factor of `index`. S is
    /// the relief's power spectrum, `q` the scattering vector `wi + wo`, and `cosines` are those of `wi` and `wo`. `R`
    /// is a type of numbers (`src/numeric`).
    #[inline(always)]
    pub(crate) fn albedo_factor<R: Real>(&self, q: [R; 3], cosines: [R; 2], index: Option<ComplexIndex>) -> R {
        let angular = angular_factor(self.obliquity, self.shadowing, q, cosines);
        match self.obliquity {
            // O is 1 with Q.
            Obliquity::SmallSlope => small_slope(q, cosines, index) * angular,
            Obliquity::Stam | Obliquity::Unit => angular,
        }
    }

    /// Obliquity factor in the density of samplers, which replace the small-slope factor Q by a simpler one. It is 1
    /// for dielectrics, where Q is bounded. Otherwise it is Stam's factor: Q of conductors grows alike towards the
    /// horizon.
    pub(crate) fn sampling_obliquity(&self) -> Obliquity {
        match (self.obliquity, &self.index) {
            (Obliquity::SmallSlope, Some(index)) if index.is_dielectric() => Obliquity::Unit,
            (Obliquity::SmallSlope, _) => Obliquity::Stam,
            (given, _) => given,
        }
    }
}

/// Builds the table of the power spectrum `S(f; κ)`, over spatial frequency f and phase rate κ (`lib.rs`), for every
/// wavelength of the tables' range.
pub(crate) fn build_table(field: &HeightField, options: &Options, progress: &Progress) -> Result<Built, TableError> {
    let window = CoherenceWindow::new(options.coherence_length_um);
    let spectrum = Spectrum::new(field, options.model, options.tiling, window, options.tolerance);
    build(&spectrum, options.tolerance, progress)
}
