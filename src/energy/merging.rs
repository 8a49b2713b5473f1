//! Gaussians of the nodes of a spectral table of powers, and fewer Gaussians in place of many.
//!
//! The fast integral of the albedo (`integral.rs`) takes nodes whose Gaussians are narrow over the hemisphere one by
//! one if they are few. Of many nodes, the weaker ones are merged in squares of frequencies. A node's *record* in the
//! table gives its power by phase rate.

use super::node_gaussian::NodeGaussian;
use crate::table::{LatticeAxis, NodeCurve, SpectralTable};
use std::collections::BTreeMap;

/// Largest number of narrow nodes that the fast integral takes one by one. With more, the weaker nodes are merged.
/// Chosen: a larger number is more accurate but takes longer.
pub(super) const SEPARATE_MAX: usize = 640;
/// Number of the strongest nodes that stay separate where others are merged. Merging widens a node's Gaussian, which
/// matters most for strong nodes. Chosen: a larger number is more accurate but takes longer.
const STRONGEST: usize = 16;
/// Side in cycles/µm of the squares in which nodes are merged. Chosen: larger squares leave fewer Gaussians; smaller
/// ones keep more of the nodes' frequencies.
const MERGED_SIDE_PER_UM: f64 = 0.14;

/// Whether the table has a cutoff, the largest frequency that the pixels resolve, along one of its axes. The nodes
/// along such an axis sample a continuous spectrum, whereas nodes without a cutoff are orders.
pub(super) fn is_limited(table: &SpectralTable) -> bool {
    table.lattice().x.cutoff.is_finite() || table.lattice().y.cutoff.is_finite()
}

/// One Gaussian for every node with a record.
pub(super) fn node_gaussians(table: &SpectralTable) -> Vec<NodeGaussian<'_>> {
    let axes = [&table.lattice().x, &table.lattice().y];
    let sigma_f = axes.map(LatticeAxis::sigma_per_um);
    let kept = table.kept_nodes().into_iter();
    kept.map(|(jx, jy, record)| NodeGaussian {
        f: [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um],
        sigma_f,
        record: record.into(),
        merged: false,
    })
    .collect()
}

/// One Gaussian for each of the [`STRONGEST`] nodes, and one for all other nodes of each square of frequencies. In a
/// table without a cutoff and with at most [`SEPARATE_MAX`] nodes, all stay separate.
pub(super) fn merged_gaussians(table: &SpectralTable) -> Vec<NodeGaussian<'_>> {
    let mut gaussians = node_gaussians(table);
    if gaussians.len() <= SEPARATE_MAX && !is_limited(table) {
        return gaussians;
    }
    // A node's strength is the sum of its powers at five phase rates, chosen evenly over the table's range. Splines of
    // weak powers may be negative.
    let curves = [0.1, 0.3, 0.5, 0.7, 0.9].map(|fraction| NodeCurve::new(table, fraction * table.kappa_max()));
    let strength = |node: &NodeGaussian| curves.iter().map(|curve| curve.power(&node.record).abs()).sum::<f64>();
    // Integers as keys, since floats have no total order. Strengths are of order one or less.
    gaussians.sort_by_cached_key(|node| std::cmp::Reverse((strength(node) * 1e12) as u64));
    let mut squares: BTreeMap<[i64; 2], Vec<(f64, NodeGaussian<'_>)>> = BTreeMap::new();
    for node in gaussians.split_off(STRONGEST.min(gaussians.len())) {
        let square = node.f.map(|f| (f / MERGED_SIDE_PER_UM).round() as i64);
        // A positive weight, so that the weights of a square have a positive sum.
        squares.entry(square).or_default().push((strength(&node).max(f64::MIN_POSITIVE), node));
    }
    gaussians.extend(squares.into_values().map(joined));
    gaussians
}

/// One Gaussian in place of several nodes, each given with its weight. It has the sum of their records, and the mean
/// and variance of their weighted Gaussians.
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
