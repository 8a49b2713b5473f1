//! The power of a table of wide nodes on a grid of frequencies, for integrals by the thousand.

use crate::table::{HEADER, NodeCurve, SpectralTable, WAVELENGTH_MIN_NM};
use rayon::prelude::*;

/// Spacing of the grid in standard deviations of a node.
const SPACING_SIGMAS: f64 = 0.4;
/// Standard deviations out to which a node counts, on any lattice.
const REACH_SIGMAS: f64 = 4.0;
/// Steps in κ for each knot of the table's splines.
const STEPS_A_KNOT: f64 = 3.0;
/// Least number of steps: flat reliefs have few knots.
const STEPS_MIN: f64 = 40.0;

/// The powers of an ensemble table, cubic between frequencies and linear between steps of κ.
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
    pub(super) fn new(table: &SpectralTable) -> Self {
        let axes = [&table.lattice().x, &table.lattice().y];
        let sigma = axes.map(|axis| axis.sigma / axis.period_um);
        let per_f = sigma.map(|sigma| 1.0 / (SPACING_SIGMAS * sigma));
        let reach = [0, 1].map(|c| {
            let known = (axes[c].cutoff / axes[c].period_um).min(2e3 / WAVELENGTH_MIN_NM);
            (known * per_f[c]).ceil() as usize + 2
        });
        let steps_per_kappa = (STEPS_A_KNOT / table.kappa_step()).max(STEPS_MIN / table.kappa_max());
        let steps = (table.kappa_max() * steps_per_kappa).ceil() as usize + 2;
        let curves: Vec<_> = (0..steps).map(|i| NodeCurve::new(table, i as f64 / steps_per_kappa)).collect();
        let kept = table.kept_nodes();
        let of_node = |record: &[f32]| {
            // The last step before a record's end is joined with one beyond.
            let end = (record.len() - HEADER - 3) as f64 * table.kappa_step() * (1.0 - f64::EPSILON);
            let beyond = NodeCurve::new(table, end).power(record);
            let power = |(i, curve): (usize, &NodeCurve)| match i as f64 / steps_per_kappa < end {
                true => curve.power(record),
                false => beyond,
            };
            curves.iter().enumerate().map(|step| (table.norm() * power(step)) as f32).collect()
        };
        let of_nodes: Vec<Vec<f32>> = kept.par_iter().map(|(_, _, record)| of_node(record)).collect();
        let [columns, rows] = reach.map(|reach| 2 * reach + 1);
        // One axis after the other, since what joins nodes is a product.
        let at = |c: usize, j: i64| j as f64 / axes[c].period_um * per_f[c] + reach[c] as f64;
        let spread = REACH_SIGMAS / SPACING_SIGMAS;
        let near = |c: usize, centre: f64, count: usize| {
            let (joining, nodes) = (axes[c].kernel, axes[c].period_um / per_f[c]);
            let (low, high) = ((centre - spread).ceil().max(0.0) as usize, (centre + spread).floor().max(-1.0) as i64);
            (low..count.min((high + 1) as usize)).map(move |i| (i, joining.weight((i as f64 - centre) * nodes) as f32))
        };
        let mut by_row = vec![Vec::new(); rows];
        for ((jx, jy, _), powers) in kept.iter().zip(&of_nodes) {
            for (row, share) in near(1, at(1, *jy), rows) {
                by_row[row].push((at(0, *jx), share, powers));
            }
        }
        let row = |nodes: Vec<(f64, f32, &Vec<f32>)>| {
            let mut sums = vec![0f32; columns * steps];
            for (centre, share, powers) in nodes {
                for (column, along) in near(0, centre, columns) {
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
    pub(super) fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        let [(ix, tx), (iy, ty)] = [0, 1].map(|c| {
            let at = (f[c] * self.per_f[c] + self.reach[c] as f64).clamp(1.0, (2 * self.reach[c]) as f64 - 1.0 - 1e-6);
            let node = at as usize;
            (node - 1, at - node as f64)
        });
        let step = (kappa * self.steps_per_kappa).min(self.steps as f64 - 1.5);
        let k = step as usize;
        let tk = step - k as f64;
        let columns = 2 * self.reach[0] + 1;
        let value = |dx: usize, dy: usize| {
            let pair = &self.powers[((iy + dy) * columns + ix + dx) * self.steps + k..][..2];
            f64::from(pair[0]) + tk * f64::from(pair[1] - pair[0])
        };
        let (wx, wy) = (cubic_weights(tx), cubic_weights(ty));
        let row = |dy: usize| (0..4).map(|dx| wx[dx] * value(dx, dy)).sum::<f64>();
        (0..4).map(|dy| wy[dy] * row(dy)).sum::<f64>().max(0.0)
    }
}

/// Weights of the four nodes around a place, of which the second lies `t` before it, of the cubic that goes through
/// nodes with the slopes of their neighbours.
fn cubic_weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-0.5 * t * s * s, 1.0 + t * t * (1.5 * t - 2.5), 1.0 + s * s * (1.5 * s - 2.5), -0.5 * s * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::HeightField;
    use crate::height_field::random::Random;
    use crate::scattering::Options;
    use crate::scattering::build_table;
    use crate::table::{Progress, Tiling};

    /// The grid stands for the table however nodes are joined, up to the largest κ that directions have.
    #[test]
    fn the_grid_is_the_table() {
        // A third of a knot from step to step: linear between these it is off by some 10⁻³ of what bends with a period
        // of a few knots.
        const MEAN: f64 = 1e-3;
        const EACH: f64 = 5e-3;
        let mut random = Random::new(3);
        let relief = random.smooth_field(24, 20, 3);
        let cases = [(Tiling::Aperiodic, 65.0), (Tiling::Periodic, 1.0)];
        // The splines of a shallow relief have few knots, and records end where these do.
        for (height_um, (tiling, coherence_length_um)) in
            [0.2, 0.003].into_iter().flat_map(|h| cases.map(|case| (h, case)))
        {
            let field = HeightField::new(height_um * &relief, 0.1, 0.1).unwrap();
            let options = Options { tiling, coherence_length_um, ..Options::default() };
            let table = build_table(&field, &options, &Progress::none()).unwrap().table;
            let grid = PowerGrid::new(&table);
            let (mut sums, mut most, mut worst) = ([0.0; 2], 0f64, 0f64);
            for _ in 0..4000 {
                let f = [0, 1].map(|_| random.between(-3.0, 3.0));
                let kappa = random.between(0.05, 1.0) * table.kappa_limit(f);
                let (found, exact) = (grid.density(f, kappa), table.density(f, kappa));
                sums = [sums[0] + found, sums[1] + exact];
                most = most.max(exact);
                worst = worst.max((found - exact).abs());
            }
            assert!((sums[0] / sums[1] - 1.0).abs() < MEAN, "{height_um} {tiling:?}: {sums:?}");
            assert!(worst < EACH * most, "{height_um} {tiling:?}: {worst} of {most}");
        }
    }
}
