use super::Vec3;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The reciprocal scaling `s(wi)·s(wo)`, `s ≤ 1`, that keeps the albedo at or below one (model.md §5.2), on a grid of
/// direction and wavelength, read by trilinear interpolation.
///
/// Nodes in cosθ lie at `(i/cosines)²`, dense at grazing; azimuths are periodic from −π; wavelengths are equally
/// spaced over the table's range. The scaling is found with the Fresnel reflectance at one, so it serves every
/// material.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AlbedoScale {
    cosines: usize,
    azimuths: usize,
    wavelengths: usize,
    /// `[wavelength][azimuth][cosine]`, `cosines + 1` nodes in cosθ.
    values: Vec<f32>,
}

/// A direction's place in the grid: nodes at either azimuth, and the fractions between nodes.
pub(super) struct Cell {
    corners: [usize; 2],
    across: f64,
    around: f64,
}

impl Cell {
    /// The four nodes of a plane about it, with their shares in what is interpolated.
    pub(super) fn nodes(&self) -> [(usize, f64); 4] {
        let [a, b] = self.corners;
        let ([near, far], [left, right]) = ([1.0 - self.across, self.across], [1.0 - self.around, self.around]);
        [(a, left * near), (a + 1, left * far), (b, right * near), (b + 1, right * far)]
    }
}

fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

/// How much a scaling changes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoScaleReport {
    /// Largest albedo found before scaling, over the grid below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean of the albedo over incident directions weighted by cosθ and wavelengths, before and after.
    pub albedo_mean_unscaled: f64,
    pub albedo_mean_scaled: f64,
}

impl AlbedoScale {
    /// The factor `s` of one direction at a wavelength in nm; both are clamped to the grid.
    pub fn factor(&self, direction: Vec3, wavelength_nm: f64) -> f64 {
        self.at_cell(&self.cell(direction), wavelength_nm)
    }

    /// Where in the grid a direction lies.
    pub(super) fn cell(&self, direction: Vec3) -> Cell {
        let cos = direction[2].clamp(0.0, 1.0);
        let i = ((cos.sqrt() * self.cosines as f64) as usize).min(self.cosines - 1);
        let node = |i: usize| (i as f64 / self.cosines as f64).powi(2);
        let turn = (direction[1].atan2(direction[0]) / TAU + 0.5).clamp(0.0, 1.0) * self.azimuths as f64;
        let azimuth = turn as usize;
        let row = |a: usize| a % self.azimuths * (self.cosines + 1) + i;
        Cell {
            corners: [row(azimuth), row(azimuth + 1)],
            // Rounding may put a direction a hair before its cell, where the scaling about the horizon would be negative.
            across: ((cos - node(i)) / (node(i + 1) - node(i))).clamp(0.0, 1.0),
            around: turn - azimuth as f64,
        }
    }

    /// [`AlbedoScale::factor`] of a direction whose cell is known.
    pub(super) fn at_cell(&self, cell: &Cell, wavelength_nm: f64) -> f64 {
        let (plane, t) = self.plane(wavelength_nm);
        let stride = self.in_plane();
        let value = |plane: usize| {
            let [a, b] = cell.corners.map(|row| {
                let pair = &self.values[plane * stride + row..][..2];
                lerp(pair[0] as f64, pair[1] as f64, cell.across)
            });
            lerp(a, b, cell.around)
        };
        lerp(value(plane), value(plane + 1), t)
    }

    /// The plane of nodes below a wavelength in nm, and the fraction towards the next.
    pub(super) fn plane(&self, wavelength_nm: f64) -> (usize, f64) {
        let last = (self.wavelengths - 1) as f64;
        let span = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
        let l = ((wavelength_nm - WAVELENGTH_MIN_NM) / span * last).clamp(0.0, last);
        let plane = (l as usize).min(self.wavelengths - 2);
        (plane, l - plane as f64)
    }

    /// Nodes of one wavelength.
    pub(super) fn in_plane(&self) -> usize {
        self.azimuths * (self.cosines + 1)
    }

    /// Intervals in cosθ, nodes in azimuth and in wavelength.
    pub fn shape(&self) -> (usize, usize, usize) {
        (self.cosines, self.azimuths, self.wavelengths)
    }

    /// The nodes' values, `[wavelength][azimuth][cosine]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The nodes' values rearranged for look-ups: `[wavelength][azimuth][interval in cosθ]`, each with its four corners
    /// (azimuth, cosine), (azimuth, cosine + 1), (azimuth + 1, cosine), (azimuth + 1, cosine + 1).
    pub fn corners(&self) -> Vec<f32> {
        let mut corners = Vec::with_capacity(4 * self.wavelengths * self.azimuths * self.cosines);
        for l in 0..self.wavelengths {
            for a in 0..self.azimuths {
                for c in 0..self.cosines {
                    for azimuth in [a, (a + 1) % self.azimuths] {
                        let row = (l * self.azimuths + azimuth) * (self.cosines + 1) + c;
                        corners.extend_from_slice(&self.values[row..row + 2]);
                    }
                }
            }
        }
        corners
    }

    /// Whether nothing is scaled.
    pub fn is_one(&self) -> bool {
        self.values.iter().all(|&s| s == 1.0)
    }

    /// A scaling by one on a grid of that shape: intervals in cosθ, nodes in azimuth and in wavelength.
    pub(super) fn one((cosines, azimuths, wavelengths): (usize, usize, usize)) -> Self {
        Self { cosines, azimuths, wavelengths, values: vec![1.0; wavelengths * azimuths * (cosines + 1)] }
    }

    /// [`AlbedoScale::values`], to be changed.
    pub(super) fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// Direction and wavelength at fractional node numbers. The node at the horizon stands just above it, that at the
    /// normal just beside it, where it still has an azimuth.
    pub(super) fn at(&self, cosine: f64, azimuth: f64, wavelength: f64) -> (Vec3, f64) {
        let cos = (cosine / self.cosines as f64).powi(2).clamp(1e-6, 1.0 - 1e-6);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let phi = (azimuth / self.azimuths as f64 - 0.5) * TAU;
        let span = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
        let wavelength_nm = WAVELENGTH_MIN_NM + span * wavelength / (self.wavelengths - 1) as f64;
        ([sin * phi.cos(), sin * phi.sin(), cos], wavelength_nm)
    }

    /// Direction and wavelength of a node.
    pub(super) fn node(&self, index: usize) -> (Vec3, f64) {
        let cosine = index % (self.cosines + 1);
        let azimuth = index / (self.cosines + 1) % self.azimuths;
        let wavelength = index / ((self.cosines + 1) * self.azimuths);
        self.at(cosine as f64, azimuth as f64, wavelength as f64)
    }
}
