//! A table's power gathered into fewer, wider lobes, for the integrals over the hemisphere.

use super::lobe::{Lobe, PHASE_PANEL, Setting};
use super::quadrature::hemisphere;
use super::surface::Options;
use super::{Pair, Vec3};
use crate::table::{BANDS, HEADER, KernelKind, NodeCurve, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::f64::consts::TAU;

/// Standard deviation in direction cosines below which lobes make sharp features of the albedo.
const FEATURES: f64 = 0.03;
/// Standard deviations of a node in a panel of 16 places, and most panels of an integral over the hemisphere.
const PANEL_SIGMAS: f64 = 18.0;
const PANELS_MAX: f64 = 24.0;
/// Lobes below which each makes a feature of the albedo.
const FEW: usize = 40;
/// Nodes that stay alone whatever their number, the strongest first.
const SINGLES: usize = 48;
/// Lobes up to which each is integrated finely, and not the strongest alone.
const FINE: usize = 300;
/// Times as many nodes are left alone where pixels are so coarse that they limit what is known, if that is all: the limit
/// then cuts through a good part of the lobes.
const LIMITED: usize = 8;

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

/// About how many panels an integral over the hemisphere takes; `None` where nodes are so narrow that each is better
/// integrated for itself.
fn panels_over_the_hemisphere(table: &SpectralTable) -> Option<f64> {
    let wavelength_um = 1e-3 * WAVELENGTH_MIN_NM;
    let lattice = table.lattice();
    let ranges =
        [&lattice.x, &lattice.y].map(|axis| 2.0 * (wavelength_um * axis.cutoff / axis.period_um).min(1.0).asin());
    let panels = |widths: [f64; 2]| (ranges[0] / widths[0]).ceil() * (ranges[1] / widths[1]).ceil();
    (panels(panel_widths_of_nodes(table, wavelength_um)) <= PANELS_MAX)
        .then(|| panels(panel_widths(table, wavelength_um)))
}

/// The lobes of an ensemble table.
pub(super) struct PowerBins<'a> {
    table: &'a SpectralTable,
    lobes: Vec<Lobe>,
    /// Whether every lobe is integrated across as well as along its radius. Many lobes that tile the plane need not.
    fine: bool,
    /// Where nodes are so wide that the density is smooth and is integrated over the hemisphere, about how many panels that
    /// takes.
    panels: Option<f64>,
    /// Whether lobes may be oblong, and the limit of what is known cuts into them.
    cut: bool,
}

impl<'a> PowerBins<'a> {
    /// Gathers the nodes of `table` into about `target` lobes; with at most that many nodes, each is its own. `usize::MAX`
    /// asks for each node to be integrated finely however many there are. Nodes so wide that the density is smooth are
    /// integrated together, over the hemisphere. `None` for a table of amplitudes, whose powers do not add.
    pub fn new(table: &'a SpectralTable, target: usize) -> Option<Self> {
        if table.kernel() != KernelKind::Power {
            return None;
        }
        let (x, y) = (&table.lattice().x, &table.lattice().y);
        let mut nodes = table.kept_nodes();
        let strength = |record: &[f32]| record[..BANDS].iter().sum::<f32>();
        nodes.sort_by(|a, b| strength(b.2).total_cmp(&strength(a.2)));
        let mut lobes = Vec::new();
        let limited = x.cutoff.is_finite() || y.cutoff.is_finite();
        let cut = limited && nodes.len() <= target.saturating_mul(LIMITED);
        let side = if cut { 1 } else { (nodes.len() as f64 / target as f64).sqrt().ceil() as i64 };
        let singles = if side <= 1 { nodes.len() } else { SINGLES };
        let mut groups = std::collections::BTreeMap::<(i64, i64), Vec<(i64, i64, &[f32])>>::new();
        for (i, &(jx, jy, record)) in nodes.iter().enumerate() {
            if i < singles {
                lobes.push(Lobe {
                    f: [jx as f64 / x.period_um, jy as f64 / y.period_um],
                    sigma_f: [x.sigma / x.period_um, y.sigma / y.period_um],
                    record: record.to_vec(),
                });
            } else {
                groups.entry((jy.div_euclid(side), jx.div_euclid(side))).or_default().push((jx, jy, record));
            }
        }
        for ((gy, gx), members) in groups {
            let mut record = vec![0f32; members.iter().map(|m| m.2.len()).max().unwrap_or(HEADER)];
            for (_, _, member) in &members {
                record.iter_mut().zip(*member).for_each(|(sum, value)| *sum += value);
            }
            let spread = |sigma: f64| (sigma * sigma + (side * side - 1) as f64 / 12.0).sqrt();
            let middle = |g: i64| (g * side) as f64 + 0.5 * (side - 1) as f64;
            lobes.push(Lobe {
                f: [middle(gx) / x.period_um, middle(gy) / y.period_um],
                sigma_f: [spread(x.sigma) / x.period_um, spread(y.sigma) / y.period_um],
                record,
            });
        }
        let panels = panels_over_the_hemisphere(table);
        Some(Self { table, fine: target == usize::MAX || lobes.len() <= FINE, lobes, panels, cut })
    }

    /// Whether lobes are so narrow that the albedo has sharp features where one leaves along the surface.
    pub fn narrow(&self) -> bool {
        let widest = self.lobes.iter().flat_map(|lobe| lobe.sigma_f).fold(0.0, f64::max);
        1e-3 * WAVELENGTH_MAX_NM * widest < FEATURES
    }

    /// Whether there are few lobes, all of them narrow.
    pub fn sharp(&self) -> bool {
        self.lobes.len() < FEW && self.narrow()
    }

    /// About how many places [`PowerBins::visit`] takes, as a measure of its cost.
    pub fn places(&self, options: &Options) -> usize {
        /// Places of a lobe on average at least: one in the middle of the hemisphere, dozens about the horizon.
        const OF_A_LOBE: usize = 10;
        /// cosθ of incidences at which places are counted.
        const COSINES: [f64; 3] = [1.0, 0.6, 0.2];
        let lattice = self.table.lattice();
        if let Some(panels) = self.panels {
            return 256 * panels as usize * lattice.x.taps * lattice.y.taps;
        }
        let mut counted = 0;
        for cos in COSINES {
            let across = ((1.0 - cos * cos) / 2.0).sqrt();
            let middle_nm = 0.5 * (WAVELENGTH_MIN_NM + WAVELENGTH_MAX_NM);
            self.visit([across, across, cos], middle_nm, options, |_, _| counted += 1);
        }
        (OF_A_LOBE * self.lobes.len()).max(counted / COSINES.len())
    }

    /// Wavelengths in nm, from `low_nm` to `high_nm`, at which light from `wi` leaves just above the horizon in one of
    /// the stronger lobes: there the lobe's mean of 1/cosθo peaks, and with it the albedo.
    pub fn grazing_wavelengths(&self, wi: Vec3, low_nm: f64, high_nm: f64) -> Vec<f64> {
        /// Standard deviations inside the horizon: where the mean of `max(0, 1 − ρ)^(−½)` over a Gaussian is
        /// largest, and further in, where a scaling that rises with cosθo moves the peak.
        const INSIDE: [f64; 2] = [0.77, 1.8];
        let middle_um = 0.5e-3 * (low_nm + high_nm);
        let mut found = Vec::new();
        for lobe in self.lobes.iter().take(SINGLES) {
            let [fx, fy] = lobe.f;
            let sigma = middle_um * lobe.sigma_f[0].max(lobe.sigma_f[1]);
            let (a, b) = (fx * fx + fy * fy, fx * wi[0] + fy * wi[1]);
            for radius in INSIDE.map(|inside| 1.0 - inside * sigma) {
                // |λf − wi| = radius along the surface.
                let discriminant = b * b - a * (wi[0] * wi[0] + wi[1] * wi[1] - radius * radius);
                if a > 0.0 && discriminant >= 0.0 {
                    let root = discriminant.sqrt();
                    let both = [1e3 * (b - root) / a, 1e3 * (b + root) / a];
                    found.extend(both.iter().filter(|nm| (low_nm..=high_nm).contains(*nm)));
                }
            }
        }
        found
    }

    /// `∫ f_r cosθo · scale(wo) dωo` over the upper hemisphere, Fresnel reflectance left out.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64, options: &Options, scale: impl Fn(Vec3) -> f64) -> f64 {
        let mut sum = 0.0;
        self.visit(wi, wavelength_nm, options, |wo, part| sum += part * scale(wo));
        sum
    }

    /// Visits directions with the parts of `∫ f_r cosθo dωo` that they stand for.
    pub fn visit(&self, wi: Vec3, wavelength_nm: f64, options: &Options, mut visit: impl FnMut(Vec3, f64)) {
        let wavelength_um = wavelength_nm * 1e-3;
        let lattice = self.table.lattice();
        let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        if self.panels.is_some() {
            for (wo, area) in hemisphere(known, panel_widths(self.table, wavelength_um), wi[2]) {
                if let Some(pair) = Pair::new(wi, wo) {
                    let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                    let value = self.table.density(f, pair.kappa(wavelength_um));
                    visit(wo, area * options.angular_factor(&pair) * value / (wavelength_um * wavelength_um));
                }
            }
            return;
        }
        let setting = Setting { wi, wavelength_um, known, phase: phase(self.table, wavelength_um), cut: self.cut };
        for (i, lobe) in self.lobes.iter().enumerate() {
            lobe.integrate(&setting, self.fine || i < SINGLES, |wo, area| {
                if let Some(pair) = Pair::new(wi, wo) {
                    let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                    visit(wo, area * curve.power(&lobe.record) * options.angular_factor(&pair));
                }
            });
        }
    }
}
