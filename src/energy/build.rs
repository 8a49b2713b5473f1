//! Fills albedo tables of reliefs that reflect, in the steps of the [module](super), whose symbols are used here.

use super::grid::Grid;
use super::integral::AlbedoIntegral;
use super::nodes::Nodes;
use super::{AlbedoLayout, AlbedoView};
use crate::numeric::{Lanes, Numbers, Real, Values};
use crate::scattering::Vec3;
use crate::table::Progress;

/// Numbers of cells along each side and of planes of a table with narrow orders. Chosen for albedos of at most 1.01
/// (`tests/core/energy.rs`). With 48 cells, divisors are raised more widely around ridges: where the albedo of a
/// sinusoid is below 0.98, division removes 2.3 % of it instead of 1.6 %.
const SIZE_OF_ORDERS: (u32, u32) = (64, 17);
/// Numbers of cells and planes of other tables, chosen as those of [`SIZE_OF_ORDERS`].
const SIZE: (u32, u32) = (20, 9);
/// Numbers of cells and planes where the spectrum is continuous, and smoother than that of orders. They take half of
/// the time of [`SIZE`].
const SIZE_CONTINUOUS: (u32, u32) = (16, 7);
/// Check points in each cell of a table with narrow orders. With 22, an albedo of 1.014 remains at 89.5° on a blazed
/// grating; more take longer.
const CHECKS_OF_ORDERS: usize = 32;
/// Check points in each cell of other tables. With 4, an albedo of 1.024 remains on a relief 2 µm deep; more take
/// longer.
const CHECKS: usize = 8;
/// Excess of the least divisor b, as a fraction of the albedo's excess `a − 1`. With 0.5, the mean albedo of a steep
/// sinusoid is lower by 0.01. With 0.7, t has ridges too narrow for the check points, and an albedo of 1.015 remains on
/// a blazed grating.
const LEAST_FRACTION: f64 = 0.6;
/// Albedo that is accepted at nodes and check points. Chosen: less than the fast integral's errors.
const ACCEPTED: f64 = 1.0003;
/// Number of iterations for t. Every iterate is an upper bound of t. Chosen: more give smaller divisors, but take
/// longer.
const ITERATIONS: usize = 4;

/// Four numbers, one in each lane.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Number of cells along each side of a relief's table, and number of its planes of wavelength.
pub(super) fn resolution(integral: &AlbedoIntegral) -> (u32, u32) {
    match (integral.has_narrow_orders(), integral.is_continuous()) {
        (true, _) => SIZE_OF_ORDERS,
        (false, false) => SIZE,
        (false, true) => SIZE_CONTINUOUS,
    }
}

/// Excess `A − 1` of the divisor that leaves an [`ACCEPTED`] albedo.
pub(super) fn excess(albedo: f64) -> f64 {
    (albedo / ACCEPTED - 1.0).max(0.0)
}

/// Packets `[gap][y][x]` of a slab. `wavelength_nm` gives the wavelength at a position among the planes, from 0 to
/// `planes − 1`.
pub(super) fn slab(
    integral: &AlbedoIntegral,
    AlbedoLayout { cells, planes, .. }: AlbedoLayout,
    wavelength_nm: impl Fn(f64) -> f64 + Sync,
    progress: &Progress,
) -> Vec<u32> {
    let nodes = Nodes {
        grid: Grid { cells },
        planes,
        is_mirrored: integral.is_mirrored(),
        has_pole: !integral.is_dielectric(),
    };
    let checks = if integral.has_narrow_orders() { CHECKS_OF_ORDERS } else { CHECKS };
    // Nodes are integrated twice, for b and for t.
    let steps = progress.of_steps(2 * nodes.len() + checks * nodes.cells());
    let least = nodes
        .values(&steps, |wi, plane| LEAST_FRACTION * excess(parts_and_bound(integral, wi, wavelength_nm(plane)).1));
    let words = nodes.packets(&least);
    // The small-slope factor of a dielectric vanishes at the horizon. So there are no ridges between nodes, and
    // divisors of one at all nodes suffice.
    if integral.is_dielectric() && least.iter().all(|value| *value == 0.0) {
        return words;
    }
    let b = AlbedoView::<Lanes> { layout: nodes.layout(), words: &words };
    let needed = |wi: Vec3, plane: f64, enough: f64| {
        let (parts, mut t) = parts_and_bound(integral, wi, wavelength_nm(plane));
        // The first bound suffices if it is small enough.
        if t > 1.0 + enough {
            // Parts of a with 1/b(wo), where b = 1 + excess.
            let per_b = |wo| Real4::lit(1.0) / (Real4::lit(1.0) + b.excess_in_plane(wo, plane));
            let weighted: Vec<_> = parts.into_iter().map(|(wo, part)| (per_b(wo), part)).collect();
            // Each iteration replaces t by the larger of 1 and I(t) = ∫ f min(1, t/b(wo)) cosθo dωo. The first t
            // fulfils I(t) ≤ t, and I does not decrease with t. So I(I(t)) ≤ I(t): the new t fulfils it, too.
            for _ in 0..ITERATIONS {
                let reached = weighted.iter().fold(Real4::lit(0.0), |sum, &(per_b, part)| {
                    (Real4::lit(t) * per_b).min(Real4::lit(1.0)).fma(part, sum)
                });
                t = Lanes::total(reached).max(1.0);
            }
        }
        excess(t)
    };
    let mut values = nodes.values(&steps, |wi, plane| needed(wi, plane, 0.0));
    // b must not exceed the divisor anywhere.
    values.iter_mut().zip(&least).for_each(|(value, least)| *value = value.max(*least));
    nodes.raise(&mut values, checks, &steps, needed);
    nodes.packets(&values)
}

/// Sets of four directions wo with their parts of the albedo a of wi, and `max(1, a)`, the first upper bound of t.
fn parts_and_bound(integral: &AlbedoIntegral, wi: Vec3, nm: f64) -> (Vec<([Real4; 3], Real4)>, f64) {
    let mut parts = Vec::new();
    let mut albedo = Real4::lit(0.0);
    integral.visit::<Lanes>(wi, nm, |wo, part| {
        albedo += part;
        parts.push((wo, part));
    });
    (parts, Lanes::total(albedo).max(1.0))
}
