//! Portions of a power spectrum: the Gaussians of a table's nodes, and rectangles of the frequency plane, called
//! *squares*, each with the sum of many Gaussians' parts.
//!
//! A spectral table of powers has a Gaussian over frequency for each of its nodes. A node's *record* in the table is a
//! spline of its power over the phase rate κ (`scattering/`). Records are linear in the power, so the sum of several
//! records is the record of their sum.

use crate::scattering::{TYPICAL_WAVELENGTH_UM, Vec3};
use crate::table::{LatticeAxis, SpectralTable};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Number of the strongest narrow Gaussians that stay separate. With 300, a crossed grating of 2 µm by 2 µm loses 6 %
/// of its albedo to divisors, since tables with squares are coarser (`build.rs`); but with 500 the table takes 1.7 s
/// instead of 0.05 s. With 1000, crops of *Elaphe* of 2.3 µm by 2.3 µm (docs/validity.md) misplace 5.3 % of the power
/// at 75° instead of 7.0 %, but their tables take 5 s longer.
const SEPARATE: usize = 500;
/// Side in cycles/µm of the squares for narrow Gaussians: about the largest of which the quadrature has a single row at
/// all wavelengths. Smaller ones take longer.
pub(super) const NARROW_SIDE_PER_UM: f64 = 0.2;
/// Standard deviation in direction cosines, at [`TYPICAL_WAVELENGTH_UM`] and along the axis where it is larger, above
/// which a Gaussian counts as wide. All wide Gaussians are summed in squares. Chosen: they overlap their neighbours,
/// and a square serves several of them.
const WIDE_SIGMA: f64 = 0.04;
/// Side of the squares for wide Gaussians, in their standard deviations. With 0.8, albedos at a coherence length of
/// 1 µm err by 1.7 % (root mean square) instead of 1.3 %.
const WIDE_SIDE_SIGMAS: f64 = 0.7;
/// Standard deviation of a uniform variate on an interval of length 1: 1/√12.
const UNIFORM_SIGMA: f64 = 0.288_675_134_594_812_9;
/// Distance from its centre, in standard deviations, at which a Gaussian is cut off. 3e-4 of its power lies beyond.
pub(super) const REACH: f64 = 3.6;

/// Gaussian or square of frequencies, with its portion of the power of a spectral table.
#[derive(Clone)]
pub(super) struct Portion<'a> {
    /// Frequency of its centre along x and y in cycles/µm.
    pub f: [f64; 2],
    /// Standard deviation along x and y in cycles/µm.
    pub sigma_f: [f64; 2],
    /// Whether it is uniform over a square, with sides of `√12·sigma_f`, instead of a Gaussian.
    pub is_square: bool,
    /// Spline of its power over the phase rate; coefficients that it lacks at the end are zero.
    pub record: Cow<'a, [f32]>,
}

/// Incident light, and the relief's phase.
pub(super) struct Incidence {
    /// Incident direction.
    pub wi: Vec3,
    /// Wavelength in µm.
    pub wavelength_um: f64,
    /// Phase in radians between the relief's lowest and highest point, per unit of cosθo. Not negative.
    pub phase_per_cosine: f64,
    /// Largest |wi + wo| along x and y that the relief's pixels resolve, in direction cosines; may be infinite.
    pub limits: [f64; 2],
}

/// Probability that a standard normal variate lies between two numbers.
fn probability(low: f64, high: f64) -> f64 {
    let cumulative = |t: f64| 0.5 * (1.0 + libm::erf(t / std::f64::consts::SQRT_2));
    cumulative(high) - cumulative(low)
}

/// One Gaussian for every node with a record.
pub(super) fn node_gaussians(table: &SpectralTable) -> Vec<Portion<'_>> {
    let axes = [&table.lattice().x, &table.lattice().y];
    let sigma_f = axes.map(LatticeAxis::sigma_per_um);
    let kept = table.kept_nodes().into_iter();
    kept.map(|(jx, jy, record)| Portion {
        f: [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um],
        sigma_f,
        is_square: false,
        record: record.into(),
    })
    .collect()
}

/// Portions of a table. At most [`SEPARATE`] Gaussians, the strongest, stay if they are narrow and diffraction orders.
/// All others are summed in squares, with sides of at least `side_min_per_um` cycles/µm along axes with several nodes.
pub(super) fn portions(table: &SpectralTable, side_min_per_um: f64) -> Vec<Portion<'_>> {
    let mut gaussians = node_gaussians(table);
    let axes = [&table.lattice().x, &table.lattice().y];
    let sigma_f = axes.map(LatticeAxis::sigma_per_um);
    let is_wide = sigma_f[0].max(sigma_f[1]) * TYPICAL_WAVELENGTH_UM > WIDE_SIGMA;
    // With a cutoff, the largest frequency that the pixels resolve, nodes sample a continuous spectrum. Without one,
    // each node is a diffraction order.
    let is_continuous = axes.iter().any(|axis| axis.cutoff.is_finite());
    let separate = if is_wide || is_continuous { 0 } else { SEPARATE };
    // `reach` is the largest node number along an axis. If it is 0, all nodes lie at frequency 0.
    let sides = [0, 1].map(|c| {
        match (is_wide, axes[c].reach) {
            (true, 0) => WIDE_SIDE_SIGMAS * sigma_f[c],
            (true, _) => side_min_per_um.max(WIDE_SIDE_SIGMAS * sigma_f[c]),
            // One square, with the standard deviation of the Gaussians, takes their power.
            (false, 0) => sigma_f[c] / UNIFORM_SIGMA,
            (false, _) => NARROW_SIDE_PER_UM,
        }
    });
    // Strength: the sum of the absolute coefficients of the spline. Integers are keys, since `f64` is not `Ord`.
    // The factor keeps twelve decimals.
    let strength = |gaussian: &Portion| gaussian.record.iter().map(|value| f64::from(value.abs())).sum::<f64>();
    gaussians.sort_by_cached_key(|gaussian| std::cmp::Reverse((strength(gaussian) * 1e12) as u64));
    let weak = gaussians.split_off(separate.min(gaussians.len()));
    gaussians.extend(squares(&weak, sides));
    gaussians
}

/// Sums of Gaussians over the squares of a lattice with the given sides in cycles/µm. The sums have the Gaussians'
/// variance, if these are wide enough.
fn squares(gaussians: &[Portion], sides: [f64; 2]) -> Vec<Portion<'static>> {
    // Indices of the squares along axis c that a Gaussian reaches, each with the fraction in it.
    let along = |gaussian: &Portion, c: usize| {
        let (f, side) = (gaussian.f[c], sides[c]);
        // Squares add twice the variance side²/12 of a uniform interval: their own, and that of moving powers to their
        // centres. It is subtracted from the Gaussian's variance first. If nothing is left, the Gaussian falls into the
        // square around its centre.
        let sigma = (gaussian.sigma_f[c].powi(2) - side * side / 6.0).max(1e-12 * side * side).sqrt();
        let [low, high] = [-REACH, REACH].map(|t| ((f + t * sigma) / side).round() as i64);
        (low..=high).map(move |i| {
            let [low, high] = [-0.5, 0.5].map(|half| ((i as f64 + half) * side - f) / sigma);
            (i, probability(low, high))
        })
    };
    let mut records: BTreeMap<[i64; 2], Vec<f32>> = BTreeMap::new();
    for gaussian in gaussians {
        for (ix, in_x) in along(gaussian, 0) {
            for (iy, in_y) in along(gaussian, 1) {
                let record = records.entry([ix, iy]).or_default();
                record.resize(record.len().max(gaussian.record.len()), 0.0);
                let fraction = (in_x * in_y) as f32;
                record.iter_mut().zip(&*gaussian.record).for_each(|(sum, value)| *sum += fraction * value);
            }
        }
    }
    let sigma_f = sides.map(|side| UNIFORM_SIGMA * side);
    let centre = |square: [i64; 2]| [0, 1].map(|c| square[c] as f64 * sides[c]);
    records
        .into_iter()
        .map(|(square, record)| Portion { f: centre(square), sigma_f, is_square: true, record: record.into() })
        .collect()
}
