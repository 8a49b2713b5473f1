//! Choice of the knots in κ, and the length of a node's record over them.
//!
//! Amplitudes are mean values of `exp(iκh)` with `|h| ≤ H` (H half the range of heights). As functions of κ they are
//! band-limited to H, in µm. Powers are products of two amplitudes, and band-limited to 2H. Knots are spaced uniformly.
//! Their spacing is given in units of 1/bandwidth, in rad, and depends on the tolerance.

use super::lattice::{GAP_FRACTION, Lattice, LatticeAxis};
use super::{FREQUENCY_MAX_PER_UM, HEADER, NodeQuantity};
use std::f64::consts::TAU;

/// Largest κ in rad/µm: `|wi + wo| ≤ 2` at the shortest wavelength, `λmin = 2/FREQUENCY_MAX_PER_UM`.
pub(super) const KAPPA_MAX: f64 = TAU * FREQUENCY_MAX_PER_UM;

/// Number of knots beyond either end of the κ range. The boundary conditions at the spline's ends reach into the range
/// with `|p|⁶ ≈ 4e-4` of their error, where p is the pole of `spline.rs`. Fewer knots leave more of it.
pub(super) const EXTRA_KNOTS: i64 = 6;

/// First knot spacing at a tolerance of 1, in units of 1/bandwidth. The error of a cubic B-spline goes as the fourth
/// power of its spacing, so the spacing scales with the fourth root of the tolerance. At a wider spacing than 13 no
/// preset or scan meets its tolerance, and all need a second build. A smaller one costs knots.
const KNOT_SPACING: f64 = 13.0;

/// Number of nodes up to which a table counts as small: about half a MB for a relief 1 µm deep. Its splines then have
/// finer knots and single-precision coefficients.
pub(super) const FEW_NODES: usize = 4096;

/// Relative error that the splines of a table may have, for a table of the relative error `tolerance`.
///
/// It is smaller where nodes may have deep gaps, ranges of κ where the power nearly vanishes: in a table of few nodes,
/// or of a resampled lattice. The measured error is a percentile, which does not show errors within gaps.
pub(super) fn spline_tolerance(lattice: &Lattice, tolerance: f64) -> f64 {
    let has_gaps = lattice.nodes() <= FEW_NODES || !lattice.is_native();
    if has_gaps { tolerance * GAP_FRACTION } else { tolerance }
}

/// Knot spacing of the first build, in units of 1/bandwidth.
pub(super) fn first_spacing(lattice: &Lattice, tolerance: f64) -> f64 {
    KNOT_SPACING * spline_tolerance(lattice, tolerance).powf(0.25)
}

/// Distance between knots in rad/µm for heights within ±`half_range_um`, with `spacing` in units of 1/bandwidth. At
/// most [`KAPPA_MAX`].
pub(super) fn knot_step(quantity: NodeQuantity, half_range_um: f64, spacing: f64) -> f64 {
    let bandwidth = match quantity {
        NodeQuantity::Power => 2.0 * half_range_um,
        NodeQuantity::Amplitude => half_range_um,
    };
    if bandwidth > 0.0 { (spacing / bandwidth).min(KAPPA_MAX) } else { KAPPA_MAX }
}

/// Largest κ in rad/µm of any pair of directions at a frequency in cycles/µm. `None` for a frequency beyond
/// [`FREQUENCY_MAX_PER_UM`].
///
/// Since `|wi + wo| ≤ 2`, `|f|² + (κ/2π)² ≤ (2/λmin)²`.
pub(super) fn kappa_reached([fx, fy]: [f64; 2]) -> Option<f64> {
    /// Relative increase for the rounding of κ in look-ups: 84 units in the last place of 1 in single precision. κ errs
    /// by a few.
    const ROUNDING: f64 = 1e-5;
    let rest = FREQUENCY_MAX_PER_UM.powi(2) - fx.powi(2) - fy.powi(2);
    (rest >= 0.0).then(|| TAU * rest.sqrt() * (1.0 + ROUNDING))
}

/// Smallest absolute frequency in cycles/µm along an axis whose look-up reads the node of number `node`. It lies half
/// the taps closer to zero.
pub(super) fn nearest_frequency(axis: &LatticeAxis, node: f64) -> f64 {
    (node.abs() - 0.5 * axis.taps as f64).max(0.0) / axis.period_um
}

/// Length in floats of a record that look-ups read up to the whole knot `last_knot`: a header, and the coefficients of
/// the knots from −1 to `last_knot + 2`. Their number is rounded up to even, since packing takes pairs. Numbers are
/// floating-point, as in `estimate.rs`.
pub(super) fn record_floats(quantity: NodeQuantity, last_knot: f64) -> f64 {
    let pairs = (0.5 * (last_knot + 4.0)).ceil();
    HEADER as f64 + 2.0 * pairs * quantity.components() as f64
}
