//! What is refused, and why.

/// Why a grating was not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number outside its range.
    #[error("{quantity} is {found}; accepted: {accepted}")]
    OutOfRange {
        /// What the number is, with its unit.
        quantity: &'static str,
        /// The number given.
        found: f64,
        /// The numbers that are accepted.
        accepted: &'static str,
    },
    /// A list of heights or corners that does not describe one period of a relief.
    #[error("the profile has {found}; accepted: {accepted}")]
    Profile {
        /// What is wrong with it.
        found: String,
        /// What is accepted.
        accepted: &'static str,
    },
    /// A length of the relief that is too many wavelengths for the sum over the periods.
    #[error(
        "the {length} of {found_um} µm is {waves:.1} wavelengths of {wavelength_nm} nm in {medium}; accepted: at most \
         {waves_max} wavelengths, here {most_um:.3} µm"
    )]
    TooManyWaves {
        /// Name of the length: the period, or the relief's height.
        length: &'static str,
        /// The length in µm.
        found_um: f64,
        /// The length in wavelengths of the medium.
        waves: f64,
        /// Air, or the medium below.
        medium: &'static str,
        /// Wavelength in vacuum, in nm.
        wavelength_nm: f64,
        /// Most wavelengths that are served.
        waves_max: f64,
        /// Largest length at this wavelength, in µm.
        most_um: f64,
    },
    /// A problem larger than what is served.
    #[error(
        "{nodes} nodes are needed at {wavelength_nm} nm, about {seconds:.0} s a solution; accepted: at most {nodes_max} nodes, \
         here a relief {:.3} times as large or a longer wavelength",
        *nodes_max as f64 / *nodes as f64
    )]
    TooLarge {
        /// Wavelength in vacuum, in nm.
        wavelength_nm: f64,
        /// Nodes on one period of the curve.
        nodes: usize,
        /// The most that are served.
        nodes_max: usize,
        /// Estimated time of one solution on one core.
        seconds: f64,
    },
    /// The checks still failed with the most nodes that were tried.
    #[error(
        "with {nodes} nodes the power is off by {balance:.1e} and reciprocity by {reciprocity:.1e}; accepted: {tolerance:.1e}"
    )]
    Unresolved {
        /// Nodes of the last try.
        nodes: usize,
        /// [`Amplitudes::balance_error`](crate::Amplitudes::balance_error) of the last try.
        balance: f64,
        /// [`Amplitudes::reciprocity_error`](crate::Amplitudes::reciprocity_error) of the last try.
        reciprocity: f64,
        /// What both must be below.
        tolerance: f64,
    },
    /// A function or a linear system that came out infinite or as no number.
    #[error("{what} is not finite; accepted: a period, wavelength, index and direction for which it is")]
    NotFinite {
        /// What was being computed.
        what: &'static str,
    },
}

/// Refuses what is not finite and positive.
pub(crate) fn positive(quantity: &'static str, found: f64) -> Result<f64, Error> {
    if found.is_finite() && found > 0.0 {
        Ok(found)
    } else {
        Err(Error::OutOfRange { quantity, found, accepted: "finite and above 0" })
    }
}

/// Refuses what is not finite.
pub(crate) fn finite(quantity: &'static str, found: f64) -> Result<f64, Error> {
    if found.is_finite() { Ok(found) } else { Err(Error::OutOfRange { quantity, found, accepted: "finite" }) }
}
