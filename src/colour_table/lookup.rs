//! Look-up in a [`super::ColourTable`], generic over [`Numbers`]: an `N::Real` is one number, a SIMD vector or a traced
//! variable.
//!
//! The table holds the colour F of the scattering vector `q = wi + wo = (u, v, w)`, on rings in the plane of (u, v). A
//! look-up reads the four rings nearest to the radius `r = |(u, v)|`, and on each ring 4 × 4 coefficients of a cubic
//! B-spline over direction and w. A *direction* is the azimuth of (u, v). Words of coefficients are packed by
//! `pack.rs`. Formulas of positions are those of [`ColourLayout`] and [`Ring`].
//!
//! `src/methods/table.wgsl` is the counterpart in WGSL, with the same formulas. Tests of the method `table` in
//! crates/realtime compare the two.

use super::pack::MANTISSA_BITS;
use super::{ColourLayout, Ring};
use crate::numeric::math::{cubic_b_spline_weights, polynomial};
use crate::numeric::{Index, Number, Numbers, Real};
use std::array;
use std::f64::consts::LN_2;

/// Upper bound of `|q|²` for a sum of two unit vectors: 4, and room for rounding.
pub const SUM_SQUARED_MAX: f32 = 4.001;

/// Evaluator of a [`super::ColourTable`] over the numbers `N`.
#[derive(Clone, Copy, Debug)]
pub struct ColourView<N: Numbers> {
    /// Layout of the words.
    pub layout: ColourLayout,
    /// [`super::ColourTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> ColourView<N> {
    /// Colour `F(q)` of the [module](super), linear sRGB in 1/sr. Colours outside sRGB have negative channels. Zero
    /// unless `active`, `w > 0` and `|q|²` is at most [`SUM_SQUARED_MAX`]; zero for NaN.
    #[inline(always)]
    pub fn relief_rgb(&self, u: N::Real, v: N::Real, w: N::Real, active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let squared = u.fma(u, v * v);
        // Comparisons with NaN are false.
        let valid = active & lit(0.0).lt(w) & w.fma(w, squared).le(lit(SUM_SQUARED_MAX.into()));
        let turn = turns(u, v);
        // Position among the rings, arsinh(r·growth/inner_spacing)/growth − ½: ring k lies at k. `Real` has the binary
        // logarithm only. Neither the divisions nor `u·u + v·v` may be simplified or fused: their rounding must
        // match that of table.wgsl. Beside a bright order another rounding of the position changes the colour visibly.
        let growth = lit(self.layout.growth.into());
        let stretched = (u * u + v * v).sqrt() * growth / lit(self.layout.inner_spacing.into());
        let arsinh = (stretched + (stretched * stretched + lit(1.0)).sqrt()).log2() * lit(LN_2);
        let position = arsinh / growth - lit(0.5);
        let inner = position.floor();
        let weights = lagrange_weights(position - inner);
        // ln(1 + w/w_log), in e-folds.
        let efolds = w.fma(lit(1.0 / f64::from(self.layout.w_log)), lit(1.0)).log2() * lit(LN_2);
        let rings = [-1.0, 0.0, 1.0, 2.0].map(|i| inner + lit(i));
        // Values [channel][ring]. `map_each` calls the function for each ring in turn. In kernels that Dr.Jit records,
        // the calls become a loop with this label.
        let values = N::map_each(c"rings of colours", rings, valid, |ring| self.on_ring(ring, turn, w, efolds, valid));
        array::from_fn(|c| {
            let sum = (0..4).fold(lit(0.0), |sum, i| weights[i].fma(values[c][i], sum));
            N::Real::select(valid, sum, lit(0.0))
        })
    }

    /// Colour on the ring of index `ring`, a whole number, at the direction `turn` (in turns) and `w`. `efolds` is
    /// `ln(1 + w/w_log)`. Arbitrary unless `active`: the caller replaces such colours by zero.
    ///
    /// The line through the centre goes on to ring 0 on the opposite side, so index −1 is ring 0 half a turn away, and
    /// −2 is ring 1. Indices beyond the last ring read the last.
    #[inline(always)]
    fn on_ring(&self, ring: N::Real, turn: N::Real, w: N::Real, efolds: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (lit, int) = (N::Real::lit, N::Index::lit);
        let opposite = ring.lt(lit(0.0));
        let ring = N::Real::select(opposite, lit(-1.0) - ring, ring).min(lit(self.layout.last_ring.into()));
        let turn = N::Real::select(opposite, turn + lit(0.5), turn);
        // Packets of four words in a ring's record.
        const PACKETS: u32 = Ring::WORDS as u32 / 4;
        // Index of the record's first packet, in packets like `rings_at`. `gather::<4>` counts packets, and
        // `gather::<1>` counts words, as `offset` does.
        let record = N::index(ring) * int(PACKETS) + int(self.layout.rings_at);
        let [offset, directions, w_count, knots_per_w] = N::gather::<4>(self.words, record, active);
        let rest = N::gather::<4>(self.words, record + int(1), active);
        let [knots_per_efold, knee_squared, zero_squared, _] = rest.map(N::from_bits);
        // Positions in knots, along the ring and over w. Four of the w_count coefficients over w are read from `row`
        // on, so the last interval begins at the knot w_count − 4.
        let per_turn = N::real(directions);
        let x = turn * per_turn;
        let y = w.fma(N::from_bits(knots_per_w), knots_per_efold * efolds);
        let column = x.floor();
        let row = y.floor().min(N::real(w_count) - lit(4.0));
        let direction_weights = cubic_b_spline_weights(x - column);
        let w_weights = cubic_b_spline_weights(y - row);
        // The four directions read are column − 1 to column + 2, modulo the number of directions. A turn lies in [−½,
        // 1], so one addition and at most one subtraction bring the first into range.
        let wrapped = N::index(column + per_turn - lit(1.0));
        let mut direction = wrapped - N::Index::select(directions.le(wrapped), directions, int(0));
        // Coefficient 0 over w belongs to the knot −1, so those of the knots row − 1 to row + 2 begin at `row`.
        let start = offset + N::index(row);
        // [channel][coefficient over w], so that four coefficients fill a vector.
        let mut sums = [[lit(0.0); 4]; 3];
        for direction_weight in direction_weights {
            let first = direction * w_count + start;
            // Read one by one, since `first` need not be a multiple of four, where packets begin.
            let words: [N::Index; 4] = array::from_fn(|j| {
                let [word] = N::gather::<1>(self.words, first + int(j as u32), active);
                word
            });
            for (sum, coefficients) in sums.iter_mut().zip(self.unpack(words)) {
                *sum = array::from_fn(|j| coefficients[j].fma(direction_weight, sum[j]));
            }
            let next = direction + int(1);
            direction = N::Index::select(next.lt(directions), next, int(0));
        }
        // The coefficients are those of F·(w² + knee²)/(w² + zero²), which varies less with w (`fit.rs`).
        let squared = w * w;
        let shape = (squared + zero_squared) / (squared + knee_squared);
        sums.map(|sum| (0..4).fold(lit(0.0), |total, j| w_weights[j].fma(sum[j], total)) * shape)
    }

    /// Coefficients of four words, `[channel][word]`. From bit 0 upwards a word has the mantissas of red, green and
    /// blue with nine bits each, and their common exponent with five bits (`pack.rs`).
    ///
    /// The nine stored bits m of a mantissa become the upper bits of a float's mantissa. With the exponent e of
    /// `pack.rs` the float is `(1 + m/512)·2^(e + 9)`. Subtracting `1.5·2^(e + 9)` leaves `(m − 256)·2^e` exactly.
    #[inline(always)]
    fn unpack(&self, words: [N::Index; 4]) -> [[N::Real; 4]; 3] {
        let int = N::Index::lit;
        let exponent_offset = int(self.layout.exponent_offset + MANTISSA_BITS);
        let powers = words.map(|word| ((word >> (3 * MANTISSA_BITS)) + exponent_offset) << 23);
        let excess = powers.map(|power| N::from_bits(power | int(1 << 22)));
        // Shifts that move red, green and blue to the bits 14 to 22.
        let shifts = [|word: N::Index| word << 14, |word| word << 5, |word| word >> 4];
        shifts.map(|shift| {
            array::from_fn(|j| {
                let bits = (shift(words[j]) & int(0x1ff << 14)) | powers[j];
                N::from_bits(bits) - excess[j]
            })
        })
    }
}

/// Coefficients of `atan(a)/(2πa)` in powers of a², for a in [0, 1]: a minimax fit that errs by at most 1e-8 turns.
const ATAN_TURNS: [f64; 8] = [
    1.591_548_4e-1,
    -5.304_612e-2,
    3.174_594_5e-2,
    -2.213_627e-2,
    1.534_603e-2,
    -8.898_719e-3,
    3.479_595e-3,
    -6.453_036_6e-4,
];

/// Direction of `(u, v)` in turns from +u towards +v, −½ to ½; 0 at the origin.
///
/// table.wgsl has the same polynomial, because WGSL allows `atan2` an error of 4096 units in the last place. This is up
/// to 0.7 of the spacing of coefficients along the ring with most of them, at the default coherence length.
#[inline(always)]
fn turns<R: Real>(u: R, v: R) -> R {
    let (abs_u, abs_v) = (u.abs(), v.abs());
    // The lower bound, about the smallest normal number, avoids 0/0 at the origin.
    let largest = abs_v.max(abs_u).max(R::lit(1e-37));
    let ratio = abs_v.min(abs_u) / largest;
    let octant = ratio * polynomial(ratio * ratio, &ATAN_TURNS);
    let quadrant = R::select(abs_u.lt(abs_v), R::lit(0.25) - octant, octant);
    let half = R::select(u.lt(R::lit(0.0)), R::lit(0.5) - quadrant, quadrant);
    R::select(v.lt(R::lit(0.0)), -half, half)
}

/// Weights of the values at −1, 0, 1, 2 in the cubic polynomial through them, at `t` in [0, 1].
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
