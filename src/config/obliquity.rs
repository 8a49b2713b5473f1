//! The parameter `obliquity`. It selects a factor of the reflectance. The obliquity factor O is a function of the
//! directions of light and viewer alone (docs/model.md#the-reflectance). The small-slope factor Q takes the place of O
//! and of the Fresnel reflectance (docs/model.md#the-small-slope-factor).

use crate::scattering::{Obliquity, SpectralIndex};
use serde::{Deserialize, Serialize};

/// The choice of the obliquity factor: an [`Obliquity`], or `auto`, which selects one from the refractive index.
///
/// ```
/// use sunbeam::config::ObliquityChoice;
/// use sunbeam::scattering::{ComplexIndex, Obliquity, SpectralIndex};
///
/// let glass = SpectralIndex::Constant(ComplexIndex { eta: 1.5, k: 0.0 });
/// assert_eq!(ObliquityChoice::Auto.resolved(Some(&glass)), Obliquity::SmallSlope);
/// assert_eq!(ObliquityChoice::Auto.resolved(None), Obliquity::Stam);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObliquityChoice {
    /// `small_slope` for a dielectric ([`SpectralIndex::is_dielectric`]: `k` is at most a tenth of `eta` at every
    /// tabulated wavelength), `stam` for other indices and for a perfect conductor, which has none.
    #[default]
    Auto,
    /// [`Obliquity::Stam`]: `O = (1 + wi·wo)²/(cosθi cosθo w²)` with `w = cosθi + cosθo`. The unit vectors wi to the
    /// light and wo to the viewer have the angles θi and θo with the normal. O grows towards the horizon. It is that of
    /// the tangent-plane approximation for a perfect conductor.
    Stam,
    /// [`Obliquity::SmallSlope`], the factor Q in place of O and of the Fresnel reflectance.
    SmallSlope,
    /// [`Obliquity::Unit`]: O = 1 for all directions.
    Unit,
}

impl ObliquityChoice {
    /// All choices, the default first.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Stam, Self::SmallSlope, Self::Unit];

    /// The name in settings and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Stam => "stam",
            Self::SmallSlope => "small_slope",
            Self::Unit => "unit",
        }
    }

    /// The factor that `auto` selects for a refractive index, `None` for a perfect conductor. The other choices ignore
    /// the index.
    pub fn resolved(self, index: Option<&SpectralIndex>) -> Obliquity {
        match self {
            Self::Auto if index.is_some_and(SpectralIndex::is_dielectric) => Obliquity::SmallSlope,
            Self::Auto | Self::Stam => Obliquity::Stam,
            Self::SmallSlope => Obliquity::SmallSlope,
            Self::Unit => Obliquity::Unit,
        }
    }
}

impl From<Obliquity> for ObliquityChoice {
    fn from(obliquity: Obliquity) -> Self {
        match obliquity {
            Obliquity::Stam => Self::Stam,
            Obliquity::SmallSlope => Self::SmallSlope,
            Obliquity::Unit => Self::Unit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SurfaceConfig;
    use crate::scattering::ComplexIndex;

    #[test]
    fn auto_follows_the_index_and_other_choices_do_not() {
        let constant = |eta, k| Some(SpectralIndex::Constant(ComplexIndex { eta, k }));
        // Wavelength in nm, eta and k of an invented material: k/eta exceeds a tenth at 450 nm alone.
        let absorbing = [(400.0, 5.57, 0.39), (450.0, 4.7, 0.6), (700.0, 3.8, 0.01)];
        let absorbing = absorbing.map(|(nm, eta, k)| (nm, ComplexIndex { eta, k })).to_vec();
        for (index, expected) in [
            (None, Obliquity::Stam),
            (constant(1.56, 0.0), Obliquity::SmallSlope),
            // A tenth of eta is 0.156.
            (constant(1.56, 0.15), Obliquity::SmallSlope),
            (constant(1.56, 0.16), Obliquity::Stam),
            (constant(1.0, 6.9), Obliquity::Stam),
            (Some(SpectralIndex::sampled(absorbing).unwrap()), Obliquity::Stam),
        ] {
            assert_eq!(ObliquityChoice::Auto.resolved(index.as_ref()), expected, "{index:?}");
            assert_eq!(ObliquityChoice::Unit.resolved(index.as_ref()), Obliquity::Unit);
        }
        for choice in ObliquityChoice::ALL {
            assert_eq!(serde_json::to_string(&choice).unwrap(), format!("{:?}", choice.name()));
        }
        let skin = SurfaceConfig::from_json(r#"{"eta": 1.56}"#).unwrap().options();
        assert_eq!((skin.obliquity, skin.index), (Obliquity::SmallSlope, constant(1.56, 0.0)));
        let metal = SurfaceConfig::from_json(r#"{"eta": 1.0, "k": 6.9}"#).unwrap().options();
        // Options have an index for the factor Q alone. With O, the Fresnel reflectance is applied to the lobe's value.
        assert_eq!((metal.obliquity, metal.index), (Obliquity::Stam, None));
    }
}
