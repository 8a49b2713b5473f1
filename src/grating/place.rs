//! Coordinates in which a grating's efficiencies are smooth, and their cells.
//!
//! An incident wave on a grating of period d is `exp(i(αx − βz + k_y y))`, with the grooves along y. Its efficiencies
//! depend on
//!
//! ```text
//! t = d·√(k² − k_y²)/2π     transverse wave number in units of the grating's
//! a = d·α/2π                component along x in the same unit; order m leaves with a + m
//! ```
//!
//! An order grazes the surface where `t − a` or `t + a` is a whole number. Between these lines efficiencies are smooth;
//! near them they vary with the square root of the distance. Tables therefore consist of cells between whole numbers of
//! `t − a` and `t + a`. Coordinates in a cell are the two fractions, stretched so that square roots become linear. The
//! solver takes `t` and the Bloch phase `b`, which is `a` up to a whole number.

use crate::numeric::{Index, Number, Numbers, Real};

/// An incident wave's cell and its coordinates there.
#[derive(Clone, Copy)]
pub(super) struct Place<N: Numbers> {
    /// Number of the cell: the sum of the whole parts of `t − a` and `t + a`. The cell has one more propagating order.
    pub cell: N::Index,
    /// The incident wave's number among these orders, the whole part of `t + a`. Orders are counted from the one
    /// furthest towards −x.
    pub incident: N::Index,
    /// [`stretched`] fractions of `t − a` and `t + a`, in [0, 1].
    pub stretched: [N::Real; 2],
    /// Whether the wave propagates.
    pub propagates: N::Mask,
}

impl<N: Numbers> Place<N> {
    /// The place of a wave with these coordinates.
    #[inline(always)]
    pub(super) fn new(t: N::Double, a: N::Double) -> Self {
        let zero = N::Double::lit(0.0);
        let sums = [t - a, t + a];
        let propagates = zero.lt(sums[0]) & zero.lt(sums[1]);
        let sums = sums.map(|sum| sum.max(zero));
        let whole = sums.map(Real::floor);
        Self {
            cell: N::index_of_double(whole[0] + whole[1]),
            incident: N::index_of_double(whole[1]),
            stretched: [0, 1].map(|i| stretched(N::narrow(sums[i] - whole[i]))),
            propagates,
        }
    }

    /// Number of the order `m` among the cell's orders, and whether it propagates.
    #[inline(always)]
    pub(super) fn outgoing(&self, m: N::Double) -> (N::Index, N::Mask) {
        let at = N::widen(N::real(self.incident)) + m;
        let there = N::Double::lit(0.0).le(at) & at.le(N::widen(N::real(self.cell)));
        (N::Index::select(there, N::index_of_double(at.max(N::Double::lit(0.0))), N::Index::lit(0)), there)
    }
}

/// Maps [0, 1] to [0, 1], with a square root at both ends.
#[inline(always)]
pub(super) fn stretched<R: Real>(x: R) -> R {
    let (low, high) = (x.max(R::lit(0.0)).sqrt(), (R::lit(1.0) - x).max(R::lit(0.0)).sqrt());
    low / (low + high)
}

/// Inverse of [`stretched`].
pub(super) fn unstretched(s: f64) -> f64 {
    let (low, high) = (s * s, (1.0 - s) * (1.0 - s));
    low / (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;

    type Double = Plain<'static, f64>;

    #[test]
    fn unstretched_inverts_stretched() {
        for i in 0..=100 {
            let x = f64::from(i) / 100.0;
            assert!((unstretched(stretched(x)) - x).abs() < 1e-15);
        }
    }

    #[test]
    fn reversed_waves_have_mirrored_places() {
        // Reversed, order m becomes the incident wave: a → −(a + m). Rounding only.
        for (t, a, m) in [(3.3, 0.4, 1.0), (3.3, -1.7, 2.0), (0.4, 0.1, 0.0), (6.6, -6.1, 12.0)] {
            let (there, back) = (Place::<Double>::new(t, a), Place::<Double>::new(t, -a - m));
            assert_eq!(there.cell, back.cell);
            assert_eq!(there.incident + back.incident + m as u32, there.cell);
            for i in 0..2 {
                assert!((there.stretched[i] - back.stretched[1 - i]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn outgoing_orders_propagate_between_the_horizons() {
        let (t, a) = (2.7, 0.5);
        let place = Place::<Double>::new(t, a);
        for m in -8..=8 {
            let (at, there) = place.outgoing(f64::from(m));
            assert_eq!(there, (a + f64::from(m)).abs() < t, "{m}");
            assert!(!there || f64::from(at) == f64::from(place.incident) + f64::from(m));
        }
        assert!(!Place::<Double>::new(1.0, 1.2).propagates);
    }
}
