//! The albedo by quadrature over the hemisphere, `A(wi, λ) = Σ_m F(wi, wo_m)·P_m`: quadrature nodes in directions wo_m,
//! each with its part of the power that the table holds and the angular factor F of the two directions (`O·M`, or `Q·M`
//! of a small slope).
//!
//! Tables of narrow nodes are integrated node by node, tables of wide nodes over the hemisphere.

use super::node_gaussian::{Incidence, NodeGaussian, PHASE_PANEL, Ridge, peak_cosine};
use super::power_grid::PowerGrid;
use super::quadrature::hemisphere;
use crate::numeric::{Number, Real, Values};
use crate::scattering::{COSINE_MIN, ComplexIndex, Obliquity, Options, Pair, SpectralIndex, Vec3};
use crate::table::{NodeCurve, NodeQuantity, PowerCurves, SpectralTable, WAVELENGTH_MIN_NM};
use std::collections::BTreeMap;
use std::f64::consts::{LOG2_E, TAU};

/// Width of a panel of 16 quadrature nodes in standard deviations of a table's node. Chosen.
const PANEL_SIGMAS: f64 = 18.0;
/// Largest number of panels of an integral over the hemisphere; with more, nodes are integrated one by one, which is
/// then quicker.
const PANELS_MAX: f64 = 24.0;
/// Up to this many nodes are integrated separately in fast integrals; beyond it the weaker are merged.
const SEPARATE_ALL: usize = 640;
/// Number of the strongest nodes that stay separate where others are merged.
const SEPARATE: usize = 16;
/// Side in cycles/µm of the squares in which nodes are merged.
const MERGED_SIDE: f64 = 0.14;

/// Wavelength in µm whose Gaussians place the ridges: the middle of what the eye sees.
const MIDDLE_UM: f64 = 0.55;
/// Largest cosθo of a ridge. Measured on a steep sinusoid: 0.3 leaves albedos of 1.05.
const RIDGE_COSINE_MAX: f64 = 0.45;
/// Largest ratio of neighbouring cosines of ridges. Measured on a steep sinusoid: 1.7 leaves albedos of 1.013, 1.55 of
/// 1.005.
const RIDGE_RATIO: f64 = 1.55;
/// Smallest cosθo of a ridge, for Gaussians narrower than those of sunlight (65 µm). Nearer to the horizon the divisor
/// takes a ridge away.
const RIDGE_COSINE_MIN: f64 = 0.07;

/// The integral of one ensemble table, at any incidence and wavelength.
pub(crate) struct AlbedoIntegral<'a> {
    table: &'a SpectralTable,
    options: &'a Options,
    power: Power<'a>,
}

enum Power<'a> {
    /// Narrow nodes, or merged squares of nodes. `exact_cut`: see [`Incidence`].
    Gaussians { gaussians: Vec<NodeGaussian<'a>>, exact_cut: bool },
    /// Wide nodes, read from the table.
    Table,
    /// Wide nodes, read from a finer grid.
    Grid(PowerGrid),
}

impl<'a> AlbedoIntegral<'a> {
    /// The accurate integral, which others are judged by; `None` for a table of amplitudes, whose powers do not add.
    pub(crate) fn accurate(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let gaussians = || Power::Gaussians { gaussians: node_gaussians(table), exact_cut: is_limited(table) };
        Self::new(table, options, gaussians, || Power::Table)
    }

    /// The integral that tables are built from, good to less than a hundredth. `None` as in
    /// [`AlbedoIntegral::accurate`].
    pub(crate) fn fast(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let gaussians = || Power::Gaussians { gaussians: merged(table), exact_cut: false };
        Self::new(table, options, gaussians, || Power::Grid(PowerGrid::new(table)))
    }

    fn new(
        table: &'a SpectralTable,
        options: &'a Options,
        narrow: impl Fn() -> Power<'a>,
        wide: impl Fn() -> Power<'a>,
    ) -> Option<Self> {
        (table.quantity() == NodeQuantity::Power).then(|| {
            let power = if panels_over_the_hemisphere(table) <= PANELS_MAX { wide() } else { narrow() };
            Self { table, options, power }
        })
    }

    /// Calls `visit` with directions, `V::COUNT` at once, and their parts of `∫ f_r cosθo dωo`. The Fresnel reflectance
    /// is left out, the small slope's factor is included. Lanes left over have parts of zero. With a `ridge`, narrow
    /// orders near the horizon lie on it.
    pub(crate) fn visit<V: Values>(
        &self,
        wi: Vec3,
        wavelength_nm: f64,
        ridge: Option<Ridge>,
        mut visit: impl FnMut([V::Real; 3], V::Real),
    ) {
        if wi[2] <= 0.0 {
            return;
        }
        let mut points = self.points(wi, 1e-3 * wavelength_nm, ridge);
        points.resize(points.len().next_multiple_of(V::COUNT), QuadraturePoint::NONE);
        let integrand = Integrand::<V>::new(self, wi, wavelength_nm);
        for lanes in points.chunks_exact(V::COUNT) {
            let (wo, part) = integrand.part(lanes);
            visit(wo, part);
        }
    }

    /// The quadrature nodes of an incidence.
    fn points(&self, wi: Vec3, wavelength_um: f64, ridge: Option<Ridge>) -> Vec<QuadraturePoint<'_>> {
        let mut points = Vec::new();
        let lattice = self.table.lattice();
        let resolved = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        let phase = phase(self.table, wavelength_um);
        let density: &dyn Fn([f64; 2], f64) -> f64 = match &self.power {
            Power::Gaussians { gaussians, exact_cut } => {
                let incidence = Incidence { wi, wavelength_um, resolved, phase, exact_cut: *exact_cut, ridge };
                for gaussian in gaussians {
                    gaussian.integrate(&incidence, |wo, factor, exponent| {
                        points.push(QuadraturePoint { wo, factor, exponent, record: &gaussian.record });
                    });
                }
                return points;
            }
            Power::Table => &|f, kappa| self.table.density(f, kappa),
            Power::Grid(grid) => &|f, kappa| grid.density(f, kappa),
        };
        let widest = node_panel_widths(self.table, wavelength_um).map(|width| width.min(PHASE_PANEL / phase));
        hemisphere(resolved, widest, wi[2], |wo, area| {
            if let Some(pair) = Pair::new(wi, wo) {
                let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                let density = density(f, pair.kappa(wavelength_um)) / (wavelength_um * wavelength_um);
                points.push(QuadraturePoint { wo, factor: area * density, ..QuadraturePoint::NONE });
            }
        });
        points
    }

    /// Whether the relief varies along x alone, so that the albedo is mirrored at the x axis.
    pub(crate) fn is_mirrored(&self) -> bool {
        self.table.kept_nodes().iter().all(|&(_, jy, _)| jy == 0)
    }

    /// Phase in radians between the lowest and the highest point per unit of w, at the shortest wavelength.
    pub(crate) fn phase_max(&self) -> f64 {
        phase(self.table, 1e-3 * WAVELENGTH_MIN_NM)
    }

    /// Whether all nodes are narrow and few: where one leaves along the surface the albedo has a ridge.
    pub(crate) fn has_ridges(&self) -> bool {
        self.separate_orders().is_some_and(|orders| orders <= SEPARATE_ALL)
    }

    /// Number of narrow nodes; `None` if nodes are merged or wide.
    fn separate_orders(&self) -> Option<usize> {
        match &self.power {
            Power::Gaussians { gaussians, .. } => {
                gaussians.iter().all(|gaussian| !gaussian.merged).then_some(gaussians.len())
            }
            Power::Table | Power::Grid(_) => None,
        }
    }

    /// Whether the factor is a dielectric's small slope, which vanishes at the horizon instead of having a pole.
    pub(crate) fn is_dielectric(&self) -> bool {
        let index = self.options.index.as_ref();
        self.options.obliquity == Obliquity::SmallSlope && index.is_some_and(SpectralIndex::is_dielectric)
    }

    /// cosθo at which orders on a ridge are counted: from where a Gaussian about the horizon adds most to where its
    /// divisor sets in. One in the middle where orders are many and ridges low; none where nodes are merged or wide.
    pub(crate) fn ridge_cosines(&self) -> Vec<f64> {
        if self.separate_orders().is_none() {
            return Vec::new();
        }
        let sigma = MIDDLE_UM
            * [&self.table.lattice().x, &self.table.lattice().y]
                .map(|axis| axis.sigma / axis.period_um)
                .into_iter()
                .fold(0.0, f64::max);
        let first = peak_cosine(sigma).clamp(RIDGE_COSINE_MIN, RIDGE_COSINE_MAX);
        if !self.has_ridges() {
            return vec![(first * RIDGE_COSINE_MAX).sqrt()];
        }
        let count = ((RIDGE_COSINE_MAX / first).ln() / RIDGE_RATIO.ln()).ceil();
        (0..=count as i32).map(|k| first * (RIDGE_COSINE_MAX / first).powf(f64::from(k) / count.max(1.0))).collect()
    }

    /// Largest number of quadrature nodes among three typical incidences.
    pub(crate) fn points_typical(&self) -> usize {
        let incidences = [([0.0, 0.0, 1.0], 0.4), ([0.6, 0.0, 0.8], 0.5), ([0.0, 0.8, 0.6], 0.6)];
        incidences.map(|(wi, wavelength_um)| self.points(wi, wavelength_um, None).len()).into_iter().fold(1, usize::max)
    }
}

/// A direction with its weight `factor·exp(exponent)`, times the power `P(κ)` of a record where there is one.
#[derive(Clone, Copy)]
struct QuadraturePoint<'a> {
    wo: Vec3,
    factor: f64,
    exponent: f64,
    record: &'a [f32],
}

impl QuadraturePoint<'_> {
    /// A point that adds nothing.
    const NONE: Self = Self { wo: [0.0, 0.0, 1.0], factor: 0.0, exponent: 0.0, record: &[] };
}

/// Quantities that all quadrature nodes of an incidence share.
struct Integrand<'a, V: Values> {
    integral: &'a AlbedoIntegral<'a>,
    wi: [V::Real; 3],
    /// 2π over the wavelength in µm.
    wavenumber: V::Real,
    index: Option<ComplexIndex>,
}

impl<'a, V: Values> Integrand<'a, V> {
    fn new(integral: &'a AlbedoIntegral, [x, y, z]: Vec3, wavelength_nm: f64) -> Self {
        Self {
            integral,
            wi: [x, y, z.max(COSINE_MIN)].map(V::Real::lit),
            wavenumber: V::Real::lit(TAU * 1e3 / wavelength_nm),
            index: integral.options.index.as_ref().map(|index| index.at(wavelength_nm)),
        }
    }

    /// Directions of `V::COUNT` quadrature nodes and their parts of the albedo.
    #[inline(always)]
    fn part(&self, points: &[QuadraturePoint]) -> ([V::Real; 3], V::Real) {
        let wo = [0, 1, 2].map(|c| V::pack(|lane| points[lane].wo[c]));
        let cosines = [self.wi[2], wo[2].max(V::Real::lit(COSINE_MIN))];
        let q = [self.wi[0] + wo[0], self.wi[1] + wo[1], cosines[0] + cosines[1]];
        let factor = self.integral.options.albedo_factor(q, cosines, self.index);
        let mut part = V::pack(|lane| points[lane].factor) * factor;
        if let Power::Gaussians { .. } = self.integral.power {
            let curves = PowerCurves::<V>::new(self.integral.table, q[2] * self.wavenumber);
            let gaussian = (V::pack(|lane| points[lane].exponent) * V::Real::lit(LOG2_E)).exp2();
            part = part * gaussian * curves.power(|lane| points[lane].record);
        }
        (wo, part)
    }
}

/// Change of the relief's phase, in radians from its lowest point to its highest, per unit of cosθo.
fn phase(table: &SpectralTable, wavelength_um: f64) -> f64 {
    // The knee is the reciprocal of half the range of heights.
    TAU / wavelength_um * 2.0 / table.kappa_knee()
}

/// Widths in radians, along x and y, of panels in which a table of wide nodes is smooth at one κ.
fn node_panel_widths(table: &SpectralTable, wavelength_um: f64) -> [f64; 2] {
    let lattice = table.lattice();
    [&lattice.x, &lattice.y].map(|axis| PANEL_SIGMAS * wavelength_um * axis.sigma / axis.period_um)
}

/// Number of panels of the nodes' width over the hemisphere, at the shortest wavelength.
fn panels_over_the_hemisphere(table: &SpectralTable) -> f64 {
    let wavelength_um = 1e-3 * WAVELENGTH_MIN_NM;
    let lattice = table.lattice();
    let widths = node_panel_widths(table, wavelength_um);
    let panels = [(&lattice.x, widths[0]), (&lattice.y, widths[1])]
        .map(|(axis, width)| (2.0 * (wavelength_um * axis.cutoff / axis.period_um).min(1.0).asin() / width).ceil());
    panels[0] * panels[1]
}

/// Whether the pixels resolve the relief up to some frequency alone.
fn is_limited(table: &SpectralTable) -> bool {
    table.lattice().x.cutoff.is_finite() || table.lattice().y.cutoff.is_finite()
}

/// A Gaussian for every node.
fn node_gaussians(table: &SpectralTable) -> Vec<NodeGaussian<'_>> {
    let axes = [&table.lattice().x, &table.lattice().y];
    let sigma_f = axes.map(|axis| axis.sigma / axis.period_um);
    let kept = table.kept_nodes().into_iter();
    kept.map(|(jx, jy, record)| NodeGaussian {
        f: [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um],
        sigma_f,
        record: record.into(),
        merged: false,
    })
    .collect()
}

/// A Gaussian for each of the strongest nodes, and one for all others of each square; for every node where there are
/// few.
fn merged(table: &SpectralTable) -> Vec<NodeGaussian<'_>> {
    let mut gaussians = node_gaussians(table);
    if gaussians.len() <= SEPARATE_ALL && !is_limited(table) {
        return gaussians;
    }
    let curves = [0.1, 0.3, 0.5, 0.7, 0.9].map(|part| NodeCurve::new(table, part * table.kappa_max()));
    let strength = |node: &NodeGaussian| curves.iter().map(|curve| curve.power(&node.record).abs()).sum::<f64>();
    // Integers sort.
    gaussians.sort_by_cached_key(|node| std::cmp::Reverse((strength(node) * 1e12) as u64));
    let mut squares: BTreeMap<[i64; 2], Vec<(f64, NodeGaussian<'_>)>> = BTreeMap::new();
    for node in gaussians.split_off(SEPARATE.min(gaussians.len())) {
        let square = node.f.map(|f| (f / MERGED_SIDE).round() as i64);
        squares.entry(square).or_default().push((strength(&node).max(f64::MIN_POSITIVE), node));
    }
    gaussians.extend(squares.into_values().map(joined));
    gaussians
}

/// One Gaussian for several nodes of equal width with their weights: the sum of their records, their centre and their
/// spread.
fn joined(mut nodes: Vec<(f64, NodeGaussian<'_>)>) -> NodeGaussian<'_> {
    if nodes.len() == 1 {
        return nodes.swap_remove(0).1;
    }
    let total: f64 = nodes.iter().map(|node| node.0).sum();
    let mean =
        |of: &dyn Fn(&NodeGaussian) -> f64| nodes.iter().map(|(weight, node)| weight * of(node)).sum::<f64>() / total;
    let f = [0, 1].map(|c| mean(&|node| node.f[c]));
    let sigma_f = [0, 1].map(|c| mean(&|node| (node.f[c] - f[c]).powi(2) + node.sigma_f[c].powi(2)).sqrt());
    let mut record = vec![0f32; nodes.iter().map(|node| node.1.record.len()).max().unwrap_or(0)];
    for (_, node) in &nodes {
        record.iter_mut().zip(node.record.iter()).for_each(|(sum, value)| *sum += value);
    }
    NodeGaussian { f, sigma_f, record: record.into(), merged: true }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::{HeightField, random::Random};
    use crate::numeric::{Lanes, Plain};
    use crate::scattering::build_table;
    use crate::table::{Progress, Tiling, WAVELENGTH_MAX_NM};

    fn albedo<V: Values>(integral: &AlbedoIntegral, wi: Vec3, nm: f64) -> f64 {
        let mut sum = 0.0;
        integral.visit::<V>(wi, nm, None, |_, part| sum += V::total(part));
        sum
    }

    /// Calls `check` with the fast integral of several reliefs, whether each varies along x alone, and 200 random
    /// incidences.
    fn each_incidence(check: impl Fn(&AlbedoIntegral, bool, Vec3, f64)) {
        let mut random = Random::new(5);
        let relief = |random: &mut Random, nx, ny, height_um: f64| {
            HeightField::new(height_um * random.smooth_field(nx, ny, 3), 0.1, 0.1).unwrap()
        };
        let metal = Some(SpectralIndex::Constant(ComplexIndex { eta: 1.0, k: 6.9 }));
        let plain = Options::default();
        let cases = [
            (relief(&mut random, 30, 1, 0.2), plain.clone()),
            (relief(&mut random, 30, 1, 0.5), Options { coherence_length_um: 6.0, shadowing: true, ..plain.clone() }),
            (
                relief(&mut random, 24, 20, 0.3),
                Options { obliquity: Obliquity::SmallSlope, index: metal, ..plain.clone() },
            ),
            // Wide nodes, read from a grid.
            (relief(&mut random, 24, 20, 0.3), Options { tiling: Tiling::Aperiodic, ..plain.clone() }),
            // Flat: splines have next to no knots.
            (relief(&mut random, 30, 1, 0.0), plain),
        ];
        for (field, options) in &cases {
            let table = build_table(field, options, &Progress::none()).unwrap().table;
            let integral = AlbedoIntegral::fast(&table, options).unwrap();
            for _ in 0..200 {
                let (theta, phi): (f64, f64) = (random.between(0.0, 1.57), random.between(0.0, TAU));
                let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                check(&integral, field.size().1 == 1, wi, random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM));
            }
        }
    }

    #[test]
    fn lanes_match_scalar() {
        // Single precision of directions and factors; parts are not negative, so nothing cancels.
        const SINGLE: f64 = 3e-6;
        each_incidence(|integral, _, wi, nm| {
            let (scalar, lanes) = (albedo::<Plain<f64>>(integral, wi, nm), albedo::<Lanes>(integral, wi, nm));
            assert!(scalar > 0.01 && (lanes / scalar - 1.0).abs() < SINGLE, "{wi:?} {nm}: {scalar}, {lanes}");
        });
    }

    #[test]
    fn mirrored_half_matches_full() {
        // Equal numbers summed in another order, in double precision.
        const ROUNDING: f64 = 1e-12;
        each_incidence(|integral, along_x_alone, wi, nm| {
            assert_eq!(integral.is_mirrored(), along_x_alone);
            if along_x_alone {
                let [one, other] = [wi[1], -wi[1]].map(|y| albedo::<Plain<f64>>(integral, [wi[0], y, wi[2]], nm));
                assert!((other / one - 1.0).abs() < ROUNDING, "{wi:?} {nm}: {one}, {other}");
            }
        });
    }
}
