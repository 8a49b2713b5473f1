//! Limits on the size of a problem, checked before anything is solved.
//!
//! The sum over periods is interpolated by polynomials of at most 400 terms along x and along z (`TERMS_MAX` of
//! [`lattice_sum`](crate::lattice_sum)). This bounds the period and the height of the relief in wavelengths of each
//! medium. The curve has at most [`NODES_MAX`] nodes, which bounds its length in wavelengths.

use crate::discretisation::NODES_MAX;
use crate::error::positive;
use crate::layers::Images;
use crate::medium::outgoing;
use crate::{Error, Estimate, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest period in wavelengths of a medium.
///
/// 400 terms suffice for one wavelength more (`nodes_needed` in `lattice_sum.rs`; measured: up to 109.8 wavelengths).
/// The margin is for tables over directions: they extend beyond the horizon, to a period of up to one wavelength more
/// than any direction has.
pub(crate) const PERIOD_WAVES_MAX: f64 = 108.0;

/// Largest height of a relief in wavelengths of a medium.
///
/// 400 terms suffice for at least 64 wavelengths, measured at a period of half the height. This is the worst case,
/// since a [`Profile`] is at most twice as high as its period. The margin of two wavelengths allows for cases that were
/// not measured.
pub(crate) const HEIGHT_WAVES_MAX: f64 = 62.0;

/// Checks that a profile above a medium can be solved at a wavelength (nm), and returns the estimated cost. Nothing is
/// solved.
///
/// `along` is |ky|/k, 0 to 1: for light in air, the magnitude of the direction's component along the grooves. Smaller
/// values are stricter, so 0 covers every direction.
///
/// ```
/// use sunbeam_rigorous::{Medium, Profile, check_size};
///
/// assert!(check_size(&Profile::blazed(1.2, 0.1)?, &Medium::Perfect, 550.0, 0.0).is_ok());
/// // A period of 1818 wavelengths.
/// assert!(check_size(&Profile::blazed(1000.0, 0.1)?, &Medium::Perfect, 550.0, 0.0).is_err());
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
///
/// # Errors
/// A wavelength that is not finite and positive, [`Error::TooManyWaves`] and [`Error::TooLarge`].
pub fn check_size(profile: &Profile, medium: &Medium, wavelength_nm: f64, along: f64) -> Result<Estimate, Error> {
    // Wave number in air, in rad/µm.
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    // Name and permittivity of each medium that waves enter.
    let mut media = vec![("air", Complex64::ONE)];
    if let Medium::Index(index) = *medium {
        media.push(("the medium below", index * index));
    }
    for (medium_name, epsilon) in media {
        // Wave number across the grooves in the medium, κ or κm, with ky = k·along; the root that decays (`outgoing`).
        let wave_number = k * outgoing(epsilon - along * along);
        if matches!(Images::needed(wave_number.im, profile.period_um()), Images::Near(_)) {
            // A field that decays within a few periods is summed image by image, without polynomials.
            continue;
        }
        let lengths =
            [("period", profile.period_um(), PERIOD_WAVES_MAX), ("height", profile.height_um(), HEIGHT_WAVES_MAX)];
        for (length, found_um, waves_max) in lengths {
            let waves = found_um * wave_number.norm() / TAU;
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
