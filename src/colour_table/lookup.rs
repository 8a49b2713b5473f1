//! Look-up in a [`super::ColourTable`], written once for all families of numbers.
//!
//! A look-up reads four rings about the radius `r = |(u, v)|`. On each ring it reads 4 × 4 coefficients about direction
//! and w. Words are those of `pack.rs`. The WGSL twin is `src/methods/table.wgsl`.

use super::pack::MANTISSA_BITS;
use super::{ColourLayout, Ring};
use crate::numeric::math::{cubic_b_spline_weights, polynomial};
use crate::numeric::{Index, Number, Numbers, Real};
use std::array;
use std::f64::consts::LN_2;

/// Upper bound of `|q|²` for a sum of two unit vectors: 4, and room for rounding.
pub const SUM_SQUARED_MAX: f32 = 4.001;

/// A [`super::ColourTable`] as an evaluator over the numbers `N` reads it.
#[derive(Clone, Copy, Debug)]
pub struct ColourView<N: Numbers> {
    /// Layout of the words.
    pub layout: ColourLayout,
    /// [`super::ColourTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> ColourView<N> {
    /// The colour `F(q)` of the [module](super), linear sRGB in 1/sr; colours outside sRGB have negative channels. Zero
    /// unless `active`, `w > 0`, and `q` can be a sum of two unit vectors.
    #[inline(always)]
    pub fn relief_rgb(&self, u: N::Real, v: N::Real, w: N::Real, active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let squared = u.fma(u, v * v);
        // Comparisons with NaN are false.
        let valid = active & lit(0.0).lt(w) & w.fma(w, squared).le(lit(SUM_SQUARED_MAX.into()));
        let turn = turns(u, v);
        // The divisions of the WGSL twin, one by one: next to a bright order a rounding of the radial position shows.
        let growth = lit(self.layout.growth.into());
        let stretched = (u * u + v * v).sqrt() * growth / lit(self.layout.knee_radius.into());
        let arsinh = (stretched + (stretched * stretched + lit(1.0)).sqrt()).log2() * lit(LN_2);
        let position = arsinh / growth - lit(0.5);
        let first = position.floor();
        let weights = lagrange_weights(position - first);
        let efolds = w.fma(lit(1.0 / f64::from(self.layout.w_log)), lit(1.0)).log2() * lit(LN_2);
        let numbers = [-1.0, 0.0, 1.0, 2.0].map(|i| first + lit(i));
        let rings =
            N::each_lane(c"rings of colours", numbers, valid, |number| self.on_ring(number, turn, w, efolds, valid));
        array::from_fn(|c| {
            let sum = (0..4).fold(lit(0.0), |sum, i| weights[i].fma(rings[c][i], sum));
            N::Real::select(valid, sum, lit(0.0))
        })
    }

    /// Colour on ring `number` at the direction `turn` (in turns) and `w`; `efolds` is `ln(1 + w/w_log)`. Negative
    /// numbers are rings on the other side of the centre.
    #[inline(always)]
    fn on_ring(&self, number: N::Real, turn: N::Real, w: N::Real, efolds: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (lit, index) = (N::Real::lit, N::Index::lit);
        let mirrored = number.lt(lit(0.0));
        let number = N::Real::select(mirrored, lit(-1.0) - number, number).min(lit(self.layout.last_ring.into()));
        let turn = N::Real::select(mirrored, turn + lit(0.5), turn);
        const PACKETS: u32 = Ring::WORDS as u32 / 4;
        let record = N::index(number) * index(PACKETS) + index(self.layout.rings_at);
        let [offset, directions, heights, knots_per_w] = N::gather::<4>(self.words, record, active);
        let rest = N::gather::<4>(self.words, record + index(1), active);
        let [knots_per_efold, knee_squared, zero_squared, _] = rest.map(N::from_bits);
        let around = N::real(directions);
        let x = turn * around;
        let y = w.fma(N::from_bits(knots_per_w), knots_per_efold * efolds);
        let column = x.floor();
        let row = y.floor().min(N::real(heights) - lit(4.0));
        let direction_weights = cubic_b_spline_weights(x - column);
        let height_weights = cubic_b_spline_weights(y - row);
        // A turn lies in [−½, 1], so that one addition and at most one subtraction bring the direction into range.
        let wrapped = N::index(column + around - lit(1.0));
        let mut direction = wrapped - N::Index::select(directions.le(wrapped), directions, index(0));
        let start = offset + N::index(row);
        // [channel][height], so that the four heights fill a vector.
        let mut sums = [[lit(0.0); 4]; 3];
        for direction_weight in direction_weights {
            let first = direction * heights + start;
            // Single words, since they begin at any word.
            let words: [N::Index; 4] = array::from_fn(|j| {
                let [word] = N::gather::<1>(self.words, first + index(j as u32), active);
                word
            });
            // Stored mantissa bits m in the top of a float's mantissa make `(1 + m/512)·2^e`. Subtracting `1.5·2^e`
            // removes the excess 256 exactly, without a conversion from integers.
            let powers = words.map(|word| ((word >> 27) + index(self.layout.exponent_offset + MANTISSA_BITS)) << 23);
            let excess = powers.map(|power| N::from_bits(power | index(1 << 22)));
            let in_place = [|word: N::Index| word << 14, |word| word << 5, |word| word >> 4];
            for (sum, in_place) in sums.iter_mut().zip(in_place) {
                *sum = array::from_fn(|j| {
                    let bits = (in_place(words[j]) & index(0x1ff << 14)) | powers[j];
                    (N::from_bits(bits) - excess[j]).fma(direction_weight, sum[j])
                });
            }
            let next = direction + index(1);
            direction = N::Index::select(next.lt(directions), next, index(0));
        }
        let squared = w * w;
        let shape = (squared + zero_squared) / (squared + knee_squared);
        sums.map(|sum| (0..4).fold(lit(0.0), |total, j| height_weights[j].fma(sum[j], total)) * shape)
    }
}

/// Coefficients of `atan(a)/2πa` in powers of a² on [0, 1]: a minimax fit with an error of at most 6e-9 turns.
const TURNS: [f64; 8] = [
    1.591_548_4e-1,
    -5.304_612e-2,
    3.174_594_5e-2,
    -2.213_627e-2,
    1.534_603e-2,
    -8.898_719e-3,
    3.479_595e-3,
    -6.453_036_6e-4,
];

/// Direction of `(u, v)` in turns from +u towards +v, −½ to ½; 0 at the origin. WGSL allows `atan2` an error of 4096
/// units in the last place, a quarter of the distance between directions, so both twins use this function.
#[inline(always)]
fn turns<R: Real>(u: R, v: R) -> R {
    let (abs_u, abs_v) = (u.abs(), v.abs());
    let largest = abs_v.max(abs_u).max(R::lit(1e-37));
    let ratio = abs_v.min(abs_u) / largest;
    let octant = ratio * polynomial(ratio * ratio, &TURNS);
    let quadrant = R::select(abs_u.lt(abs_v), R::lit(0.25) - octant, octant);
    let half = R::select(u.lt(R::lit(0.0)), R::lit(0.5) - quadrant, quadrant);
    R::select(v.lt(R::lit(0.0)), -half, half)
}

/// Weights of the values at −1, 0, 1, 2 in the cubic through them, at `t` in [0, 1].
#[inline(always)]
fn lagrange_weights<R: Real>(t: R) -> [R; 4] {
    let (a, b, c) = (t + R::lit(1.0), t - R::lit(1.0), t - R::lit(2.0));
    let (sixth, half) = (R::lit(1.0 / 6.0), R::lit(0.5));
    [-t * b * c * sixth, a * b * c * half, -a * t * c * half, a * t * b * sixth]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_match_the_arc_tangent() {
        for i in 0..2000 {
            let angle = (f64::from(i) - 1000.0) * 1e-3 * std::f64::consts::PI;
            let (sin, cos) = angle.sin_cos();
            let found = f64::from(turns(0.3 * cos as f32, 0.3 * sin as f32));
            let expected = angle / std::f64::consts::TAU;
            // Error of the coefficients and a few roundings. Turns of −½ and ½ are the same direction.
            let off = (found - expected).abs();
            assert!(off.min((off - 1.0).abs()) < 1e-7, "{found} {expected}");
        }
        assert_eq!(turns(0.0f32, 0.0), 0.0);
    }

    #[test]
    fn lagrange_weights_reproduce_cubics() {
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            let moment: f64 = lagrange_weights(t).iter().zip([-1.0, 0.0, 1.0, 2.0]).map(|(w, x)| w * x * x * x).sum();
            assert!((moment - t * t * t).abs() < 1e-14);
        }
    }
}
