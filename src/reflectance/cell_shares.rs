//! How the reflected light shares out among the cells of a table, for a grid of incidences.

use super::Vec3;
use crate::table::{LeafAxis, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Intervals of the grid in the polar angle, in azimuth (periodic) and nodes in wavelength.
const POLAR: usize = 16;
const AZIMUTHS: usize = 24;
const WAVELENGTHS: usize = 14;
/// The grid's node at the horizon stands this much above it.
const COS_MIN: f64 = 2e-3;
/// What a cumulative share of one is stored as.
const ONE: f64 = 65535.0;
/// Unit of the cumulative shares.
pub const UNIT: f64 = 1.0 / ONE;
/// Integers that say where a node's shares are.
const INDEX: usize = 4;

/// A place in the grid of incidences: node numbers below it and fractions towards the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incidence {
    polar: (usize, f64),
    azimuth: (usize, f64),
}

/// Nodes of the grid about an incidence and a wavelength, with weights that sum to one.
pub(super) type Corners = [(usize, f64); 8];

/// Shares of cells at nodes of a grid of incidences. Between nodes the eight about an incidence are mixed by their
/// trilinear weights, so that the shares of all cells sum to one everywhere.
///
/// Polar nodes lie at `√(1 − √cosθ)`, evenly spaced: 3° apart towards grazing, 7° about the normal. Azimuths begin at
/// −π; wavelengths have equal ratios.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct CellShares {
    /// For every node `[wavelength][azimuth][polar]` where its cumulative shares start, the first cell along x and
    /// along y, and the width and height of its window of cells as `width + 65536·height`.
    index: Vec<u32>,
    /// Cumulative over the cells of a window row by row, with a leading zero, in units of [`UNIT`].
    cumulative: Vec<u16>,
}

impl CellShares {
    /// Finds the shares, where `weights(wi, wavelength_nm)` lists leaves along x and y with their weight.
    pub(super) fn build(
        x: &LeafAxis,
        y: &LeafAxis,
        weights: impl Fn(Vec3, f64) -> Vec<([usize; 2], f64)> + Sync,
    ) -> Self {
        let windows: Vec<(usize, usize, usize, Vec<f64>)> = (0..WAVELENGTHS * AZIMUTHS * (POLAR + 1))
            .into_par_iter()
            .map(|node| {
                let (wi, nm) = grid_node(node);
                let cells: Vec<_> = weights(wi, nm)
                    .into_iter()
                    .filter(|(_, weight)| *weight > 0.0)
                    .map(|([gx, gy], weight)| (gx / x.in_cell, gy / y.in_cell, weight))
                    .collect();
                let bounds = |of: fn(&(usize, usize, f64)) -> usize| {
                    let low = cells.iter().map(of).min().unwrap_or(0);
                    (low, cells.iter().map(of).max().map_or(0, |high| high + 1 - low))
                };
                let ((x0, width), (y0, height)) = (bounds(|c| c.0), bounds(|c| c.1));
                let mut sums = vec![0.0; width * height];
                cells.iter().for_each(|(cx, cy, weight)| sums[(cy - y0) * width + cx - x0] += weight);
                (x0, y0, width, sums)
            })
            .collect();
        let mut shares = Self::default();
        for (x0, y0, width, sums) in windows {
            let height = sums.len().checked_div(width).unwrap_or(0);
            let start = shares.cumulative.len();
            shares.index.extend([start, x0, y0, width | height << 16].map(|i| i as u32));
            let total: f64 = sums.iter().sum();
            // Every cell that reflects anything has a unit, so that rounding leaves none out.
            let (mut sum, mut lit) = (0.0, 0.0);
            let spare = ONE - sums.iter().filter(|weight| **weight > 0.0).count() as f64;
            shares.cumulative.push(0);
            for weight in sums {
                sum += weight;
                lit += f64::from(u8::from(weight > 0.0));
                shares.cumulative.push((lit + (sum / total * spare).round()) as u16);
            }
        }
        shares
    }

    /// Where in the grid a direction lies.
    pub(super) fn incidence(wi: Vec3) -> Incidence {
        let cos = wi[2].clamp(0.0, 1.0);
        let polar = (1.0 - cos.sqrt()).sqrt() * POLAR as f64;
        let turn = (wi[1].atan2(wi[0]) / TAU + 0.5).clamp(0.0, 1.0) * AZIMUTHS as f64;
        let (p, a) = ((polar as usize).min(POLAR - 1), turn as usize);
        Incidence { polar: (p, polar - p as f64), azimuth: (a, turn - a as f64) }
    }

    /// The nodes about an incidence and a wavelength in nm.
    pub(super) fn corners(incidence: &Incidence, wavelength_nm: f64) -> Corners {
        let ratio = (wavelength_nm / WAVELENGTH_MIN_NM).ln() / (WAVELENGTH_MAX_NM / WAVELENGTH_MIN_NM).ln();
        let last = (WAVELENGTHS - 1) as f64;
        let l = (ratio * last).clamp(0.0, last);
        let l = if std::env::var("NEAR").is_ok() { l.round() } else { l };
        let plane = (l as usize).min(WAVELENGTHS - 2);
        let weight = |upper: usize, fraction: f64| if upper == 1 { fraction } else { 1.0 - fraction };
        std::array::from_fn(|k| {
            let (dp, da, dl) = (k & 1, k >> 1 & 1, k >> 2);
            let azimuth = (incidence.azimuth.0 + da) % AZIMUTHS;
            let node = ((plane + dl) * AZIMUTHS + azimuth) * (POLAR + 1) + incidence.polar.0 + dp;
            (node, weight(dp, incidence.polar.1) * weight(da, incidence.azimuth.1) * weight(dl, l - plane as f64))
        })
    }

    /// The share of a cell.
    pub(super) fn share(&self, corners: &Corners, cell: [usize; 2]) -> f64 {
        let mut sum = 0.0;
        for &(node, weight) in corners {
            let (start, x0, y0, width, height) = self.window(node);
            let (x, y) = (cell[0].wrapping_sub(x0), cell[1].wrapping_sub(y0));
            if x < width && y < height {
                let pair = &self.cumulative[start + y * width + x..][..2];
                sum += weight * UNIT * f64::from(pair[1] - pair[0]);
            }
        }
        sum
    }

    /// A cell by its share and what is left of the random numbers, `None` where nothing is reflected. The second number
    /// draws the node of the grid, the first the cell.
    pub(super) fn choose(&self, corners: &Corners, [u, uy]: [f64; 2]) -> Option<([usize; 2], [f64; 2])> {
        let (corner, uy) = crate::table::pick(corners.len(), |k| corners[k].1, uy)?;
        let (start, x0, y0, width, height) = self.window(corners[corner].0);
        if width == 0 {
            return None;
        }
        let cumulative = &self.cumulative[start..start + width * height + 1];
        let cell = cumulative[1..cumulative.len() - 1].partition_point(|&c| UNIT * f64::from(c) <= u);
        let (low, high) = (UNIT * f64::from(cumulative[cell]), UNIT * f64::from(cumulative[cell + 1]));
        let inside = if high > low { ((u - low) / (high - low)).clamp(0.0, 1.0 - f64::EPSILON) } else { 0.5 };
        Some(([x0 + cell % width, y0 + cell / width], [inside, uy]))
    }

    fn window(&self, node: usize) -> (usize, usize, usize, usize, usize) {
        let [start, x0, y0, size] = std::array::from_fn(|i| self.index[INDEX * node + i] as usize);
        (start, x0, y0, size & 0xffff, size >> 16)
    }

    /// See the type's documentation; four integers a node.
    pub fn index(&self) -> &[u32] {
        &self.index
    }

    /// Cumulative shares in units of [`UNIT`].
    pub fn cumulative(&self) -> &[u16] {
        &self.cumulative
    }

    /// Intervals in the polar angle, nodes in azimuth and in wavelength.
    pub fn shape() -> (usize, usize, usize) {
        (POLAR, AZIMUTHS, WAVELENGTHS)
    }

    /// Most cells at a node.
    pub fn cells_max(&self) -> usize {
        self.index.chunks(INDEX).map(|node| (node[3] & 0xffff) as usize * (node[3] >> 16) as usize).max().unwrap_or(0)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.index.as_slice()) + size_of_val(self.cumulative.as_slice())
    }
}

/// Direction and wavelength in nm of a node of the grid.
fn grid_node(node: usize) -> (Vec3, f64) {
    let (polar, azimuth) = (node % (POLAR + 1), node / (POLAR + 1) % AZIMUTHS);
    let wavelength = node / ((POLAR + 1) * AZIMUTHS);
    let t = polar as f64 / POLAR as f64;
    let cos = (1.0 - t * t).powi(2).max(COS_MIN);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let phi = (azimuth as f64 / AZIMUTHS as f64 - 0.5) * TAU;
    let ratio = wavelength as f64 / (WAVELENGTHS - 1) as f64;
    let nm = WAVELENGTH_MIN_NM * (WAVELENGTH_MAX_NM / WAVELENGTH_MIN_NM).powf(ratio);
    ([sin * phi.cos(), sin * phi.sin(), cos], nm)
}
