//! The power of a table of wide nodes on a grid of frequencies, for integrals by the thousand.

use crate::table::{NodeCurve, SpectralTable, WAVELENGTH_MIN_NM};
use rayon::prelude::*;

/// Spacing of the grid in standard deviations of a node; what lies linearly between errs by an eighth of its square at a node's peak.
const SPACING_SIGMAS: f64 = 0.4;
/// Standard deviations out to which a node counts.
const REACH_SIGMAS: f64 = 4.0;
/// Steps in κ for each knot of the table's splines.
const STEPS_A_KNOT: f64 = 3.0;

/// The powers of an ensemble table, linear between frequencies and between steps of κ.
pub(super) struct PowerGrid {
    /// Nodes per cycle/µm, and on either side of frequency zero.
    per_f: [f64; 2],
    reach: [usize; 2],
    /// Steps in κ, and how many make a rad/µm.
    steps: usize,
    steps_per_kappa: f64,
    /// µm² at every step, row-major from node `(−reach, −reach)`.
    powers: Vec<f32>,
}

impl PowerGrid {
    pub fn new(table: &SpectralTable) -> Self {
        let axes = [&table.lattice().x, &table.lattice().y];
        let sigma = axes.map(|axis| axis.sigma / axis.period_um);
        let per_f = sigma.map(|sigma| 1.0 / (SPACING_SIGMAS * sigma));
        let reach = [0, 1].map(|c| {
            let known = (axes[c].cutoff / axes[c].period_um).min(2e3 / WAVELENGTH_MIN_NM);
            (known * per_f[c]).ceil() as usize + 1
        });
        let steps_per_kappa = STEPS_A_KNOT / table.kappa_step();
        let steps = (table.kappa_max() * steps_per_kappa).ceil() as usize + 2;
        let curves: Vec<_> = (0..steps).map(|i| NodeCurve::new(table, i as f64 / steps_per_kappa)).collect();
        let kept = table.kept_nodes();
        let of_nodes: Vec<Vec<f32>> = kept
            .par_iter()
            .map(|(_, _, record)| curves.iter().map(|curve| (table.norm() * curve.power(record)) as f32).collect())
            .collect();
        let [columns, rows] = reach.map(|reach| 2 * reach + 1);
        // One axis after the other, since a node's Gaussian is a product.
        let at = |c: usize, j: i64| j as f64 / axes[c].period_um * per_f[c] + reach[c] as f64;
        let spread = REACH_SIGMAS / SPACING_SIGMAS;
        let near = |centre: f64, count: usize| {
            let (low, high) = ((centre - spread).ceil().max(0.0) as usize, (centre + spread).floor().max(-1.0) as i64);
            (low..count.min((high + 1) as usize)).map(move |i| {
                let z = (i as f64 - centre) * SPACING_SIGMAS;
                (i, (-0.5 * z * z).exp() as f32)
            })
        };
        let mut by_row = vec![Vec::new(); rows];
        for ((jx, jy, _), powers) in kept.iter().zip(&of_nodes) {
            for (row, share) in near(at(1, *jy), rows) {
                by_row[row].push((at(0, *jx), share, powers));
            }
        }
        let row = |nodes: Vec<(f64, f32, &Vec<f32>)>| {
            let mut sums = vec![0f32; columns * steps];
            for (centre, share, powers) in nodes {
                for (column, along) in near(centre, columns) {
                    let sum = &mut sums[column * steps..][..steps];
                    sum.iter_mut().zip(powers).for_each(|(sum, power)| *sum += share * along * power);
                }
            }
            sums
        };
        let powers = by_row.into_par_iter().flat_map_iter(row).collect();
        Self { per_f, reach, steps, steps_per_kappa, powers }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm, brought into the grid, and κ in rad/µm; never negative.
    #[inline]
    pub fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        let [(ix, tx), (iy, ty)] = [0, 1].map(|c| {
            let at = (f[c] * self.per_f[c] + self.reach[c] as f64).clamp(0.0, (2 * self.reach[c]) as f64 - 1e-6);
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
