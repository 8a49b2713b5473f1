//! Named surfaces. Single 2014 is M. Single's thesis, *An Interactive Shader for Natural Diffraction Gratings* (Bern,
//! 2014), on whose scans the snake skins are modelled.

use super::{HeightField, HeightFieldError, Regions, cd, skin, synthetic};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Pixels in one period of a grating, and along each side of the disc and the skins. The number is even, so that both
/// halves of the lamellar grating are equal. Pixels of the disc and the skins are about 63 nm wide: two span the wall
/// of a pit, ten the shortest period of fingers, 0.62 µm. More pixels take more memory and time in all later steps;
/// fewer lose walls and flanks.
pub(super) const PIXELS: usize = 1024;

/// A named surface; [`Preset::build`] describes the tiles.
///
/// ```
/// use sunbeam_height_field::Preset;
///
/// // A sawtooth with a period of 1.2 µm and a height of 0.1 µm.
/// let blazed = Preset::Blazed.build(Some(1.2), Some(0.1))?;
/// assert_eq!(blazed.size(), (1024, 1));
/// let skin: Preset = "xenopeltis".parse()?;
/// assert!(skin.is_skin());
/// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// A plane: one pixel of 1 × 1 µm at height 0.
    Flat,
    /// Sawtooth that rises along +x; period 2.5 µm, height 0.25 µm.
    Blazed,
    /// Sinusoid along x; period 2.5 µm, height 0.25 µm peak to valley.
    Sinusoidal,
    /// Rectangular grating along x with duty 0.5; period 2.5 µm, height 0.125 µm.
    Lamellar,
    /// Compact disc: tracks along y, 1.6 µm apart along x, with pits 0.12 µm deep; 64 × 64 µm.
    Cd,
    /// Skin of the genus *Elaphe*: finger-like ridges along +y, 1.144 µm apart along x; 65.2 × 65.2 µm, heights 0 to
    /// 0.435 µm.
    ///
    /// The period is the one that Single 2014 measures for this skin, 1144.26 nm.
    Elaphe,
    /// Skin of the sunbeam snake *Xenopeltis*: layers 1.552 µm apart along x, each with finger-like ridges along +x,
    /// 0.62 µm apart along y; 65.2 × 65.2 µm, heights 0 to 0.819 µm.
    ///
    /// The period of the layers is the one that Single 2014 measures for this skin, 1552.27 nm.
    Xenopeltis,
}

impl Preset {
    /// Every preset, in the order in which messages list them.
    pub const ALL: [Self; 7] =
        [Self::Flat, Self::Blazed, Self::Sinusoidal, Self::Lamellar, Self::Cd, Self::Elaphe, Self::Xenopeltis];

    /// The name used on command lines and in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Blazed => "blazed",
            Self::Sinusoidal => "sinusoidal",
            Self::Lamellar => "lamellar",
            Self::Cd => "cd",
            Self::Elaphe => "elaphe",
            Self::Xenopeltis => "xenopeltis",
        }
    }

    /// Default period and height (peak to valley) in µm; `None` for presets that do not take these parameters.
    pub const fn defaults_um(self) -> Option<(f64, f64)> {
        match self {
            Self::Blazed | Self::Sinusoidal => Some((2.5, 0.25)),
            Self::Lamellar => Some((2.5, 0.125)),
            Self::Flat | Self::Cd | Self::Elaphe | Self::Xenopeltis => None,
        }
    }

    /// Builds the tile.
    ///
    /// `period_um` and `height_um` (peak to valley) apply to blazed, sinusoidal and lamellar gratings; `None` stands
    /// for the default.
    ///
    /// Gratings are one period of 1024 samples by one row; the pixel size along y is the period. Samples lie at pixel
    /// centres: sample i of the sawtooth is `(i + ½)/1024` of its height. The disc and the skins have 1024 × 1024
    /// pixels, are periodic over the tile, and identical to the bit on every machine.
    ///
    /// # Errors
    /// [`HeightFieldError::PresetParameter`] for a parameter that the preset does not take,
    /// [`HeightFieldError::OutOfRange`] for one that is not finite and positive.
    pub fn build(self, period_um: Option<f64>, height_um: Option<f64>) -> Result<HeightField, HeightFieldError> {
        for (parameter, value) in [("period", period_um), ("height", height_um)] {
            let Some(value_um) = value else { continue };
            if self.defaults_um().is_none() {
                return Err(HeightFieldError::PresetParameter { parameter, preset: self.name() });
            }
            if !(value_um.is_finite() && value_um > 0.0) {
                return Err(HeightFieldError::OutOfRange { parameter, value_um });
            }
        }
        // Presets without defaults take neither parameter, so their numbers are arbitrary.
        let (default_period_um, default_height_um) = self.defaults_um().unwrap_or((1.0, 1.0));
        let period_um = period_um.unwrap_or(default_period_um);
        let height_um = height_um.unwrap_or(default_height_um);
        match self {
            Self::Flat => synthetic::flat(),
            Self::Blazed => synthetic::blazed(period_um, height_um),
            Self::Sinusoidal => synthetic::sinusoidal(period_um, height_um),
            Self::Lamellar => synthetic::lamellar(period_um, height_um),
            Self::Cd => cd::cd(),
            Self::Elaphe => skin::elaphe(None),
            Self::Xenopeltis => skin::xenopeltis(None),
        }
    }

    /// Whether the preset is a skin, which can have sub-regions ([`Preset::build_in_regions`]).
    pub const fn is_skin(self) -> bool {
        matches!(self, Self::Elaphe | Self::Xenopeltis)
    }

    /// Builds the tile of a skin with sub-regions, squares with slightly shorter or longer periods. Size and range of
    /// heights are those of [`Preset::build`].
    ///
    /// # Errors
    /// [`HeightFieldError::SkinParameter`] for a preset other than a skin.
    pub fn build_in_regions(self, regions: Regions) -> Result<HeightField, HeightFieldError> {
        match self {
            Self::Elaphe => skin::elaphe(Some(regions)),
            Self::Xenopeltis => skin::xenopeltis(Some(regions)),
            _ => Err(HeightFieldError::SkinParameter { parameter: "region_size", preset: self.name() }),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = HeightFieldError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or_else(|| HeightFieldError::UnknownName {
            parameter: "preset",
            found: name.to_owned(),
            accepted: Self::ALL.map(Self::name).join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sums of 1024 terms of order 0.1 µm.
    const ROUNDING_UM: f64 = 1e-15;

    #[test]
    fn names_round_trip_and_errors_list_them() {
        for preset in Preset::ALL {
            assert_eq!(preset.to_string().parse::<Preset>().unwrap(), preset);
        }
        let message = "cobra".parse::<Preset>().unwrap_err().to_string();
        assert!(message.contains("cobra") && Preset::ALL.iter().all(|p| message.contains(p.name())), "{message}");
    }

    #[test]
    fn gratings_have_their_period_height_and_mean() {
        for preset in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
            let field = preset.build(Some(2.0), Some(0.5)).unwrap();
            assert_eq!(field.size(), (1024, 1));
            assert_eq!(field.extent_um(), (2.0, 2.0));
            assert!((field.mean_um() - 0.25).abs() < ROUNDING_UM, "{preset}: {}", field.mean_um());
            // The sawtooth stops half a pixel short of both ends.
            assert!((field.peak_to_valley_um() - 0.5).abs() <= 0.5 / 1024.0, "{preset}");
        }
        let blazed = Preset::Blazed.build(None, None).unwrap();
        assert_eq!(blazed.extent_um().0, 2.5);
        let h = blazed.heights_um();
        assert!((1..1024).all(|ix| h[[0, ix]] > h[[0, ix - 1]]), "the sawtooth rises along +x");
        assert!((h[[0, 1]] - h[[0, 0]] - 0.25 / 1024.0).abs() < ROUNDING_UM);
        assert_eq!(Preset::Flat.build(None, None).unwrap().size(), (1, 1));
    }

    #[test]
    fn parameters_that_do_not_apply_are_named() {
        for preset in [Preset::Flat, Preset::Cd, Preset::Elaphe, Preset::Xenopeltis] {
            let message = preset.build(Some(1.0), None).unwrap_err().to_string();
            assert!(message.contains("`period`") && message.contains(preset.name()), "{message}");
            assert!(preset.build(None, Some(1.0)).unwrap_err().to_string().contains("`height`"));
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Preset::Blazed.build(Some(bad), None).unwrap_err().to_string().contains("`period`"));
            assert!(Preset::Lamellar.build(None, Some(bad)).unwrap_err().to_string().contains("`height`"));
        }
    }
}
