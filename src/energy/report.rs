//! Mean and largest albedos before and after division.

use super::grid::Grid;
use super::integral::AlbedoIntegral;
use super::{AlbedoTable, AlbedoView};
use crate::numeric::{Lanes, Numbers, Real};
use crate::table::{Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Incident angle, in degrees, up to which the largest albedo is reported; beyond it the pole at the horizon tells
/// nothing of the surface.
const LARGEST_BELOW_DEG: f64 = 85.0;

/// Effect of dividing by an [`AlbedoTable`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// Largest albedo before division, over incident directions below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean albedo before division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_unscaled: f64,
    /// Mean albedo after division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_scaled: f64,
}

/// Sums over incident directions and wavelengths.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    before: f64,
    after: f64,
    largest: f64,
}

impl Sums {
    fn merged(self, other: Self) -> Self {
        Self {
            weight: self.weight + other.weight,
            before: self.before + other.before,
            after: self.after + other.after,
            largest: self.largest.max(other.largest),
        }
    }
}

impl AlbedoReport {
    /// Integrates over every other node of the table's grid and every other plane.
    pub(super) fn new(integral: &AlbedoIntegral, table: &AlbedoTable, progress: &Progress) -> Self {
        type Real4 = <Lanes<'static> as Numbers>::Real;
        let view = AlbedoView::<Lanes> { layout: table.layout, words: &table.words };
        let grid = Grid { cells: table.layout.cells / 2 };
        let planes = table.layout.planes as usize / 2 + 1;
        let plane_nm = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / (planes - 1) as f64;
        let mirrored = integral.is_mirrored();
        let steps = progress.of_steps(planes * grid.in_plane());
        let at = |i: usize| {
            steps.one();
            let (plane, node) = (i / grid.in_plane(), i % grid.in_plane());
            let (wi, radius) = grid.direction([node % grid.side(), node / grid.side()].map(|at| at as f64));
            let nodes = match node.cmp(&grid.mirrored(node)) {
                _ if radius >= 1.0 => 0.0,
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Less if mirrored => 2.0,
                std::cmp::Ordering::Greater if mirrored => 0.0,
                _ => 1.0,
            };
            if nodes == 0.0 {
                return Sums::default();
            }
            let nm = WAVELENGTH_MIN_NM + plane as f64 * plane_nm;
            let (place, lane_nm) = (view.place(wi.map(Real4::lit)), Real4::lit(nm));
            let (mut before, mut after) = (Real4::lit(0.0), Real4::lit(0.0));
            integral.visit::<Lanes>(wi, nm, None, |wo, part| {
                before += part;
                after += part * view.factor_at(&place, &view.place(wo), lane_nm, Lanes::mask(true));
            });
            let total = |sum: Real4| sum.to_array().into_iter().map(f64::from).sum::<f64>();
            let (before, after) = (total(before), total(after));
            // Solid angle of a node, up to a constant, times cosθ.
            let weight = nodes * wi[2].powf(1.5);
            let counts = wi[2] > LARGEST_BELOW_DEG.to_radians().cos();
            Sums { weight, before: weight * before, after: weight * after, largest: if counts { before } else { 0.0 } }
        };
        let sums = (0..planes * grid.in_plane()).into_par_iter().map(at).reduce(Sums::default, Sums::merged);
        Self {
            albedo_max_unscaled: sums.largest,
            albedo_mean_unscaled: sums.before / sums.weight,
            albedo_mean_scaled: sums.after / sums.weight,
        }
    }
}
