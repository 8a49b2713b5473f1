//! Choice of the knots over the phase rate κ, and the length of a node's record over them.
//!
//! The power or amplitude of a node over κ is a cubic spline with uniform knots. Amplitudes are means of `exp(iκh)`
//! over the relief, with heights `|h| ≤ H` from the middle of their range. As functions of κ they are sums of waves of
//! angular frequencies up to the *bandwidth* H, in µm. Powers are products of two amplitudes, so their bandwidth is
//! 2H. The spacing of knots is given in units of 1/bandwidth: it is the phase in rad by which the fastest wave
//! advances from knot to knot. It depends on the tolerance.

use super::lattice::{GAP_FRACTION, Lattice, LatticeAxis};
use super::{FREQUENCY_MAX_PER_UM, HEADER, NodeQuantity};
use std::f64::consts::TAU;

/// Largest κ in rad/µm: `|wi + wo| ≤ 2` at the shortest wavelength, `λmin = 2/FREQUENCY_MAX_PER_UM`.
pub(super) const KAPPA_MAX: f64 = TAU * FREQUENCY_MAX_PER_UM;

/// Number of knots beyond either end of the range of κ. The spline's boundary conditions are wrong at its ends. Within
/// the range their error has fallen to `|p|⁶ ≈ 4e-4`, where p is the pole of `spline.rs`. Fewer knots leave a larger
/// part; more knots take longer.
pub(super) const EXTRA_KNOTS: i64 = 6;

/// Knot spacing of the first build for a tolerance of 1, in units of 1/bandwidth. The error of a cubic B-spline is
/// proportional to the fourth power of its spacing, so the spacing is this constant times the fourth root of the
/// tolerance. At a wider spacing than 13 no preset or scan meets its tolerance, and all need a second build. A smaller
/// spacing costs knots.
const KNOT_SPACING: f64 = 13.0;

/// Number of nodes up to which a table counts as small: about half a MB for a relief 1 µm deep. Splines of small
/// tables have finer knots and single-precision coefficients. A larger value spends this memory on larger tables, too;
/// with a smaller one, errors fill the gaps over κ ([`spline_tolerance`]) of more tables.
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
    /// Relative increase for the rounding of κ in look-ups: 84 units in the last place of 1 in single precision, where
    /// κ errs by a few units.
    const ROUNDING: f64 = 1e-5;
    let rest = FREQUENCY_MAX_PER_UM.powi(2) - fx.powi(2) - fy.powi(2);
    (rest >= 0.0).then(|| TAU * rest.sqrt() * (1.0 + ROUNDING))
}

/// Smallest absolute frequency in cycles/µm along an axis whose look-up reads the node of number `node`. It is closer
/// to zero than the node by half the number of taps, the nodes that a look-up reads.
pub(super) fn nearest_frequency(axis: &LatticeAxis, node: f64) -> f64 {
    (node.abs() - 0.5 * axis.taps as f64).max(0.0) / axis.period_um
}

/// Length in floats of a record that look-ups read up to the knot of number `last_knot`: a header, and the
/// coefficients of the knots from −1 to `last_knot + 2`. The number of coefficients is rounded up to even, since
/// packing takes pairs. `last_knot` is a whole number in floating point, as in `estimate.rs`.
pub(super) fn record_floats(quantity: NodeQuantity, last_knot: f64) -> f64 {
    let pairs = (0.5 * (last_knot + 4.0)).ceil();
    HEADER as f64 + 2.0 * pairs * quantity.components() as f64
}
