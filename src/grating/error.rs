//! Errors of gratings by Maxwell's equations.

use crate::table::TableError;

/// Reason why a grating was not solved or tabulated.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum GratingError {
    #[error(
        "the relief varies along y by {found_um:.2e} µm, but that of a grating must vary along x alone, to within \
         {accepted_um:.2e} µm; theory \"scalar\" takes any, except for lists of orders"
    )]
    NotAlongX { found_um: f64, accepted_um: f64 },
    /// Any error of the solver except those that become [`GratingError::Size`].
    #[error(transparent)]
    Solver(sunbeam_rigorous::Error),
    /// A relief or wave number beyond the solver's limits.
    #[error("{0}; theory \"scalar\" takes any")]
    Size(sunbeam_rigorous::Error),
    /// A power balance that does not hold on the finest mesh, with the largest number of nodes on the profile. `t`
    /// bounds the wave numbers of propagating orders along x, and `b` is the Bloch phase, the wave number of one order
    /// (symbols: `mod.rs`). `balance` is the violation as a fraction of the power on the surface.
    #[error(
        "with {nodes} nodes the power at t = {t}, b = {b} and {wavelength_nm} nm is off by {balance:.1e}, more than a \
         table of efficiencies may be; theory \"scalar\" takes any relief"
    )]
    Unbalanced { t: f64, b: f64, wavelength_nm: f64, nodes: usize, balance: f64 },
    /// A build whose estimated cost exceeds the limit.
    #[error(transparent)]
    Limit(#[from] TableError),
}

impl From<sunbeam_rigorous::Error> for GratingError {
    fn from(error: sunbeam_rigorous::Error) -> Self {
        use sunbeam_rigorous::Error::{TooLarge, TooManyWaves};
        if matches!(error, TooLarge { .. } | TooManyWaves { .. }) { Self::Size(error) } else { Self::Solver(error) }
    }
}
