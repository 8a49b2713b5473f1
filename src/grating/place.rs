//! Where directions lie between the lines on which orders pass off.
//!
//! A wave that meets a relief along x is `exp(i(αx − βz + k_y y))`. With `κ² = k² − k_y²`, what it does depends on
//! `t = dκ/2π` and `a = dα/2π`, and of `a` only the fraction matters to which orders there are: an order passes off where
//! `t − a` or `t + a` is whole. Between these lines efficiencies are smooth; next to them they go with the square root of
//! the distance. So tables are made of cells between whole numbers, and a place in a cell is the fraction of `t − a` and of
//! `t + a`, stretched at both ends.

use crate::numeric::{Index, Number, Numbers, Real};

/// A place of an incident wave in the cells.
#[derive(Clone, Copy)]
pub(super) struct Place<N: Numbers> {
    /// Number of orders that propagate besides one: the whole parts of `t − a` and of `t + a`, added up.
    pub cell: N::Index,
    /// The incident wave's own among these orders, counted from the one that goes furthest to −x: the whole part of `t + a`.
    pub incident: N::Index,
    /// [`stretched`] fractions of `t − a` and of `t + a`.
    pub stretched: [N::Real; 2],
    /// Whether the wave propagates.
    pub propagates: N::Mask,
}

impl<N: Numbers> Place<N> {
    /// Of a wave with this `t` and `a`.
    #[inline(always)]
    pub fn new(t: N::Double, a: N::Double) -> Self {
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

    /// The order that is `m` further to +x among those of the cell, and whether it propagates.
    #[inline(always)]
    pub fn outgoing(&self, m: N::Double) -> (N::Index, N::Mask) {
        let at = N::widen(N::real(self.incident)) + m;
        let there = N::Double::lit(0.0).le(at) & at.le(N::widen(N::real(self.cell)));
        (N::Index::select(there, N::index_of_double(at.max(N::Double::lit(0.0))), N::Index::lit(0)), there)
    }
}

/// A number of [0, 1] to one that goes with the square root of the distance from either end.
#[inline(always)]
pub(super) fn stretched<R: Real>(x: R) -> R {
    let (low, high) = (x.max(R::lit(0.0)).sqrt(), (R::lit(1.0) - x).max(R::lit(0.0)).sqrt());
    low / (low + high)
}

/// What [`stretched`] makes a number of.
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
    fn stretching_is_undone() {
        for i in 0..=100 {
            let x = f64::from(i) / 100.0;
            assert!((unstretched(stretched(x)) - x).abs() < 1e-15);
        }
    }

    #[test]
    fn a_wave_and_its_reverse_lie_at_mirrored_places() {
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
    fn orders_are_those_that_propagate() {
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
