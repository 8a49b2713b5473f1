//! Errors of this crate, and checks of single numbers.

/// Reason why a grating was not solved. Every message names what was found and what is accepted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number outside its range.
    #[error("{quantity} is {found}; accepted: {accepted}")]
    OutOfRange {
        /// Name of the quantity, with its unit.
        quantity: &'static str,
        /// The number given.
        found: f64,
        /// Accepted range, in words.
        accepted: &'static str,
    },
    /// A list of heights or corners that does not describe one period of a relief.
    #[error("the profile has {found}; accepted: {accepted}")]
    Profile {
        /// Description of the defect.
        found: String,
        /// Accepted profiles, in words.
        accepted: &'static str,
    },
    /// A period or height of too many wavelengths for the sum over periods (`lattice_sum.rs`).
    #[error(
        "the {length} of {found_um} µm is {waves:.1} wavelengths of {wavelength_nm} nm in {medium}; accepted: at most \
         {waves_max} wavelengths, here {most_um:.3} µm"
    )]
    TooManyWaves {
        /// Name of the length: "period" or "height".
        length: &'static str,
        /// The length in µm.
        found_um: f64,
        /// The length times |κ|/2π. κ is the wave number in the medium across the grooves, so the wavelength counted is
        /// longer for light that runs along them.
        waves: f64,
        /// Name of the medium: "air" or "the medium below".
        medium: &'static str,
        /// Wavelength in vacuum, in nm.
        wavelength_nm: f64,
        /// Largest accepted `waves`.
        waves_max: f64,
        /// Largest accepted length at this wavelength, in µm.
        most_um: f64,
    },
    /// A curve so long, in wavelengths, that it needs too many nodes.
    #[error(
        "{nodes} nodes are needed at {wavelength_nm} nm, about {seconds:.0} s a solution; accepted: at most \
         {nodes_max} nodes, here a relief {:.3} times as large or a longer wavelength",
        *nodes_max as f64 / *nodes as f64
    )]
    TooLarge {
        /// Wavelength in vacuum, in nm.
        wavelength_nm: f64,
        /// Nodes, points where fields are computed, needed on one period of the curve.
        nodes: usize,
        /// Most accepted nodes.
        nodes_max: usize,
        /// Estimated time of one solution on one core, in seconds.
        seconds: f64,
    },
    /// A solution whose power balance or reciprocity is still violated with the largest number of nodes tried.
    #[error(
        "with {nodes} nodes the power is off by {balance:.1e} and reciprocity by {reciprocity:.1e}; accepted: \
         {tolerance:.1e}"
    )]
    Unresolved {
        /// Nodes of the last try.
        nodes: usize,
        /// [`Amplitudes::balance_error`](crate::Amplitudes::balance_error) of the last try.
        balance: f64,
        /// [`Amplitudes::reciprocity_error`](crate::Amplitudes::reciprocity_error) of the last try.
        reciprocity: f64,
        /// Largest accepted value of either error.
        tolerance: f64,
    },
    /// A special function, a sum or a linear system whose result is infinite or NaN, or a series that does not
    /// converge.
    #[error("{what} is not finite; accepted: a period, wavelength, index and direction for which it is")]
    NotFinite {
        /// Name of the computation.
        what: &'static str,
    },
}

/// Returns `found` if it is finite and positive.
///
/// # Errors
/// [`Error::OutOfRange`] with the name `quantity`.
pub(crate) fn positive(quantity: &'static str, found: f64) -> Result<f64, Error> {
    if found.is_finite() && found > 0.0 {
        Ok(found)
    } else {
        Err(Error::OutOfRange { quantity, found, accepted: "finite and above 0" })
    }
}

/// Returns `found` if it is finite.
///
/// # Errors
/// [`Error::OutOfRange`] with the name `quantity`.
pub(crate) fn finite(quantity: &'static str, found: f64) -> Result<f64, Error> {
    if found.is_finite() { Ok(found) } else { Err(Error::OutOfRange { quantity, found, accepted: "finite" }) }
}
