//! Position of an incident wave in the cells of a grating's tables.
//!
//! The wave has the wave number `a` along x, and order m has `a + m`, both in units of 2π/d with the period d. An
//! order propagates where its wave number lies between −t and t (symbols: `mod.rs`). Below an interface, tm takes the
//! place of t in some cells.
//!
//! The lines `t − a = integer` and `t + a = integer` divide the plane of (t, a) into *cells*. On each line one order
//! appears at the horizon. Within a cell the set of propagating orders is constant and their efficiencies are smooth,
//! except below an interface (`channels.rs`). Towards a line efficiencies vary as the square root of the distance.
//!
//! A position within a cell is given by the fractional parts p of `t − a` and q of `t + a`. [`node_coordinate`] maps
//! both so that nodes with equal steps crowd towards the lines. Cells that are shifted by an integer along a differ in
//! the indices m alone, so they share the index s. The WGSL twin is in `src/methods/grating.wgsl`.

use crate::numeric::{Number, Numbers, Real};

/// Position of one incident wave in the cells.
#[derive(Clone, Copy)]
pub(super) struct CellPosition<N: Numbers> {
    /// Index s of the cell: the number of propagating orders minus one. It is −1 where no order propagates.
    pub cell: N::Double,
    /// *Order number* of m = 0: its place among the propagating orders by ascending m. Order 0 has the wave number of
    /// the incident wave along x. From 0 to s where the incident wave propagates.
    pub incident: N::Double,
    /// [`node_coordinate`] of p and of q, in [0, 1].
    pub coordinates: [N::Real; 2],
}

impl<N: Numbers> CellPosition<N> {
    /// Position of the wave with these `t` and `a`. They are in double precision (`N::Double`: one number, a SIMD
    /// vector or a traced variable), since they may be large while their fractional parts matter.
    #[inline(always)]
    pub(super) fn new(t: N::Double, a: N::Double) -> Self {
        let sums = [t - a, t + a];
        let whole = sums.map(Real::floor);
        Self {
            cell: whole[0] + whole[1],
            // Orders −⌊t + a⌋ to ⌊t − a⌋ propagate.
            incident: whole[1],
            coordinates: [0, 1].map(|i| node_coordinate(N::narrow(sums[i] - whole[i]))),
        }
    }
}

/// `t = (d/λ)·√(1 − y²)`, from `periods = d/λ` and the direction cosine `y` along the grooves; 0 where |y| exceeds 1,
/// as by rounding.
#[inline(always)]
pub(super) fn groove_t<N: Numbers>(periods: N::Double, y: N::Double) -> N::Double {
    let one = N::Double::lit(1.0);
    periods * ((one - y) * (one + y)).max(N::Double::lit(0.0)).sqrt()
}

/// Maps a fractional part in [0, 1] to the coordinate in [0, 1] in which nodes have equal steps: `√x/(√x + √(1 − x))`.
/// It varies as the square root of the distance from either end, and so do efficiencies.
#[inline(always)]
pub(super) fn node_coordinate<R: Real>(fraction: R) -> R {
    let (low, high) = (fraction.max(R::lit(0.0)).sqrt(), (R::lit(1.0) - fraction).max(R::lit(0.0)).sqrt());
    low / (low + high)
}

/// Inverse of [`node_coordinate`].
pub(super) fn fraction_at(coordinate: f64) -> f64 {
    let (low, high) = (coordinate * coordinate, (1.0 - coordinate) * (1.0 - coordinate));
    low / (low + high)
}

/// Order number ⌈cell/2⌉ of m = 0 at the waves that [`wave_at`] returns.
pub(super) fn middle_order(cell: i32) -> i32 {
    cell - cell.div_euclid(2)
}

/// `(t, a)` of a point of a cell with the fractional parts p and q. Several values of `a` that differ by integers
/// belong to this point; the one returned gives m = 0 the order number [`middle_order`]. In cell −1, points with
/// `p + q < 1` have a negative t.
pub(super) fn wave_at(cell: i32, [p, q]: [f64; 2]) -> (f64, f64) {
    // t − a and t + a. Their whole parts, ⌊cell/2⌋ and ⌈cell/2⌉, have the sum `cell`.
    let (difference, sum) = (f64::from(cell.div_euclid(2)) + p, f64::from(middle_order(cell)) + q);
    (0.5 * (difference + sum), 0.5 * (sum - difference))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;

    type Double = Plain<'static, f64>;

    #[test]
    fn fraction_at_inverts_node_coordinate() {
        for i in 0..=100 {
            let x = f64::from(i) / 100.0;
            assert!((fraction_at(node_coordinate(x)) - x).abs() < 1e-15);
        }
    }

    #[test]
    fn waves_of_a_cell_have_its_index_and_fractions() {
        for cell in -1..6 {
            let (t, a) = wave_at(cell, [0.3, 0.8]);
            let position = CellPosition::<Double>::new(t, a);
            assert_eq!((position.cell, position.incident), (f64::from(cell), f64::from(middle_order(cell))));
            for (found, fraction) in position.coordinates.into_iter().zip([0.3, 0.8]) {
                assert!((found - node_coordinate(fraction)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn reversed_waves_have_mirrored_positions() {
        // Reversed, order m becomes the incident wave: a → −(a + m). Positions differ by rounding alone.
        for (t, a, m) in [(3.3, 0.4, 1.0), (3.3, -1.7, 2.0), (0.4, 0.1, 0.0), (6.6, -6.1, 12.0)] {
            let (there, back) = (CellPosition::<Double>::new(t, a), CellPosition::<Double>::new(t, -a - m));
            assert_eq!(there.cell, back.cell);
            assert_eq!(there.incident + back.incident + m, there.cell);
            for i in 0..2 {
                assert!((there.coordinates[i] - back.coordinates[1 - i]).abs() < 1e-12);
            }
        }
    }
}
