//! Quadrature of the albedo over the hemisphere: `a(wi, λ) = Σ_m F(wi, wo_m)·P_m`.
//!
//! Each quadrature node m has a direction wo_m and a power P_m, a fraction of a portion's power. F is the angular
//! factor of the two directions: `O·M`, or `Q·M` in small-slope theory. O is the obliquity factor, Q the small-slope
//! factor and M the V-cavity factor of shadowing (docs/model.md#the-reflectance).
//!
//! A portion of the power (`portion.rs`) has the power `P(κ)` at the phase rate κ, spread around a frequency
//! (`quadrature.rs`). The fast integral has few portions; the accurate one has the Gaussian of each node of the table,
//! and a finer quadrature.
//!
//! A resized relief has its pattern s times as wide and its heights d times as large as the table's. Frequencies then
//! follow from λ' = λ/s, and the phase rate κ from λ" = λ/d (`scattering/size.rs`). Without resizing λ, λ' and λ" are
//! equal. w is `cosθi + cosθo`.

use super::portion::{Incidence, Portion, node_gaussians, portions};
use super::quadrature::integrate;
use crate::numeric::{Number, Real, Values};
use crate::scattering::{COSINE_MIN, Obliquity, Options, SizeRange, SpectralIndex, TYPICAL_WAVELENGTH_UM, Vec3};
use crate::table::{NodeQuantity, PowerCurves, SpectralTable, WAVELENGTH_MIN_NM};
use std::f64::consts::TAU;

/// Factor on the numbers of rows and steps of the accurate integral. Twice as many change albedos by less than
/// 1e-3.
const REFINEMENT: f64 = 12.0;

/// Albedo integral of one ensemble table, at any incidence and wavelength.
#[derive(Clone)]
pub(crate) struct AlbedoIntegral<'a> {
    table: &'a SpectralTable,
    /// Obliquity, shadowing and index: the parameters of F.
    options: &'a Options,
    /// Portions of the power.
    portions: Vec<Portion<'a>>,
    /// Factor on the numbers of rows and steps of the quadrature (`quadrature.rs`).
    refinement: f64,
    /// Relative depth d at which the refractive index is read, at λ = λ"·d.
    depth: f64,
}

impl<'a> AlbedoIntegral<'a> {
    /// The accurate integral, of the table's nodes. `None` for a table of amplitudes, whose powers do not add.
    pub(crate) fn accurate(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        Self::new(table, options, node_gaussians, REFINEMENT)
    }

    /// The fast integral, from which tables of divisors are built. The test `fast_matches_accurate` bounds its error.
    /// `None` as in [`AlbedoIntegral::accurate`].
    pub(crate) fn fast(table: &'a SpectralTable, options: &'a Options) -> Option<Self> {
        // Squares have no smallest side, since F may have a pole at the horizon, which wide ones would blur.
        let side_min_per_um = 0.0;
        Self::new(table, options, |table| portions(table, side_min_per_um), 1.0)
    }

    /// The integral of the given portions of a table; `None` for a table of amplitudes.
    fn new(
        table: &'a SpectralTable,
        options: &'a Options,
        portions: impl Fn(&'a SpectralTable) -> Vec<Portion<'a>>,
        refinement: f64,
    ) -> Option<Self> {
        (table.quantity() == NodeQuantity::Power).then(|| {
            let portions = portions(table);
            Self { table, options, portions, refinement, depth: 1.0 }
        })
    }

    /// The integral for a range of sizes.
    ///
    /// Orders of gratings keep their width when the pattern is resized by s. The table's frequencies are s times those
    /// of the resized pattern, so the standard deviation σ becomes s·σ there. It is narrowest at the smallest scale,
    /// where albedos are largest; all sizes get this width. Squares stay unchanged. The index is that of the largest
    /// depth, which is exact for a single depth.
    pub(super) fn of_sizes(mut self, sizes: &SizeRange) -> Self {
        for portion in self.portions.iter_mut().filter(|portion| !portion.is_square) {
            portion.sigma_f = portion.sigma_f.map(|sigma| sigma * sizes.scale[0]);
        }
        Self { depth: sizes.depth[1], ..self }
    }

    /// Calls `visit` with the quadrature nodes of `∫ f cosθo dωo`, `V::COUNT` at once: directions wo and their parts of
    /// the integral, whose sum is the albedo. `V` are plain numbers or several lanes. Surplus lanes have parts of
    /// zero. Nothing is visited unless wi lies above the surface. The wavelengths in nm are λ' and λ".
    ///
    /// The reflectance f excludes the Fresnel reflectance and includes the small-slope factor.
    pub(crate) fn visit<V: Values>(
        &self,
        wi: Vec3,
        [wavelength_nm, depth_wavelength_nm]: [f64; 2],
        mut visit: impl FnMut([V::Real; 3], V::Real),
    ) {
        if wi[2] <= 0.0 {
            return;
        }
        let phase_per_cosine = phase_per_cosine(self.table, 1e-3 * depth_wavelength_nm);
        let wavelength_um = 1e-3 * wavelength_nm;
        let axes = [&self.table.lattice().x, &self.table.lattice().y];
        // `cutoff` counts nodes, whose frequencies are 1/period apart. Infinite where nodes are diffraction orders.
        let limits = axes.map(|axis| wavelength_um * axis.cutoff / axis.period_um);
        let incidence = Incidence { wi, wavelength_um, phase_per_cosine, limits };
        // Directions wo, fractions of the power, and the records that give `P(κ)`.
        let mut nodes: Vec<(Vec3, f64, &[f32])> = Vec::new();
        for portion in &self.portions {
            integrate(portion, &incidence, self.refinement, |wo, fraction| nodes.push((wo, fraction, &portion.record)));
        }
        nodes.resize(nodes.len().next_multiple_of(V::COUNT), ([0.0, 0.0, 1.0], 0.0, &[]));
        let index = self.options.index.as_ref().map(|index| index.at(depth_wavelength_nm * self.depth));
        let kappa_per_w = V::Real::lit(TAU * 1e3 / depth_wavelength_nm);
        // Cosines are bounded from below, since F divides by them.
        let [x, y, cos_i] = [wi[0], wi[1], wi[2].max(COSINE_MIN)].map(V::Real::lit);
        for lanes in nodes.chunks_exact(V::COUNT) {
            let wo = [0, 1, 2].map(|c| V::pack(|lane| lanes[lane].0[c]));
            let cosines = [cos_i, wo[2].max(V::Real::lit(COSINE_MIN))];
            let q = [x + wo[0], y + wo[1], cosines[0] + cosines[1]];
            let factor = self.options.albedo_factor(q, cosines, index);
            let power = PowerCurves::<V>::new(self.table, q[2] * kappa_per_w).power(|lane| lanes[lane].2);
            // The power of a single node of an aperiodic relief may be negative; sums over neighbours are not.
            visit(wo, V::pack(|lane| lanes[lane].1) * factor * power);
        }
    }

    /// Whether the relief varies along x alone, so that directions mirrored at the x axis have equal albedos.
    pub(super) fn is_mirrored(&self) -> bool {
        self.table.kept_nodes().iter().all(|&(_, jy, _)| jy == 0)
    }

    /// [`phase_per_cosine`] at the shortest wavelength of the tables.
    pub(super) fn phase_max(&self) -> f64 {
        phase_per_cosine(self.table, 1e-3 * WAVELENGTH_MIN_NM)
    }

    /// Whether all portions are Gaussians. In the fast integral these are narrow diffraction orders, and the albedo has
    /// a high ridge where one of them leaves along the surface.
    pub(super) fn has_separate_orders(&self) -> bool {
        self.portions.iter().all(|portion| !portion.is_square)
    }

    /// Largest standard deviation of a portion in direction cosines, at [`TYPICAL_WAVELENGTH_UM`].
    pub(super) fn sigma_max(&self) -> f64 {
        let sigma_f = self.portions.iter().flat_map(|portion| portion.sigma_f).fold(0.0, f64::max);
        sigma_f * TYPICAL_WAVELENGTH_UM
    }

    /// Whether F contains the small-slope factor of a dielectric, so that it vanishes at the horizon instead of having
    /// a pole.
    pub(super) fn is_dielectric(&self) -> bool {
        let index = self.options.index.as_ref();
        self.options.obliquity == Obliquity::SmallSlope && index.is_some_and(SpectralIndex::is_dielectric)
    }
}

/// Phase between the relief's lowest and highest point per unit of w, in radians: 2π/λ times the range of heights. Its
/// change per unit of cosθo is the same number, since `w = cosθi + cosθo`.
pub(super) fn phase_per_cosine(table: &SpectralTable, wavelength_um: f64) -> f64 {
    // `kappa_knee` is the reciprocal of half the range of heights in µm.
    TAU / wavelength_um * 2.0 / table.kappa_knee()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::{HeightField, Preset, random::Random};
    use crate::numeric::{Lanes, Plain};
    use crate::scattering::{ComplexIndex, build_table};
    use crate::table::{Progress, Tiling, WAVELENGTH_MAX_NM};

    /// The albedo, computed in the numbers `V`.
    fn albedo<V: Values>(integral: &AlbedoIntegral, wi: Vec3, nm: f64) -> f64 {
        let mut sum = 0.0;
        integral.visit::<V>(wi, [nm; 2], |_, part| sum += V::total(part));
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
            // Squares.
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
    fn mirrored_incidences_have_equal_albedos() {
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

    /// Errors of the fast integral, relative to the albedo or to 1 if that is larger, over random incidences.
    #[test]
    fn fast_matches_accurate() {
        const QUERIES: usize = 100;
        let preset = |preset: Preset| preset.build(None, None).unwrap();
        let smooth = |nx, ny, height_um: f64| {
            HeightField::new(height_um * Random::new(5).smooth_field(nx, ny, 3), 0.1, 0.1).unwrap()
        };
        let coherence = |coherence_length_um| Options { coherence_length_um, ..Options::default() };
        let aperiodic = Options { tiling: Tiling::Aperiodic, ..Options::default() };
        // Largest root mean square and largest absolute mean of the error, each above the measured one.
        let cases = [
            ("blazed", preset(Preset::Blazed), Options::default(), 0.008, 0.002),
            ("blazed, 5 µm", preset(Preset::Blazed), coherence(5.0), 0.008, 0.002),
            ("blazed, 1 µm", preset(Preset::Blazed), coherence(1.0), 0.02, 0.008),
            ("lamellar", preset(Preset::Lamellar), Options::default(), 0.008, 0.002),
            ("aperiodic", smooth(24, 20, 0.3), aperiodic, 0.005, 0.002),
            ("deep", smooth(24, 20, 3.0), Options::default(), 0.025, 0.005),
            ("many nodes", smooth(64, 48, 0.3), Options::default(), 0.015, 0.002),
        ];
        for (name, field, options, rms_max, mean_max) in &cases {
            let table = build_table(field, options, &Progress::none()).unwrap().table;
            let [fast, accurate] =
                [AlbedoIntegral::fast, AlbedoIntegral::accurate].map(|new| new(&table, options).unwrap());
            let mut random = Random::new(6);
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..QUERIES {
                let (theta, phi): (f64, f64) = (random.between(0.0, 1.55), random.between(0.0, TAU));
                let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                let nm = random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                let [found, truth] = [&fast, &accurate].map(|integral| albedo::<Lanes>(integral, wi, nm));
                let error = (found - truth) / truth.max(1.0);
                (sum, squares) = (sum + error, squares + error * error);
            }
            let (mean, rms) = (sum / QUERIES as f64, (squares / QUERIES as f64).sqrt());
            println!("{name}: mean {mean:.4}, root mean square {rms:.4}");
            assert!(rms < *rms_max && mean.abs() < *mean_max, "{name}: mean {mean}, root mean square {rms}");
        }
    }
}
