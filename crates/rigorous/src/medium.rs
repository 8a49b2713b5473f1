//! The medium below the relief.

use crate::Error;
use num_complex::Complex64;

/// Largest magnitude of the index. Chosen: beyond it the nodes along the curve do not resolve the skin depth.
const INDEX_MAX: f64 = 100.0;

/// The medium below the relief; above it is air, of index 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Medium {
    /// A perfect conductor.
    Perfect,
    /// A metal or dielectric of refractive index `eta + ik`, k ≥ 0, with time as e^{−iωt}.
    Index(Complex64),
}

impl Medium {
    /// A metal or dielectric of refractive index `eta + ik`.
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
        let size = eta.hypot(k);
        if !(1e-3..=INDEX_MAX).contains(&size) {
            let quantity = "magnitude of the index eta + ik";
            return Err(Error::OutOfRange { quantity, found: size, accepted: "0.001 to 100" });
        }
        Ok(Self::Index(Complex64::new(eta, k)))
    }
}

/// Square root of a squared wave number whose wave travels outwards or decays: Im ≥ 0, and Re > 0 where it is real.
pub(crate) fn outgoing(square: Complex64) -> Complex64 {
    let root = square.sqrt();
    if root.im < 0.0 || (root.im == 0.0 && root.re < 0.0) { -root } else { root }
}
