//! Mean and largest albedos before and after division.

use super::grid::Grid;
use super::integral::AlbedoIntegral;
use super::{AlbedoTable, AlbedoView};
use crate::numeric::{Lanes, Numbers, Real, Values};
use crate::scattering::{Reading, Vec3};
use crate::table::{Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Incident angle in degrees below which the largest albedo is reported. Chosen: beyond it most surfaces have large
/// albedos, by the pole at the horizon.
const LARGEST_BELOW_DEG: f64 = 85.0;

/// Numbers of four lanes: quadrature nodes side by side.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Albedos before and after division by an [`AlbedoTable`], at the relief's own size and without the Fresnel
/// reflectance.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// Largest albedo before division, over incident directions below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean albedo before division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_unscaled: f64,
    /// Mean albedo after division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_scaled: f64,
}

/// Albedos of a direction at a wavelength in nm, before and after division by a table at the relief's own size.
pub(crate) fn integrated_albedos(
    integral: &AlbedoIntegral,
    table: Option<&AlbedoTable>,
    wi: Vec3,
    nm: f64,
) -> [f64; 2] {
    let view = table.map(|table| AlbedoView::<Lanes> { layout: table.layout, words: &table.words });
    let divided = view.as_ref().map(|view| (view, view.place(wi.map(Real4::lit))));
    let reading = Reading::at(Real4::lit(nm));
    let (mut before, mut after) = (Real4::lit(0.0), Real4::lit(0.0));
    integral.visit::<Lanes>(wi, nm, None, |wo, part| {
        before += part;
        after += match &divided {
            None => part,
            Some((view, place)) => part * view.factor_at(place, &view.place(wo), &reading, Lanes::mask(true)),
        };
    });
    [before, after].map(Lanes::total)
}

/// Sums over incident directions and wavelengths.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Sum of the weights of the mean.
    weight: f64,
    /// Weighted sum of the albedos before division.
    before: f64,
    /// Weighted sum of the albedos after division.
    after: f64,
    /// Largest albedo before division, below [`LARGEST_BELOW_DEG`].
    largest: f64,
}

impl Sums {
    /// Sums over the directions and wavelengths of `self` and `other`.
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
    /// Integrates the albedo at every other node of the table's grid, and at uniform wavelengths, one for every other
    /// plane of the table.
    pub(super) fn new(integral: &AlbedoIntegral, table: &AlbedoTable, progress: &Progress) -> Self {
        let grid = Grid { cells: table.layout.cells / 2 };
        // The table has at least two planes, so these are at least two, too.
        let planes = table.layout.planes as usize / 2 + 1;
        let spacing_nm = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / (planes - 1) as f64;
        let is_mirrored = integral.is_mirrored();
        let steps = progress.of_steps(planes * grid.in_plane());
        let sums_at = |i: usize| {
            steps.one();
            // Nodes are numbered `[plane][y][x]`.
            let (plane, node) = (i / grid.in_plane(), i % grid.in_plane());
            let (wi, radius) = grid.direction(grid.position(node));
            // Number of nodes for which this node counts. Of two nodes mirrored at the x axis with equal albedos, the
            // first counts for both.
            let count = match node.cmp(&grid.mirrored(node)) {
                Ordering::Less if is_mirrored => 2.0,
                Ordering::Greater if is_mirrored => 0.0,
                _ => 1.0,
            };
            // The horizon has the radius 1 on the grid; nodes outside are not directions.
            if count == 0.0 || radius >= 1.0 {
                return Sums::default();
            }
            let nm = WAVELENGTH_MIN_NM + plane as f64 * spacing_nm;
            let [before, after] = integrated_albedos(integral, Some(table), wi, nm);
            // cosθ times the solid angle of a node, which is proportional to √cosθ: cosθ = (1 − r²)² at the radius r,
            // so |d cosθ| = 2√cosθ·d(r²).
            let weight = count * wi[2].powf(1.5);
            let is_off_grazing = wi[2] > LARGEST_BELOW_DEG.to_radians().cos();
            let largest = if is_off_grazing { before } else { 0.0 };
            Sums { weight, before: weight * before, after: weight * after, largest }
        };
        let sums = (0..planes * grid.in_plane()).into_par_iter().map(sums_at).reduce(Sums::default, Sums::merged);
        Self {
            albedo_max_unscaled: sums.largest,
            albedo_mean_unscaled: sums.before / sums.weight,
            albedo_mean_scaled: sums.after / sums.weight,
        }
    }
}
