//! Table of the divisor A for transparent bodies: the sum of what they reflect and transmit.
//!
//! One divisor serves reflection and transmission, `max(1, A(wi), A(wo))`, each direction on its own side of the
//! relief. So energy is conserved and reciprocity kept. Light that a film traps counts as transmitted.
//!
//! Factors of bodies vanish at the horizon, so that albedos have no poles there, and A is the albedo itself. Each node
//! of the table of power spectra counts at its own frequency.

use super::grid::Grid;
use super::integral::merged_gaussians;
use super::node_gaussian::NodeGaussian;
use super::sizes::SizeAxes;
use super::{AlbedoLayout, AlbedoTable, packets};
use crate::numeric::{Lanes, Number, Numbers, Real, Values};
use crate::scattering::{Passage, SizeRange, TransparentBody, Vec3};
use crate::table::{NodeQuantity, PowerCurves, Progress, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Cells along each side of the grid.
const CELLS: u32 = 24;
/// Planes over the tables' range of wavelengths.
const PLANES: u32 = 11;
/// Margin of the divisor for errors of interpolation.
const MARGIN: f64 = 0.005;
/// Excess of the divisor over one from which it gets the whole margin. Smaller excesses get it in proportion.
const MARGIN_FROM: f64 = 0.02;
/// Largest change of the phase of the heights between slabs, in radians per unit of w.
const SLAB_PHASE: f64 = 3.0;

/// Four nodes of the table side by side.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Albedo integral of a transparent body.
struct BodyIntegral<'a> {
    table: &'a SpectralTable,
    /// The body as an interface, in which nothing is trapped.
    body: TransparentBody,
    gaussians: Vec<NodeGaussian<'a>>,
}

impl AlbedoTable {
    /// Builds the table of a transparent body, from the table of its relief magnified by the index. `None` where no
    /// albedo exceeds one, and for a table of amplitudes, whose powers do not add.
    pub(crate) fn build_of_body(
        table: &SpectralTable,
        body: TransparentBody,
        sizes: Option<&SizeRange>,
        progress: &Progress,
    ) -> Option<Self> {
        if table.quantity() != NodeQuantity::Power {
            return None;
        }
        let integral = BodyIntegral::new(table, body);
        // Phase in radians between the relief's lowest and highest point, per unit of w, at the shortest wavelength.
        let phase_max = TAU / (1e-3 * WAVELENGTH_MIN_NM) * 2.0 / table.kappa_knee();
        let (planes, sizes) = match sizes {
            None => (PLANES, None),
            Some(sizes) => {
                let (planes, axes) = SizeAxes::covering(sizes, PLANES, phase_max, SLAB_PHASE);
                (planes, Some(axes))
            }
        };
        let per_nm = f64::from(planes - 1) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM);
        let layout = match sizes {
            None => AlbedoLayout {
                cells: CELLS,
                planes,
                wavelength_min_nm: WAVELENGTH_MIN_NM as f32,
                planes_per_nm: per_nm as f32,
                sizes,
            },
            Some(_) => AlbedoLayout { cells: CELLS, planes, wavelength_min_nm: 0.0, planes_per_nm: 0.0, sizes },
        };
        // Wavelengths λ' of a plane and λ" of a slab in nm.
        let wavelengths_nm = |plane: usize, slab: u32| match &sizes {
            None => [WAVELENGTH_MIN_NM + plane as f64 / per_nm; 2],
            Some(axes) => [axes.plane_nm(plane as f64), axes.slab_nm(slab)],
        };
        let grid = Grid { cells: CELLS };
        let slabs = sizes.map_or(1, |axes| axes.slabs);
        let in_slab = planes as usize * grid.in_plane();
        let steps = progress.of_steps(2 * slabs as usize * in_slab);
        let mut words = Vec::new();
        for (is_below, slab) in [false, true].into_iter().flat_map(|side| (0..slabs).map(move |slab| (side, slab))) {
            let value = |node: usize| {
                steps.one();
                let (plane, node) = (node / grid.in_plane(), node % grid.in_plane());
                let ([x, y, cos], radius) = grid.direction([node % grid.side(), node / grid.side()].map(|i| i as f64));
                if grid.is_beyond(radius) {
                    return 0.0;
                }
                let wi = [x, y, if is_below { -cos } else { cos }];
                let albedo = integral.albedo(wi, wavelengths_nm(plane, slab));
                let excess = (albedo - 1.0).max(0.0);
                ((excess + MARGIN * (excess / MARGIN_FROM).min(1.0)) * cos * cos) as f32
            };
            let values: Vec<f32> = (0..in_slab).into_par_iter().map(value).collect();
            words.extend(packets(grid, planes, |node| values[node]));
        }
        let table = Self { layout, words };
        (!table.is_one()).then_some(table)
    }
}

impl<'a> BodyIntegral<'a> {
    fn new(table: &'a SpectralTable, body: TransparentBody) -> Self {
        // Frequencies up to the cutoff, beyond which the pixels do not resolve the relief.
        let mut gaussians = merged_gaussians(table);
        gaussians.retain(|gaussian| table.is_resolved(gaussian.f));
        Self { table, body: TransparentBody { is_film: false, ..body }, gaussians }
    }

    /// Reflected and transmitted power over the power incident from `wi`, a direction on its own side of the relief.
    /// The wavelengths in nm are λ' for frequencies and λ" for κ.
    fn albedo(&self, wi: Vec3, [nm, depth_nm]: [f64; 2]) -> f64 {
        let lit = Real4::lit;
        let incident = self.body.side::<Lanes>(wi.map(lit));
        let mut albedo = lit(0.0);
        for is_below in [false, true] {
            let to_below = Lanes::mask(is_below);
            let passage = Passage::at_body(self.body, &incident, to_below);
            // Length of wave vectors over n.
            let length = self.body.reach(is_below);
            for gaussians in self.gaussians.chunks(Lanes::COUNT) {
                let at = |lane: usize| &gaussians[Ord::min(lane, gaussians.len() - 1)];
                let [x, y] = [0, 1].map(|axis| {
                    let drawn = Lanes::pack(|lane| 1e-3 * nm * at(lane).f[axis]) - passage.tangential[axis];
                    drawn * passage.turn * lit(1.0 / length)
                });
                let cos_squared = lit(1.0) - x.fma(x, y * y);
                let cos = cos_squared.max(lit(0.0)).sqrt();
                let wo = [x, y, Real4::select(to_below, -cos, cos)];
                let pair = self.body.pair(&incident, &self.body.side::<Lanes>(wo));
                let kappa = pair.normal() * lit(TAU * 1e3 / depth_nm);
                let power = PowerCurves::<Lanes>::new(self.table, kappa).power(|lane| &at(lane).record);
                // Surplus lanes repeat the last Gaussian.
                let is_counted = Lanes::pack(|lane| if lane < gaussians.len() { 1.0 } else { 0.0 });
                let scattered = power.max(lit(0.0)) * pair.power() * is_counted;
                albedo += Real4::select(lit(0.0).lt(cos_squared), scattered, lit(0.0));
            }
        }
        Lanes::total(albedo)
    }
}
