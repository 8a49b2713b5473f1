//! The diffraction orders of a tile, and the sum over a neighbourhood of them (Single 2014, docs/model.md#sources).
//!
//! | symbol | meaning |
//! | --- | --- |
//! | q = wi + wo = (u, v, w) | scattering vector |
//! | f = (u, v)/λ, κ = 2πw/λ | frequency in cycles/µm, phase rate in rad/µm: a point at height h has the phase κh |
//! | (Lx, Ly) | extent of the tile in µm |
//! | h, H | heights about the middle of their range, and half of this range, in µm |
//! | j = (jx, jy) | order of frequency f_j = (jx/Lx, jy/Ly) |
//! | c_j(κ) = Σ_n weight_n(κH)·term_{j,n} | amplitude of an order (weights: term_weights.rs) |
//! | term_{j,n} | Fourier coefficient j of T_n(h/H) (Chebyshev series) or (h/H)ⁿ (Taylor series) |
//! | p = (u·Lx, v·Ly)/λ | *position* of q among the orders: order j is at p = j |
//! | s | standard deviation of the coherence window in µm |
//! | sharpness = 2π²s²/L² | factor in the window's Gaussian over p along an axis, `exp(−sharpness·(p − j)²)` |
//! | S | power spectrum of exp(iκh) in µm², within one window at a fixed position (*patch model*, docs/model.md) |
//!
//! The amplitudes of neighbouring orders add up with the window's Gaussian over p. The *neighbourhood* is the number of
//! orders summed along each axis, those nearest to p:
//!
//! `S = 4πs²·|Σ_j c_j·exp(−2π²s²|f − f_j|²)|²`

use super::bessel::TERMS_MAX;
use super::options::{NEIGHBOURHOOD_MAX, check_window_and_tolerance};
use super::order_grid::{OrderGrid, TERMS_MULTIPLE};
use super::term_weights::TermWeights;
use super::{MethodError, MethodOptions, WAVELENGTH_MIN_UM};
use crate::height_field::HeightField;
use crate::table::{CoherenceWindow, Progress};
use crate::transform::{Series, TermTransform, chebyshev_terms, taylor_terms};
use arrayvec::ArrayVec;
use rayon::prelude::*;
use std::f32::consts::FRAC_1_SQRT_2;
use std::f64::consts::PI;
use std::sync::Arc;
use sunbeam_fourier::num_complex::Complex32;

/// Largest exponent x of a factor e⁻ˣ or eˣ of an amplitude. The squares e^{±60} lie within the range of single
/// precision, with room for sums. Gaussians below e⁻³⁰ are neglected: their power is below 1e-26 of the peak.
pub(super) const EXPONENT_MAX: f32 = 30.0;
/// Largest κH of the Taylor series, whose terms reach e^κH before they cancel. This only prevents overflow: rounding,
/// up to about 1e-7·e^κH, exceeds the usual tolerances far below this limit.
pub const TAYLOR_KAPPA_H_MAX: f64 = EXPONENT_MAX as f64;
/// Largest size in bytes of the orders of a tile. Chosen to bound the memory of a method; larger values allow larger
/// tiles and deeper reliefs.
pub const ORDERS_BYTES_MAX: usize = 512 << 20;

/// Largest w of two directions: both along the normal.
const W_MAX: f64 = 2.0;

/// 1.5·2²³. Adding this to a number of magnitude below 2²² and subtracting it again rounds the number to a whole one,
/// halves to even. This takes two instructions on any processor, unlike `f32::round`. Positions are far smaller: `2L/λ`
/// is below 6000 for a tile of a millimetre.
const ROUNDING_BIAS: f32 = 1.5 / f32::EPSILON;

/// The Fourier coefficients term_{j,n} of every order that light from 380 to 780 nm can reach. The tile repeats.
///
/// They are stored as `[jy][jx][pair]` with jy from 0 and jx from −reach. A pair `[re, im, re, im]` has a term of even
/// n and the term of n + 1. Orders with negative jy follow from `term_{−j,n} = conj term_{j,n}`, since heights are
/// real.
///
/// With an even number of pixels, the Fourier coefficient at half the sampling rate represents the orders of both
/// signs. Each gets half of its power, `√½` of its amplitude, as in [`crate::lobe::Exact`].
#[derive(Clone)]
pub(super) struct Orders {
    /// Lattice of the orders, and the numbers of terms and orders that an evaluation sums.
    pub grid: OrderGrid,
    /// Number of terms of the series. `grid.terms` is this number rounded up; the terms beyond it are zeros.
    count: usize,
    /// Pairs of coefficients, `grid.terms / 2` of each order.
    terms: Arc<Vec<[f32; 4]>>,
}

/// Largest numbers of terms and orders that an evaluation sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderCounts {
    /// Terms of the series.
    pub terms: usize,
    /// Orders along each axis.
    pub neighbourhood: usize,
}

impl Orders {
    /// Computes the orders of `field` for a coherence length in µm, four standard deviations of the window.
    ///
    /// Unless the options give them, the number of terms and the neighbourhood follow from `tolerance`. It bounds the
    /// error of an amplitude without rounding; order 0 of a flat tile has the amplitude 1. `progress` advances with
    /// each pair of terms.
    ///
    /// # Errors
    /// [`MethodError`]: arguments beyond their ranges, a relief that is too deep, a neighbourhood that is too wide, or
    /// too many bytes.
    pub(super) fn new(
        field: &HeightField,
        coherence_length_um: f64,
        tolerance: f64,
        options: &MethodOptions,
        progress: &Progress,
    ) -> Result<Self, MethodError> {
        options.validate()?;
        check_window_and_tolerance(coherence_length_um, tolerance)?;
        let transform = TermTransform::<f32>::new(field, options.series);
        let count = term_count(transform.half_range_um(), tolerance, options)?;
        let terms = count.next_multiple_of(TERMS_MULTIPLE);
        let (nx, ny) = field.size();
        let (lx, ly) = field.extent_um();
        let window = CoherenceWindow::new(coherence_length_um);
        let sharpness = [lx, ly].map(|l| 2.0 * (PI * window.sigma_um() / l).powi(2));
        let neighbourhood = required_neighbourhood(sharpness, [nx, ny], tolerance, options)?;
        let reach = [stored_reach(nx, lx, neighbourhood), stored_reach(ny, ly, neighbourhood)];
        check_bytes(reach, terms)?;
        let grid = OrderGrid {
            extent_um: [lx as f32, ly as f32],
            sharpness: sharpness.map(|a| a as f32),
            reach: reach.map(|r| r as i32),
            terms: terms as u32,
            series: match options.series {
                Series::Chebyshev => 0,
                Series::Taylor => 1,
            },
            half_range_um: transform.half_range_um() as f32,
            peak_um2: window.order_peak_um2() as f32,
            neighbourhood: neighbourhood as u32,
            full_terms_kappa_h: match options.terms {
                // All terms are summed at any κH.
                Some(_) => 0.0,
                // For each unit of κH below this number, one term less is summed. At the largest κH `count` terms are
                // summed, and never the zeros that fill up `terms`.
                None => (kappa_h_max(transform.half_range_um()) + (terms - count) as f64) as f32,
            },
        };
        Ok(Self { grid, count, terms: Arc::new(pack(&transform, [nx, ny], reach, count, progress)) })
    }

    /// The orders with the neighbourhood that `tolerance` requires, or the present one if that is smaller.
    pub(super) fn narrowed(&self, tolerance: f64) -> Self {
        let needed = self.grid.sharpness.map(|sharpness| orders_needed(sharpness.into(), tolerance) as u32);
        let neighbourhood = self.grid.neighbourhood.min(needed[0].max(needed[1]));
        Self { grid: OrderGrid { neighbourhood, ..self.grid }, ..self.clone() }
    }

    /// Largest numbers of terms and orders that an evaluation sums.
    pub(super) fn counts(&self) -> OrderCounts {
        OrderCounts { terms: self.count, neighbourhood: self.grid.neighbourhood as usize }
    }

    /// The terms as the shaders read them.
    pub(super) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.terms.as_slice())
    }

    /// `p = (u·Lx, v·Ly)/λ`, the position of `q` among the orders.
    pub(super) fn position(&self, q: [f32; 3], wavelength_um: f32) -> [f32; 2] {
        [0, 1].map(|axis| q[axis] / wavelength_um * self.grid.extent_um[axis])
    }

    /// The order nearest to a position, and the position minus that of the order.
    pub(super) fn nearest(position: [f32; 2]) -> ([i32; 2], [f32; 2]) {
        let order = position.map(|p| floor(p + 0.5));
        (order, [0, 1].map(|axis| position[axis] - order[axis] as f32))
    }

    /// Whether an order is stored, or follows from a stored one by conjugation.
    pub(super) fn holds(&self, order: [i32; 2]) -> bool {
        (0..2).all(|axis| order[axis].unsigned_abs() <= self.grid.reach[axis].unsigned_abs())
    }

    /// `c_j` as `[re, im]` of an order for which [`Orders::holds`] is true.
    pub(super) fn amplitude(&self, order: [i32; 2], weights: &TermWeights) -> [f32; 2] {
        let OrderGrid { reach, terms, .. } = self.grid;
        // Order j or −j is stored: the one with jy ≥ 0.
        let sign = if order[1] < 0 { -1 } else { 1 };
        let row = (sign * order[1]) * (2 * reach[0] + 1);
        let first = (row + sign * order[0] + reach[0]) as usize * (terms as usize / 2);
        // Sums over even terms (re, im) and over odd ones (re, im). Weights come in the same order, each of them twice:
        // [even, even, odd, odd].
        let mut sum = [0.0f32; 4];
        for (term, weight) in self.terms[first..first + weights.len()].iter().zip(weights) {
            (0..4).for_each(|part| sum[part] += term[part] * weight[part]);
        }
        // The even sum plus i times the odd one: weights leave out the factor i of odd terms. Where −j is stored, the
        // sums of j are the conjugates of both.
        let sign = sign as f32;
        [sum[0] - sign * sum[3], sign * sum[1] + sum[2]]
    }

    /// Computes S in µm² at several wavelengths. Each wavelength in µm comes with a value of the caller. `receive` is
    /// called with wavelength, value and S. Wavelengths at which the Gaussian of every order is neglected are left out.
    pub(super) fn densities<T>(
        &self,
        q: [f32; 3],
        wavelengths_um: impl Iterator<Item = (f32, T)>,
        mut receive: impl FnMut(f32, T, f32),
    ) {
        let reaching = wavelengths_um.filter_map(|(um, value)| {
            let position = self.position(q, um);
            self.is_reached(position).then_some((um, (position, value)))
        });
        self.grid.at_wavelengths(q[2], reaching, |um, (position, value), weights| {
            receive(um, value, self.density(position, weights));
        });
    }

    /// S in µm² at one wavelength in µm.
    pub(super) fn density_at(&self, q: [f32; 3], wavelength_um: f32) -> f32 {
        let mut found = 0.0;
        self.densities(q, std::iter::once((wavelength_um, ())), |_, (), density| found = density);
        found
    }

    /// Whether the exponent of the nearest stored order's Gaussian is at most [`EXPONENT_MAX`] at a position. This
    /// limits the sum over both axes; [`Orders::neighbours`] limits each axis.
    #[inline]
    fn is_reached(&self, position: [f32; 2]) -> bool {
        let exponent = |axis: usize| {
            let reach = self.grid.reach[axis] as f32;
            // The position rounded to a whole number.
            let nearest = (position[axis] + ROUNDING_BIAS) - ROUNDING_BIAS;
            let distance = position[axis] - nearest.max(-reach).min(reach);
            self.grid.sharpness[axis] * distance * distance
        };
        exponent(0) + exponent(1) <= EXPONENT_MAX
    }

    /// S in µm² at a position: the sum over a block of the nearest orders.
    fn density(&self, position: [f32; 2], weights: &TermWeights) -> f32 {
        // A single order needs no sum of amplitudes, so the square of its Gaussian is computed directly.
        if self.grid.neighbourhood == 1 {
            let (order, distance) = Self::nearest(position);
            if !self.holds(order) {
                return 0.0;
            }
            let c = self.amplitude(order, weights);
            let exponent = (0..2).map(|axis| self.grid.sharpness[axis] * distance[axis] * distance[axis]).sum::<f32>();
            return self.grid.peak_um2 * (-2.0 * exponent).exp() * (c[0] * c[0] + c[1] * c[1]);
        }
        let (mut columns, mut rows) = (Gaussians::new(), Gaussians::new());
        columns.extend(self.neighbours(0, position[0]));
        rows.extend(self.neighbours(1, position[1]));
        let mut sum = [0.0f32; 2];
        for &(jy, gaussian_y) in &rows {
            for &(jx, gaussian_x) in &columns {
                let c = self.amplitude([jx, jy], weights);
                sum[0] += gaussian_x * gaussian_y * c[0];
                sum[1] += gaussian_x * gaussian_y * c[1];
            }
        }
        self.grid.peak_um2 * (sum[0] * sum[0] + sum[1] * sum[1])
    }

    /// The `neighbourhood` nearest orders along an axis, with their Gaussians at a position. Orders that are not stored
    /// and Gaussians that are neglected are left out.
    fn neighbours(&self, axis: usize, position: f32) -> impl Iterator<Item = (i32, f32)> {
        let OrderGrid { reach, sharpness, neighbourhood, .. } = self.grid;
        let (reach, count) = (reach[axis], neighbourhood as i32);
        // The `count` nearest orders lie in (position − count/2, position + count/2].
        let first = floor(position - 0.5 * count as f32) + 1;
        (first.max(-reach)..=(first + count - 1).min(reach)).filter_map(move |j| {
            let exponent = sharpness[axis] * (position - j as f32) * (position - j as f32);
            (exponent < EXPONENT_MAX).then(|| (j, (-exponent).exp()))
        })
    }
}

/// Orders along an axis, each with its Gaussian at a position.
type Gaussians = ArrayVec<(i32, f32), NEIGHBOURHOOD_MAX>;

/// `f32::floor` as an integer, inlined: the standard function is a call on processors below SSE 4.1.
fn floor(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero.saturating_sub(i32::from(towards_zero as f32 > x))
}

/// Largest order to store along an axis of `pixels` pixels, for light from 380 to 780 nm.
fn stored_reach(pixels: usize, extent_um: f64, neighbourhood: usize) -> usize {
    // |u|, |v| ≤ 2, so |p| is at most 2L/λ. Up to half of the neighbourhood of p lies beyond p. A tile of n pixels has
    // orders up to n/2.
    let position_max = (2.0 * extent_um / f64::from(WAVELENGTH_MIN_UM)).ceil() as usize;
    position_max.saturating_add(neighbourhood / 2 + 1).min(pixels / 2)
}

/// Checks the size of the orders up to `reach` along x and y, with `terms` terms each.
///
/// # Errors
/// [`MethodError::TooLarge`] above [`ORDERS_BYTES_MAX`].
fn check_bytes(reach: [usize; 2], terms: usize) -> Result<(), MethodError> {
    // A term has 8 bytes. Orders of negative jy are not stored.
    let needed = (2 * reach[0] + 1).saturating_mul(reach[1] + 1).saturating_mul(8 * terms);
    if needed <= ORDERS_BYTES_MAX {
        return Ok(());
    }
    let mb = |bytes: usize| bytes as f64 / 1e6;
    Err(MethodError::TooLarge { needed_mb: mb(needed), limit_mb: mb(ORDERS_BYTES_MAX) })
}

/// Largest κH: that of 380 nm with both directions along the normal.
fn kappa_h_max(half_range_um: f64) -> f64 {
    2.0 * PI * W_MAX / f64::from(WAVELENGTH_MIN_UM) * half_range_um
}

/// Number of terms: the given one, or the number with which the remainder of the series is below a tenth of the
/// tolerance for every κ up to the largest. The orders left out may take half of the tolerance.
///
/// # Errors
/// [`MethodError::TooManyTerms`] and [`MethodError::TaylorRange`].
fn term_count(half_range_um: f64, tolerance: f64, options: &MethodOptions) -> Result<usize, MethodError> {
    let kappa_h = kappa_h_max(half_range_um);
    if options.series == Series::Taylor && kappa_h > TAYLOR_KAPPA_H_MAX {
        return Err(MethodError::TaylorRange { kappa_h, limit: TAYLOR_KAPPA_H_MAX });
    }
    // A series needs more than κH terms, so a κH above TERMS_MAX is refused even if the options give the number.
    let needed = (kappa_h <= TERMS_MAX as f64).then(|| {
        options.terms.unwrap_or_else(|| match options.series {
            Series::Chebyshev => chebyshev_terms(kappa_h, 0.1 * tolerance),
            Series::Taylor => taylor_terms(kappa_h, 0.1 * tolerance),
        })
    });
    needed.filter(|terms| *terms <= TERMS_MAX).ok_or(MethodError::TooManyTerms { kappa_h, limit: TERMS_MAX })
}

/// Number n of orders along an axis with which the Gaussians left out are below half the tolerance. The nearest of
/// these is at least n/2 away, so `exp(−sharpness·(n/2)²) = tolerance/2`.
fn orders_needed(sharpness: f64, tolerance: f64) -> f64 {
    let needed = 2.0 * ((0.5 * tolerance).recip().ln() / sharpness).sqrt();
    needed.ceil().max(1.0)
}

/// Number of orders along each axis: the given one, at most [`NEIGHBOURHOOD_MAX`] (options.rs checks it), or the one
/// that the tolerance requires.
///
/// # Errors
/// [`MethodError::TooWide`] if the tolerance requires more than [`NEIGHBOURHOOD_MAX`].
fn required_neighbourhood(
    sharpness: [f64; 2],
    pixels: [usize; 2],
    tolerance: f64,
    options: &MethodOptions,
) -> Result<usize, MethodError> {
    if let Some(given) = options.neighbourhood {
        return Ok(given);
    }
    let needed = |axis: usize| {
        // At most all orders. An even number n of pixels has n + 1: −n/2 and n/2 are two orders.
        orders_needed(sharpness[axis], tolerance).min(pixels[axis] as f64 + 1.0) as usize
    };
    let needed = needed(0).max(needed(1));
    if needed > NEIGHBOURHOOD_MAX {
        return Err(MethodError::TooWide { needed, limit: NEIGHBOURHOOD_MAX });
    }
    Ok(needed)
}

/// The first `count` terms of the orders up to `reach`, arranged as [`Orders`] describes. `pixels` is the size of the
/// field along x and y.
fn pack(
    transform: &TermTransform<f32>,
    pixels: [usize; 2],
    reach: [usize; 2],
    count: usize,
    progress: &Progress,
) -> Vec<[f32; 4]> {
    let steps = progress.of_steps(count.div_ceil(2));
    let (pairs, width) = (count.next_multiple_of(TERMS_MULTIPLE) / 2, 2 * reach[0] + 1);
    let mut packed = vec![[0.0f32; 4]; width * (reach[1] + 1) * pairs];
    // Index in a Fourier transform of n pixels.
    let bin = |j: i64, n: usize| j.rem_euclid(n as i64) as usize;
    // √½ at half the sampling rate, where one coefficient represents the orders of both signs.
    let split = |j: i64, n: usize| if j != 0 && 2 * j.unsigned_abs() as usize == n { FRAC_1_SQRT_2 } else { 1.0 };
    for pair in 0..count.div_ceil(2) {
        let odd = || if 2 * pair + 1 < count { Some(transform.term(2 * pair + 1)) } else { None };
        let (even, odd) = rayon::join(|| transform.term(2 * pair), odd);
        packed.par_chunks_mut(width * pairs).enumerate().for_each(|(jy, row)| {
            for (column, order) in row.chunks_mut(pairs).enumerate() {
                let (jx, jy) = (column as i64 - reach[0] as i64, jy as i64);
                let from = bin(jy, pixels[1]) * pixels[0] + bin(jx, pixels[0]);
                let factor = split(jx, pixels[0]) * split(jy, pixels[1]);
                let odd = odd.as_ref().map_or(Complex32::ZERO, |odd| odd[from]);
                order[pair] = [even[from].re, even[from].im, odd.re, odd.im].map(|part| part * factor);
            }
        });
        steps.one();
    }
    packed
}
