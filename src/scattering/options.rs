use super::geometry::{obliquity, shadowing};
use super::small_slope::small_slope;
use super::{ComplexIndex, Obliquity, Pair, SpectralIndex};
use crate::height_field::HeightField;
use crate::numeric::Real;
use crate::table::{
    BuildDemand, Built, Model, Progress, Purpose, Spectrum, TableError, Tiling, WAVELENGTH_MIN_NM, build,
};
use serde::{Deserialize, Serialize};

/// What of the model is asked for (docs/model.md#the-reflectance); the defaults are those of the plugin for a preset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Four standard deviations of the coherence window, in µm.
    pub coherence_length_um: f64,
    /// The coherence model.
    pub model: Model,
    /// Whether the tile repeats.
    pub tiling: Tiling,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// The index that the small-slope factor of the albedo is taken for, `None` for a perfect conductor's. Other obliquity
    /// factors leave it out: their albedo knows no index.
    pub index: Option<SpectralIndex>,
    /// Scale so that the albedo is at most one.
    pub conserve_energy: bool,
    /// V-cavity shadowing and masking.
    pub shadowing: bool,
    /// Relative error the tables are built to.
    pub tolerance: f64,
    /// Factor on what building may take in memory and time, at least 1; no part of what is built.
    #[serde(skip, default = "one")]
    pub build_limit: f64,
}

fn one() -> f64 {
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
            tolerance: 1e-3,
            build_limit: one(),
        }
    }
}

impl Options {
    /// What building a surface of `field` with these options takes, told without doing any of it.
    pub fn demand(&self, field: &HeightField) -> BuildDemand {
        let (low, high) = field.range_um();
        BuildDemand {
            size: field.size(),
            pixel_um: (field.dx_um(), field.dy_um()),
            range_um: high - low,
            model: self.model,
            tiling: self.tiling,
            coherence_length_um: self.coherence_length_um,
            tolerance: self.tolerance,
            purpose: Purpose::Surface { energy: self.conserve_energy },
        }
    }

    /// `O·M` of a pair of directions.
    pub fn angular_factor(&self, pair: &Pair) -> f64 {
        self.angular([pair.u, pair.v, pair.w], [pair.cos_i, pair.cos_o])
    }

    /// What the albedo weighs the relief's power with, of `wi + wo` and the cosines: `O·M`, or `Q·M` of the small slope of an index.
    #[inline(always)]
    pub(crate) fn albedo_factor<R: Real>(&self, q: [R; 3], cosines: [R; 2], index: Option<ComplexIndex>) -> R {
        match self.obliquity {
            Obliquity::SmallSlope => small_slope(q, cosines, index) * self.angular(q, cosines),
            Obliquity::Stam | Obliquity::Unit => self.angular(q, cosines),
        }
    }

    #[inline(always)]
    fn angular<R: Real>(&self, q: [R; 3], cosines: [R; 2]) -> R {
        let factor = obliquity(self.obliquity, q, cosines);
        if self.shadowing { factor * shadowing(q, cosines) } else { factor }
    }

    /// The obliquity factor that samplers weigh directions with. The small slope's is bounded for dielectrics, and grows
    /// towards the horizon as Stam's does for conductors.
    pub(crate) fn proposed(&self) -> Obliquity {
        match (self.obliquity, &self.index) {
            (Obliquity::SmallSlope, Some(index)) if index.is_dielectric() => Obliquity::Unit,
            (Obliquity::SmallSlope, _) => Obliquity::Stam,
            (given, _) => given,
        }
    }
}

pub(crate) fn build_table(field: &HeightField, options: &Options, progress: &Progress) -> Result<Built, TableError> {
    let frequency_max = 2e3 / WAVELENGTH_MIN_NM;
    let s_um = options.coherence_length_um / 4.0;
    let spectrum = Spectrum::new(field, options.model, options.tiling, s_um, frequency_max, options.tolerance);
    build(&spectrum, options.tolerance, progress)
}
