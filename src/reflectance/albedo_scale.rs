use super::power_bins::PowerBins;
use super::surface::Options;
use super::{Vec3, surface};
use crate::table::{SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::TAU;

/// Albedo up to which a direction is left alone: quadrature and table are good to about this.
const ALBEDO_MAX: f64 = 1.0005;
/// Rounds of the fixed point, which converges by about a half each.
const ROUNDS: usize = 6;
/// Rounds that look between the grid's nodes and only lower, by half of what is needed so that directions that light
/// each other are not both made to pay in full; the last few by all of it.
const HALF_ROUNDS: usize = 3;
const FULL_ROUNDS: usize = 4;
/// Most places looked at in each cell of the grid in each of those rounds, where cells span most of cosθ; for the
/// direction of each also every wavelength of the cell at which an order grazes the surface, since that is where narrow
/// orders peak.
const SAMPLES: usize = 9;
/// Fewest places, in the cells at the horizon.
const GRAZING_SAMPLES: usize = 5;
/// Places looked at in every cell where the albedo has no sharp features; grazing orders are not looked for there.
const SMOOTH_SAMPLES: usize = 4;
/// How far below one the last rounds bring a cell that they find above it: what is left between the places looked at.
const MARGIN: f64 = 1.01;

/// The reciprocal scaling `s(wi)·s(wo)`, `s ≤ 1`, that keeps the albedo at or below one (model.md §5.2), on a grid of
/// direction and wavelength, read by trilinear interpolation.
///
/// Nodes in cosθ lie at `(i/cosines)²`, dense at grazing; azimuths are periodic from −π; wavelengths are equally
/// spaced over the table's range. The scaling is found with the Fresnel reflectance at one, so it serves every
/// material.
#[derive(Clone, Debug)]
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

fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

/// How much a scaling changes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct AlbedoScaleReport {
    /// Largest albedo found before scaling, over the grid below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean of the albedo over incident directions weighted by cosθ and wavelengths, before and after.
    pub albedo_mean_unscaled: f64,
    pub albedo_mean_scaled: f64,
}

impl AlbedoScale {
    /// Finds the scaling for an ensemble table; `None` for a table of amplitudes.
    pub fn build(table: &SpectralTable, options: &Options) -> Option<(Self, AlbedoScaleReport)> {
        const LOBES: usize = 300;
        let bins = PowerBins::new(table, LOBES)?;
        // Few sharp lobes are cheap and need a fine grid; many or wide ones are smooth and dear.
        let sharp = bins.sharp();
        let (cosines, azimuths, wavelengths) = if sharp { (24, 32, 12) } else { (16, 16, 6) };
        let samples = |c: usize| {
            let towards_normal = 1 + (SAMPLES - 1) * (c + 2) / (cosines + 1);
            if sharp { towards_normal.max(GRAZING_SAMPLES) } else { SMOOTH_SAMPLES }
        };
        let mut scale =
            Self { cosines, azimuths, wavelengths, values: vec![1.0; wavelengths * azimuths * (cosines + 1)] };
        let albedo = |scale: &Self, (wi, wavelength_nm): (Vec3, f64)| {
            bins.albedo(wi, wavelength_nm, options, |wo| scale.factor(wo, wavelength_nm))
        };
        let nodes: Vec<_> = (0..scale.values.len()).map(|i| scale.node(i)).collect();
        let unscaled: Vec<f64> = nodes.par_iter().map(|&node| albedo(&scale, node)).collect();
        if unscaled.iter().any(|&a| a > ALBEDO_MAX) {
            for _ in 0..ROUNDS {
                let received: Vec<f64> = nodes.par_iter().map(|&node| albedo(&scale, node)).collect();
                for (s, received) in scale.values.iter_mut().zip(received) {
                    *s = (*s as f64 / received.max(1e-30)).sqrt().min(1.0) as f32;
                }
            }
            for round in 0..HALF_ROUNDS + FULL_ROUNDS {
                let (exponent, margin) = if round < HALF_ROUNDS { (0.5, 1.0) } else { (1.0, MARGIN) };
                let grazing = |wi, low_nm, high_nm| {
                    if sharp { bins.grazing_wavelengths(wi, low_nm, high_nm) } else { Vec::new() }
                };
                scale.lower(round, samples, |excess| (excess * margin).powf(-exponent), albedo, grazing);
            }
        }
        let scaled: Vec<f64> =
            nodes.par_iter().map(|&node| albedo(&scale, node) * scale.factor(node.0, node.1)).collect();
        let weights: Vec<f64> = (0..nodes.len()).map(|i| scale.solid_angle(i)).collect();
        let mean =
            |albedo: &[f64]| albedo.iter().zip(&weights).map(|(a, w)| a * w).sum::<f64>() / weights.iter().sum::<f64>();
        let steep = nodes.iter().zip(&unscaled).filter(|((wi, _), _)| wi[2] > surface::COS_85_DEGREES);
        let report = AlbedoScaleReport {
            albedo_max_unscaled: steep.map(|(_, &a)| a).fold(0.0, f64::max),
            albedo_mean_unscaled: mean(&unscaled),
            albedo_mean_scaled: mean(&scaled),
        };
        Some((scale, report))
    }

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
            across: (cos - node(i)) / (node(i + 1) - node(i)),
            around: turn - azimuth as f64,
        }
    }

    /// [`AlbedoScale::factor`] of a direction whose cell is known.
    pub(super) fn at_cell(&self, cell: &Cell, wavelength_nm: f64) -> f64 {
        let last = (self.wavelengths - 1) as f64;
        let span = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
        let l = ((wavelength_nm - WAVELENGTH_MIN_NM) / span * last).clamp(0.0, last);
        let plane = (l as usize).min(self.wavelengths - 2);
        let stride = self.azimuths * (self.cosines + 1);
        let value = |plane: usize| {
            let [a, b] = cell.corners.map(|row| {
                let pair = &self.values[plane * stride + row..][..2];
                lerp(pair[0] as f64, pair[1] as f64, cell.across)
            });
            lerp(a, b, cell.around)
        };
        lerp(value(plane), value(plane + 1), l - plane as f64)
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

    /// Direction and wavelength at fractional node numbers. The node at the horizon stands just above it.
    fn at(&self, cosine: f64, azimuth: f64, wavelength: f64) -> (Vec3, f64) {
        let cos = (cosine / self.cosines as f64).powi(2).max(1e-6);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let phi = (azimuth / self.azimuths as f64 - 0.5) * TAU;
        let span = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
        let wavelength_nm = WAVELENGTH_MIN_NM + span * wavelength / (self.wavelengths - 1) as f64;
        ([sin * phi.cos(), sin * phi.sin(), cos], wavelength_nm)
    }

    fn node(&self, index: usize) -> (Vec3, f64) {
        let cosine = index % (self.cosines + 1);
        let azimuth = index / (self.cosines + 1) % self.azimuths;
        let wavelength = index / ((self.cosines + 1) * self.azimuths);
        self.at(cosine as f64, azimuth as f64, wavelength as f64)
    }

    /// cosθ times the node's share of cosθ, up to a constant.
    fn solid_angle(&self, index: usize) -> f64 {
        let i = (index % (self.cosines + 1)) as f64;
        let at = |i: f64| (i.clamp(0.0, self.cosines as f64) / self.cosines as f64).powi(2);
        at(i) * (at(i + 1.0) - at(i - 1.0))
    }

    /// Where a place between nodes still reflects more than one, lowers all nodes about it by `remedy` of the excess.
    /// `grazing` lists the wavelengths between two at which a direction's albedo peaks; `samples` says how many
    /// places to look at in a cell of the given number in cosθ.
    fn lower(
        &mut self,
        round: usize,
        samples: impl Fn(usize) -> usize + Sync,
        remedy: impl Fn(f64) -> f64,
        albedo: impl Fn(&Self, (Vec3, f64)) -> f64 + Sync,
        grazing: impl Fn(Vec3, f64, f64) -> Vec<f64> + Sync,
    ) {
        let (azimuths, cosines) = (self.azimuths, self.cosines);
        let cell = |i: usize| (i / (cosines * azimuths), i / cosines % azimuths, i % cosines);
        let cells: Vec<_> = (0..(self.wavelengths - 1) * azimuths * cosines).map(cell).collect();
        let excess: Vec<f64> = cells
            .par_iter()
            .enumerate()
            .map(|(i, &(l, a, c))| {
                (0..samples(c)).fold(1.0, |excess: f64, k| {
                    let [dl, da, inside] = scattered(i + cells.len() * (k + SAMPLES * round));
                    // Every other place on the edge nearer the normal, about which the last cells are very long.
                    let dc = if k % 2 == 1 { 1.0 } else { inside };
                    let at = |l: f64| self.at(c as f64 + dc, a as f64 + da, l);
                    let (wi, nm) = at(l as f64 + dl);
                    let peaks = grazing(wi, at(l as f64).1, at(l as f64 + 1.0).1);
                    let received = |nm| albedo(self, (wi, nm)) * self.factor(wi, nm);
                    peaks.into_iter().map(received).fold(excess.max(received(nm)), f64::max)
                })
            })
            .collect();
        let mut lowered = vec![1.0f64; self.values.len()];
        for (&(l, a, c), excess) in cells.iter().zip(excess).filter(|(_, excess)| *excess > ALBEDO_MAX) {
            for dl in 0..2 {
                for da in 0..2 {
                    let row = ((l + dl) * azimuths + (a + da) % azimuths) * (cosines + 1) + c;
                    for factor in &mut lowered[row..row + 2] {
                        *factor = factor.min(remedy(excess));
                    }
                }
            }
        }
        self.values.iter_mut().zip(lowered).for_each(|(s, factor)| *s = (*s as f64 * factor) as f32);
    }
}

/// A point of an additive low-discrepancy sequence in the unit cube (reciprocal powers of the root of x⁴ = x + 1).
fn scattered(i: usize) -> [f64; 3] {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * i as f64).fract())
}
