//! A table's power gathered into fewer, wider lobes, for the integrals over the hemisphere.

use super::geometry::direction_above;
use super::surface::Options;
use super::{Pair, Vec3};
use crate::table::{BANDS, HEADER, KernelKind, NodeCurve, SpectralTable, WAVELENGTH_MAX_NM};

/// Standard deviation in direction cosines below which a lobe is not integrated across.
const SHARP: f64 = 0.01;
/// Lobes below which each of them counts, and is cheap enough to be integrated finely.
const FEW: usize = 40;
/// Nodes that stay alone whatever their number, the strongest first.
const SINGLES: usize = 48;

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
}

impl<'a> PowerBins<'a> {
    /// Gathers the nodes of `table` into about `target` lobes; with at most that many nodes, each is its own. `usize::MAX`
    /// asks for each node to be integrated finely however many there are. `None`
    /// for a table of amplitudes, whose powers do not add.
    pub fn new(table: &'a SpectralTable, target: usize) -> Option<Self> {
        if table.kernel() != KernelKind::Power {
            return None;
        }
        let (x, y) = (&table.lattice().x, &table.lattice().y);
        let mut nodes = table.kept_nodes();
        nodes.retain(|(jx, jy, _)| jx.abs() as f64 <= x.cutoff && jy.abs() as f64 <= y.cutoff);
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
        Some(Self { table, fine: target == usize::MAX || lobes.len() < FEW, lobes })
    }

    /// Whether the albedo has sharp features: few lobes, so narrow that one evaluation stands for each away from the
    /// horizon.
    pub fn sharp(&self) -> bool {
        let widest = self.lobes.iter().flat_map(|lobe| lobe.sigma_f).fold(0.0, f64::max);
        self.lobes.len() < FEW && 1e-3 * WAVELENGTH_MAX_NM * widest < SHARP
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
        let wavelength_um = wavelength_nm * 1e-3;
        let term = |lobe: &Lobe, wo: Vec3| {
            Pair::new(wi, wo).map_or(0.0, |pair| {
                let curve = NodeCurve::new(self.table, pair.kappa(wavelength_um));
                curve.power(&lobe.record) * options.angular_factor(&pair) * scale(wo)
            })
        };
        self.lobes.iter().map(|lobe| lobe.integrate(wi, wavelength_um, self.fine, |wo| term(lobe, wo))).sum()
    }
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
    /// Mean of `value(wo)` over the lobe's Gaussian in the plane of direction cosines, with what lies beyond the
    /// horizon counted as zero. Near the horizon the radial integral is taken in cosθo, which the obliquity factor
    /// divides by, so that the integrand stays smooth.
    fn integrate(&self, wi: Vec3, wavelength_um: f64, fine: bool, value: impl Fn(Vec3) -> f64) -> f64 {
        let [qx, qy] = [wavelength_um * self.f[0] - wi[0], wavelength_um * self.f[1] - wi[1]];
        let [sx, sy] = [wavelength_um * self.sigma_f[0], wavelength_um * self.sigma_f[1]];
        let rho = qx.hypot(qy);
        let widest = sx.max(sy);
        // Half a per mille of 1/cosθo averaged over the Gaussian is 40 standard deviations inside in cos²θo.
        if 1.0 - rho * rho > 40.0 * widest {
            if widest < SHARP || !fine {
                return direction_above(qx, qy).map_or(0.0, value);
            }
            let mut sum = 0.0;
            for (tx, px) in HERMITE_3 {
                for (ty, py) in HERMITE_3 {
                    sum += px * py * direction_above(qx + tx * sx, qy + ty * sy).map_or(0.0, &value);
                }
            }
            return sum;
        }
        let (ex, ey) = if rho > 1e-9 { (qx / rho, qy / rho) } else { (1.0, 0.0) };
        let radial = (ex * sx).hypot(ey * sy);
        let across = (ey * sx).hypot(ex * sy);
        const CUT: f64 = 5.0;
        if rho - CUT * radial >= 1.0 {
            return 0.0;
        }
        let across_rule: &[(f64, f64)] = if across < SHARP || !fine { &[(0.0, 1.0)] } else { &HERMITE_3 };
        let mut sum = 0.0;
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
                    let density = (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * radial);
                    let wo = [r * ex - offset * ey, r * ey + offset * ex, cos];
                    sum += p * weight * half * density * cos * value(wo);
                }
            }
        }
        sum
    }
}
