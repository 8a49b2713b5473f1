//! Sizes that are served, checked before anything is solved.
//!
//! The sum over the periods is a polynomial of at most 400 terms along x and along z
//! ([`lattice_sum`](crate::lattice_sum)), and the curve has at most 2048 nodes. Both bound lengths in wavelengths of the medium that
//! they are summed for: d/λ along x, and the relief's height over λ along z.

use crate::discretisation::NODES_MAX;
use crate::error::positive;
use crate::layers::Images;
use crate::medium::outgoing;
use crate::{Error, Estimate, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Most wavelengths on a period. A period of t wavelengths needs `πt + 10 + 6.4·(πt)^⅓` terms (measured up to t = 150), of which
/// 400 serve up to 109.8; a table goes one wavelength beyond what it is asked for.
pub(crate) const PERIOD_WAVES_MAX: f64 = 108.0;

/// Most wavelengths on the height of a relief. 400 terms serve at least 64, on a period of half as many (measured; more on
/// longer periods, and shorter ones are refused as too deep).
pub(crate) const HEIGHT_WAVES_MAX: f64 = 62.0;

/// Refuses a profile above a medium that is too large at a wavelength (nm), for light whose direction has the component
/// `along` (0 to 1) along the grooves; 0 stands for every direction. Takes no time.
///
/// # Errors
/// A wavelength that is not finite and positive, [`Error::TooManyWaves`] and [`Error::TooLarge`].
pub fn check_size(profile: &Profile, medium: &Medium, wavelength_nm: f64, along: f64) -> Result<Estimate, Error> {
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    let below = match *medium {
        Medium::Perfect => None,
        Medium::Index(index) => Some(("the medium below", index * index)),
    };
    for (medium, epsilon) in [Some(("air", Complex64::ONE)), below].into_iter().flatten() {
        let wave_number = k * outgoing(epsilon - along * along);
        if matches!(Images::needed(wave_number.im, profile.period_um()), Images::Near(_)) {
            // A field that decays within a few periods is summed without the polynomial.
            continue;
        }
        let lengths =
            [("period", profile.period_um(), PERIOD_WAVES_MAX), ("height", profile.height_um(), HEIGHT_WAVES_MAX)];
        for (length, found_um, waves_max) in lengths {
            let waves = found_um * wave_number.norm() / TAU;
            if waves > waves_max {
                let most_um = waves_max * found_um / waves;
                return Err(Error::TooManyWaves { length, found_um, waves, medium, wavelength_nm, waves_max, most_um });
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
