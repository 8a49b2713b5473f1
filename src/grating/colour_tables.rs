//! Tables of a grating's colour lobe beside its efficiencies (symbols: `mod.rs`, formulas: `colour_lobe.rs`).
//!
//! | table | axes | entry |
//! | --- | --- | --- |
//! | spectral weights | width τ and centre of an order's Gaussian over ν | sRGB's weights averaged over the Gaussian |
//! | order 0 | cosine in the plane across the grooves, cosine of that plane | colour of order 0's efficiency |
//! | order weights | bin of the incident direction, order | probability of drawing the order, not normalised |

use super::lobe::REACH;
use super::surface::GratingSurface;
use crate::colour::WavelengthWeights;
use crate::numeric::math::{lerp, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::sampling::BELOW_ONE;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;

/// Middle of the tables' range of ν in 1/µm.
pub(crate) const NU_MIDDLE: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM + 1.0 / WAVELENGTH_MAX_NM);
/// Half width of the tables' range of ν in 1/µm.
pub(crate) const NU_HALF: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM - 1.0 / WAVELENGTH_MAX_NM);
/// Scale in 1/µm of the coordinate `τ/(τ + TAU_SCALE)` of a width. Chosen: about the width of sRGB's weights.
pub(crate) const TAU_SCALE: f64 = 0.25;
/// Means and standard deviations in 1/µm of the Gaussians that ν is drawn from, with equal probability. Chosen: they
/// follow sRGB's weights of blue, green and red.
pub(super) const PROPOSED: [(f64, f64); 3] = [(2.2, 0.13), (1.86, 0.13), (1.63, 0.11)];
/// Nodes of the table of weights: `[width, ν]`.
pub(crate) const WEIGHTS: [u32; 2] = [96, 256];
/// Nodes of the colour of order 0 along each axis.
pub(crate) const ORDER_ZERO: [u32; 2] = [48, 48];
/// Bins of the sampler over the incident direction: its cosine across the grooves in [−1, 1], and along them in [0, 1].
const BINS: [u32; 2] = [32, 12];
/// Positions in a bin at which efficiencies are averaged, as fractions of its sides: the centre, and near each corner.
const BIN_POINTS: [(f64, f64); 5] = [(0.5, 0.5), (0.02, 0.02), (0.02, 0.98), (0.98, 0.02), (0.98, 0.98)];
/// Wavenumbers of each of [`PROPOSED`] at which efficiencies are averaged.
const PROPOSED_NODES: usize = 16;
/// Step in nm of the integral over wavelengths of order 0's colour.
const ORDER_ZERO_STEP_NM: usize = 4;

/// Layout of the three tables in their data, which begin with the spectral weights.
///
/// Spectral weights and order 0 are packets of four words: red, green, blue, and zero. A row of order weights has the
/// orders from `−orders` to `orders`, then their sum. All words are bits of single-precision numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTables {
    /// The highest order that propagates at any incidence and wavelength.
    pub orders: u32,
    /// Offset in words of the colours of order 0.
    order_zero: u32,
    /// Offset in words of the order weights.
    order_weights: u32,
}

impl ColourTables {
    /// Builds the tables of a grating, with their data.
    pub(super) fn build(grating: &GratingSurface) -> (Self, Vec<u32>) {
        let orders = (2e3 * grating.layout().period_um / WAVELENGTH_MIN_NM) as u32;
        let mut words: Vec<f32> = weights();
        let order_zero = words.len() as u32;
        words.extend(order_zero_colours(grating));
        let offset = words.len() as u32;
        words.extend(order_weights(grating, orders));
        (Self { orders, order_zero, order_weights: offset }, words.into_iter().map(f32::to_bits).collect())
    }

    /// Data of spectral weights and order 0, from which values are computed, and the first packet of order 0.
    pub(crate) fn packets<'a>(&self, words: &'a [u32]) -> (&'a [u32], u32) {
        (&words[..self.order_weights as usize], self.order_zero / 4)
    }

    /// Spectral weights of an order, over the width `τ/(τ + TAU_SCALE)`. `width` is this coordinate, `centre` that of
    /// the Gaussian's centre; both are in [0, 1].
    #[inline(always)]
    pub(super) fn weights<N: Numbers>(
        &self,
        words: N::Words,
        width: N::Real,
        centre: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        interpolated::<N>(words, 0, WEIGHTS, [width, centre], active)
    }

    /// Colour of order 0's efficiency. `in_plane` is the cosine of incidence within the plane across the grooves,
    /// `of_plane` the cosine between the plane and the normal.
    #[inline(always)]
    pub(super) fn order_zero<N: Numbers>(
        &self,
        words: N::Words,
        in_plane: N::Real,
        of_plane: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        interpolated::<N>(words, self.order_zero, ORDER_ZERO, [in_plane, of_plane], active)
    }

    /// Offset of the order weights for an incident direction.
    #[inline(always)]
    pub(super) fn order_weights_row<N: Numbers>(&self, wi: [N::Real; 3]) -> N::Index {
        let real = N::Real::lit;
        let of_plane = (real(1.0) - wi[1] * wi[1]).max(real(1e-12)).sqrt();
        let bin = |coordinate: N::Real, count: u32| {
            N::index(coordinate.clip(real(0.0), real(BELOW_ONE)) * real(f64::from(count)))
        };
        let x = bin((real(1.0) - wi[0] / of_plane) * real(0.5), BINS[0]);
        let y = bin(wi[1].abs(), BINS[1]);
        let row_length = N::Index::lit(2 * self.orders + 2);
        N::Index::lit(self.order_weights) + (x * N::Index::lit(BINS[1]) + y) * row_length
    }

    /// Weight of an order in a row.
    #[inline(always)]
    pub(super) fn order_weight<N: Numbers>(
        &self,
        words: N::Words,
        row: N::Index,
        order: N::Real,
        active: N::Mask,
    ) -> N::Real {
        let entry = N::index((order + N::Real::lit(f64::from(self.orders))).max(N::Real::lit(0.0)));
        let [word] = N::gather::<1>(words, row + entry, active);
        N::from_bits(word)
    }

    /// Sum of the weights of a row.
    #[inline(always)]
    pub(super) fn total_weight<N: Numbers>(&self, words: N::Words, row: N::Index, active: N::Mask) -> N::Real {
        let [word] = N::gather::<1>(words, row + N::Index::lit(2 * self.orders + 1), active);
        N::from_bits(word)
    }
}

/// Table of spectral weights: `(τ + TAU_SCALE)/τ · ∫ weight(1/ν') exp(−(ν' − ν)²/2τ²) dν'`, `[width][centre]` in
/// packets. The factor makes the limit of zero width finite; the lobe divides by it.
fn weights() -> Vec<f32> {
    let wavelengths: Vec<(f64, [f64; 4])> = WavelengthWeights::per_nm()
        .iter()
        .enumerate()
        .map(|(i, weight)| (1e3 / (WAVELENGTH_MIN_NM + i as f64), weight.map(f64::from)))
        .collect();
    (0..WEIGHTS[0])
        .into_par_iter()
        .flat_map_iter(|row| {
            // The first and last rows stand for the limits of zero and infinite width.
            let width = (f64::from(row) / f64::from(WEIGHTS[0] - 1)).clamp(1e-3, 0.999);
            let tau = TAU_SCALE * width / (1.0 - width);
            let wavelengths = &wavelengths;
            (0..WEIGHTS[1]).flat_map(move |column| {
                let centre = 2.0 * f64::from(column) / f64::from(WEIGHTS[1] - 1) - 1.0;
                let nu = NU_MIDDLE + centre * (NU_HALF + REACH * tau);
                let mut sum = [0.0; 3];
                for (nu_sample, weight) in wavelengths {
                    let offset = (nu_sample - nu) / tau;
                    // Weights are per nm and sampled every nm; dν = ν² dλ with λ in µm.
                    let gaussian = (-0.5 * offset * offset).exp() * nu_sample * nu_sample / width;
                    for (total, weight) in sum.iter_mut().zip(weight) {
                        *total += weight * gaussian;
                    }
                }
                [sum[0] as f32, sum[1] as f32, sum[2] as f32, 0.0]
            })
        })
        .collect()
}

/// Table of order 0's colours, `[in_plane][of_plane]` in packets (see [`ColourTables::order_zero`]): its efficiency
/// averaged with sRGB's weights over ν².
fn order_zero_colours(grating: &GratingSurface) -> Vec<f32> {
    let last = |axis: usize| f64::from(ORDER_ZERO[axis] - 1);
    (0..ORDER_ZERO[0] * ORDER_ZERO[1])
        .into_par_iter()
        .flat_map_iter(|node| {
            let in_plane = (f64::from(node / ORDER_ZERO[1]) / last(0)).clamp(1e-3, 1.0);
            let of_plane = (f64::from(node % ORDER_ZERO[1]) / last(1)).clamp(1e-3, 1.0);
            let (x, y) = (of_plane * (1.0 - in_plane * in_plane).sqrt(), (1.0 - of_plane * of_plane).sqrt());
            let (mut sum, mut total) = ([0.0; 3], [0.0; 3]);
            for (i, weight) in WavelengthWeights::per_nm().iter().enumerate().step_by(ORDER_ZERO_STEP_NM) {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let efficiency = grating.efficiency(nm, [-x, y], 0);
                for c in 0..3 {
                    let weight = f64::from(weight[c]) / (nm * nm);
                    sum[c] += weight * efficiency;
                    total[c] += weight;
                }
            }
            [(sum[0] / total[0]) as f32, (sum[1] / total[1]) as f32, (sum[2] / total[2]) as f32, 0.0]
        })
        .collect()
}

/// Table of order weights, `[bin across the grooves][bin along them][order, then the sum]`: efficiencies averaged over
/// the bin and over the wavenumbers of [`PROPOSED`].
fn order_weights(grating: &GratingSurface, orders: u32) -> Vec<f32> {
    let orders = orders as i32;
    (0..BINS[0] * BINS[1])
        .into_par_iter()
        .flat_map_iter(|bin| {
            let mut row = vec![0.0; 2 * orders as usize + 2];
            for (dx, dy) in BIN_POINTS {
                let y = (f64::from(bin % BINS[1]) + dy) / f64::from(BINS[1]);
                let sine_in_plane = 1.0 - 2.0 * (f64::from(bin / BINS[1]) + dx) / f64::from(BINS[0]);
                let x = sine_in_plane * (1.0 - y * y).sqrt();
                for (mean, sigma) in PROPOSED {
                    for i in 0..PROPOSED_NODES {
                        let u = (i as f64 + 0.5) / PROPOSED_NODES as f64;
                        let nu = mean + sigma * normal_quantile(u);
                        let nm = (1e3 / nu).clamp(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                        for m in -orders..=orders {
                            row[(m + orders) as usize] += grating.efficiency(nm, [x, y], m);
                        }
                    }
                }
            }
            // Rounded first, so that the sum matches the stored weights.
            let row: Vec<f32> = row.into_iter().map(|weight| weight as f32).collect();
            let total: f32 = row.iter().sum();
            let orders = row.len() - 1;
            row.into_iter().take(orders).chain([total])
        })
        .collect()
}

/// Colour by bilinear interpolation in a table of packets, `[first][second]`, that begins at the word `offset`.
/// `coordinates` are in [0, 1].
#[inline(always)]
fn interpolated<N: Numbers>(
    words: N::Words,
    offset: u32,
    counts: [u32; 2],
    coordinates: [N::Real; 2],
    active: N::Mask,
) -> [N::Real; 3] {
    let real = N::Real::lit;
    let index = |i: u32| N::Index::lit(i);
    let [(i, p), (j, q)] = array::from_fn(|axis| {
        let last = f64::from(counts[axis] - 1);
        let x = coordinates[axis].clip(real(0.0), real(1.0)) * real(last);
        let low = x.floor().min(real(last - 1.0));
        (N::index(low), x - low)
    });
    let at = |di: u32, dj: u32| {
        let packet = index(offset / 4) + (i + index(di)) * index(counts[1]) + j + index(dj);
        N::gather::<4>(words, packet, active).map(N::from_bits)
    };
    let (a, b, c, d) = (at(0, 0), at(0, 1), at(1, 0), at(1, 1));
    array::from_fn(|channel| lerp(lerp(a[channel], b[channel], q), lerp(c[channel], d[channel], q), p))
}
