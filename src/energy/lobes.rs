//! The albedo by integrals over the hemisphere, lobe by lobe.

use super::node_gaussian::{Lobe, PHASE_PANEL, Setting};
use super::power_grid::PowerGrid;
use super::quadrature::hemisphere;
use crate::numeric::{Number, Real, Values};
use crate::scattering::{COSINE_MIN, ComplexIndex, Obliquity, Options, Pair, Vec3};
use crate::table::{NodeCurve, NodeQuantity, PowerCurves, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::collections::BTreeMap;
use std::f64::consts::{LOG2_E, TAU};

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

/// Places that are evaluated together, a multiple of the numbers that any family has.
const AT_ONCE: usize = 64;

/// The power of an ensemble table in the form that integrals over it take.
pub(crate) struct Lobes<'a> {
    table: &'a SpectralTable,
    options: &'a Options,
    power: Power<'a>,
    /// Whether the relief varies along x alone; asked of quick integrals only, and not found out for others.
    mirrored: bool,
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
        let quick = Self::new(table, options, lobes, || Power::Grid(PowerGrid::new(table)))?;
        Some(Self { mirrored: table.kept_nodes().iter().all(|&(_, jy, _)| jy == 0), ..quick })
    }

    fn new(
        table: &'a SpectralTable,
        options: &'a Options,
        lobes: impl Fn() -> Power<'a>,
        smooth: impl Fn() -> Power<'a>,
    ) -> Option<Self> {
        (table.quantity() == NodeQuantity::Power).then(|| {
            let power = if panels_over_the_hemisphere(table) <= PANELS_MAX { smooth() } else { lobes() };
            Self { table, options, power, mirrored: false }
        })
    }

    /// Visits directions, as many at once as the family has numbers, with the parts of `∫ f_r cosθo dωo` that they stand for, the
    /// Fresnel reflectance left out; the small slope's factor is in them. The last are filled up with some that are no part.
    pub fn visit<V: Values>(&self, wi: Vec3, wavelength_nm: f64, mut visit: impl FnMut([V::Real; 3], V::Real)) {
        if Pair::new(wi, wi).is_none() {
            return;
        }
        let integrand = Integrand::<V>::new(self, wi, wavelength_nm);
        self.places(wi, wavelength_nm * 1e-3, &mut |places| places.take(&integrand, &mut visit));
    }

    /// Where an integral over the hemisphere looks: `take` takes what there is, and leaves nothing, as often as there is much.
    fn places<'b>(&'b self, wi: Vec3, wavelength_um: f64, take: &mut dyn FnMut(&mut Places<'b>)) {
        let mut places = Places::default();
        let mut put = |place| {
            places.push(place);
            if places.count == AT_ONCE {
                take(&mut places);
            }
        };
        let lattice = self.table.lattice();
        let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
            let reach = wavelength_um * axis.cutoff / axis.period_um;
            [-reach - wi, reach - wi]
        });
        let density: &dyn Fn([f64; 2], f64) -> f64 = match &self.power {
            Power::Lobes { singles, merged, cut } => {
                let setting = Setting { wi, wavelength_um, known, phase: phase(self.table, wavelength_um), cut: *cut };
                for (lobe, fine) in
                    singles.iter().map(|lobe| (lobe, true)).chain(merged.iter().map(|lobe| (lobe, false)))
                {
                    lobe.integrate(&setting, fine, |wo, share, exponent| {
                        put(Place { wo, factor: share, exponent, record: &lobe.record });
                    });
                }
                return take(&mut places);
            }
            Power::Smooth => &|f, kappa| self.table.density(f, kappa),
            Power::Grid(grid) => &|f, kappa| grid.density(f, kappa),
        };
        hemisphere(known, panel_widths(self.table, wavelength_um), wi[2], |wo, area| {
            if let Some(pair) = Pair::new(wi, wo) {
                let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                let density = density(f, pair.kappa(wavelength_um)) / (wavelength_um * wavelength_um);
                put(Place { wo, factor: area * density, ..Place::NONE });
            }
        });
        take(&mut places);
    }

    /// Whether it is known that the relief varies along x alone, so that the albedo is the same on either side of the x axis.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
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
        let nm = 1e3 * (if which % 2 == 0 { b + root } else { b - root }) / a;
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
    pub fn count_places(&self) -> usize {
        let count = |(wi, wavelength_um)| {
            let mut count = 0;
            self.places(wi, wavelength_um, &mut |places| count += std::mem::take(&mut places.count));
            count
        };
        [([0.0, 0.0, 1.0], 0.4), ([0.6, 0.0, 0.8], 0.5), ([0.0, 0.8, 0.6], 0.6)]
            .map(count)
            .into_iter()
            .fold(1, usize::max)
    }
}

/// A direction in an integral, and what it stands for: the power of a node, where there is one, at this direction's κ, times the angular
/// factor, times `factor·exp(exponent)`.
struct Place<'a> {
    wo: Vec3,
    factor: f64,
    exponent: f64,
    record: &'a [f32],
}

impl Place<'_> {
    const NONE: Self = Self { wo: [0.0, 0.0, 1.0], factor: 0.0, exponent: 0.0, record: &[] };
}

/// Places, component by component. There are many of them since what has just been written one by one is slow to be read together.
struct Places<'a> {
    count: usize,
    wo: [[f64; AT_ONCE]; 3],
    factor: [f64; AT_ONCE],
    exponent: [f64; AT_ONCE],
    record: [&'a [f32]; AT_ONCE],
}

impl Default for Places<'_> {
    fn default() -> Self {
        let zeros = [0.0; AT_ONCE];
        Self { count: 0, wo: [zeros; 3], factor: zeros, exponent: zeros, record: [&[]; AT_ONCE] }
    }
}

impl<'a> Places<'a> {
    #[inline(always)]
    fn push(&mut self, Place { wo, factor, exponent, record }: Place<'a>) {
        let i = self.count;
        (self.wo[0][i], self.wo[1][i], self.wo[2][i]) = (wo[0], wo[1], wo[2]);
        (self.factor[i], self.exponent[i], self.record[i]) = (factor, exponent, record);
        self.count += 1;
    }

    /// Visits all, and has none then.
    fn take<V: Values>(&mut self, integrand: &Integrand<V>, mut visit: impl FnMut([V::Real; 3], V::Real)) {
        while self.count % V::COUNT != 0 {
            self.push(Place::NONE);
        }
        for first in (0..self.count).step_by(V::COUNT) {
            let (wo, part) = integrand.part(self, first);
            visit(wo, part);
        }
        self.count = 0;
    }
}

/// What all directions of an integral have in common.
struct Integrand<'a, V: Values> {
    lobes: &'a Lobes<'a>,
    wi: [V::Real; 3],
    /// 2π over the wavelength in µm.
    wavenumber: V::Real,
    index: Option<ComplexIndex>,
}

impl<'a, V: Values> Integrand<'a, V> {
    fn new(lobes: &'a Lobes, wi: Vec3, wavelength_nm: f64) -> Self {
        let [x, y, z] = wi;
        Self {
            lobes,
            wi: [x, y, z.max(COSINE_MIN)].map(V::Real::lit),
            wavenumber: V::Real::lit(TAU * 1e3 / wavelength_nm),
            index: lobes.options.index.as_ref().map(|index| index.at(wavelength_nm)),
        }
    }

    /// The directions of as many places as the family has numbers, and the parts that these are.
    #[inline(always)]
    fn part(&self, places: &Places, first: usize) -> ([V::Real; 3], V::Real) {
        let pack = |of: &[f64; AT_ONCE]| V::pack(|lane| of[first + lane]);
        let wo = places.wo.each_ref().map(pack);
        let cosines = [self.wi[2], wo[2].max(V::Real::lit(COSINE_MIN))];
        let q = [self.wi[0] + wo[0], self.wi[1] + wo[1], cosines[0] + cosines[1]];
        let mut part = pack(&places.factor) * self.lobes.options.albedo_factor(q, cosines, self.index);
        if let Power::Lobes { .. } = self.lobes.power {
            let curves = PowerCurves::<V>::new(self.lobes.table, q[2] * self.wavenumber);
            let gaussian = (pack(&places.exponent) * V::Real::lit(LOG2_E)).exp2();
            part = part * gaussian * curves.power(|lane| places.record[first + lane]);
        }
        (wo, part)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::{HeightField, random::Random};
    use crate::numeric::{Lanes, Plain};
    use crate::scattering::SpectralIndex;
    use crate::scattering::build_table;
    use crate::table::{Progress, Tiling};

    /// The integral of `visit`'s parts.
    fn total<V: Values>(lobes: &Lobes, wi: Vec3, nm: f64) -> f64 {
        let mut sum = 0.0;
        lobes.visit::<V>(wi, nm, |_, part| sum += V::total(part));
        sum
    }

    #[test]
    fn four_places_at_a_time_are_each_of_them_and_one_side_of_a_grating_is_the_other() {
        // Single precision, of places and of what they are multiplied by; parts are not negative, so that nothing cancels.
        const SINGLE: f64 = 3e-6;
        // The same numbers in another order, in double precision.
        const MIRRORED: f64 = 1e-12;
        let mut random = Random::new(5);
        let relief = |random: &mut Random, nx, ny, height_um: f64| {
            HeightField::new(height_um * random.smooth_field(nx, ny, 3), 0.1, 0.1).unwrap()
        };
        let metal = Some(SpectralIndex::Constant(ComplexIndex { eta: 1.0, k: 6.9 }));
        let plain = Options::default();
        let small_slope = Options { obliquity: Obliquity::SmallSlope, index: metal, ..plain.clone() };
        let cases = [
            (relief(&mut random, 30, 1, 0.2), plain.clone()),
            (relief(&mut random, 30, 1, 0.5), Options { coherence_length_um: 6.0, shadowing: true, ..plain.clone() }),
            (relief(&mut random, 24, 20, 0.3), small_slope),
            // Wide nodes, tabulated.
            (relief(&mut random, 24, 20, 0.3), Options { tiling: Tiling::Aperiodic, ..plain.clone() }),
            // Nothing is diffracted, and splines have next to no knots.
            (relief(&mut random, 30, 1, 0.0), plain),
        ];
        for (i, (field, options)) in cases.iter().enumerate() {
            let table = build_table(field, options, &Progress::none()).unwrap().table;
            let lobes = Lobes::quick(&table, options).unwrap();
            assert_eq!(lobes.is_mirrored(), field.size().1 == 1);
            for _ in 0..200 {
                let (theta, phi): (f64, f64) = (random.between(0.0, 1.57), random.between(0.0, TAU));
                let [x, y, z] = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                let nm = random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                let one = total::<Plain<f64>>(&lobes, [x, y, z], nm);
                let four = total::<Lanes>(&lobes, [x, y, z], nm);
                assert!(one > 0.01 && (four / one - 1.0).abs() < SINGLE, "{i}, {theta} {phi} {nm}: {one}, {four}");
                if lobes.is_mirrored() {
                    let other = total::<Plain<f64>>(&lobes, [x, -y, z], nm);
                    assert!((other / one - 1.0).abs() < MIRRORED, "{i}, {theta} {phi} {nm}: {one}, {other}");
                }
            }
        }
    }
}
