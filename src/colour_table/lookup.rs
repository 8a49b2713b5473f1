//! Look-up of a colour, for every family of numbers. Symbols are those of `mod.rs`, the packing that of `pack.rs`.
//!
//! `src/methods/table.wgsl` is its twin in WGSL.

use super::{ColourLayout, Ring};
use crate::numeric::math::{cubic_b_spline_weights, polynomial};
use crate::numeric::{Index, Number, Numbers, Real};
use std::array;
use std::f64::consts::LN_2;

/// Largest |q|²: that of two parallel unit vectors, with room for rounding.
pub const SUM_SQUARED_MAX: f32 = 4.001;

/// Bits of a stored mantissa, whose offset is half its range.
const MANTISSA_BITS: u32 = super::pack::EXCESS.ilog2() + 1;
/// Mask of a stored mantissa.
const MANTISSA_MASK: u32 = (1 << MANTISSA_BITS) - 1;
/// First bit of the shared exponent in a word, after three mantissas.
const EXPONENT_SHIFT: u32 = 3 * MANTISSA_BITS;
/// First bit of the exponent in a number of single precision.
const FLOAT_EXPONENT_SHIFT: u32 = f32::MANTISSA_DIGITS - 1;
/// First bit of a stored mantissa when it takes the upper bits of a float's mantissa.
const FLOAT_MANTISSA_SHIFT: u32 = FLOAT_EXPONENT_SHIFT - MANTISSA_BITS;
/// Packets of four words per ring record.
const RECORD_PACKETS: u32 = Ring::WORDS as u32 / 4;

/// A [`super::ColourTable`] over one family of numbers.
#[derive(Clone, Copy, Debug)]
pub struct ColourView<N: Numbers> {
    /// Constants of the look-up.
    pub layout: ColourLayout,
    /// Table data.
    pub words: N::Words,
}

impl<N: Numbers> ColourView<N> {
    /// The colour `F` of `q = (u, v, w)` (see the [module](super)), linear sRGB in 1/sr; colours outside sRGB have
    /// negative channels. Zero unless `active`, `w > 0`, and `q` the sum of two unit vectors.
    #[inline(always)]
    pub fn relief_rgb(&self, u: N::Real, v: N::Real, w: N::Real, active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let squared = u.fma(u, v * v);
        // False for NaN and infinities.
        let valid = active & lit(0.0).lt(w) & w.fma(w, squared).le(lit(SUM_SQUARED_MAX.into()));
        let turn = turns(u, v);
        // The divisions are those of the WGSL twin: beside a bright order a rounding of the ring's position shows.
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

    /// The value on a ring at `turn` (a direction in turns) and `w`. Negative ring numbers are beyond the centre, on
    /// the opposite side. `efolds` is `ln(1 + w/w_log)`.
    #[inline(always)]
    fn on_ring(&self, number: N::Real, turn: N::Real, w: N::Real, efolds: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (lit, index) = (N::Real::lit, N::Index::lit);
        let mirrored = number.lt(lit(0.0));
        let number = N::Real::select(mirrored, lit(-1.0) - number, number).min(lit(self.layout.last_ring.into()));
        let turn = N::Real::select(mirrored, turn + lit(0.5), turn);
        let record = N::index(number) * index(RECORD_PACKETS) + index(self.layout.rings_at);
        let [offset, directions, heights, knots_per_w] = N::gather::<4>(self.words, record, active);
        let rest = N::gather::<4>(self.words, record + index(1), active);
        let [knots_per_efold, knee_squared, zero_squared, _] = rest.map(N::from_bits);
        let circumference = N::real(directions);
        let x = turn * circumference;
        let y = w.fma(N::from_bits(knots_per_w), knots_per_efold * efolds);
        let column = x.floor();
        let row = y.floor().min(N::real(heights) - lit(4.0));
        let weights_x = cubic_b_spline_weights(x - column);
        let weights_y = cubic_b_spline_weights(y - row);
        // The first of four directions, modulo their number: turns lie in [−½, 1].
        let positive = N::index(column + circumference - lit(1.0));
        let mut direction = N::Index::select(directions.le(positive), positive - directions, positive);
        let start = offset + N::index(row);
        // `[channel][height]`, four heights per SIMD vector.
        let mut sums = [[lit(0.0); 4]; 3];
        for weight_x in weights_x {
            let first = direction * heights + start;
            // Word by word, since a record need not begin at a packet.
            let words: [N::Index; 4] = array::from_fn(|j| {
                let [word] = N::gather::<1>(self.words, first + index(j as u32), active);
                word
            });
            // A stored mantissa m in the upper bits of a float's makes `(1 + m/512)·2^e`. Subtracting 1.5·2^e, which
            // has the mantissa 256, removes the offset exactly and without an integer conversion.
            let exponent_offset = index(self.layout.exponent_offset + MANTISSA_BITS);
            let powers = words.map(|word| ((word >> EXPONENT_SHIFT) + exponent_offset) << FLOAT_EXPONENT_SHIFT);
            let offsets = powers.map(|power| N::from_bits(power | index(1 << (FLOAT_EXPONENT_SHIFT - 1))));
            // Shifts of red, green and blue to the float's mantissa.
            let shifted = [
                |word: N::Index| word << FLOAT_MANTISSA_SHIFT,
                |word| word << (FLOAT_MANTISSA_SHIFT - MANTISSA_BITS),
                |word| word >> (2 * MANTISSA_BITS - FLOAT_MANTISSA_SHIFT),
            ];
            for (sum, shifted) in sums.iter_mut().zip(shifted) {
                *sum = array::from_fn(|j| {
                    let mantissa = shifted(words[j]) & index(MANTISSA_MASK << FLOAT_MANTISSA_SHIFT);
                    (N::from_bits(mantissa | powers[j]) - offsets[j]).fma(weight_x, sum[j])
                });
            }
            let next = direction + index(1);
            direction = N::Index::select(next.lt(directions), next, index(0));
        }
        let squared = w * w;
        let scale = (squared + zero_squared) / (squared + knee_squared);
        sums.map(|sum| (0..4).fold(lit(0.0), |total, j| weights_y[j].fma(sum[j], total)) * scale)
    }
}

/// Coefficients of `atan(a)/2πa` in powers of a² on [0, 1]: a minimax fit, off by at most 6e-9 of a turn.
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

/// Direction of `(u, v)` in turns from +u towards +v, −½ to ½; 0 for the zero vector. WGSL allows `atan2` an error of
/// 4096 units in the last place, a quarter of the distance between directions. Both twins therefore use this
/// polynomial.
#[inline(always)]
fn turns<R: Real>(u: R, v: R) -> R {
    let (abs_u, abs_v) = (u.abs(), v.abs());
    // At least the smallest normal number, so that the zero vector has the ratio 0.
    let largest = abs_v.max(abs_u).max(R::lit(1e-37));
    let ratio = abs_v.min(abs_u) / largest;
    let octant = ratio * polynomial(ratio * ratio, &TURNS);
    let quadrant = R::select(abs_u.lt(abs_v), R::lit(0.25) - octant, octant);
    let half = R::select(u.lt(R::lit(0.0)), R::lit(0.5) - quadrant, quadrant);
    R::select(v.lt(R::lit(0.0)), -half, half)
}

/// Weights of the values at −1, 0, 1, 2 of the cubic through them, at `t` in [0, 1].
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
            // The coefficients' error and a few roundings; at the ends ±½ are the same direction.
            let off = (found - expected).abs();
            assert!(off.min((off - 1.0).abs()) < 1e-7, "{found} {expected}");
        }
        assert_eq!(turns(0.0f32, 0.0), 0.0);
    }

    #[test]
    fn lagrange_weights_reproduce_a_cubic() {
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            let moment: f64 = lagrange_weights(t).iter().zip([-1.0, 0.0, 1.0, 2.0]).map(|(w, x)| w * x * x * x).sum();
            assert!((moment - t * t * t).abs() < 1e-14);
        }
    }
}
