//! Quadrature of the albedo over the hemisphere: `a(wi, λ) = Σ_m F(wi, wo_m)·P_m`.
//!
//! Each quadrature node m has a direction wo_m and a fraction P_m of the power in the table. F is the angular factor of
//! the two directions: `O·M`, or `Q·M` in small-slope theory. O is the obliquity factor, Q the small-slope factor and M
//! the V-cavity factor of shadowing (docs/model.md#the-reflectance).
//!
//! The table's nodes carry Gaussians over frequency, which are *narrow* or *wide* over the hemisphere ([`PANELS_MAX`]).
//! A node's *record* in the table gives its power `P(κ)` at the phase rate κ. Narrow nodes are integrated one by one,
//! or merged in squares of frequencies (`merging.rs`). The sum of wide nodes, the power spectrum `S(f; κ)`, is
//! integrated over the hemisphere (`quadrature.rs`).
//!
//! A *ridge* is a narrow maximum of the albedo along the incidences from which an order leaves along the surface.
//! Tables of the albedo treat such an order as if it left slightly above the surface, at one of a few cosines
//! ([`Ridge`]).
//!
//! A resized relief has its pattern s times as wide and its heights d times as large as the table's. Frequencies then
//! follow from λ' = λ/s, and the phase rate κ from λ" = λ/d (`scattering/size.rs`). The wavelengths that callers pass
//! are λ'. Without resizing λ, λ' and λ" are equal. w is `cosθi + cosθo`.

use super::merging::{SEPARATE_MAX, is_limited, merged_gaussians, node_gaussians};
use super::node_gaussian::{Incidence, NodeGaussian, PANEL_PHASE_MAX, PANEL_SIGMAS, Ridge, peak_cosine};
use super::power_grid::PowerGrid;
use super::quadrature::hemisphere;
use crate::numeric::{Number, Real, Values};
use crate::scattering::{
    COSINE_MIN, ComplexIndex, Obliquity, Options, Pair, SpectralIndex, TYPICAL_WAVELENGTH_UM, Vec3,
};
use crate::table::{LatticeAxis, NodeQuantity, PowerCurves, SpectralTable, WAVELENGTH_MIN_NM};
use std::f64::consts::{LOG2_E, TAU};

/// Largest number of panels over the hemisphere with which a table's nodes count as wide. Chosen: with more, it is
/// faster to integrate nodes one by one.
const PANELS_MAX: f64 = 24.0;

/// Largest cosθo at which orders on a ridge are counted. Smaller values leave larger albedos (0.3 leaves 1.05 on a
/// steep sinusoid); larger ones take longer.
const RIDGE_COSINE_MAX: f64 = 0.45;
/// Largest ratio of neighbouring [`AlbedoIntegral::ridge_cosines`]. It leaves albedos of 1.005 on a steep sinusoid; 1.7
/// leaves 1.013, and smaller ratios take longer.
const RIDGE_RATIO: f64 = 1.55;
/// Smallest cosθo at which orders on a ridge are counted. Chosen: only Gaussians narrower than those of filtered
/// sunlight (coherence length 65 µm) reach this bound. Closer to the horizon the albedo of the outgoing direction, by
/// which the reflectance is divided, too, removes the ridge.
const RIDGE_COSINE_MIN: f64 = 0.07;

/// Albedo integral of one ensemble table, at any incidence and wavelength.
pub(crate) struct AlbedoIntegral<'a> {
    table: &'a SpectralTable,
    /// Obliquity, shadowing and index: the parameters of F.
    options: &'a Options,
    /// Source of the fractions P_m.
    power: Power<'a>,
    /// λ" in nm for every integral; `None` where λ" is the integral's own wavelength λ'.
    depth_wavelength_nm: Option<f64>,
}

/// Form in which the power of a table is integrated.
enum Power<'a> {
    /// Narrow nodes, or merged squares of them. With `exact_cut`, Gaussians that extend beyond the frequencies that the
    /// pixels resolve are integrated exactly up to them.
    Gaussians { gaussians: Vec<NodeGaussian<'a>>, exact_cut: bool },
    /// Wide nodes, read from the table.
    Table,
    /// Wide nodes, read from a finer grid, which is faster.
    Grid(PowerGrid),
}

impl<'a> AlbedoIntegral<'a> {
    /// The accurate integral, the reference for albedos. `None` for a table of amplitudes, whose powers do not add.
    pub(crate) fn accurate(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let gaussians = || Power::Gaussians { gaussians: node_gaussians(table), exact_cut: is_limited(table) };
        Self::new(table, options, gaussians, || Power::Table)
    }

    /// The fast integral, from which tables of the albedo are built, with an error below 1 %. `None` as in
    /// [`AlbedoIntegral::accurate`].
    pub(crate) fn fast(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        let gaussians = || Power::Gaussians { gaussians: merged_gaussians(table), exact_cut: false };
        Self::new(table, options, gaussians, || Power::Grid(PowerGrid::new(table)))
    }

    /// The integral of a table, with the power in the form that `narrow` or `wide` makes, by the width of its nodes.
    /// `None` for a table of amplitudes.
    fn new(
        table: &'a SpectralTable,
        options: &'a Options,
        narrow: impl Fn() -> Power<'a>,
        wide: impl Fn() -> Power<'a>,
    ) -> Option<Self> {
        (table.quantity() == NodeQuantity::Power).then(|| {
            let power = if panels_over_the_hemisphere(table) <= PANELS_MAX { wide() } else { narrow() };
            Self { table, options, power, depth_wavelength_nm: None }
        })
    }

    /// Multiplies the standard deviations of the Gaussians of narrow nodes by `factor`. Wide nodes stay unchanged.
    pub(super) fn scale_widths(&mut self, factor: f64) {
        if let Power::Gaussians { gaussians, .. } = &mut self.power {
            gaussians.iter_mut().for_each(|gaussian| gaussian.sigma_f = gaussian.sigma_f.map(|sigma| sigma * factor));
        }
    }

    /// Sets λ" in nm for every integral; `None` restores each integral's own wavelength.
    pub(super) fn set_depth_wavelength(&mut self, nm: Option<f64>) {
        self.depth_wavelength_nm = nm;
    }

    /// Calls `visit` with the quadrature nodes of `∫ f cosθo dωo`, `V::COUNT` at once: directions wo and their parts of
    /// the integral, whose sum is the albedo. Surplus lanes have parts of zero. Nothing is visited unless wi lies above
    /// the surface.
    ///
    /// The reflectance f excludes the Fresnel reflectance and includes the small-slope factor. With a `ridge`, narrow
    /// orders near the horizon are moved onto it.
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
        let mut nodes = self.quadrature_nodes(wi, 1e-3 * wavelength_nm, ridge);
        nodes.resize(nodes.len().next_multiple_of(V::COUNT), QuadratureNode::NONE);
        let integrand = Integrand::<V>::new(self, wi, wavelength_nm);
        for lanes in nodes.chunks_exact(V::COUNT) {
            let (wo, part) = integrand.part(lanes);
            visit(wo, part);
        }
    }

    /// Quadrature nodes of an incidence at a wavelength, in no particular order.
    fn quadrature_nodes(&self, wi: Vec3, wavelength_um: f64, ridge: Option<Ridge>) -> Vec<QuadratureNode<'_>> {
        let lattice = self.table.lattice();
        // Outgoing direction cosines up to the cutoff, the largest order that the pixels resolve: |wi + wo|/λ ≤
        // cutoff/period along each axis.
        let resolved = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, cosine)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - cosine, reach - cosine]
        });
        match &self.power {
            Power::Gaussians { gaussians, exact_cut } => {
                let phase = phase_per_cosine(self.table, self.depth_wavelength_um(wavelength_um));
                let incidence = Incidence { wi, wavelength_um, resolved, phase, exact_cut: *exact_cut, ridge };
                let mut nodes = Vec::new();
                for gaussian in gaussians {
                    gaussian.integrate(&incidence, |wo, factor, exponent| {
                        nodes.push(QuadratureNode { wo, factor, exponent, record: &gaussian.record });
                    });
                }
                nodes
            }
            Power::Table => self.wide_nodes(wi, wavelength_um, resolved, |f, kappa| self.table.density(f, kappa)),
            Power::Grid(grid) => self.wide_nodes(wi, wavelength_um, resolved, |f, kappa| grid.density(f, kappa)),
        }
    }

    /// Quadrature nodes of a table of wide nodes, within the outgoing direction cosines `resolved`. `density` is
    /// S(f; κ) in µm², of a frequency in cycles/µm and κ in rad/µm.
    fn wide_nodes(
        &self,
        wi: Vec3,
        wavelength_um: f64,
        resolved: [[f64; 2]; 2],
        density: impl Fn([f64; 2], f64) -> f64,
    ) -> Vec<QuadratureNode<'_>> {
        let depth_wavelength_um = self.depth_wavelength_um(wavelength_um);
        let phase = phase_per_cosine(self.table, depth_wavelength_um);
        let mut nodes = Vec::new();
        let widest = wide_node_panels(self.table, wavelength_um).map(|width| width.min(PANEL_PHASE_MAX / phase));
        hemisphere(resolved, widest, wi[2], |wo, area| {
            if let Some(pair) = Pair::new(wi, wo) {
                let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                // S/λ², the power per area of direction cosines.
                let power_per_area = density(f, pair.kappa(depth_wavelength_um)) / (wavelength_um * wavelength_um);
                nodes.push(QuadratureNode { wo, factor: area * power_per_area, ..QuadratureNode::NONE });
            }
        });
        nodes
    }

    /// λ" in µm of an integral at a wavelength λ' in µm.
    fn depth_wavelength_um(&self, wavelength_um: f64) -> f64 {
        self.depth_wavelength_nm.map_or(wavelength_um, |nm| 1e-3 * nm)
    }

    /// Whether the relief varies along x alone, so that directions mirrored at the x axis have equal albedos.
    pub(crate) fn is_mirrored(&self) -> bool {
        self.table.kept_nodes().iter().all(|&(_, jy, _)| jy == 0)
    }

    /// Phase in radians between the relief's lowest and highest point, per unit of w: at λ" if it is set, else at the
    /// shortest wavelength of the tables.
    pub(crate) fn phase_max(&self) -> f64 {
        phase_per_cosine(self.table, 1e-3 * self.depth_wavelength_nm.unwrap_or(WAVELENGTH_MIN_NM))
    }

    /// Whether the table has narrow nodes, at most [`SEPARATE_MAX`]. The albedo then has a high ridge where one of them
    /// leaves along the surface.
    pub(crate) fn has_ridges(&self) -> bool {
        self.separate_nodes().is_some_and(|nodes| nodes <= SEPARATE_MAX)
    }

    /// Number of narrow nodes; `None` if some are merged, or if nodes are wide.
    fn separate_nodes(&self) -> Option<usize> {
        match &self.power {
            Power::Gaussians { gaussians, .. } => {
                gaussians.iter().all(|gaussian| !gaussian.merged).then_some(gaussians.len())
            }
            Power::Table | Power::Grid(_) => None,
        }
    }

    /// Whether F contains the small-slope factor of a dielectric, so that it vanishes at the horizon instead of having
    /// a pole.
    pub(crate) fn is_dielectric(&self) -> bool {
        let index = self.options.index.as_ref();
        self.options.obliquity == Obliquity::SmallSlope && index.is_some_and(SpectralIndex::is_dielectric)
    }

    /// Values of cosθo at which orders on a ridge are counted ([`Ridge::cosine`]), in geometric progression.
    ///
    /// At the first value a Gaussian adds most to the albedo ([`peak_cosine`]); the last is [`RIDGE_COSINE_MAX`].
    /// Tables of many narrow nodes have low ridges, and get one value, the geometric mean of these two. Empty if nodes
    /// are merged or wide.
    pub(crate) fn ridge_cosines(&self) -> Vec<f64> {
        if self.separate_nodes().is_none() {
            return Vec::new();
        }
        // Standard deviation of a node in direction cosines, the larger one of both axes.
        let sigma = TYPICAL_WAVELENGTH_UM
            * [&self.table.lattice().x, &self.table.lattice().y]
                .map(LatticeAxis::sigma_per_um)
                .into_iter()
                .fold(0.0, f64::max);
        let first = peak_cosine(sigma).clamp(RIDGE_COSINE_MIN, RIDGE_COSINE_MAX);
        if !self.has_ridges() {
            return vec![(first * RIDGE_COSINE_MAX).sqrt()];
        }
        // With `first` at the upper bound there are 0 steps and one value. The bound 1 then avoids a division by 0.
        let steps = ((RIDGE_COSINE_MAX / first).ln() / RIDGE_RATIO.ln()).ceil();
        (0..=steps as i32).map(|k| first * (RIDGE_COSINE_MAX / first).powf(f64::from(k) / steps.max(1.0))).collect()
    }

    /// Largest number of quadrature nodes among three typical incidences; at least 1. It decides on the resolution of
    /// the albedo's table (`build.rs`).
    pub(crate) fn typical_nodes(&self) -> usize {
        // Directions wi, each with a wavelength in µm. Chosen.
        let incidences = [([0.0, 0.0, 1.0], 0.4), ([0.6, 0.0, 0.8], 0.5), ([0.0, 0.8, 0.6], 0.6)];
        let counts = incidences.map(|(wi, wavelength_um)| self.quadrature_nodes(wi, wavelength_um, None).len());
        counts.into_iter().fold(1, usize::max)
    }
}

/// Quadrature node of an albedo integral: a direction wo and its fraction P_m of the power.
///
/// The fraction is `factor·exp(exponent)·P(κ)` for [`Power::Gaussians`], with `P(κ)` from the table's `record`. For the
/// other forms of the power it is `factor` alone.
#[derive(Clone, Copy)]
struct QuadratureNode<'a> {
    /// Unit vector.
    wo: Vec3,
    /// Weight of the quadrature times the power; without the power for [`Power::Gaussians`].
    factor: f64,
    /// Exponent of the Gaussian, at most 0.
    exponent: f64,
    /// Record of the table that gives `P(κ)`.
    record: &'a [f32],
}

impl QuadratureNode<'_> {
    /// Node without power.
    const NONE: Self = Self { wo: [0.0, 0.0, 1.0], factor: 0.0, exponent: 0.0, record: &[] };
}

/// Quantities that all quadrature nodes of an incidence share.
struct Integrand<'a, V: Values> {
    integral: &'a AlbedoIntegral<'a>,
    /// Incident direction, with a cosine of at least [`COSINE_MIN`], since F divides by it.
    wi: [V::Real; 3],
    /// Phase rate κ per unit of w, in rad/µm.
    kappa_per_w: V::Real,
    /// Index of the small-slope factor; `None` for a perfect conductor.
    index: Option<ComplexIndex>,
}

impl<'a, V: Values> Integrand<'a, V> {
    /// The shared quantities of an incident direction and a wavelength.
    fn new(integral: &'a AlbedoIntegral, [x, y, z]: Vec3, wavelength_nm: f64) -> Self {
        let depth_wavelength_nm = integral.depth_wavelength_nm.unwrap_or(wavelength_nm);
        // The index is that of the wavelength λ = λ"·d at the relative depth d. The largest depth stands for all, which
        // is exact where the depth is uniform.
        let index_nm = match (integral.depth_wavelength_nm, integral.options.sizes) {
            (Some(nm), Some(sizes)) => nm * sizes.depth[1],
            _ => wavelength_nm,
        };
        Self {
            integral,
            wi: [x, y, z.max(COSINE_MIN)].map(V::Real::lit),
            kappa_per_w: V::Real::lit(TAU * 1e3 / depth_wavelength_nm),
            index: integral.options.index.as_ref().map(|index| index.at(index_nm)),
        }
    }

    /// Directions wo of `V::COUNT` quadrature nodes, and their parts `F·P_m` of the albedo.
    #[inline(always)]
    fn part(&self, nodes: &[QuadratureNode]) -> ([V::Real; 3], V::Real) {
        let wo = [0, 1, 2].map(|c| V::pack(|lane| nodes[lane].wo[c]));
        let cosines = [self.wi[2], wo[2].max(V::Real::lit(COSINE_MIN))];
        let q = [self.wi[0] + wo[0], self.wi[1] + wo[1], cosines[0] + cosines[1]];
        let factor = self.integral.options.albedo_factor(q, cosines, self.index);
        let mut part = V::pack(|lane| nodes[lane].factor) * factor;
        if let Power::Gaussians { .. } = self.integral.power {
            let curves = PowerCurves::<V>::new(self.integral.table, q[2] * self.kappa_per_w);
            let gaussian = (V::pack(|lane| nodes[lane].exponent) * V::Real::lit(LOG2_E)).exp2();
            part = part * gaussian * curves.power(|lane| nodes[lane].record);
        }
        (wo, part)
    }
}

/// Phase between the relief's lowest and highest point per unit of w, in radians: 2π/λ times the range of heights. Its
/// change per unit of cosθo is the same number, since `w = cosθi + cosθo`.
pub(super) fn phase_per_cosine(table: &SpectralTable, wavelength_um: f64) -> f64 {
    // The knee is the reciprocal of half the range of heights.
    TAU / wavelength_um * 2.0 / table.kappa_knee()
}

/// Largest widths of panels of 16 quadrature nodes that resolve a table's wide nodes, along x and y in radians. They
/// are computed in direction cosines, which change at most as fast as the angles of `quadrature.rs`.
fn wide_node_panels(table: &SpectralTable, wavelength_um: f64) -> [f64; 2] {
    let lattice = table.lattice();
    [&lattice.x, &lattice.y].map(|axis| PANEL_SIGMAS * wavelength_um * axis.sigma / axis.period_um)
}

/// Number of the panels of [`wide_node_panels`] over the hemisphere, at the shortest wavelength and normal incidence.
fn panels_over_the_hemisphere(table: &SpectralTable) -> f64 {
    let wavelength_um = 1e-3 * WAVELENGTH_MIN_NM;
    let lattice = table.lattice();
    let widths = wide_node_panels(table, wavelength_um);
    let panels = [(&lattice.x, widths[0]), (&lattice.y, widths[1])].map(|(axis, width)| {
        // Largest angle with the normal, in radians: that of the cutoff, or of the horizon.
        let angle_max = (wavelength_um * axis.cutoff / axis.period_um).min(1.0).asin();
        (2.0 * angle_max / width).ceil()
    });
    panels[0] * panels[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::{HeightField, random::Random};
    use crate::numeric::{Lanes, Plain};
    use crate::scattering::build_table;
    use crate::table::{Progress, Tiling, WAVELENGTH_MAX_NM};

    /// The albedo, computed in the numbers `V`.
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
        // Rounding of directions and factors to single precision. Parts are not negative, so nothing cancels.
        const SINGLE: f64 = 3e-6;
        each_incidence(|integral, _, wi, nm| {
            let (scalar, lanes) = (albedo::<Plain<f64>>(integral, wi, nm), albedo::<Lanes>(integral, wi, nm));
            assert!(scalar > 0.01 && (lanes / scalar - 1.0).abs() < SINGLE, "{wi:?} {nm}: {scalar}, {lanes}");
        });
    }

    #[test]
    fn mirrored_half_matches_full() {
        // Rounding of sums of equal numbers in another order, in double precision.
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
