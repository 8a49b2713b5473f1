//! A table's power gathered into fewer, wider lobes, for the integrals over the hemisphere.

use super::geometry::direction_above;
use super::surface::Options;
use super::{Pair, Vec3};
use crate::table::{BANDS, HEADER, KernelKind, NodeCurve, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::f64::consts::{PI, TAU};

/// Standard deviation in direction cosines below which a lobe is not integrated across.
const SHARP: f64 = 0.01;
/// The same below which lobes make sharp features of the albedo.
const FEATURES: f64 = 0.03;
/// Standard deviations of a node in a panel of 16 places, and most panels of an integral over the hemisphere.
const PANEL_SIGMAS: f64 = 18.0;
const PANELS_MAX: usize = 10;
/// Lobes below which each makes a feature of the albedo.
const FEW: usize = 40;
/// Nodes that stay alone whatever their number, the strongest first.
const SINGLES: usize = 48;
/// Lobes up to which each is integrated finely, and not the strongest alone.
const FINE: usize = 300;

/// One lobe: power `P(κ)` about the frequency `f` with a Gaussian spread.
struct Lobe {
    f: [f64; 2],
    sigma_f: [f64; 2],
    /// A record of the table, or a sum of such.
    record: Vec<f32>,
}

/// The lobes of an ensemble table.
pub(super) struct PowerBins<'a> {
    table: &'a SpectralTable,
    lobes: Vec<Lobe>,
    /// Whether every lobe is integrated across as well as along its radius. Many lobes that tile the plane need not.
    fine: bool,
    /// Where nodes are so wide that the density is smooth, the panels along x and y in which it is integrated over the
    /// hemisphere.
    panels: Option<[usize; 2]>,
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
        let side = (nodes.len() as f64 / target as f64).sqrt().ceil() as i64;
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
        // A panel of 16 for each so many standard deviations of a node.
        let panels = [x, y].map(|axis| {
            let sigma = 1e-3 * WAVELENGTH_MIN_NM * axis.sigma / axis.period_um;
            (PI / (PANEL_SIGMAS * sigma)).ceil() as usize
        });
        let panels = (panels[0] * panels[1] <= PANELS_MAX).then_some(panels);
        Some(Self { table, fine: target == usize::MAX || lobes.len() <= FINE, lobes, panels })
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
    pub fn places(&self) -> usize {
        /// Places of a lobe on average: one in the middle of the hemisphere, dozens about the horizon.
        const OF_A_LOBE: usize = 10;
        let lattice = self.table.lattice();
        match self.panels {
            Some([x, y]) => 256 * x * y * lattice.x.taps * lattice.y.taps,
            None => OF_A_LOBE * self.lobes.len(),
        }
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
        if let Some(panels) = self.panels {
            let lattice = self.table.lattice();
            let known = [(&lattice.x, wi[0]), (&lattice.y, wi[1])].map(|(axis, wi)| {
                let reach = wavelength_um * axis.cutoff / axis.period_um;
                [(-reach - wi).max(-1.0), (reach - wi).min(1.0)]
            });
            for (wo, area) in hemisphere(panels, known) {
                if let Some(pair) = Pair::new(wi, wo) {
                    let f = [pair.u / wavelength_um, pair.v / wavelength_um];
                    let value = self.table.density(f, pair.kappa(wavelength_um));
                    visit(wo, area * options.angular_factor(&pair) * value / (wavelength_um * wavelength_um));
                }
            }
            return;
        }
        for (i, lobe) in self.lobes.iter().enumerate() {
            lobe.integrate(wi, wavelength_um, self.fine || i < SINGLES, |wo, area| {
                let pair = Pair::new(wi, wo);
                let known = |pair: &Pair| self.table.knows([pair.u / wavelength_um, pair.v / wavelength_um]);
                if let Some(pair) = pair.filter(known) {
                    let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                    visit(wo, area * curve.power(&lobe.record) * options.angular_factor(&pair));
                }
            });
        }
    }
}

/// Directions over the part of the hemisphere between two direction cosines along x and two along y, with their areas in
/// direction cosines, `cosθ dω`.
///
/// With `y = sin α` and `x = cos α sin ψ` the cosine is `cos α cos ψ` and the area `cos α · cosθ dα dψ`, so that the cosine
/// that the obliquity factor divides by cancels, and places crowd towards the horizon.
fn hemisphere(
    [panels_x, panels_y]: [usize; 2],
    [between_x, between_y]: [[f64; 2]; 2],
) -> impl Iterator<Item = (Vec3, f64)> {
    in_panels(panels_y, between_y.map(f64::asin)).flat_map(move |(alpha, weight_y)| {
        let (y, across) = alpha.sin_cos();
        let between = between_x.map(|x| (x / across.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).asin());
        in_panels(panels_x, between).map(move |(psi, weight_x)| {
            let (sin, cos) = psi.sin_cos();
            ([across * sin, y, across * cos], weight_x * weight_y * across * across * cos)
        })
    })
}

/// Places between two with their weights, 16 in each of the panels; none if the two are in the wrong order.
fn in_panels(panels: usize, [low, high]: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
    let half = 0.5 * (high - low).max(0.0) / panels as f64;
    (0..panels).flat_map(move |panel| {
        let middle = low + (2 * panel + 1) as f64 * half;
        let both = move |&(node, weight): &(f64, f64)| [-node, node].map(|node| (middle + half * node, half * weight));
        LEGENDRE_16.iter().flat_map(both)
    })
}

/// Abscissae and weights of a three-point Gauss–Hermite rule for a standard normal variate.
const HERMITE_3: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (-1.732_050_807_568_877_2, 1.0 / 6.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// Positive abscissae and weights of the six-point Gauss–Legendre rule on [−1, 1].
const LEGENDRE_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_35),
];

/// Positive abscissae and weights of the 16-point Gauss–Legendre rule on [−1, 1].
const LEGENDRE_16: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_5),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_7),
    (0.755_404_408_355_003, 0.124_628_971_255_533_9),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_8),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_9),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

impl Lobe {
    /// Visits directions with their shares of the lobe's Gaussian in the plane of direction cosines, of which nothing
    /// lies beyond the horizon. Near the horizon the radial integral is taken in cosθo, which the obliquity factor
    /// divides by, so that the integrand stays smooth.
    fn integrate(&self, wi: Vec3, wavelength_um: f64, fine: bool, mut visit: impl FnMut(Vec3, f64)) {
        let [qx, qy] = [wavelength_um * self.f[0] - wi[0], wavelength_um * self.f[1] - wi[1]];
        let [sx, sy] = [wavelength_um * self.sigma_f[0], wavelength_um * self.sigma_f[1]];
        let rho = qx.hypot(qy);
        let widest = sx.max(sy);
        // Half a per mille of 1/cosθo averaged over the Gaussian is 40 standard deviations inside in cos²θo.
        if 1.0 - rho * rho > 40.0 * widest {
            if widest < SHARP || !fine {
                if let Some(wo) = direction_above(qx, qy) {
                    visit(wo, 1.0);
                }
                return;
            }
            for (tx, px) in HERMITE_3 {
                for (ty, py) in HERMITE_3 {
                    if let Some(wo) = direction_above(qx + tx * sx, qy + ty * sy) {
                        visit(wo, px * py);
                    }
                }
            }
            return;
        }
        let (ex, ey) = if rho > 1e-9 { (qx / rho, qy / rho) } else { (1.0, 0.0) };
        let radial = (ex * sx).hypot(ey * sy);
        let across = (ey * sx).hypot(ex * sy);
        const CUT: f64 = 5.0;
        if rho - CUT * radial >= 1.0 {
            return;
        }
        let across_rule: &[(f64, f64)] = if across < SHARP || !fine { &[(0.0, 1.0)] } else { &HERMITE_3 };
        for &(t, p) in across_rule {
            // cosθo along the radius at this offset across: cos² = reach² − ρ².
            let offset = t * across;
            let reach_squared = 1.0 - offset * offset;
            if reach_squared <= 0.0 {
                continue;
            }
            let inner = (rho - CUT * radial).max(-reach_squared.sqrt());
            let outer = (rho + CUT * radial).min(reach_squared.sqrt());
            if inner >= outer {
                continue;
            }
            // ρ = reach·sin ψ makes dρ = cosθo dψ.
            let reach = reach_squared.sqrt();
            let (low, high) = ((inner / reach).clamp(-1.0, 1.0).asin(), (outer / reach).clamp(-1.0, 1.0).asin());
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let rule: &[(f64, f64)] = if fine { &LEGENDRE_16 } else { &LEGENDRE_6 };
            for &(node, weight) in rule {
                for psi in [middle - half * node, middle + half * node] {
                    let (r, cos) = (reach * psi.sin(), reach * psi.cos());
                    let z = (r - rho) / radial;
                    let density = (-0.5 * z * z).exp() / (TAU.sqrt() * radial);
                    visit([r * ex - offset * ey, r * ey + offset * ex, cos], p * weight * half * density * cos);
                }
            }
        }
    }
}
