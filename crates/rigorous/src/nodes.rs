//! Nodes on one period of the curve, the relief's cross-section: positions, derivatives, distances and quadrature
//! weights.
//!
//! The curve r(τ) has a parameter τ in [0, 2π), with nodes at `τ_i = 2π(i + ½)/n`. *Speed* is |dr/dτ|, so that the
//! arc element is `speed·dτ` and the trapezium rule has weights `speed·2π/n`. Positions are (x, z) in µm, across the
//! grooves and upwards; the normal ν points into the air above.
//!
//! Integrals over the curve become sums over the nodes (Nyström's method). Their kernels, from a *source* node to a
//! *target* node, are singular as ln|τ − τ'|, which the trapezium rule does not integrate. For the logarithmic part
//! of a kernel (`layers.rs`), Kress' weights (`log_weights`) replace those of the trapezium rule.
//!
//! The relief repeats with the period. The *nearest image* of a source node is its copy, moved by −1, 0 or 1 periods,
//! that lies nearest to the target node.
//!
//! A profile is smooth or consists of *edges* that meet in corners (`profile/mod.rs`). Fields are singular at corners,
//! so the nodes of an edge are graded: they crowd towards both ends. Differences of positions near one corner are
//! computed from offsets to that corner, which keep the digits that positions lose.

use crate::profile::{Edge, Profile, Shape, smooth_height};
use std::f64::consts::{PI, TAU};

/// Exponent of the grading towards corners: near a corner, the distance of the i-th of n nodes varies as (i/n)^5. An
/// exponent of 3 leaves several times the error; larger ones move more nodes towards the corners.
const GRADING: f64 = 5.0;

/// Fewest nodes on an edge: four on either half, graded towards the corner at its end. Larger numbers give short walls
/// more nodes than they need; smaller ones hardly grade.
pub(crate) const EDGE_NODES_MIN: usize = 8;

/// Fraction of the nodes that is distributed equally over the edges; the rest is distributed by length. A short wall
/// needs more nodes than its length suggests, for the singularities at its corners. Larger fractions take nodes from
/// long edges; smaller ones from short edges.
const EQUAL_FRACTION: f64 = 0.4;

/// Position of a node relative to the two corners of its edge.
#[derive(Clone, Copy, Debug)]
struct OnEdge {
    /// Index of the edge, in order along the curve.
    edge: usize,
    /// Whether this edge is a straight line.
    straight: bool,
    /// (x, z) of the node minus (x, z) of a corner, in µm: for the first corner of the edge, then for its last.
    offsets: [[f64; 2]; 2],
    /// Index in `offsets` of the corner that is nearer by the edge's parameter.
    nearer: usize,
}

/// The corner nearer to a node. Corner i of a period is the start of edge i.
struct NearerCorner {
    /// Index of the corner within its period.
    index: usize,
    /// Period that the corner lies in: 1 for the end of the last edge, else 0.
    period: i32,
    /// (x, z) of the node minus that of the corner, in µm.
    offset: [f64; 2],
}

impl OnEdge {
    /// The nearer corner of this node, on a curve of `edge_count` edges.
    fn nearer_corner(&self, edge_count: usize) -> NearerCorner {
        let corner = self.edge + self.nearer;
        NearerCorner {
            index: corner % edge_count,
            period: i32::from(corner == edge_count),
            offset: self.offsets[self.nearer],
        }
    }
}

/// Nodes in order along the curve; lengths in µm.
#[derive(Clone, Debug)]
pub(crate) struct Nodes {
    /// Period d of the relief.
    pub(crate) period: f64,
    /// Coordinates across the grooves, which do not decrease along the curve.
    pub(crate) x: Vec<f64>,
    /// Heights.
    pub(crate) z: Vec<f64>,
    /// |dr/dτ|.
    pub(crate) speed: Vec<f64>,
    /// Unit normal (x, z) into the air.
    pub(crate) normal: Vec<[f64; 2]>,
    /// Curvature `ν·r''/|r'|²` in 1/µm; negative where the relief is convex.
    pub(crate) curvature: Vec<f64>,
    /// Element k: Kress' weight for the logarithm `ln(4 sin²((τ − τ')/2))` at nodes k steps apart, minus the trapezium
    /// rule's, which is taken as 0 at k = 0.
    pub(crate) log_weights: Vec<f64>,
    /// Position of each node on its edge; empty for a smooth profile.
    on_edge: Vec<OnEdge>,
    /// Number of edges; 0 for a smooth profile.
    edge_count: usize,
}

/// Vector from the nearest image of a source node to a target node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// Component along x, in µm.
    pub(crate) x: f64,
    /// Component along z, in µm.
    pub(crate) z: f64,
    /// Periods by which the source is moved along +x to its nearest image: −1, 0 or 1.
    pub(crate) periods: i32,
    /// Component along the source's normal, in µm; exactly 0 between two nodes of one straight edge.
    pub(crate) along_normal: f64,
}

impl Nodes {
    /// Places `counts[i]` nodes on edge i; a smooth profile has one count. The sum of the counts must be even.
    pub(crate) fn new(profile: &Profile, counts: &[usize]) -> Self {
        let count = counts.iter().sum();
        let mut nodes = Self {
            period: profile.period_um(),
            x: Vec::with_capacity(count),
            z: Vec::with_capacity(count),
            speed: Vec::with_capacity(count),
            normal: Vec::with_capacity(count),
            curvature: Vec::with_capacity(count),
            log_weights: log_weights(count),
            on_edge: Vec::new(),
            edge_count: 0,
        };
        match &profile.shape {
            Shape::Smooth(harmonics) => {
                // τ is the phase 2πx/d, and the parameter u of `push`.
                for i in 0..count {
                    let phase = TAU * (i as f64 + 0.5) / count as f64;
                    let [z, dz, ddz] = smooth_height(harmonics, phase);
                    let dx = nodes.period / TAU;
                    nodes.push([dx * phase, z], [dx, dz], [0.0, ddz], 1.0);
                }
            }
            Shape::Edges(edges) => {
                nodes.edge_count = edges.len();
                for (index, (edge, &n)) in edges.iter().zip(counts).enumerate() {
                    nodes.push_edge(edge, index, n, count);
                }
            }
        }
        nodes
    }

    /// Appends the n nodes of edge `index`; the whole curve has `count` nodes.
    fn push_edge(&mut self, edge: &Edge, index: usize, n: usize, count: usize) {
        for i in 0..n {
            let Graded { from_start, from_end, rate } = graded(i, n);
            let (point, ends) = (edge.at(from_start), edge.ends());
            let offsets = if edge.is_straight() {
                // On a straight edge the first derivative is the vector from its start to its end.
                [from_start, -from_end].map(|fraction| point.first.map(|component| component * fraction))
            } else {
                ends.map(|end| [0, 1].map(|j| point.position[j] - end[j]))
            };
            let nearer = usize::from(from_start > from_end);
            let position = [0, 1].map(|j| ends[nearer][j] + offsets[nearer][j]);
            // du/dτ = du/dσ·dσ/dτ with σ = (i + ½)/n: σ advances by 1/n from node to node, τ by 2π/count.
            let du_dtau = rate * count as f64 / (TAU * n as f64);
            self.push(position, point.first, point.second, du_dtau);
            self.on_edge.push(OnEdge { edge: index, straight: edge.is_straight(), offsets, nearer });
        }
    }

    /// Appends a node at (x, z). `first` and `second` are the derivatives of (x, z) with respect to a parameter u.
    fn push(&mut self, [x, z]: [f64; 2], first: [f64; 2], second: [f64; 2], du_dtau: f64) {
        let length = first[0].hypot(first[1]);
        let normal = [-first[1] / length, first[0] / length];
        self.x.push(x);
        self.z.push(z);
        self.speed.push(length * du_dtau);
        self.normal.push(normal);
        self.curvature.push((normal[0] * second[0] + normal[1] * second[1]) / (length * length));
    }

    /// Number of nodes n on one period.
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// Step of the parameter τ between nodes, 2π/n.
    pub(crate) fn step(&self) -> f64 {
        TAU / self.len() as f64
    }

    /// Peak-to-valley height of the nodes, in µm.
    pub(crate) fn height(&self) -> f64 {
        let high = self.z.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - self.z.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Smallest distance between neighbouring nodes, in µm.
    pub(crate) fn spacing_min(&self) -> f64 {
        let n = self.len();
        (0..n)
            .map(|i| {
                let s = self.separation(i, (i + 1) % n);
                s.x.hypot(s.z)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Vector from the nearest image of node `source` to node `target`.
    ///
    /// The vector is a difference of positions. Where both nodes are nearest to the same corner, it is the difference
    /// of their offsets to this corner.
    pub(crate) fn separation(&self, target: usize, source: usize) -> Separation {
        let (mut x, mut z) = (self.x[target] - self.x[source], self.z[target] - self.z[source]);
        let half_period = 0.5 * self.period;
        let mut periods = i32::from(x > half_period) - i32::from(x < -half_period);
        x -= self.period * f64::from(periods);
        let mut on_one_line = false;
        if let (Some(on_target), Some(on_source)) = (self.on_edge.get(target), self.on_edge.get(source)) {
            let [by_target, by_source] = [on_target, on_source].map(|on| on.nearer_corner(self.edge_count));
            let [dx, dz] = [0, 1].map(|j| by_target.offset[j] - by_source.offset[j]);
            // Offsets from a common corner keep the digits that positions lose. The source moves by the periods between
            // the corner beside it and the same corner beside the target. If the nodes are more than half a period
            // apart along x, another image is nearer, and the difference of positions is kept.
            if by_target.index == by_source.index && dx.abs() < half_period {
                (x, z, periods) = (dx, dz, by_target.period - by_source.period);
            }
            on_one_line = on_target.straight && on_target.edge == on_source.edge && periods == 0;
        }
        let normal = self.normal[source];
        let along_normal = if on_one_line { 0.0 } else { normal[0] * x + normal[1] * z };
        Separation { x, z, periods, along_normal }
    }

    /// Correction of the diagonal of K, the double layer potential (`layers.rs`), at a node `target`. It concerns the
    /// edge across the node's nearer corner, and is 0 for a smooth profile.
    ///
    /// At short distances the kernel of K from r' to r is `ν'·(r − r')/(2π|r − r'|²)`, with the normal ν' at r'. For a
    /// target r next to a corner, the kernel on the neighbouring edge varies over the target's distance from the
    /// corner, which no grading resolves. For a constant field the integral is known: the angle that the edge subtends
    /// at the target, in turns, positive where the edge is followed counter-clockwise about the target. The correction
    /// is this angle minus the quadrature.
    pub(crate) fn corner_defect(&self, target: usize) -> f64 {
        let Some(own) = self.on_edge.get(target) else { return 0.0 };
        // If the corner is the end of the target's edge, the neighbouring edge is the next one, else the previous one.
        let is_after = own.nearer == 1;
        let steps = if is_after { 1 } else { self.edge_count - 1 };
        let neighbour = (own.edge + steps) % self.edge_count;
        // Index of the corner in `offsets` of the neighbouring edge: 0 for its start, 1 for its end.
        let corner = usize::from(!is_after);
        // All vectors below have their origin at the corner.
        let node = own.offsets[own.nearer];
        // 2π times the quadrature of the kernel for a constant field.
        let mut sum = 0.0;
        let mut far_end = [0.0; 2];
        for (source, on) in self.on_edge.iter().enumerate().filter(|(_, on)| on.edge == neighbour) {
            let [dx, dz] = [0, 1].map(|j| on.offsets[corner][j] - node[j]);
            let [nx, nz] = self.normal[source];
            // The kernel has r − r' = −(dx, dz).
            sum -= (nx * dx + nz * dz) / (dx * dx + dz * dz) * self.speed[source] * self.step();
            // Every source gives the same vector, up to rounding.
            far_end = [0, 1].map(|j| on.offsets[corner][j] - on.offsets[1 - corner][j]);
        }
        // Vectors from the target to both ends of the neighbouring edge, in the order along the curve.
        let to_far_end = [0, 1].map(|j| far_end[j] - node[j]);
        let to_corner = node.map(|c| -c);
        let (first, last) = if is_after { (to_corner, to_far_end) } else { (to_far_end, to_corner) };
        let (cross, dot) = (first[0] * last[1] - first[1] * last[0], first[0] * last[0] + first[1] * last[1]);
        (cross.atan2(dot) - sum) / TAU
    }
}

/// Number of nodes of each edge; one number for a smooth profile. The sum is even, as [`log_weights`] requires. It
/// differs from `count` by the rounding of each number and by [`EDGE_NODES_MIN`].
pub(crate) fn distribute_nodes(profile: &Profile, count: usize) -> Vec<usize> {
    let Shape::Edges(edges) = &profile.shape else { return vec![count.next_multiple_of(2)] };
    let chords: Vec<f64> = edges.iter().map(Edge::chord).collect();
    let total: f64 = chords.iter().sum();
    let mut counts: Vec<usize> = chords
        .iter()
        .map(|chord| {
            let fraction = EQUAL_FRACTION / edges.len() as f64 + (1.0 - EQUAL_FRACTION) * chord / total;
            ((count as f64 * fraction).round() as usize).max(EDGE_NODES_MIN)
        })
        .collect();
    counts[0] += counts.iter().sum::<usize>() % 2;
    counts
}

/// Position of a graded node on its edge. The edge's parameter u is in [0, 1].
struct Graded {
    /// u of the node.
    from_start: f64,
    /// `1 − from_start`, with all its digits.
    from_end: f64,
    /// du/dσ with σ = (i + ½)/n.
    rate: f64,
}

/// Node i of n on an edge, by Kress' substitution (Numer. Math. 58, 1990, eq. 2.3).
///
/// With σ = (i + ½)/n, s = 2σ − 1 in (−1, 1), and p the exponent [`GRADING`], the node lies at `u = a^p/(a^p + b^p)`.
/// Here a = v(s) and b = v(−s), with `v(s) = (½ − 1/p)s³ + s/p + ½`.
fn graded(i: usize, n: usize) -> Graded {
    let p = GRADING;
    let cubic = 0.5 - 1.0 / p;
    // v in terms of 1 + s, the distance from the end s = −1, where v vanishes.
    let kress_v = |one_plus_s: f64| {
        let s = one_plus_s - 1.0;
        // s³ + 1 without cancellation.
        let cube_plus_one = one_plus_s * (1.0 - s + s * s);
        cubic * cube_plus_one + one_plus_s / p
    };
    // 1 + s = 2σ and 1 − s = 2(1 − σ), each from integers without cancellation.
    let (one_plus_s, one_minus_s) = ((2 * i + 1) as f64 / n as f64, (2 * (n - i) - 1) as f64 / n as f64);
    let (a, b) = (kress_v(one_plus_s), kress_v(one_minus_s));
    let (ap, bp) = (a.powf(p), b.powf(p));
    let s = one_plus_s - 1.0;
    // du/dσ = 2·du/ds and du/ds = p·v'(s)·(ab)^{p−1}·(a + b)/(a^p + b^p)², since v'(s) = v'(−s) = 3·cubic·s² + 1/p.
    // Moreover, a + b = 1.
    let rate = 2.0 * p * (3.0 * cubic * s * s + 1.0 / p) * (a * b).powf(p - 1.0) / ((ap + bp) * (ap + bp));
    Graded { from_start: ap / (ap + bp), from_end: bp / (ap + bp), rate }
}

/// [`Nodes::log_weights`] for n nodes, n elements (Kress, *Linear Integral Equations*, eq. 12.19).
///
/// With h = n/2 (n even) they are `−(2π/h) Σ_{m=1}^{h−1} cos(2πmk/n)/m − (π/h²)(−1)^k`, minus
/// `(2π/n)·ln(4 sin²(πk/n))` for k > 0.
fn log_weights(n: usize) -> Vec<f64> {
    let half = n / 2;
    let cosines: Vec<f64> = (0..n).map(|k| (TAU * k as f64 / n as f64).cos()).collect();
    (0..n)
        .map(|k| {
            let series: f64 = (1..half).map(|m| cosines[m * k % n] / m as f64).sum();
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let weight = -2.0 * PI / half as f64 * series - PI / (half * half) as f64 * sign;
            let sine = (PI * k as f64 / n as f64).sin();
            if k == 0 { weight } else { weight - TAU / n as f64 * (4.0 * sine * sine).ln() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_integrate_to_the_arc_length() {
        let blazed = Profile::blazed(2.5, 0.5).unwrap();
        let nodes = Nodes::new(&blazed, &distribute_nodes(&blazed, 64));
        let arc: f64 = nodes.speed.iter().map(|v| v * nodes.step()).sum();
        // Error of the graded rule on 45 nodes of the slope and 19 of the wall.
        assert!((arc / blazed.arc_um() - 1.0).abs() < 1e-3, "{arc}");
        // A smooth profile: the trapezium rule converges exponentially, so 48 nodes are exact.
        let sinusoid = Profile::sinusoid(1.0, 0.2).unwrap();
        let arc = |n| Nodes::new(&sinusoid, &[n]).speed.iter().sum::<f64>() * TAU / n as f64;
        assert!((arc(48) - arc(96)).abs() < 1e-12);
    }

    #[test]
    fn log_weights_integrate_harmonics_exactly() {
        // ∫ ln(4 sin²(t/2)) cos(mt) dt over a period is −2π/m, and 0 for m = 0.
        let n = 24;
        let weights = log_weights(n);
        for m in 0..8 {
            let sum: f64 = (0..n)
                .map(|k| {
                    let t = TAU * k as f64 / n as f64;
                    let trapezium = if k == 0 { 0.0 } else { TAU / n as f64 * (4.0 * (0.5 * t).sin().powi(2)).ln() };
                    (weights[k] + trapezium) * (m as f64 * t).cos()
                })
                .sum();
            let expected = if m == 0 { 0.0 } else { -TAU / m as f64 };
            assert!((sum - expected).abs() < 1e-13, "{m}: {sum}");
        }
    }

    #[test]
    fn separations_across_a_corner_are_differences_of_offsets() {
        let lamellar = Profile::lamellar(1.6, 0.12, 0.5).unwrap();
        let nodes = Nodes::new(&lamellar, &distribute_nodes(&lamellar, 480));
        let n = nodes.len();
        // The last node and the first lie on either side of the corner at the end of the period. The last edge is a
        // vertical wall, the first a horizontal line.
        let across = nodes.separation(0, n - 1);
        assert_eq!(across.periods, -1);
        let (first, last) = (nodes.on_edge[0].offsets[0], nodes.on_edge[n - 1].offsets[1]);
        assert!(across.x == first[0] && across.z == -last[1] && across.x > 0.0 && across.z > 0.0);
        // The quadrature resolves the next edge from node 80, near the middle of the 173 nodes of the first edge, but
        // not from a node beside the corner.
        assert!(nodes.corner_defect(80).abs() < 1e-6 && nodes.corner_defect(0).abs() > 1e-3);
    }
}
