//! The wave orders of a tile as the methods read them, and Single 2014's sum over a neighbourhood of them.

use super::bessel::TERMS_MAX;
use super::options::NEIGHBOURHOOD_MAX;
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

/// Largest κH of the Taylor series: its terms reach e^κH before they cancel, and their squares must not overflow.
pub const TAYLOR_KAPPA_H_MAX: f64 = 30.0;
/// Most bytes that the orders of a tile may take.
pub const ORDERS_BYTES_MAX: usize = 512 << 20;

/// Largest w of two directions.
const W_MAX: f64 = 2.0;
/// Where the Gaussian of an amplitude is below e⁻⁴⁰, single precision has nothing left of its square beside others.
pub(super) const FAINT: f32 = 40.0;

/// Added and taken away again, it rounds numbers up to a third of its size to whole ones.
const WHOLE: f32 = 12_582_912.0;

/// The terms of every order that light from 380 to 780 nm can reach.
///
/// The tile always goes on periodically. Terms are `DFT{T_n(h/H)}` or `DFT{(h/H)ⁿ}` with the heights about the middle of
/// their range, in pairs of an even and an odd n, `[jy][jx][n]` with jy from 0 and jx from −reach: those of a real
/// function obey `D(−j) = conj D(j)`. In an even number of pixels the bin at half the sampling rate stands for both
/// signs; each carries `√½` of its amplitude, as in [`crate::lobe::Exact`].
#[derive(Clone)]
pub(super) struct Orders {
    pub grid: OrderGrid,
    /// Terms asked for; the grid's are filled up with zeros.
    count: usize,
    terms: Arc<Vec<[f32; 4]>>,
}

/// What is summed at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderCounts {
    /// Terms of the series.
    pub terms: usize,
    /// Orders along each axis.
    pub neighbourhood: usize,
}

impl Orders {
    /// Transforms `field` for a Gaussian window of four standard deviations `coherence_length_um`; `tolerance` is the
    /// relative error that the number of terms and the neighbourhood follow from unless they are given. `progress` hears of
    /// each pair of terms.
    pub fn new(
        field: &HeightField,
        coherence_length_um: f64,
        tolerance: f64,
        options: &MethodOptions,
        progress: &Progress,
    ) -> Result<Self, MethodError> {
        let transform = TermTransform::<f32>::new(field, options.series);
        let count = term_count(transform.half_range_um(), tolerance, options)?;
        let terms = count.next_multiple_of(TERMS_MULTIPLE);
        let (nx, ny) = field.size();
        let (lx, ly) = field.extent_um();
        let window = CoherenceWindow::from_length_um(coherence_length_um);
        let sharpness = [lx, ly].map(|l| 2.0 * (PI * window.sigma_um() / l).powi(2));
        let neighbourhood = neighbourhood(sharpness, [nx, ny], tolerance, options)?;
        let reach = |n: usize, extent_um: f64| {
            let reached = (2.0 * extent_um / f64::from(WAVELENGTH_MIN_UM)).ceil() as usize;
            reached.saturating_add(neighbourhood / 2 + 1).min(n / 2)
        };
        let reach = [reach(nx, lx), reach(ny, ly)];
        let needed = (2 * reach[0] + 1).saturating_mul(reach[1] + 1).saturating_mul(8 * terms);
        if needed > ORDERS_BYTES_MAX {
            let mb = |bytes: usize| bytes as f64 / 1e6;
            return Err(MethodError::TooLarge { needed_mb: mb(needed), limit_mb: mb(ORDERS_BYTES_MAX) });
        }
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
            argument_of_terms: match options.terms {
                Some(_) => 0.0,
                // Those that fill up are needed nowhere.
                None => (kappa_h_max(transform.half_range_um()) + (terms - count) as f64) as f32,
            },
        };
        Ok(Self { grid, count, terms: Arc::new(pack(&transform, [nx, ny], reach, count, progress)) })
    }

    /// The same terms with no more orders summed at a place than `tolerance` asks for.
    pub fn narrowed(&self, tolerance: f64) -> Self {
        let across = self.grid.sharpness.map(|sharpness| orders_across(sharpness.into(), tolerance) as u32);
        let neighbourhood = self.grid.neighbourhood.min(across[0].max(across[1]));
        Self { grid: OrderGrid { neighbourhood, ..self.grid }, ..self.clone() }
    }

    /// What is summed at a place, given or as the tolerance asks for.
    pub fn counts(&self) -> OrderCounts {
        OrderCounts { terms: self.count, neighbourhood: self.grid.neighbourhood as usize }
    }

    /// The terms as the shaders read them.
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.terms.as_slice())
    }

    /// `p = (u, v)·L/λ`, the place of `q` among the orders.
    pub fn place(&self, q: [f32; 3], wavelength_um: f32) -> [f32; 2] {
        [0, 1].map(|axis| q[axis] / wavelength_um * self.grid.extent_um[axis])
    }

    /// The nearest order to a place, and how far it is.
    pub fn nearest(place: [f32; 2]) -> ([i32; 2], [f32; 2]) {
        let order = place.map(|p| floor(p + 0.5));
        (order, [0, 1].map(|axis| place[axis] - order[axis] as f32))
    }

    /// Whether an order is held.
    pub fn holds(&self, order: [i32; 2]) -> bool {
        (0..2).all(|axis| order[axis].unsigned_abs() <= self.grid.reach[axis].unsigned_abs())
    }

    /// `c_j` of an order that is held.
    pub fn amplitude(&self, order: [i32; 2], weights: &TermWeights) -> [f32; 2] {
        let OrderGrid { reach, terms, .. } = self.grid;
        let sign = if order[1] < 0 { -1 } else { 1 };
        let row = (sign * order[1]) * (2 * reach[0] + 1);
        let first = (row + sign * order[0] + reach[0]) as usize * (terms as usize / 2);
        let mut sum = [0.0f32; 4];
        for (term, weight) in self.terms[first..first + weights.len()].iter().zip(weights) {
            (0..4).for_each(|part| sum[part] += term[part] * weight[part]);
        }
        // Even terms plus i times the odd ones, both conjugate where the opposite order is the one that is stored.
        let sign = sign as f32;
        [sum[0] - sign * sum[3], sign * sum[1] + sum[2]]
    }

    /// Calls `visit` with S in µm² for each of the wavelengths in µm at which an order is near enough to be seen.
    ///
    /// `S = |Σ_j c_j g(f − f_j)|²/(πs²)`, the sum over a block of the nearest orders.
    pub fn densities<T>(
        &self,
        q: [f32; 3],
        wavelengths_um: impl Iterator<Item = (f32, T)>,
        mut visit: impl FnMut(f32, T, f32),
    ) {
        let lit = wavelengths_um.filter_map(|(um, with)| {
            let place = self.place(q, um);
            self.is_lit(place).then_some((um, (place, with)))
        });
        self.grid.at_wavelengths(q[2], lit, |um, (place, with), weights| visit(um, with, self.density(place, weights)));
    }

    /// S in µm² at one wavelength in µm.
    pub fn density_at(&self, q: [f32; 3], wavelength_um: f32) -> f32 {
        let mut found = 0.0;
        self.densities(q, std::iter::once((wavelength_um, ())), |_, (), density| found = density);
        found
    }

    /// Whether the Gaussian of the nearest order is more than [`FAINT`] at a place.
    #[inline]
    fn is_lit(&self, place: [f32; 2]) -> bool {
        let fall = |axis: usize| {
            let reach = self.grid.reach[axis] as f32;
            let nearest = (place[axis] + WHOLE) - WHOLE;
            let beside = place[axis] - nearest.max(-reach).min(reach);
            self.grid.sharpness[axis] * beside * beside
        };
        fall(0) + fall(1) <= FAINT
    }

    fn density(&self, place: [f32; 2], weights: &TermWeights) -> f32 {
        if self.grid.neighbourhood == 1 {
            let (order, distance) = Self::nearest(place);
            if !self.holds(order) {
                return 0.0;
            }
            let c = self.amplitude(order, weights);
            let exponent = (0..2).map(|axis| self.grid.sharpness[axis] * distance[axis] * distance[axis]).sum::<f32>();
            return self.grid.peak_um2 * (-2.0 * exponent).exp() * (c[0] * c[0] + c[1] * c[1]);
        }
        let (mut columns, mut rows) = (Gaussians::new(), Gaussians::new());
        columns.extend(self.beside(0, place[0]));
        rows.extend(self.beside(1, place[1]));
        let mut sum = [0.0f32; 2];
        for &(jy, gy) in &rows {
            for &(jx, gx) in &columns {
                let c = self.amplitude([jx, jy], weights);
                sum[0] += gx * gy * c[0];
                sum[1] += gx * gy * c[1];
            }
        }
        self.grid.peak_um2 * (sum[0] * sum[0] + sum[1] * sum[1])
    }

    /// The orders nearest to a place along an axis, those that are held and not faint, with their Gaussians.
    fn beside(&self, axis: usize, place: f32) -> impl Iterator<Item = (i32, f32)> {
        let OrderGrid { reach, sharpness, neighbourhood, .. } = self.grid;
        let (reach, count) = (reach[axis], neighbourhood as i32);
        let first = floor(place - 0.5 * count as f32) + 1;
        (first.max(-reach)..=(first + count - 1).min(reach)).filter_map(move |j| {
            let exponent = sharpness[axis] * (place - j as f32) * (place - j as f32);
            (exponent < FAINT).then(|| (j, (-exponent).exp()))
        })
    }
}

/// Orders along an axis with their Gaussians.
type Gaussians = ArrayVec<(i32, f32), NEIGHBOURHOOD_MAX>;

/// Without the call that `f32::floor` is where processors are not assumed to have an instruction for it.
fn floor(place: f32) -> i32 {
    let towards_zero = place as i32;
    towards_zero.saturating_sub(i32::from(towards_zero as f32 > place))
}

/// κH of 380 nm along the normal.
fn kappa_h_max(half_range_um: f64) -> f64 {
    2.0 * PI * W_MAX / f64::from(WAVELENGTH_MIN_UM) * half_range_um
}

/// Terms for every κ up to that of 380 nm along the normal: so many that what is left out is below a tenth of the
/// tolerance, or as many as are asked for.
fn term_count(half_range_um: f64, tolerance: f64, options: &MethodOptions) -> Result<usize, MethodError> {
    let kappa_h = kappa_h_max(half_range_um);
    if options.series == Series::Taylor && kappa_h > TAYLOR_KAPPA_H_MAX {
        return Err(MethodError::TaylorRange { kappa_h, limit: TAYLOR_KAPPA_H_MAX });
    }
    // Beyond that many no series that a method can hold comes near, whatever is asked for.
    let needed = (kappa_h <= TERMS_MAX as f64).then(|| {
        options.terms.unwrap_or_else(|| match options.series {
            Series::Chebyshev => chebyshev_terms(kappa_h, 0.1 * tolerance),
            Series::Taylor => taylor_terms(kappa_h, 0.1 * tolerance),
        })
    });
    needed.filter(|terms| *terms <= TERMS_MAX).ok_or(MethodError::TooManyTerms { kappa_h, limit: TERMS_MAX })
}

/// Orders along an axis, so many that the Gaussian of an amplitude left out is below half the tolerance: the first is at
/// least half their number away.
fn orders_across(sharpness: f64, tolerance: f64) -> f64 {
    let across = 2.0 * ((0.5 * tolerance).recip().ln() / sharpness).sqrt();
    across.ceil().max(1.0)
}

/// Orders along each axis: as the tolerance asks for, or as are asked for.
fn neighbourhood(
    sharpness: [f64; 2],
    pixels: [usize; 2],
    tolerance: f64,
    options: &MethodOptions,
) -> Result<usize, MethodError> {
    if let Some(given) = options.neighbourhood {
        return Ok(given);
    }
    let along = |axis: usize| {
        // No more than the orders there are, and half the sampling rate counts twice.
        orders_across(sharpness[axis], tolerance).min(pixels[axis] as f64 + 1.0) as usize
    };
    let needed = along(0).max(along(1));
    if needed > NEIGHBOURHOOD_MAX {
        return Err(MethodError::TooWide { needed, limit: NEIGHBOURHOOD_MAX });
    }
    Ok(needed)
}

/// The first `count` terms of the orders up to `reach`, two at a time.
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
    let bin = |j: i64, n: usize| j.rem_euclid(n as i64) as usize;
    let share = |j: i64, n: usize| if j != 0 && 2 * j.unsigned_abs() as usize == n { FRAC_1_SQRT_2 } else { 1.0 };
    for pair in 0..count.div_ceil(2) {
        let odd = || if 2 * pair + 1 < count { Some(transform.term(2 * pair + 1)) } else { None };
        let (even, odd) = rayon::join(|| transform.term(2 * pair), odd);
        packed.par_chunks_mut(width * pairs).enumerate().for_each(|(jy, row)| {
            for (column, order) in row.chunks_mut(pairs).enumerate() {
                let (jx, jy) = (column as i64 - reach[0] as i64, jy as i64);
                let from = bin(jy, pixels[1]) * pixels[0] + bin(jx, pixels[0]);
                let share = share(jx, pixels[0]) * share(jy, pixels[1]);
                let odd = odd.as_ref().map_or(Complex32::ZERO, |odd| odd[from]);
                order[pair] = [even[from].re, even[from].im, odd.re, odd.im].map(|part| part * share);
            }
        });
        steps.one();
    }
    packed
}
