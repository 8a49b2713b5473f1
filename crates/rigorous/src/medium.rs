//! The medium below the relief.

use crate::Error;
use num_complex::Complex64;
use std::ops::RangeInclusive;

/// Accepted magnitudes of the index n. At smaller ones the squared wave number across the grooves in the medium, κm²
/// (`lib.rs`), nearly vanishes where ky = 0. The response of the medium is singular at κm² = 0. At larger
/// magnitudes the nodes along the relief's cross-section do not resolve the skin depth.
const INDEX_RANGE: RangeInclusive<f64> = 1e-3..=100.0;

/// The medium below the relief; above the relief is air, of index 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Medium {
    /// A perfect conductor.
    Perfect,
    /// A metal or dielectric of refractive index `eta + i·k`, k ≥ 0, for fields that vary in time as e^{−iωt}.
    /// [`Medium::index`] checks the range. For a variant made without it, solutions may be wrong or not finite.
    Index(Complex64),
}

impl Medium {
    /// A metal or dielectric of refractive index `eta + i·k`.
    ///
    /// ```
    /// use sunbeam_rigorous::Medium;
    ///
    /// let silver = Medium::index(0.06, 3.59)?;
    /// assert_ne!(silver, Medium::Perfect);
    /// assert!(Medium::index(-1.0, 0.0).is_err());
    /// # Ok::<(), sunbeam_rigorous::Error>(())
    /// ```
    ///
    /// # Errors
    /// Negative or non-finite parts, and a magnitude outside of 0.001 to 100.
    pub fn index(eta: f64, k: f64) -> Result<Self, Error> {
        for (quantity, found) in [("eta", eta), ("k", k)] {
            if !(found.is_finite() && found >= 0.0) {
                return Err(Error::OutOfRange { quantity, found, accepted: "finite and at least 0" });
            }
        }
        let magnitude = eta.hypot(k);
        if !INDEX_RANGE.contains(&magnitude) {
            let quantity = "magnitude of the index eta + ik";
            return Err(Error::OutOfRange { quantity, found: magnitude, accepted: "0.001 to 100" });
        }
        Ok(Self::Index(Complex64::new(eta, k)))
    }
}

/// The square root of a squared wave number whose wave travels outwards or decays: Im ≥ 0, and Re ≥ 0 where Im = 0.
pub(crate) fn outgoing(square: Complex64) -> Complex64 {
    let root = square.sqrt();
    if root.im < 0.0 || (root.im == 0.0 && root.re < 0.0) { -root } else { root }
}
