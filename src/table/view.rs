//! Look-up of the power spectrum S in a [`super::PackedTable`], generic over [`Numbers`].
//!
//! A look-up at the frequency f in cycles/µm and the phase rate κ in rad per µm of height reads `taps.x · taps.y` nodes
//! of the frequency lattice. A node's power or amplitude over κ is a header and a cubic spline. Of each node a look-up
//! reads the entry, and the packets of words that contain the four spline coefficients around κ. Packets begin at
//! multiples of their length, so six or eight coefficients are read, some with weights of zero: three packets of two or
//! two packets of four.
//!
//! Symbols are those of the [module](super), formulas of a node those of [`super::SpectralTable`], and the words of
//! entries and packets those of [`Format`]. Entries have a fixed number W of words, and so have packets:
//! `gather::<W>(words, i)` reads the words W·i to W·i + W − 1.
//!
//! `N` is a family of numbers (`src/numeric`). An `N::Real` is one number, a SIMD vector, or a *traced* variable,
//! whose operations the Mitsuba plugin records in kernels; an `N::Index` is likewise an unsigned integer. `lit` makes
//! constants.

use super::format::Format;
use super::kernel::InterpolationKernel;
use super::packed::PackedLayout;
use crate::numeric::math::{bf16_pair, cubic_b_spline, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use std::f64::consts::LOG2_E;

/// Largest number of nodes in a row that are read without a loop, so that recorded kernels need no loop within a loop.
/// A larger value makes kernels slow to compile. Presets with the default coherence length and tolerance read shorter
/// rows.
const UNROLLED_TAPS: u32 = 8;

/// Evaluator of a [`super::PackedTable`] over the numbers `N`.
///
/// ```
/// use sunbeam::numeric::Plain;
/// use sunbeam::table::TableView;
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let surface = Surface::new(&field, &Options { conserve_energy: false, ..Options::default() })?;
/// let table = surface.table();
/// let single: TableView<Plain<f32>> = TableView { layout: *table.layout(), words: table.words() };
/// let (f, kappa) = ([0.4, 0.0], 20.0);
/// let exact = table.density(f, kappa);
/// assert!((f64::from(single.density(f, kappa as f32, true)) - exact).abs() < 1e-4 * exact);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
pub struct TableView<N: Numbers> {
    /// Layout of the words.
    pub layout: PackedLayout,
    /// Table data, [`super::PackedTable::words`].
    pub words: N::Words,
}

/// First node that a look-up reads along an axis.
struct FirstTap<N: Numbers> {
    /// Index of the node, counted from the axis's first node.
    index: N::Index,
    /// Distance of the look-up's position from the node, in nodes.
    distance: N::Real,
}

impl<N: Numbers> TableView<N> {
    /// Power density `S(f; κ)` in µm², never negative, at `f` in cycles/µm and `kappa` in rad/µm. Meaningless where
    /// `active` is false.
    #[inline(always)]
    pub fn density(&self, f: [N::Double; 2], kappa: N::Real, active: N::Mask) -> N::Real {
        self.density_of(f, kappa, None, active)
    }

    /// [`TableView::density`] with the widths of all orders, but not their peaks, multiplied by `order_width_factor`,
    /// which is in (0, 1]. `None` stands for 1. Tables whose nodes are not diffraction orders need `None`.
    #[inline(always)]
    pub(crate) fn density_of(
        &self,
        f: [N::Double; 2],
        kappa: N::Real,
        order_width_factor: Option<N::Real>,
        active: N::Mask,
    ) -> N::Real {
        let layout = &self.layout;
        let lit = N::Real::lit;
        // Position in nodes from the node of frequency 0; nodes are 1/period apart.
        let position: [N::Double; 2] = std::array::from_fn(|axis| f[axis] * N::Double::lit(layout.period_um[axis]));
        let first: [FirstTap<N>; 2] = std::array::from_fn(|axis| self.first_tap(position[axis], axis));
        let curve = Curve::<N>::new(layout, kappa);
        let [re, im] = self.sum(&first, &curve, order_width_factor, active);
        let value = match layout.format {
            Format::Complex => re * re + im * im,
            // Where the power is about zero, the spline may be negative by the tolerance.
            Format::Fixed => {
                // Order zero is node (0, 0), so its distance is the position itself.
                let [x, y] = position.map(N::narrow);
                let weight =
                    self.kernel_weight(0, x, order_width_factor) * self.kernel_weight(1, y, order_width_factor);
                (re + self.order_zero(&curve, weight, &first)).max(lit(0.0))
            }
            Format::Single | Format::FixedFromZero => re.max(lit(0.0)),
        } * lit(layout.norm);
        if layout.cutoff.iter().all(|cutoff| cutoff.is_infinite()) {
            return value;
        }
        // S is zero beyond the frequencies that the pixels resolve.
        let [resolved_x, resolved_y]: [N::Mask; 2] =
            std::array::from_fn(|axis| position[axis].abs().le(N::Double::lit(layout.cutoff[axis])));
        N::Real::select(resolved_x & resolved_y, value, lit(0.0))
    }

    /// Weighted sum over the nodes that a look-up reads, with the components of [`TableView::node`].
    #[inline(always)]
    fn sum(
        &self,
        [first_x, first_y]: &[FirstTap<N>; 2],
        curve: &Curve<N>,
        order_width_factor: Option<N::Real>,
        active: N::Mask,
    ) -> [N::Real; 2] {
        let (lit, int) = (N::Real::lit, N::Index::lit);
        let [taps_x, taps_y] = self.layout.taps;
        // Nodes in a row of the lattice.
        let columns = int(2 * self.layout.reach[0] + 1);
        // Weights of the columns. Single numbers and SIMD vectors compute them once for all rows.
        let weight_x =
            N::tabulated(taps_x, |i| self.kernel_weight(0, first_x.distance - N::real(i), order_width_factor));
        let add_node = |node: N::Index, weight: N::Real, [re, im]: [N::Real; 2]| {
            let [a, b] = self.node(curve, node, active);
            [weight.fma(a, re), weight.fma(b, im)]
        };
        let add_row = |iy: N::Index, sum: [N::Real; 2]| {
            let first = (first_y.index + iy) * columns + first_x.index;
            let row_sum = if taps_x <= UNROLLED_TAPS {
                (0..taps_x).fold([lit(0.0); 2], |sum, ix| add_node(first + int(ix), weight_x(int(ix)), sum))
            } else {
                let start = (int(0), [lit(0.0); 2]);
                let go_on = |(ix, _): (N::Index, [N::Real; 2])| active & ix.lt(int(taps_x));
                let step = |(ix, sum): (N::Index, [N::Real; 2])| (ix + int(1), add_node(first + ix, weight_x(ix), sum));
                // The text labels the loop in recorded kernels. The first part of the state is the index.
                N::while_loop(c"orders of a row", start, go_on, step).1
            };
            let weight_y = self.kernel_weight(1, first_y.distance - N::real(iy), order_width_factor);
            std::array::from_fn(|part| weight_y.fma(row_sum[part], sum[part]))
        };
        // A single row needs no loop in recorded kernels.
        if taps_y == 1 {
            add_row(int(0), [lit(0.0); 2])
        } else {
            let start = (int(0), [lit(0.0); 2]);
            let go_on = |(iy, _): (N::Index, [N::Real; 2])| active & iy.lt(int(taps_y));
            N::while_loop(c"diffraction orders", start, go_on, |(iy, sum)| (iy + int(1), add_row(iy, sum))).1
        }
    }

    /// Weight of a node at a distance in nodes along an axis, with the `order_width_factor` of
    /// [`TableView::density_of`].
    #[inline(always)]
    fn kernel_weight(&self, axis: usize, distance: N::Real, order_width_factor: Option<N::Real>) -> N::Real {
        let distance = order_width_factor.map_or(distance, |factor| distance / factor);
        kernel_weight(self.layout.kernel[axis], distance)
    }

    /// Contribution of `P(0)` of order zero, which entries of [`Format::Fixed`] leave out; all other nodes have
    /// `P(0) = 0`. `weight` is the kernel's weight of order zero. Zero unless order zero is among the nodes read, from
    /// `first` on.
    #[inline(always)]
    fn order_zero(&self, curve: &Curve<N>, weight: N::Real, first: &[FirstTap<N>; 2]) -> N::Real {
        let layout = &self.layout;
        let is_read_along = |axis: usize| {
            let index = N::Index::lit(layout.reach[axis]);
            let first = first[axis].index;
            first.le(index) & index.lt(first + N::Index::lit(layout.taps[axis]))
        };
        let contribution = weight * curve.header_factors[0] * N::Real::lit(layout.zero);
        N::Real::select(is_read_along(0) & is_read_along(1), contribution, N::Real::lit(0.0))
    }

    /// First node that a look-up at `position` (in nodes) reads along an axis; counterpart of
    /// [`super::LatticeAxis::first_tap`].
    #[inline(always)]
    fn first_tap(&self, position: N::Double, axis: usize) -> FirstTap<N> {
        let lit = N::Double::lit;
        let (taps, reach) = (f64::from(self.layout.taps[axis]), f64::from(self.layout.reach[axis]));
        let first = (position - lit(0.5 * taps)).ceil().clip(lit(-reach), lit(reach + 1.0 - taps));
        FirstTap { index: N::index_of_double(first + lit(reach)), distance: N::narrow(position - first) }
    }

    /// Power of a node and 0, or real and imaginary part of its amplitude. `node` is its row-major index in the
    /// lattice. In [`Format::Fixed`] the power lacks the term of `P(0)`.
    #[inline(always)]
    fn node(&self, curve: &Curve<N>, node: N::Index, active: N::Mask) -> [N::Real; 2] {
        let lit = N::Real::lit;
        // `start` is the index of the node's first packet.
        let packet = |start: N::Index, number: u32| start + curve.packet + N::Index::lit(number);
        match self.layout.format {
            Format::Fixed => {
                let [start, scale] = N::gather::<2>(self.words, node, active);
                [curve.spline_factor[0] * self.fixed(curve, scale, |i| packet(start, i), active), lit(0.0)]
            }
            Format::FixedFromZero => {
                let [start, scale, zero, slope] = N::gather::<4>(self.words, node, active);
                let spline = self.fixed(curve, scale, |i| packet(start, i), active);
                let header = curve.header(N::from_bits(zero), N::from_bits(slope));
                [curve.spline_factor[0].fma(spline, header), lit(0.0)]
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
                let header = curve.header(N::from_bits(zero), N::from_bits(slope));
                [curve.spline_factor[0].fma(spline, header), lit(0.0)]
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
                let [a, b] = curve.spline_factor;
                [N::from_bits(re) + a * spline[0] - b * spline[1], N::from_bits(im) + a * spline[1] + b * spline[0]]
            }
        }
    }

    /// Spline of the fixed-point coefficients `low + step·i` in the packets `packet(0)` to `packet(2)`. `scale` is the
    /// word of `low` and `step`.
    #[inline(always)]
    fn fixed(&self, curve: &Curve<N>, scale: N::Index, packet: impl Fn(u32) -> N::Index, active: N::Mask) -> N::Real {
        // Spline of the integers. Its weights sum to one, so `low` is added once.
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

/// [`InterpolationKernel::weight`] at distances within its support.
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

/// Weights of the numbers in a node's record at one κ, as in [`super::NodeCurve`]. With κ₀ = `kappa_knee` and the
/// spline Q, a power is `P(κ) = header_factors · [P(0), P'(0)] + spline_factor·Q(κ)`, where P(0) and P'(0) are its
/// *header*. An amplitude is `D(κ) = D(0) + spline_factor·Q(κ)`.
struct Curve<N: Numbers> {
    /// First packet read, in packets from the start of a node's coefficients.
    packet: N::Index,
    /// Weights of eight coefficients, from the first of that packet on. At most four of them, in a row, are not zero.
    /// Formats with packets of two coefficients use the first six.
    weights: [N::Real; 8],
    /// `κ²/(κ² + κ₀²)` and 0 for powers, real and imaginary part of `κ/(κ + iκ₀)` for amplitudes.
    spline_factor: [N::Real; 2],
    /// `κ₀²/(κ² + κ₀²)` and `κκ₀²/(κ² + κ₀²)`.
    header_factors: [N::Real; 2],
}

impl<N: Numbers> Curve<N> {
    /// Weights at `kappa` in rad/µm, clamped to the table's range.
    #[inline(always)]
    fn new(layout: &PackedLayout, kappa: N::Real) -> Self {
        let lit = N::Real::lit;
        // A packet has 2^shift coefficients.
        let shift = layout.format.packet_coefficients().ilog2();
        let kappa = kappa.clip(lit(0.0), lit(layout.kappa_max));
        let t = kappa / lit(layout.kappa_step);
        let packet = N::index(t) >> shift;
        // Position in knots from that of the packet's first coefficient: coefficient i belongs to the knot i − 1.
        let offset = t - N::real(packet << shift) + lit(1.0);
        // κ₀ is positive, so the divisors are not zero.
        let knee_squared = lit(layout.kappa_knee * layout.kappa_knee);
        let squares = kappa.fma(kappa, knee_squared);
        let kappa_per_squares = kappa / squares;
        Self {
            packet,
            weights: std::array::from_fn(|i| cubic_b_spline(offset - lit(i as f64))),
            spline_factor: match layout.format {
                // κ/(κ + iκ₀) = (κ² − iκκ₀)/(κ² + κ₀²).
                Format::Complex => [kappa * kappa_per_squares, -kappa_per_squares * lit(layout.kappa_knee)],
                Format::Fixed | Format::FixedFromZero | Format::Single => [kappa * kappa_per_squares, lit(0.0)],
            },
            header_factors: [knee_squared / squares, knee_squared * kappa_per_squares],
        }
    }

    /// Contribution of a power's header: `zero` is P(0), `slope` is P'(0).
    #[inline(always)]
    fn header(&self, zero: N::Real, slope: N::Real) -> N::Real {
        self.header_factors[1].fma(slope, self.header_factors[0] * zero)
    }
}
