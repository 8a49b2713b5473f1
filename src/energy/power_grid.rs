//! Power density `S(f; κ)` of an ensemble table (the mean over all positions of the coherence window), resampled to a
//! finer grid of frequencies f and phase rates κ.
//!
//! Each node of the table has a record: a header, then the spline coefficients of its power over κ (four at least). An
//! interpolation kernel spreads the power over f, and the points of the grid hold the sums. A look-up in the grid is
//! faster than in the table: the albedo table of one aperiodic period of the blazed grating takes 0.8 s instead of 7 s
//! on two cores. Only tables of wide nodes (`integral.rs`) have a grid, since it stays small there. They belong to
//! aperiodic height fields a few µm wide.

use crate::numeric::math::GAUSSIAN_REACH;
use crate::table::{FREQUENCY_MAX_PER_UM, HEADER, LatticeAxis, NodeCurve, SpectralTable};
use rayon::prelude::*;

/// Spacing of the grid in standard deviations of the table's kernel. Chosen with [`STEPS_PER_KNOT`] for errors below
/// 0.5 % of the largest density, which a test measures. A narrower spacing takes more memory and time.
const SPACING_SIGMAS: f64 = 0.4;
/// Steps in κ for each knot interval of the table's splines. Fewer steps are less accurate, since powers are linear
/// between them; more take more memory and time. See [`SPACING_SIGMAS`] for the error.
const STEPS_PER_KNOT: f64 = 3.0;

/// `S(f; κ)` on a grid of frequencies and uniform steps of κ.
pub(super) struct PowerGrid {
    /// Grid nodes per cycle/µm, along x and y.
    nodes_per_f: [f64; 2],
    /// Largest node number along x and y. Nodes run from −reach to reach; node 0 has the frequency zero.
    reach: [usize; 2],
    /// Number of steps in κ, from κ = 0.
    steps: usize,
    /// Steps per rad/µm.
    steps_per_kappa: f64,
    /// Power densities in µm², `[y][x][step]`.
    densities: Vec<f32>,
}

/// Part of a table node in one row of the grid.
#[derive(Clone)]
struct RowPart<'a> {
    /// Position of the table node along x, in grid nodes from the first.
    centre: f64,
    /// Weight of the row in the interpolation kernel along y.
    weight_y: f32,
    /// Power densities of the table node at every step of κ.
    densities: &'a [f32],
}

impl PowerGrid {
    /// Resamples the power density of an ensemble table; records of other tables are not powers.
    pub(super) fn new(table: &SpectralTable) -> Self {
        let axes = [&table.lattice().x, &table.lattice().y];
        let nodes_per_f = axes.map(|axis| 1.0 / (SPACING_SIGMAS * axis.sigma_per_um()));
        let reach = [0, 1].map(|c| {
            // Largest frequency of the table in cycles/µm; `cutoff` is in table nodes.
            let f_max = (axes[c].cutoff / axes[c].period_um).min(FREQUENCY_MAX_PER_UM);
            // The cubic interpolation reads up to two nodes beyond.
            (f_max * nodes_per_f[c]).ceil() as usize + 2
        });
        let steps_per_kappa = STEPS_PER_KNOT / table.kappa_step();
        // Steps from 0 to the first at or above the largest κ, and one more that linear interpolation may read.
        let steps = (table.kappa_max() * steps_per_kappa).ceil() as usize + 2;
        let curves: Vec<_> = (0..steps).map(|i| NodeCurve::new(table, i as f64 / steps_per_kappa)).collect();
        let kept = table.kept_nodes();
        let resample = |record: &[f32]| resampled(table, steps_per_kappa, &curves, record);
        let node_densities: Vec<Vec<f32>> = kept.par_iter().map(|(_, _, record)| resample(record)).collect();
        let [columns, rows] = reach.map(|reach| 2 * reach + 1);
        // Position of table node j along axis c, in grid nodes from the first.
        let position = |c: usize, j: i64| j as f64 / axes[c].period_um * nodes_per_f[c] + reach[c] as f64;
        // The kernel is a product over both axes, so table nodes are spread along y first and then along x.
        let mut by_row: Vec<Vec<RowPart>> = vec![Vec::new(); rows];
        for ((jx, jy, _), densities) in kept.iter().zip(&node_densities) {
            for (row, weight_y) in reached(axes[1], nodes_per_f[1], position(1, *jy), rows) {
                by_row[row].push(RowPart { centre: position(0, *jx), weight_y, densities });
            }
        }
        // Power densities of one row of the grid, `[x][step]`.
        let row = |parts: Vec<RowPart>| {
            let mut sums = vec![0f32; columns * steps];
            for RowPart { centre, weight_y, densities } in parts {
                for (column, weight_x) in reached(axes[0], nodes_per_f[0], centre, columns) {
                    let sum = &mut sums[column * steps..][..steps];
                    sum.iter_mut().zip(densities).for_each(|(sum, density)| *sum += weight_y * weight_x * density);
                }
            }
            sums
        };
        let densities = by_row.into_par_iter().flat_map_iter(row).collect();
        Self { nodes_per_f, reach, steps, steps_per_kappa, densities }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ ≥ 0 in rad/µm, both clamped to the grid; never negative.
    /// Cubic between frequencies, linear between steps of κ.
    #[inline]
    pub(super) fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        // First of the four nodes read, and the position between the second and the third, in [0, 1]. The bounds keep
        // all four on the grid.
        let [(ix, tx), (iy, ty)] = [0, 1].map(|c| {
            let last = 2 * self.reach[c];
            let position = (f[c] * self.nodes_per_f[c] + self.reach[c] as f64).clamp(1.0, (last - 1) as f64);
            let node = (position as usize).min(last - 2);
            (node - 1, position - node as f64)
        });
        // Position among the steps of κ, bounded so that both neighbouring steps lie on the grid.
        let step = (kappa * self.steps_per_kappa).min(self.steps as f64 - 1.5);
        let k = step as usize;
        let tk = step - k as f64;
        let columns = 2 * self.reach[0] + 1;
        let value = |dx: usize, dy: usize| {
            let pair = &self.densities[((iy + dy) * columns + ix + dx) * self.steps + k..][..2];
            f64::from(pair[0]) + tk * f64::from(pair[1] - pair[0])
        };
        let (wx, wy) = (catmull_rom_weights(tx), catmull_rom_weights(ty));
        let row = |dy: usize| (0..4).map(|dx| wx[dx] * value(dx, dy)).sum::<f64>();
        (0..4).map(|dy| wy[dy] * row(dy)).sum::<f64>().max(0.0)
    }
}

/// Power density in µm² of one table node at every step of κ, from its record. `curves` evaluate a record at the steps.
///
/// Beyond the record's end the density keeps its last value, since interpolation up to the end also reads the first
/// step beyond.
fn resampled(table: &SpectralTable, steps_per_kappa: f64, curves: &[NodeCurve], record: &[f32]) -> Vec<f32> {
    // A cubic spline of n coefficients extends over n − 3 knot intervals from κ = 0. The evaluation at the end itself
    // would read a coefficient too many, hence the last factor.
    let end = (record.len() - HEADER - 3) as f64 * table.kappa_step() * (1.0 - f64::EPSILON);
    let last = NodeCurve::new(table, end).power(record);
    let power = |(i, curve): (usize, &NodeCurve)| {
        let is_within = (i as f64 / steps_per_kappa) < end;
        if is_within { curve.power(record) } else { last }
    };
    curves.iter().enumerate().map(|step| (table.norm() * power(step)) as f32).collect()
}

/// Grid nodes along one axis that a table node reaches, each with its weight in the interpolation kernel. `centre` is
/// the table node's position in grid nodes from the first of `count`.
fn reached(
    axis: &LatticeAxis,
    nodes_per_f: f64,
    centre: f64,
    count: usize,
) -> impl Iterator<Item = (usize, f32)> + use<> {
    let (kernel, table_nodes_per_node) = (axis.kernel, axis.period_um / nodes_per_f);
    let spread = GAUSSIAN_REACH / SPACING_SIGMAS;
    // The range is empty where the table node's reach ends below the grid.
    let (low, end) = ((centre - spread).ceil().max(0.0) as usize, ((centre + spread).floor() + 1.0).max(0.0) as usize);
    (low..count.min(end)).map(move |i| (i, kernel.weight((i as f64 - centre) * table_nodes_per_node) as f32))
}

/// Weights of the nodes at −1, 0, 1 and 2 in the Catmull–Rom cubic at `t` in [0, 1].
fn catmull_rom_weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-0.5 * t * s * s, 1.0 + t * t * (1.5 * t - 2.5), 1.0 + s * s * (1.5 * s - 2.5), -0.5 * s * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::HeightField;
    use crate::height_field::random::Random;
    use crate::scattering::{Options, build_table};
    use crate::table::{Progress, Tiling};

    /// Densities of grid and table, with both kinds of lattice, up to the largest κ of any pair of directions.
    #[test]
    fn the_grid_matches_the_table() {
        // Steps are a third of a knot interval. Linear interpolation between them has an error of about 1e-3 for waves
        // with a period of a few knot intervals. Bounds: relative error of the mean density, and largest error of any
        // density relative to the largest density.
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
