//! A table's power in a form that integrals over the hemisphere are quick with: strong narrow orders one by one, all else on a grid.

use crate::reflectance::lobe::{Lobe, PHASE_PANEL, Setting};
use crate::reflectance::quadrature::hemisphere;
use crate::reflectance::surface::Options;
use crate::reflectance::{Pair, Vec3};
use crate::table::{NodeCurve, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Largest standard deviation, in direction cosines at the longest wavelength, of nodes that are integrated one by one.
const NARROW: f64 = 0.1;
/// Nodes up to which all are integrated one by one, and how many otherwise, the strongest.
const ALL_SINGLE: usize = 640;
const SINGLES: usize = 64;
/// Least spacing of the grid in cycles/µm, and in standard deviations of wide nodes.
const SPACING_MIN: f64 = 0.22;
const SPACING_SIGMAS: f64 = 0.7;
/// Widest panels of 16 places in radians, and how many standard deviations of what the grid holds one may be wide.
const PANEL_MAX: f64 = 1.6;
const PANEL_SIGMAS: f64 = 18.0;
/// The same of many narrow nodes, none of them strong.
const DENSE_PANEL_SIGMAS: f64 = 40.0;
/// Steps in κ for each knot of the table's splines, linear between.
const STEPS_A_KNOT: f64 = 3.0;
/// Standard deviations out to which a node wider than the spacing is spread over the grid.
const SPREAD: f64 = 4.0;

/// Standard deviations inside the horizon where the mean of `max(0, 1 − ρ)^(−½)` over a Gaussian is largest.
const INSIDE: f64 = 0.77;

/// See the module.
pub(super) struct Gathered<'a> {
    table: &'a SpectralTable,
    options: &'a Options,
    singles: Vec<Lobe>,
    grid: Option<PowerGrid>,
    /// Range of heights in µm.
    range_um: f64,
}

impl<'a> Gathered<'a> {
    /// Gathers an ensemble table.
    pub fn new(table: &'a SpectralTable, options: &'a Options) -> Self {
        let (x, y) = (&table.lattice().x, &table.lattice().y);
        let sigma = [x.sigma / x.period_um, y.sigma / y.period_um];
        let mut nodes = table.kept_nodes();
        let curves = [0.1, 0.3, 0.5, 0.7, 0.9].map(|part| NodeCurve::new(table, part * table.kappa_max()));
        let strength = |record: &[f32]| curves.iter().map(|curve| curve.power(record).abs()).sum::<f64>();
        nodes.sort_by_cached_key(|node| std::cmp::Reverse((strength(node.2) * 1e12) as u64));
        let narrow = 1e-3 * WAVELENGTH_MAX_NM * sigma[0].max(sigma[1]) < NARROW;
        let limited = x.cutoff.is_finite() || y.cutoff.is_finite();
        let count = match narrow {
            true if nodes.len() <= ALL_SINGLE && !limited => nodes.len(),
            true => SINGLES.min(nodes.len()),
            false => 0,
        };
        let at = |jx: i64, jy: i64| [jx as f64 / x.period_um, jy as f64 / y.period_um];
        let single =
            |&(jx, jy, record): &(i64, i64, &[f32])| Lobe { f: at(jx, jy), sigma_f: sigma, record: record.to_vec() };
        let singles = nodes[..count].iter().map(single).collect();
        let rest: Vec<_> = nodes[count..].iter().map(|&(jx, jy, record)| (at(jx, jy), record)).collect();
        let grid = (!rest.is_empty()).then(|| PowerGrid::new(table, &rest, sigma));
        // The knee is the reciprocal of half the range of heights.
        Self { table, options, singles, grid, range_um: 2.0 / table.kappa_knee() }
    }

    /// Wavelengths in nm, between two, at which light from `wi` leaves just above the horizon in one of the stronger narrow orders: there its
    /// mean of 1/cosθo peaks, and with it the albedo.
    pub fn grazing_wavelengths(&self, wi: Vec3, [low_nm, high_nm]: [f64; 2]) -> Vec<f64> {
        let middle_um = 0.5e-3 * (low_nm + high_nm);
        let mut found = Vec::new();
        let ridged = if self.has_ridges() { self.singles.as_slice() } else { &[] };
        for lobe in ridged.iter().take(SINGLES) {
            let [fx, fy] = lobe.f;
            let sigma = middle_um * lobe.sigma_f[0].max(lobe.sigma_f[1]);
            let (a, b) = (fx * fx + fy * fy, fx * wi[0] + fy * wi[1]);
            let radius = 1.0 - INSIDE * sigma;
            // |λf − wi| = radius along the surface.
            let discriminant = b * b - a * (wi[0] * wi[0] + wi[1] * wi[1] - radius * radius);
            if a > 0.0 && discriminant >= 0.0 {
                let root = discriminant.sqrt();
                let both = [1e3 * (b - root) / a, 1e3 * (b + root) / a];
                found.extend(both.into_iter().filter(|nm| (low_nm..=high_nm).contains(nm)));
            }
        }
        found
    }

    /// Whether there are narrow orders alone: where one leaves along the surface the albedo has a ridge.
    pub fn has_ridges(&self) -> bool {
        self.grid.is_none()
    }

    /// About how many places [`Gathered::visit`] takes, at most.
    pub fn places(&self) -> usize {
        let mut most = 1;
        for (wi, nm) in [([0.0, 0.0, 1.0], 400.0), ([0.6, 0.0, 0.8], 500.0), ([0.0, 0.8, 0.6], 600.0)] {
            let mut count = 0;
            self.visit(wi, nm, |_, _| count += 1);
            most = most.max(count);
        }
        most
    }

    /// Visits directions with the parts of `∫ f_r cosθo dωo` that they stand for, Fresnel reflectance left out.
    pub fn visit(&self, wi: Vec3, wavelength_nm: f64, mut visit: impl FnMut(Vec3, f64)) {
        let wavelength_um = wavelength_nm * 1e-3;
        let lattice = self.table.lattice();
        let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        let phase = TAU / wavelength_um * self.range_um;
        let setting = Setting { wi, wavelength_um, known, phase, cut: false };
        for lobe in &self.singles {
            lobe.integrate(&setting, true, |wo, area| {
                if let Some(pair) = Pair::new(wi, wo) {
                    let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                    visit(wo, area * curve.power(&lobe.record) * self.options.angular_factor(&pair));
                }
            });
        }
        let Some(grid) = &self.grid else { return };
        let sigmas = if self.singles.is_empty() { PANEL_SIGMAS } else { DENSE_PANEL_SIGMAS };
        let widths = grid.sigma.map(|sigma| (sigmas * sigma * wavelength_um).min(PANEL_MAX).min(PHASE_PANEL / phase));
        for (wo, area) in hemisphere(known, widths, wi[2]) {
            if let Some(pair) = Pair::new(wi, wo) {
                let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                let value = grid.density(f, pair.kappa(wavelength_um));
                visit(wo, area * self.options.angular_factor(&pair) * value / (wavelength_um * wavelength_um));
            }
        }
    }
}

/// Powers of a table's nodes gathered on a coarser grid of frequencies, linear between its nodes and between steps of κ.
struct PowerGrid {
    /// Cycles/µm between nodes.
    spacing: [f64; 2],
    /// Standard deviations in cycles/µm of a node of the table as the grid holds it.
    sigma: [f64; 2],
    /// Nodes on either side of frequency zero.
    reach: [usize; 2],
    /// Steps in κ, and how many make a rad/µm.
    steps: usize,
    steps_per_kappa: f64,
    /// Power per area at every step, row-major from node `(−reach, −reach)`.
    powers: Vec<f32>,
}

impl PowerGrid {
    fn new(table: &SpectralTable, nodes: &[([f64; 2], &[f32])], sigma: [f64; 2]) -> Self {
        let spacing = sigma.map(|sigma| (SPACING_SIGMAS * sigma).max(SPACING_MIN));
        let reach = spacing.map(|spacing| (2e3 / WAVELENGTH_MIN_NM / spacing).ceil() as usize + 1);
        let len = nodes.iter().map(|node| node.1.len()).max().unwrap_or(0);
        let columns = 2 * reach[0] + 1;
        let mut records = vec![0f32; columns * (2 * reach[1] + 1) * len];
        for (f, record) in nodes {
            let [along_x, along_y] = [0, 1].map(|c| shares(f[c] / spacing[c], sigma[c] / spacing[c], reach[c]));
            for (iy, wy) in &along_y {
                for (ix, wx) in &along_x {
                    let weight = (wx * wy / (spacing[0] * spacing[1])) as f32;
                    let sum = &mut records[(iy * columns + ix) * len..][..record.len()];
                    sum.iter_mut().zip(*record).for_each(|(sum, value)| *sum += weight * value);
                }
            }
        }
        let steps_per_kappa = STEPS_A_KNOT / table.kappa_step();
        let steps = (table.kappa_max() * steps_per_kappa).ceil() as usize + 2;
        let curves: Vec<_> = (0..steps).map(|i| NodeCurve::new(table, i as f64 / steps_per_kappa)).collect();
        let powers = |record: &[f32]| -> Vec<f32> { curves.iter().map(|curve| curve.power(record) as f32).collect() };
        let powers: Vec<f32> = records.par_chunks(len).flat_map_iter(powers).collect();
        // Between nodes a hat widens what it joins by a sixth of the squared spacing, and as much again what was shared out.
        let sigma = [0, 1].map(|c| (sigma[c] * sigma[c] + spacing[c] * spacing[c] / 4.0).sqrt());
        Self { spacing, sigma, reach, steps, steps_per_kappa, powers }
    }

    /// Power per area of frequencies at `f` (cycles/µm) and `kappa` (rad/µm).
    #[inline]
    fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        let [(ix, tx), (iy, ty)] = [0, 1].map(|c| {
            let at = (f[c] / self.spacing[c] + self.reach[c] as f64).clamp(0.0, (2 * self.reach[c]) as f64 - 1e-6);
            (at as usize, at.fract())
        });
        let step = (kappa * self.steps_per_kappa).min(self.steps as f64 - 1.5);
        let (k, tk) = (step as usize, step.fract());
        let columns = 2 * self.reach[0] + 1;
        let value = |dx: usize, dy: usize| {
            let pair = &self.powers[((iy + dy) * columns + ix + dx) * self.steps + k..][..2];
            f64::from(pair[0]) + tk * f64::from(pair[1] - pair[0])
        };
        let row = |dy: usize| (1.0 - tx) * value(0, dy) + tx * value(1, dy);
        ((1.0 - ty) * row(0) + ty * row(1)).max(0.0)
    }
}

/// The nodes of one axis, counted from the first, that a Gaussian about `at` is shared among, with shares that sum to one; all in nodes.
fn shares(at: f64, sigma: f64, reach: usize) -> Vec<(usize, f64)> {
    let last = 2 * reach as i64;
    let from_first = at + reach as f64;
    let mut shares: Vec<(i64, f64)> = if sigma < SPACING_SIGMAS {
        let t = from_first - from_first.floor();
        vec![(from_first.floor() as i64, 1.0 - t), (from_first.floor() as i64 + 1, t)]
    } else {
        let within = (from_first - SPREAD * sigma).ceil() as i64..=(from_first + SPREAD * sigma).floor() as i64;
        within.map(|i| (i, (-0.5 * ((i as f64 - from_first) / sigma).powi(2)).exp())).collect()
    };
    let total: f64 = shares.iter().map(|share| share.1).sum();
    shares.retain(|share| (0..=last).contains(&share.0));
    shares.into_iter().map(|(i, share)| (i as usize, share / total)).collect()
}
