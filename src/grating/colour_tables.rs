//! What the colours of a grating are read from besides its efficiencies.

use super::colour_lobe::packets;
use super::surface::GratingSurface;
use crate::colour::WavelengthWeights;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The visible range of ν = 1/λ in 1/µm, its middle and half its width, with what lies within the table's wavelengths.
pub(crate) const NU_MIDDLE: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM + 1.0 / WAVELENGTH_MAX_NM);
pub(crate) const NU_HALF: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM - 1.0 / WAVELENGTH_MAX_NM);
/// Standard deviations of an order beyond the visible range at which the table of weights ends.
pub(crate) const SPREADS: f64 = 5.0;
/// Widths in 1/µm are tabulated over `τ/(τ + this)`.
pub(crate) const TAU_SCALE: f64 = 0.25;
/// Means and standard deviations of ν in 1/µm from which wavelengths are drawn, alike: where sRGB's weights lie.
pub(super) const PROPOSED: [(f64, f64); 3] = [(2.2, 0.13), (1.86, 0.13), (1.63, 0.11)];
/// Nodes of the table of weights over ν and over widths, and of order 0 along either axis.
pub(crate) const WEIGHTS: [u32; 2] = [96, 256];
pub(crate) const ORDER_ZERO: [u32; 2] = [48, 48];
/// Bins of the shares of orders over the direction cosine across the grooves, from −1 to 1, and along them, from 0 to 1.
const BINS: [u32; 2] = [32, 12];
/// The largest place of a bin, from 0 to 1: in single precision, too, it lies in the last bin.
const BELOW_ONE: f64 = 1.0 - 1e-7;
/// Wavelengths over which shares are averaged.
const PROPOSED_NODES: usize = 16;

/// Where in the words of the colours what begins.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTables {
    /// The highest order that propagates at any incidence and wavelength.
    pub orders: u32,
    order_zero: u32,
    shares: u32,
}

impl ColourTables {
    /// The tables of a grating, and their words.
    pub(super) fn build(grating: &GratingSurface) -> (Self, Vec<u32>) {
        let orders = (2e3 * grating.layout().period_um / WAVELENGTH_MIN_NM) as u32;
        let mut words: Vec<f32> = weights();
        let order_zero = words.len() as u32;
        words.extend(order_zero_colours(grating));
        let shares = words.len() as u32;
        words.extend(shares_of_orders(grating, orders));
        (Self { orders, order_zero, shares }, words.into_iter().map(f32::to_bits).collect())
    }

    /// Of the words, the packets of the weights and, from the packet returned on, those of order 0: all that a value is read from.
    pub(crate) fn packets<'a>(&self, words: &'a [u32]) -> (&'a [u32], u32) {
        (&words[..self.shares as usize], self.order_zero / 4)
    }

    #[inline(always)]
    pub(super) fn weights<N: Numbers>(
        &self,
        words: N::Words,
        along: N::Real,
        widths: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        packets::<N>(words, 0, WEIGHTS, [widths, along], active)
    }

    #[inline(always)]
    pub(super) fn order_zero<N: Numbers>(
        &self,
        words: N::Words,
        within: N::Real,
        across: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        packets::<N>(words, self.order_zero, ORDER_ZERO, [within, across], active)
    }

    /// Where the shares of the bin of an incident direction begin.
    #[inline(always)]
    pub(super) fn shares_row<N: Numbers>(&self, wi: [N::Real; 3]) -> N::Index {
        let real = N::Real::lit;
        let across = (real(1.0) - wi[1] * wi[1]).max(real(1e-12)).sqrt();
        let bin =
            |place: N::Real, count: u32| N::index(place.clip(real(0.0), real(BELOW_ONE)) * real(f64::from(count)));
        let x = bin((real(1.0) - wi[0] / across) * real(0.5), BINS[0]);
        let y = bin(wi[1].abs(), BINS[1]);
        let width = N::Index::lit(2 * self.orders + 2);
        N::Index::lit(self.shares) + (x * N::Index::lit(BINS[1]) + y) * width
    }

    /// The share of an order of a row, or the sum of all.
    #[inline(always)]
    pub(super) fn share<N: Numbers>(
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
            // The last row stands for a width without end, the first for none; both are limits.
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

/// The colour of order 0's efficiency in packets, over the cosines in and out of the plane across the grooves.
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

/// Shares of orders and their sum, by bins of the incident direction: efficiencies averaged over the bin and the wavelengths
/// that are drawn.
fn shares_of_orders(grating: &GratingSurface, orders: u32) -> Vec<f32> {
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
            // Rounded first, so that the sum is that of what is stored.
            let row: Vec<f32> = row.into_iter().map(|share| share as f32).collect();
            let total: f32 = row.iter().sum();
            let width = row.len();
            row.into_iter().take(width - 1).chain([total])
        })
        .collect()
}
