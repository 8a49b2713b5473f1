//! Tables of a grating's colour lobe beside its efficiencies: spectral weights, the colour of order 0, and the
//! sampler's orders.
//!
//! Wavelengths are counted by ν = 1/λ in 1/µm. An order is a Gaussian over ν of standard deviation τ; the table of
//! weights holds sRGB's weights averaged over it.

use super::surface::GratingSurface;
use crate::colour::WavelengthWeights;
use crate::numeric::math::lerp;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;

/// Middle of the tables' range of ν in 1/µm.
pub(crate) const NU_MIDDLE: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM + 1.0 / WAVELENGTH_MAX_NM);
/// Half width of the tables' range of ν in 1/µm.
pub(crate) const NU_HALF: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM - 1.0 / WAVELENGTH_MAX_NM);
/// Extent of the table of weights beyond the range of ν, in standard deviations τ.
pub(crate) const SPREADS: f64 = 5.0;
/// Scale in 1/µm of the width coordinate `τ/(τ + TAU_SCALE)`, about the width of sRGB's primaries.
pub(crate) const TAU_SCALE: f64 = 0.25;
/// Means and standard deviations in 1/µm of the Gaussians that ν is drawn from, with equal probability. They cover
/// sRGB's weights of blue, green and red.
pub(super) const PROPOSED: [(f64, f64); 3] = [(2.2, 0.13), (1.86, 0.13), (1.63, 0.11)];
/// Nodes of the table of weights: `[width, ν]`.
pub(crate) const WEIGHTS: [u32; 2] = [96, 256];
/// Nodes of the colour of order 0 along each axis.
pub(crate) const ORDER_ZERO: [u32; 2] = [48, 48];
/// Bins of the sampler over the incident direction: its cosine across the grooves in [−1, 1], and along them in [0, 1].
const BINS: [u32; 2] = [32, 12];
/// Largest coordinate in [0, 1] of the last bin, in single precision, too.
const BELOW_ONE: f64 = 1.0 - 1e-7;
/// Wavelengths of each Gaussian over which the sampler's efficiencies are averaged.
const PROPOSED_NODES: usize = 16;

/// Offsets of the tables in their data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTables {
    /// The highest order that propagates at any incidence and wavelength.
    pub orders: u32,
    order_zero: u32,
    order_weights: u32,
}

impl ColourTables {
    /// Builds the tables of a grating, with their data.
    pub(super) fn build(grating: &GratingSurface) -> (Self, Vec<u32>) {
        let orders = (2e3 * grating.layout().period_um / WAVELENGTH_MIN_NM) as u32;
        let mut words: Vec<f32> = weights();
        let order_zero = words.len() as u32;
        words.extend(order_zero_colours(grating));
        let order_weights_begin = words.len() as u32;
        words.extend(order_weights(grating, orders));
        (Self { orders, order_zero, order_weights: order_weights_begin }, words.into_iter().map(f32::to_bits).collect())
    }

    /// The packets that values are read from: the weights, and from the returned packet on the colours of order 0.
    pub(crate) fn packets<'a>(&self, words: &'a [u32]) -> (&'a [u32], u32) {
        (&words[..self.order_weights as usize], self.order_zero / 4)
    }

    #[inline(always)]
    pub(super) fn weights<N: Numbers>(
        &self,
        words: N::Words,
        along: N::Real,
        widths: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        interpolated::<N>(words, 0, WEIGHTS, [widths, along], active)
    }

    #[inline(always)]
    pub(super) fn order_zero<N: Numbers>(
        &self,
        words: N::Words,
        within: N::Real,
        across: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        interpolated::<N>(words, self.order_zero, ORDER_ZERO, [within, across], active)
    }

    /// First entry of the sampler's row for an incident direction.
    #[inline(always)]
    pub(super) fn sampling_row<N: Numbers>(&self, wi: [N::Real; 3]) -> N::Index {
        let real = N::Real::lit;
        let across = (real(1.0) - wi[1] * wi[1]).max(real(1e-12)).sqrt();
        let bin =
            |place: N::Real, count: u32| N::index(place.clip(real(0.0), real(BELOW_ONE)) * real(f64::from(count)));
        let x = bin((real(1.0) - wi[0] / across) * real(0.5), BINS[0]);
        let y = bin(wi[1].abs(), BINS[1]);
        let width = N::Index::lit(2 * self.orders + 2);
        N::Index::lit(self.order_weights) + (x * N::Index::lit(BINS[1]) + y) * width
    }

    /// Sampling weight of an order in a row, or the sum of all orders' (`total`).
    #[inline(always)]
    pub(super) fn order_weight<N: Numbers>(
        &self,
        words: N::Words,
        row: N::Index,
        order: N::Real,
        total: bool,
        active: N::Mask,
    ) -> N::Real {
        let at = if total {
            N::Index::lit(2 * self.orders + 1)
        } else {
            N::index((order + N::Real::lit(f64::from(self.orders))).max(N::Real::lit(0.0)))
        };
        let [word] = N::gather::<1>(words, row + at, active);
        N::from_bits(word)
    }
}

/// `∫ weight(1/ν) exp(−(ν − ν̂)²/2τ²) dν·(τ + scale)/τ` in packets, rows of one width.
fn weights() -> Vec<f32> {
    let wavelengths: Vec<(f64, [f64; 4])> = WavelengthWeights::per_nm()
        .iter()
        .enumerate()
        .map(|(i, weight)| (1e3 / (WAVELENGTH_MIN_NM + i as f64), weight.map(f64::from)))
        .collect();
    (0..WEIGHTS[0])
        .into_par_iter()
        .flat_map_iter(|row| {
            // The first and last rows are the limits of zero and infinite width.
            let share = (f64::from(row) / f64::from(WEIGHTS[0] - 1)).clamp(1e-3, 0.999);
            let tau = TAU_SCALE * share / (1.0 - share);
            let wavelengths = &wavelengths;
            (0..WEIGHTS[1]).flat_map(move |column| {
                let along = 2.0 * f64::from(column) / f64::from(WEIGHTS[1] - 1) - 1.0;
                let nu = NU_MIDDLE + along * (NU_HALF + SPREADS * tau);
                let mut sum = [0.0; 3];
                for (at, weight) in wavelengths {
                    let off = (at - nu) / tau;
                    // A weight per nm times 1 nm is a share of the integral over λ; dν = ν² dλ, λ in µm.
                    let gaussian = (-0.5 * off * off).exp() * at * at / share;
                    for (total, weight) in sum.iter_mut().zip(weight) {
                        *total += weight * gaussian;
                    }
                }
                [sum[0] as f32, sum[1] as f32, sum[2] as f32, 0.0]
            })
        })
        .collect()
}

/// Colour of order 0's efficiency in packets, over the cosine within the plane across the grooves and the plane's own
/// cosine.
fn order_zero_colours(grating: &GratingSurface) -> Vec<f32> {
    let last = |axis: usize| f64::from(ORDER_ZERO[axis] - 1);
    (0..ORDER_ZERO[0] * ORDER_ZERO[1])
        .into_par_iter()
        .flat_map_iter(|at| {
            let within = (f64::from(at / ORDER_ZERO[1]) / last(0)).clamp(1e-3, 1.0);
            let across = (f64::from(at % ORDER_ZERO[1]) / last(1)).clamp(1e-3, 1.0);
            let (x, y) = (across * (1.0 - within * within).sqrt(), (1.0 - across * across).sqrt());
            let (mut sum, mut whole) = ([0.0; 3], [0.0; 3]);
            for (i, weight) in WavelengthWeights::per_nm().iter().enumerate().step_by(4) {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let efficiency = grating.efficiency(nm, [-x, y], 0);
                for c in 0..3 {
                    let weight = f64::from(weight[c]) / (nm * nm);
                    sum[c] += weight * efficiency;
                    whole[c] += weight;
                }
            }
            [(sum[0] / whole[0]) as f32, (sum[1] / whole[1]) as f32, (sum[2] / whole[2]) as f32, 0.0]
        })
        .collect()
}

/// Sampling weights of the orders and their sum, by bin of the incident direction: efficiencies averaged over the bin
/// and over [`PROPOSED`].
fn order_weights(grating: &GratingSurface, orders: u32) -> Vec<f32> {
    let orders = orders as i32;
    (0..BINS[0] * BINS[1])
        .into_par_iter()
        .flat_map_iter(|bin| {
            let mut row = vec![0.0; 2 * orders as usize + 2];
            for corner in 0..5 {
                let (dx, dy) = [(0.5, 0.5), (0.02, 0.02), (0.02, 0.98), (0.98, 0.02), (0.98, 0.98)][corner];
                let y = (f64::from(bin % BINS[1]) + dy) / f64::from(BINS[1]);
                let along = 1.0 - 2.0 * (f64::from(bin / BINS[1]) + dx) / f64::from(BINS[0]);
                let x = along * (1.0 - y * y).sqrt();
                for (mean, deviation) in PROPOSED {
                    for i in 0..PROPOSED_NODES {
                        let u = (i as f64 + 0.5) / PROPOSED_NODES as f64;
                        let nu = mean + deviation * crate::numeric::math::normal_quantile(u);
                        let nm = (1e3 / nu).clamp(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                        for m in -orders..=orders {
                            row[(m + orders) as usize] += grating.efficiency(nm, [x, y], m);
                        }
                    }
                }
            }
            // Rounded first, so that the sum matches the stored weights.
            let row: Vec<f32> = row.into_iter().map(|share| share as f32).collect();
            let total: f32 = row.iter().sum();
            let width = row.len();
            row.into_iter().take(width - 1).chain([total])
        })
        .collect()
}

/// Bilinear interpolation in a table of packets `[first][second]`: four words each, of which three hold a colour.
/// `places` are coordinates in [0, 1].
#[inline(always)]
fn interpolated<N: Numbers>(
    words: N::Words,
    begin: u32,
    counts: [u32; 2],
    places: [N::Real; 2],
    active: N::Mask,
) -> [N::Real; 3] {
    let real = N::Real::lit;
    let index = |i: u32| N::Index::lit(i);
    let [(i, p), (j, q)] = array::from_fn(|axis| {
        let last = f64::from(counts[axis] - 1);
        let x = places[axis].clip(real(0.0), real(1.0)) * real(last);
        let low = x.floor().min(real(last - 1.0));
        (N::index(low), x - low)
    });
    let at = |di: u32, dj: u32| {
        let packet = index(begin / 4) + (i + index(di)) * index(counts[1]) + j + index(dj);
        N::gather::<4>(words, packet, active).map(N::from_bits)
    };
    let (a, b, c, d) = (at(0, 0), at(0, 1), at(1, 0), at(1, 1));
    array::from_fn(|channel| lerp(lerp(a[channel], b[channel], q), lerp(c[channel], d[channel], q), p))
}
