//! Look-up in a [`super::PackedTable`], generic over the family of numbers (numeric/mod.rs).
//!
//! - `p = f·P`: position in nodes, for each axis. `e`: interpolation kernel (kernel.rs).
//! - Sum over `taps` nodes: `Σ_y e(p_y − y)·Σ_x e(p_x − x)·value(x, y; κ)`, row by row.
//! - `value`: power or amplitude of a node from its packed record (packed.rs), by the formulas of lookup.rs.
//! - `t = κ/Δ`: position among the knots. The packets read begin at or before the coefficient ⌊t⌋; a coefficient's
//!   weight is the B-spline at its distance from `t`, zero outside its support.

use super::kernel::InterpolationKernel;
use super::packed::{Format, PackedLayout};
use crate::numeric::math::{bf16_pair, cubic_b_spline, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use std::f64::consts::LOG2_E;

/// Largest number of taps along x that are written out without a loop. Chosen: loops cost more in recorded kernels,
/// long code costs compile time. It does not change results.
const UNROLLED_TAPS: u32 = 8;

/// A [`super::PackedTable`] over table data that a family of numbers reads.
#[derive(Clone, Copy)]
pub struct TableView<N: Numbers> {
    /// Sizes and constants of the table.
    pub layout: PackedLayout,
    /// Table data.
    pub words: N::Words,
}

impl<N: Numbers> TableView<N> {
    /// The power density `S(f; κ)` in µm², never negative, at the frequency `f` (cycles/µm) and `kappa` (rad/µm).
    #[inline(always)]
    pub fn density(&self, f: [N::Double; 2], kappa: N::Real, active: N::Mask) -> N::Real {
        let layout = &self.layout;
        let (lit, int) = (N::Real::lit, N::Index::lit);
        let position: [N::Double; 2] = std::array::from_fn(|axis| f[axis] * N::Double::lit(layout.period_um[axis]));
        let [(column, from_x), (row, from_y)] = std::array::from_fn(|axis| self.first_tap(position[axis], axis));
        let curve = Curve::<N>::new(layout, kappa);
        let [taps_x, taps_y] = layout.taps;
        let columns = int(2 * layout.reach[0] + 1);
        let ex = N::tabulated(taps_x, |i| kernel_weight(layout.kernel[0], from_x - N::real(i)));
        let tap = |node: N::Index, e: N::Real, [re, im]: [N::Real; 2]| {
            let [a, b] = self.node(&curve, node, active);
            [e.fma(a, re), e.fma(b, im)]
        };
        let in_row = |iy: N::Index, sum: [N::Real; 2]| {
            let first = (row + iy) * columns + column;
            let row_sum = if taps_x <= UNROLLED_TAPS {
                (0..taps_x).fold([lit(0.0); 2], |sum, ix| tap(first + int(ix), ex(int(ix)), sum))
            } else {
                let start = (int(0), [lit(0.0); 2]);
                let go_on = |(ix, _): (N::Index, [N::Real; 2])| active & ix.lt(int(taps_x));
                N::while_loop(c"orders of a row", start, go_on, |(ix, sum)| (ix + int(1), tap(first + ix, ex(ix), sum)))
                    .1
            };
            let ey = kernel_weight(layout.kernel[1], from_y - N::real(iy));
            std::array::from_fn(|part| ey.fma(row_sum[part], sum[part]))
        };
        let [re, im] = if taps_y == 1 {
            in_row(int(0), [lit(0.0); 2])
        } else {
            let start = (int(0), [lit(0.0); 2]);
            let go_on = |(iy, _): (N::Index, [N::Real; 2])| active & iy.lt(int(taps_y));
            N::while_loop(c"diffraction orders", start, go_on, |(iy, sum)| (iy + int(1), in_row(iy, sum))).1
        };
        let value = match layout.format {
            Format::Complex => re * re + im * im,
            Format::Fixed => {
                // Order zero adds its power at κ = 0 where it is among the nodes read.
                let zero = |first: N::Index, axis: usize| {
                    let number = int(layout.reach[axis]);
                    first.le(number) & number.lt(first + int(layout.taps[axis]))
                };
                let [x, y] = position.map(N::narrow);
                let e = kernel_weight(layout.kernel[0], x) * kernel_weight(layout.kernel[1], y);
                let value = e * curve.from_zero[0] * lit(layout.zero);
                let at_zero = N::Real::select(zero(column, 0) & zero(row, 1), value, lit(0.0));
                // A spline may undershoot a zero of the power by the tolerance.
                (re + at_zero).max(lit(0.0))
            }
            Format::Single | Format::FixedFromZero => re.max(lit(0.0)),
        } * lit(layout.norm);
        if layout.cutoff.iter().all(|cutoff| cutoff.is_infinite()) {
            return value;
        }
        let [x, y]: [N::Mask; 2] =
            std::array::from_fn(|axis| position[axis].abs().le(N::Double::lit(layout.cutoff[axis])));
        N::Real::select(x & y, value, lit(0.0))
    }

    /// Index of the first node that a look-up at `position` (in nodes) reads along an axis, from node −reach, and the
    /// distance from this node to the position. As [`super::LatticeAxis::first_tap`].
    #[inline(always)]
    fn first_tap(&self, position: N::Double, axis: usize) -> (N::Index, N::Real) {
        let lit = N::Double::lit;
        let (taps, reach) = (f64::from(self.layout.taps[axis]), f64::from(self.layout.reach[axis]));
        let first = (position - lit(0.5 * taps)).ceil().clip(lit(-reach), lit(reach + 1.0 - taps));
        (N::index_of_double(first + lit(reach)), N::narrow(position - first))
    }

    /// A node's power and zero, or the real and the imaginary part of its amplitude.
    #[inline(always)]
    fn node(&self, curve: &Curve<N>, node: N::Index, active: N::Mask) -> [N::Real; 2] {
        let lit = N::Real::lit;
        let packet = |start: N::Index, number: u32| start + curve.packet + N::Index::lit(number);
        match self.layout.format {
            Format::Fixed => {
                let [start, scale] = N::gather::<2>(self.words, node, active);
                [curve.factor[0] * self.fixed(curve, scale, |i| packet(start, i), active), lit(0.0)]
            }
            Format::FixedFromZero => {
                let [start, scale, zero, slope] = N::gather::<4>(self.words, node, active);
                let spline = self.fixed(curve, scale, |i| packet(start, i), active);
                let at_zero = curve.at_zero(N::from_bits(zero), N::from_bits(slope));
                [curve.factor[0].fma(spline, at_zero), lit(0.0)]
            }
            Format::Single => {
                let [start, zero, slope, _] = N::gather::<4>(self.words, node, active);
                let mut spline = lit(0.0);
                for i in 0..2 {
                    let words = N::gather::<4>(self.words, packet(start, i as u32), active);
                    for (word, weight) in words.into_iter().zip(&curve.weights[4 * i..]) {
                        spline = weight.fma(N::from_bits(word), spline);
                    }
                }
                let at_zero = curve.at_zero(N::from_bits(zero), N::from_bits(slope));
                [curve.factor[0].fma(spline, at_zero), lit(0.0)]
            }
            Format::Complex => {
                let [start, re, im, _] = N::gather::<4>(self.words, node, active);
                let mut spline = [lit(0.0); 2];
                for i in 0..3 {
                    let words = N::gather::<4>(self.words, packet(start, i as u32), active);
                    for (pair, weight) in words.chunks_exact(2).zip(&curve.weights[2 * i..]) {
                        spline = std::array::from_fn(|part| weight.fma(N::from_bits(pair[part]), spline[part]));
                    }
                }
                let [a, b] = curve.factor;
                [N::from_bits(re) + a * spline[0] - b * spline[1], N::from_bits(im) + a * spline[1] + b * spline[0]]
            }
        }
    }

    /// Spline of 16-bit coefficients, `low + step·Σ weight·integer`. The weights sum to one, so `low` is added once.
    #[inline(always)]
    fn fixed(&self, curve: &Curve<N>, scale: N::Index, packet: impl Fn(u32) -> N::Index, active: N::Mask) -> N::Real {
        let mut steps = N::Real::lit(0.0);
        for i in 0..3 {
            let [word] = N::gather::<1>(self.words, packet(i as u32), active);
            let [a, b] = u16_pair::<N>(word);
            steps = curve.weights[2 * i + 1].fma(b, curve.weights[2 * i].fma(a, steps));
        }
        let [low, step] = bf16_pair::<N>(scale);
        step.fma(steps, low)
    }
}

/// [`InterpolationKernel::weight`] in a family of numbers, for distances within the kernel's radius.
#[inline(always)]
fn kernel_weight<R: Real>(kernel: InterpolationKernel, distance: R) -> R {
    let lit = R::lit;
    match kernel {
        InterpolationKernel::Gaussian { sigma } => (distance * distance * lit(-0.5 * LOG2_E / (sigma * sigma))).exp2(),
        InterpolationKernel::Semicircle { beta, radius } => {
            let rest = (distance * distance).fma(lit(-1.0 / (radius * radius)), lit(1.0)).max(lit(0.0));
            rest.sqrt().fma(lit(beta * LOG2_E), lit(-beta * LOG2_E)).exp2()
        }
    }
}

/// Weights with which records are read at one κ.
struct Curve<N: Numbers> {
    /// First packet to read, from the start of a record.
    packet: N::Index,
    /// Weights of the coefficients from the first of that packet on.
    weights: [N::Real; 8],
    /// Factor of the spline as real and imaginary part: `κ²/(κ²+κ₀²)` of powers, `κ/(κ + iκ₀)` of amplitudes.
    factor: [N::Real; 2],
    /// Factors of a power and of its slope at κ = 0: `κ₀²/(κ²+κ₀²)` and `κκ₀²/(κ²+κ₀²)`.
    from_zero: [N::Real; 2],
}

impl<N: Numbers> Curve<N> {
    #[inline(always)]
    fn new(layout: &PackedLayout, kappa: N::Real) -> Self {
        let lit = N::Real::lit;
        let shift = layout.format.packet().1.ilog2();
        let kappa = kappa.clip(lit(0.0), lit(layout.kappa_max));
        let t = kappa / lit(layout.kappa_step);
        let packet = N::index(t) >> shift;
        // Coefficient i belongs to the knot i − 1.
        let offset = t - N::real(packet << shift) + lit(1.0);
        let knee = lit(layout.kappa_knee * layout.kappa_knee);
        let squares = kappa.fma(kappa, knee);
        let per_squares = kappa / squares;
        Self {
            packet,
            weights: std::array::from_fn(|i| cubic_b_spline(offset - lit(i as f64))),
            factor: match layout.format {
                Format::Complex => [kappa * per_squares, -per_squares * lit(layout.kappa_knee)],
                _ => [kappa * per_squares, lit(0.0)],
            },
            from_zero: [knee / squares, knee * per_squares],
        }
    }

    /// Contribution of a power and of its slope at κ = 0 to the power at this κ.
    #[inline(always)]
    fn at_zero(&self, power: N::Real, slope: N::Real) -> N::Real {
        self.from_zero[1].fma(slope, self.from_zero[0] * power)
    }
}
