//! Fills albedo tables of reliefs that reflect, in the steps of the [module](super).
//!
//! Symbols are the module's: f is the reflectance of wi and wo, a the albedo of wi, and A the tabulated divisor of a
//! direction. b is a lower bound of A, and t the least number from 1 on with `∫ f min(1, t/b(wo)) cosθo dωo ≤ t`.

use super::grid::Grid;
use super::integral::AlbedoIntegral;
use super::nodes::Nodes;
use super::{AlbedoLayout, AlbedoTable, AlbedoView, Real4};
use crate::numeric::{Lanes, Real, Values};
use crate::scattering::{SLAB_PHASE, SLAB_PHASE_OF_RIDGES, SizeRange, Vec3};
use crate::table::{Progress, Steps};

/// Numbers of cells along each side and of planes of a table with narrow orders. Chosen for albedos of at most 1.01
/// (`tests/core/energy.rs`). With 48 cells and 13 planes, the build takes half as long, but divisors are raised more
/// widely around ridges, and the mean albedo of a sinusoid is lower by 0.003.
const SIZE_OF_ORDERS: (u32, u32) = (56, 15);
/// Numbers of cells and planes where the orders of a relief that varies along x and y are wider than [`WIDE_ORDERS`].
/// With [`SIZE_OF_ORDERS`], the build of a tile of 2.4 µm by 2 µm takes 18 s instead of 2 s at a coherence length of
/// 10 µm, and the mean albedo is higher by 0.03.
const SIZE_OF_WIDE_ORDERS: (u32, u32) = (24, 9);
/// Standard deviation in direction cosines above which [`SIZE_OF_WIDE_ORDERS`] applies. Chosen: the build of this tile
/// takes 11 s with [`SIZE_OF_ORDERS`] at 0.02, and 5 s at 0.012.
const WIDE_ORDERS: f64 = 0.02;
/// Numbers of cells and planes of other tables, chosen as those of [`SIZE_OF_ORDERS`]. With (20, 9), the build takes
/// twice as long, and the mean albedo of the preset *Xenopeltis* is higher by 0.008.
const SIZE: (u32, u32) = (16, 7);
/// Check points of a round in each cell of a table with separate orders (`nodes.rs`). With 10, the table is built in
/// three quarters of the time, but 2 of 48,000 albedos of 12 random gratings exceed 1.01, the largest 1.019.
const CHECKS_OF_ORDERS: usize = 14;
/// Check points of a round in each cell of other tables. With 6, an albedo of 1.017 remains on a relief 2 µm deep, and
/// one of 1.19 on a lamellar grating with a coherence length of 5 µm.
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

/// Excess `A − 1` of the divisor that leaves an [`ACCEPTED`] albedo.
pub(super) fn excess(albedo: f64) -> f64 {
    (albedo / ACCEPTED - 1.0).max(0.0)
}

/// The table of a relief that reflects, for a range of `sizes` or its own size.
pub(super) fn reflecting(integral: &AlbedoIntegral, sizes: Option<&SizeRange>, progress: &Progress) -> AlbedoTable {
    // `slab_phase` is the largest change of the relief's phase between slabs, in radians: smaller where orders cause
    // ridges. `is_mirrored` tells that the relief varies along x alone.
    let ((cells, planes), checks, slab_phase) = if !integral.has_separate_orders() {
        (SIZE, CHECKS, SLAB_PHASE)
    } else if !integral.is_mirrored() && integral.sigma_max() > WIDE_ORDERS {
        (SIZE_OF_WIDE_ORDERS, CHECKS_OF_ORDERS, SLAB_PHASE)
    } else {
        (SIZE_OF_ORDERS, CHECKS_OF_ORDERS, SLAB_PHASE_OF_RIDGES)
    };
    let layout = AlbedoLayout::new(cells, planes, sizes, integral.phase_max(), slab_phase);
    let nodes = Nodes {
        grid: Grid { cells },
        planes: layout.planes,
        is_mirrored: integral.is_mirrored(),
        has_pole: !integral.is_dielectric(),
    };
    let for_sizes = sizes.map(|sizes| integral.clone().of_sizes(sizes));
    let integral = for_sizes.as_ref().unwrap_or(integral);
    // Nodes are integrated twice, for b and for t.
    let steps = progress.of_steps(layout.slabs() as usize * (2 * nodes.len() + nodes.expected_checks(checks)));
    let words = (0..layout.slabs()).flat_map(|slab| {
        let wavelengths_nm = |plane: f64| layout.wavelengths_nm(plane, slab);
        slab_packets(integral, nodes, checks, wavelengths_nm, &steps)
    });
    AlbedoTable { layout, words: words.collect() }
}

/// Packets `[gap][y][x]` of a slab. `wavelengths_nm` gives λ' and λ" at a position among the planes.
fn slab_packets(
    integral: &AlbedoIntegral,
    nodes: Nodes,
    checks: usize,
    wavelengths_nm: impl Fn(f64) -> [f64; 2] + Sync,
    steps: &Steps,
) -> Vec<u32> {
    let least = nodes
        .values(steps, |wi, plane| LEAST_FRACTION * excess(parts_and_bound(integral, wi, wavelengths_nm(plane)).1));
    let words = nodes.packets(&least);
    // The small-slope factor of a dielectric vanishes at the horizon. So the albedo has no ridges between nodes, and
    // divisors of one at all nodes suffice.
    if integral.is_dielectric() && least.iter().all(|value| *value == 0.0) {
        return words;
    }
    let b = AlbedoView::<Lanes> { layout: nodes.layout(), words: &words };
    // Excess of t. A result below `enough` need not be exact.
    let needed = |wi: Vec3, plane: f64, enough: f64| {
        let (parts, mut t) = parts_and_bound(integral, wi, wavelengths_nm(plane));
        // The first bound suffices if it is small enough.
        if t > 1.0 + enough {
            // Parts of a with 1/b(wo), where b = 1 + excess.
            let per_b = |wo| Real4::lit(1.0) / (Real4::lit(1.0) + b.excess_in_plane(wo, plane));
            let weighted: Vec<_> = parts.into_iter().map(|(wo, part)| (per_b(wo), part)).collect();
            // Each iteration replaces the bound t by t' = max(1, I(t)), with I(t) = ∫ f min(1, t/b(wo)) cosθo dωo. The
            // first bound fulfils I(t) ≤ t. Then t' ≤ t, and since I does not decrease, I(t') ≤ I(t) ≤ t': t' is a
            // bound, too.
            for _ in 0..ITERATIONS {
                let reached = weighted.iter().fold(Real4::lit(0.0), |sum, &(per_b, part)| {
                    (Real4::lit(t) * per_b).min(Real4::lit(1.0)).fma(part, sum)
                });
                t = Lanes::total(reached).max(1.0);
            }
        }
        excess(t)
    };
    let mut values = nodes.values(steps, |wi, plane| needed(wi, plane, 0.0));
    // b must not exceed the divisor anywhere.
    values.iter_mut().zip(&least).for_each(|(value, least)| *value = value.max(*least));
    nodes.raise(&mut values, checks, steps, needed);
    nodes.packets(&values)
}

/// Sets of four directions wo with their parts of the albedo a of wi, and `max(1, a)`, the first upper bound of t.
fn parts_and_bound(integral: &AlbedoIntegral, wi: Vec3, wavelengths_nm: [f64; 2]) -> (Vec<([Real4; 3], Real4)>, f64) {
    let mut parts = Vec::new();
    let mut albedo = Real4::lit(0.0);
    integral.visit::<Lanes>(wi, wavelengths_nm, |wo, part| {
        albedo += part;
        parts.push((wo, part));
    });
    (parts, Lanes::total(albedo).max(1.0))
}
