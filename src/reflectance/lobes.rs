//! The albedo by integrals over the hemisphere, lobe by lobe.

use super::lobe::{Lobe, PHASE_PANEL, Setting};
use super::power_grid::PowerGrid;
use super::quadrature::hemisphere;
use super::surface::Options;
use super::{ComplexIndex, Obliquity, Pair, Vec3};
use crate::table::{KernelKind, NodeCurve, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Standard deviations of a node in a panel of 16 places, and most panels of an integral over the hemisphere.
const PANEL_SIGMAS: f64 = 18.0;
const PANELS_MAX: f64 = 24.0;
/// Nodes up to which a quick integral takes all one by one.
const ALL_SINGLE: usize = 640;
/// How many of the strongest it does where there are more, and the side in cycles/µm of the squares whose nodes it takes for one lobe.
const SINGLES: usize = 16;
const MERGED: f64 = 0.14;

/// The strongest narrow orders, whose ridges are looked for.
const RIDGES: usize = 64;
/// Standard deviations inside the horizon where the mean of `max(0, 1 − ρ)^(−½)` over a Gaussian is largest, and the wavelength whose
/// Gaussian and index are taken.
const INSIDE: f64 = 0.77;
const MIDDLE_UM: f64 = 0.55;

/// The power of an ensemble table in the form that integrals over it take.
pub(super) struct Lobes<'a> {
    table: &'a SpectralTable,
    options: &'a Options,
    power: Power<'a>,
}

enum Power<'a> {
    /// Lobes: one for a node, or for a square of nodes, each integrated by few places; and whether those whom the pixels' limit cuts are
    /// integrated to it.
    Lobes { singles: Vec<Lobe<'a>>, merged: Vec<Lobe<'a>>, cut: bool },
    /// The table as it is, smooth since its nodes are wide, integrated over the hemisphere.
    Smooth,
    /// The same, tabulated.
    Grid(PowerGrid),
}

impl<'a> Lobes<'a> {
    /// For integrals that others are judged by; `None` for a table of amplitudes, whose powers do not add.
    pub fn fine(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let lobes = || Power::Lobes { singles: nodes(table), merged: Vec::new(), cut: is_limited(table) };
        Self::new(table, options, lobes, || Power::Smooth)
    }

    /// The same for integrals by the thousand.
    pub fn quick(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let lobes = || {
            let (singles, merged) = merged(table);
            Power::Lobes { singles, merged, cut: false }
        };
        Self::new(table, options, lobes, || Power::Grid(PowerGrid::new(table)))
    }

    fn new(
        table: &'a SpectralTable,
        options: &'a Options,
        lobes: impl Fn() -> Power<'a>,
        smooth: impl Fn() -> Power<'a>,
    ) -> Option<Self> {
        (table.kernel() == KernelKind::Power).then(|| {
            let power = if panels_over_the_hemisphere(table) <= PANELS_MAX { smooth() } else { lobes() };
            Self { table, options, power }
        })
    }

    /// Visits directions with the parts of `∫ f_r cosθo dωo` that they stand for, Fresnel reflectance left out; the small slope's
    /// factor is in them.
    pub fn visit(&self, wi: Vec3, wavelength_nm: f64, mut visit: impl FnMut(Vec3, f64)) {
        let wavelength_um = wavelength_nm * 1e-3;
        let lattice = self.table.lattice();
        let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        let mut of_lobes = |lobes: &[Lobe], cut: bool, fine: bool| {
            let setting = Setting { wi, wavelength_um, known, phase: phase(self.table, wavelength_um), cut };
            for lobe in lobes {
                lobe.integrate(&setting, fine, |wo, area| {
                    if let Some(pair) = Pair::new(wi, wo) {
                        let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                        visit(wo, area * curve.power(&lobe.record) * self.options.albedo_factor(&pair, wavelength_nm));
                    }
                });
            }
        };
        let density: &dyn Fn([f64; 2], f64) -> f64 = match &self.power {
            Power::Lobes { singles, merged, cut } => {
                of_lobes(singles, *cut, true);
                return of_lobes(merged, *cut, false);
            }
            Power::Smooth => &|f, kappa| self.table.density(f, kappa),
            Power::Grid(grid) => &|f, kappa| grid.density(f, kappa),
        };
        hemisphere(known, panel_widths(self.table, wavelength_um), wi[2], |wo, area| {
            if let Some(pair) = Pair::new(wi, wo) {
                let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                let value = density(f, pair.kappa(wavelength_um)) / (wavelength_um * wavelength_um);
                visit(wo, area * self.options.albedo_factor(&pair, wavelength_nm) * value);
            }
        });
    }

    /// Whether there are narrow orders alone: where one leaves along the surface the albedo has a ridge.
    pub fn has_ridges(&self) -> bool {
        matches!(&self.power, Power::Lobes { merged, .. } if merged.is_empty())
    }

    /// A wavelength in nm at which light from `wi` leaves in a narrow order where that adds most to the albedo ([`Lobes::ridge_sine`]).
    /// `which` picks the order, one of the strongest; `None` where there is no such wavelength, or no ridge.
    pub fn ridge_nm(&self, wi: Vec3, which: usize) -> Option<f64> {
        let Power::Lobes { singles, .. } = &self.power else { return None };
        let lobe = singles.get(which / 2 % singles.len().clamp(1, RIDGES)).filter(|_| self.has_ridges())?;
        let [fx, fy] = lobe.f;
        let sigma = MIDDLE_UM * lobe.sigma_f[0].max(lobe.sigma_f[1]);
        let (a, b) = (fx * fx + fy * fy, fx * wi[0] + fy * wi[1]);
        // |λf − wi| = radius along the surface.
        let radius = self.ridge_sine().min(1.0 - INSIDE * sigma);
        let root = (b * b - a * (wi[0] * wi[0] + wi[1] * wi[1] - radius * radius)).sqrt();
        let nm = 1e3 * (if which.is_multiple_of(2) { b + root } else { b - root }) / a;
        (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&nm).then_some(nm)
    }

    /// Sine of the angle with the normal at which an order adds most to the albedo: that of the horizon, just above which its mean of
    /// 1/cosθo peaks; or, for the small slope of what is no perfect conductor, where the p state is strongest, at a cosine of about `1/|n|`.
    fn ridge_sine(&self) -> f64 {
        match (self.options.obliquity, &self.options.index) {
            (Obliquity::SmallSlope, Some(index)) => {
                let ComplexIndex { eta, k } = index.at(1e3 * MIDDLE_UM);
                let sin_squared = 1.0 - 1.0 / (eta * eta + k * k);
                if sin_squared > 0.0 { sin_squared.sqrt() } else { 1.0 }
            }
            _ => 1.0,
        }
    }

    /// About how many places [`Lobes::visit`] takes, at most.
    pub fn places(&self) -> usize {
        let count = |(wi, nm)| {
            let mut count = 0;
            self.visit(wi, nm, |_, _| count += 1);
            count
        };
        [([0.0, 0.0, 1.0], 400.0), ([0.6, 0.0, 0.8], 500.0), ([0.0, 0.8, 0.6], 600.0)]
            .map(count)
            .into_iter()
            .fold(1, usize::max)
    }
}

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

/// A lobe for each node.
fn nodes(table: &SpectralTable) -> Vec<Lobe<'_>> {
    let axes = [&table.lattice().x, &table.lattice().y];
    let sigma_f = axes.map(|axis| axis.sigma / axis.period_um);
    let kept = table.kept_nodes().into_iter();
    kept.map(|(jx, jy, record)| Lobe {
        f: [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um],
        sigma_f,
        record: record.into(),
    })
    .collect()
}

/// Whether the pixels say nothing beyond some frequency.
fn is_limited(table: &SpectralTable) -> bool {
    table.lattice().x.cutoff.is_finite() || table.lattice().y.cutoff.is_finite()
}

/// A lobe for each of the strongest nodes, and one for all others of each square, with their sum, their centre and their
/// spread.
fn merged(table: &SpectralTable) -> (Vec<Lobe<'_>>, Vec<Lobe<'_>>) {
    let curves = [0.1, 0.3, 0.5, 0.7, 0.9].map(|part| NodeCurve::new(table, part * table.kappa_max()));
    let strength = |lobe: &Lobe| curves.iter().map(|curve| curve.power(&lobe.record).abs()).sum::<f64>();
    let mut singles = nodes(table);
    singles.sort_by_cached_key(|lobe| std::cmp::Reverse((strength(lobe) * 1e12) as u64));
    if singles.len() <= ALL_SINGLE && !is_limited(table) {
        return (singles, Vec::new());
    }
    let mut squares: BTreeMap<[i64; 2], Vec<(f64, Lobe<'_>)>> = BTreeMap::new();
    for lobe in singles.split_off(SINGLES.min(singles.len())) {
        let square = lobe.f.map(|f| (f / MERGED).round() as i64);
        squares.entry(square).or_default().push((strength(&lobe).max(f64::MIN_POSITIVE), lobe));
    }
    (singles, squares.into_values().map(joined).collect())
}

/// One lobe for several of the same width, each with its weight.
fn joined(lobes: Vec<(f64, Lobe<'_>)>) -> Lobe<'_> {
    let total: f64 = lobes.iter().map(|lobe| lobe.0).sum();
    let mean = |of: &dyn Fn(&Lobe) -> f64| lobes.iter().map(|(weight, lobe)| weight * of(lobe)).sum::<f64>() / total;
    let f = [0, 1].map(|c| mean(&|lobe| lobe.f[c]));
    let sigma_f = [0, 1].map(|c| mean(&|lobe| (lobe.f[c] - f[c]).powi(2) + lobe.sigma_f[c].powi(2)).sqrt());
    let mut record = vec![0f32; lobes.iter().map(|lobe| lobe.1.record.len()).max().unwrap_or(0)];
    for (_, lobe) in &lobes {
        record.iter_mut().zip(lobe.record.iter()).for_each(|(sum, value)| *sum += value);
    }
    Lobe { f, sigma_f, record: record.into() }
}
