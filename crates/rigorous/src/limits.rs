//! Limits on the size of a problem, checked before anything is solved.
//!
//! The periodic Green's function, a sum over the images of a source in all periods, is interpolated by polynomials of
//! at most 400 terms across the grooves (x) and in height (z) (`TERMS_MAX` of [`lattice_sum`](crate::lattice_sum)).
//! This limits the period and the height of the relief in each medium. Both are measured in wavelengths across the
//! grooves, 2π/|κ|, with the wave number κ = √(k²ε − ky²): k is that in vacuum, ky that along the grooves, and ε the
//! medium's permittivity. The profile's curve has at most [`NODES_MAX`] nodes.

use crate::discretisation::NODES_MAX;
use crate::error::positive;
use crate::layers::Images;
use crate::medium::outgoing;
use crate::{Error, Estimate, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest period in wavelengths across the grooves, 2π/|κ|, in a medium.
///
/// 400 terms suffice for 109 wavelengths (`nodes_needed` in `lattice_sum.rs`; measured: up to 109.8). The margin is for
/// tables over directions. Their cells extend beyond the horizon, where κ is larger than for any direction: a period
/// has up to one wavelength more there.
pub(crate) const PERIOD_WAVES_MAX: f64 = 108.0;

/// Largest height of a relief in wavelengths across the grooves, 2π/|κ|, in a medium.
///
/// 400 terms suffice for at least 64 wavelengths, measured at a period of half the height, the smallest that a
/// [`Profile`] may have. Longer periods need fewer terms. The margin of two wavelengths is for media and wavelengths
/// other than the measured ones.
pub(crate) const HEIGHT_WAVES_MAX: f64 = 62.0;

/// Checks that a profile on a medium, below air, can be solved at a wavelength (nm), and returns the estimated cost.
/// Nothing is solved.
///
/// `along` is |ky|/k. The caller keeps it within 0 to 1. For light in air it is the magnitude of the direction's
/// component along the grooves. 0, the strictest value, covers every direction.
///
/// ```
/// use sunbeam_rigorous::{Medium, Profile, check_size};
///
/// assert!(check_size(&Profile::blazed(1.2, 0.1)?, &Medium::Perfect, 550.0, 0.0).is_ok());
/// // A period of 1000 µm, 1818 wavelengths, and a height of 0.1 µm.
/// assert!(check_size(&Profile::blazed(1000.0, 0.1)?, &Medium::Perfect, 550.0, 0.0).is_err());
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
///
/// # Errors
/// [`Error::OutOfRange`] for a wavelength that is not finite and positive, [`Error::TooManyWaves`] for a relief above
/// the limits, and [`Error::TooLarge`] for more than [`NODES_MAX`] nodes.
pub fn check_size(profile: &Profile, medium: &Medium, wavelength_nm: f64, along: f64) -> Result<Estimate, Error> {
    // Wave number in air, in rad/µm.
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    // Name and permittivity of each medium that waves enter, which a perfect conductor is not.
    let mut media = vec![("air", Complex64::ONE)];
    if let Medium::Index(index) = *medium {
        media.push(("the medium below", index * index));
    }
    for (medium_name, epsilon) in media {
        // Wave number across the grooves in the medium in rad/µm, κ = √(k²ε − ky²); the root that decays (`outgoing`).
        let kappa = k * outgoing(epsilon - along * along);
        if matches!(Images::needed(kappa.im, profile.period_um()), Images::Near(_)) {
            // A field that decays within a few periods is summed image by image, without polynomials and their limits.
            continue;
        }
        let lengths =
            [("period", profile.period_um(), PERIOD_WAVES_MAX), ("height", profile.height_um(), HEIGHT_WAVES_MAX)];
        for (length, found_um, waves_max) in lengths {
            let waves = found_um * kappa.norm() / TAU;
            if waves > waves_max {
                return Err(Error::TooManyWaves {
                    length,
                    found_um,
                    waves,
                    medium: medium_name,
                    wavelength_nm,
                    waves_max,
                    most_um: waves_max * found_um / waves,
                });
            }
        }
    }
    let estimate = Estimate::new(profile, medium, wavelength_nm)?;
    if estimate.nodes > NODES_MAX {
        return Err(Error::TooLarge {
            wavelength_nm,
            nodes: estimate.nodes,
            nodes_max: NODES_MAX,
            seconds: estimate.seconds,
        });
    }
    Ok(estimate)
}
