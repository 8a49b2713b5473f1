//! The albedo by integrals over the hemisphere, lobe by lobe: slow and fine, to judge what is quick.

use super::lobe::{Lobe, PHASE_PANEL, Setting};
use super::quadrature::hemisphere;
use super::surface::Options;
use super::{Pair, Vec3};
use crate::table::{KernelKind, NodeCurve, SpectralTable, WAVELENGTH_MIN_NM};
use std::f64::consts::TAU;

/// Standard deviations of a node in a panel of 16 places, and most panels of an integral over the hemisphere.
const PANEL_SIGMAS: f64 = 18.0;
const PANELS_MAX: f64 = 24.0;
/// Phase in radians from the relief's lowest point to its highest that one cosθo more makes.
fn phase(table: &SpectralTable, wavelength_um: f64) -> f64 {
    // The knee is the reciprocal of half the range of heights.
    TAU / wavelength_um * 2.0 / table.kappa_knee()
}

/// Widths in radians, along x and y, of panels in which the density of a table of wide nodes is smooth: in the directions,
/// and in κ, which changes with cosθo.
fn panel_widths(table: &SpectralTable, wavelength_um: f64) -> [f64; 2] {
    let deep = PHASE_PANEL / phase(table, wavelength_um);
    panel_widths_of_nodes(table, wavelength_um).map(|width| width.min(deep))
}

fn panel_widths_of_nodes(table: &SpectralTable, wavelength_um: f64) -> [f64; 2] {
    let lattice = table.lattice();
    [&lattice.x, &lattice.y].map(|axis| PANEL_SIGMAS * wavelength_um * axis.sigma / axis.period_um)
}

/// About how many panels of the nodes' width an integral over the hemisphere takes.
fn panels_over_the_hemisphere(table: &SpectralTable) -> f64 {
    let wavelength_um = 1e-3 * WAVELENGTH_MIN_NM;
    let lattice = table.lattice();
    let widths = panel_widths_of_nodes(table, wavelength_um);
    let panels = [(&lattice.x, widths[0]), (&lattice.y, widths[1])]
        .map(|(axis, width)| (2.0 * (wavelength_um * axis.cutoff / axis.period_um).min(1.0).asin() / width).ceil());
    panels[0] * panels[1]
}

/// The lobes of an ensemble table, a lobe a node.
pub(super) struct Lobes<'a> {
    table: &'a SpectralTable,
    lobes: Vec<Lobe>,
    /// Whether nodes are so wide that the density is smooth and is integrated over the hemisphere.
    smooth: bool,
    /// Whether the limit of what is known cuts into lobes.
    cut: bool,
}

impl<'a> Lobes<'a> {
    /// `None` for a table of amplitudes, whose powers do not add.
    pub fn new(table: &'a SpectralTable) -> Option<Self> {
        if table.kernel() != KernelKind::Power {
            return None;
        }
        let (x, y) = (&table.lattice().x, &table.lattice().y);
        let lobe = |(jx, jy, record): (i64, i64, &[f32])| Lobe {
            f: [jx as f64 / x.period_um, jy as f64 / y.period_um],
            sigma_f: [x.sigma / x.period_um, y.sigma / y.period_um],
            record: record.to_vec(),
        };
        let smooth = panels_over_the_hemisphere(table) <= PANELS_MAX;
        let lobes = if smooth { Vec::new() } else { table.kept_nodes().into_iter().map(lobe).collect() };
        Some(Self { table, lobes, smooth, cut: x.cutoff.is_finite() || y.cutoff.is_finite() })
    }

    /// `∫ f_r cosθo · factor(wo) dωo` over the upper hemisphere, Fresnel reflectance left out.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64, options: &Options, factor: impl Fn(Vec3) -> f64) -> f64 {
        let wavelength_um = wavelength_nm * 1e-3;
        let lattice = self.table.lattice();
        let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        let mut sum = 0.0;
        if self.smooth {
            for (wo, area) in hemisphere(known, panel_widths(self.table, wavelength_um), wi[2]) {
                if let Some(pair) = Pair::new(wi, wo) {
                    let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                    let value = self.table.density(f, pair.kappa(wavelength_um)) / (wavelength_um * wavelength_um);
                    sum += area * options.angular_factor(&pair) * value * factor(wo);
                }
            }
            return sum;
        }
        let setting = Setting { wi, wavelength_um, known, phase: phase(self.table, wavelength_um), cut: self.cut };
        for lobe in &self.lobes {
            lobe.integrate(&setting, true, |wo, area| {
                if let Some(pair) = Pair::new(wi, wo) {
                    let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                    sum += area * curve.power(&lobe.record) * options.angular_factor(&pair) * factor(wo);
                }
            });
        }
        sum
    }
}
