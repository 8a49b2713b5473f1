//! Nodes on one period of the curve: positions, derivatives, distances and quadrature weights of Nyström's method.
//!
//! The curve r(τ) has a parameter τ in [0, 2π), with nodes at `τ_i = 2π(i + ½)/n`. *Speed* is |dr/dτ|, so that the arc
//! element is `speed·dτ` and the trapezium rule has weights `speed·2π/n`. x and z are in µm; the normal ν points into
//! the air above. The Green's function is singular as ln|τ − τ'|, which the trapezium rule does not integrate: Kress'
//! weights (`log_weights`) replace its weights for the logarithmic part of a kernel (used in `layers.rs`).
//!
//! The relief repeats with the period. The *nearest image* of a source node is the copy of it, moved by −1, 0 or 1
//! periods, that lies nearest to the target node.
//!
//! Fields are singular at corners. Edges between corners therefore have nodes graded towards both ends, and differences
//! of positions near one corner are computed from offsets to that corner, which keep all digits.

use crate::profile::{Edge, Profile, Shape, smooth_height};
use std::f64::consts::{PI, TAU};

/// Exponent of the grading towards corners: the i-th of n nodes lies at about (i/n)^5 of the edge. Chosen: an exponent
/// of 3 leaves several times the error.
const GRADING: f64 = 5.0;

/// Fewest nodes on an edge. Chosen: the grading towards both ends needs some nodes on either half.
const EDGE_NODES_MIN: usize = 8;

/// Fraction of the nodes that is distributed equally over the edges; the rest goes by length. Chosen: a short wall also
/// needs nodes for the singularities at its corners.
const EQUAL_FRACTION: f64 = 0.4;

/// Largest distance along x, in periods, at which two nodes near one corner are compared by their offsets from it.
/// Chosen below ½, from which on another image of the corner may be nearer.
const SHARED_CORNER: f64 = 0.25;

/// Position of a node relative to the corners of its edge.
#[derive(Clone, Copy, Debug)]
struct OnEdge {
    /// Index of the edge, in order along the curve.
    edge: usize,
    /// Whether the edge is a straight line.
    straight: bool,
    /// Offsets (µm) from the edge's first corner and from its last.
    offsets: [[f64; 2]; 2],
    /// Index of the nearer corner in `offsets`.
    nearer: usize,
}

impl OnEdge {
    /// Nearer corner: its index among `edges` corners, the period that it lies in (0 or 1), and the offset from it.
    fn corner(&self, edges: usize) -> (usize, i32, [f64; 2]) {
        let corner = self.edge + self.nearer;
        (corner % edges, i32::from(corner == edges), self.offsets[self.nearer])
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
    /// Unit normal into the air.
    pub(crate) normal: Vec<[f64; 2]>,
    /// Curvature in 1/µm by the edge's own parameter, `ν·r''/|r'|²`; negative where the relief is convex.
    pub(crate) curvature: Vec<f64>,
    /// Kress' weights for the logarithm `ln(4 sin²((τ − τ')/2))` of nodes k apart, minus those of the trapezium rule (0
    /// at k = 0).
    pub(crate) log_weights: Vec<f64>,
    /// Position of each node on its edge; empty for a smooth profile.
    on_edge: Vec<OnEdge>,
    /// Number of edges; 0 for a smooth profile.
    edges: usize,
}

/// Vector from the nearest image of a source node to a target node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// Component along x, in µm.
    pub(crate) x: f64,
    /// Component along z, in µm.
    pub(crate) z: f64,
    /// Periods by which the source was moved along +x.
    pub(crate) periods: i32,
    /// Component along the source's normal; exactly 0 on one straight edge.
    pub(crate) along_normal: f64,
}

impl Nodes {
    /// Distributes `counts[i]` nodes over edge i; a smooth profile has one count.
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
            edges: 0,
        };
        match &profile.shape {
            Shape::Smooth(harmonics) => {
                for i in 0..count {
                    let phase = TAU * (i as f64 + 0.5) / count as f64;
                    let [z, slope, bend] = smooth_height(harmonics, phase);
                    let along = nodes.period / TAU;
                    nodes.push([along * phase, z], [along, slope], [0.0, bend], 1.0);
                }
            }
            Shape::Edges(edges) => {
                nodes.edges = edges.len();
                for (index, (edge, &n)) in edges.iter().zip(counts).enumerate() {
                    nodes.push_edge(edge, index, n, count);
                }
            }
        }
        nodes
    }

    /// Adds the n nodes of edge `index`, of `count` on the curve.
    fn push_edge(&mut self, edge: &Edge, index: usize, n: usize, count: usize) {
        for i in 0..n {
            let Graded { from_start, from_end, rate } = graded(i, n);
            let (point, ends) = (edge.at(from_start), edge.ends());
            let offsets = if edge.is_straight() {
                [from_start, -from_end].map(|fraction| point.first.map(|along| along * fraction))
            } else {
                ends.map(|end| [0, 1].map(|j| point.position[j] - end[j]))
            };
            let nearer = usize::from(from_start > from_end);
            let position = [0, 1].map(|j| ends[nearer][j] + offsets[nearer][j]);
            // From (i + ½)/n along the edge to the parameter τ, which advances by 2π over `count` nodes.
            let rate = rate * count as f64 / (TAU * n as f64);
            self.push(position, point.first, point.second, rate);
            self.on_edge.push(OnEdge { edge: index, straight: edge.is_straight(), offsets, nearer });
        }
    }

    /// Adds a node at (x, z). `first` and `second` are derivatives with respect to some parameter u; `rate` is du/dτ.
    fn push(&mut self, [x, z]: [f64; 2], first: [f64; 2], second: [f64; 2], rate: f64) {
        let length = first[0].hypot(first[1]);
        let normal = [-first[1] / length, first[0] / length];
        self.x.push(x);
        self.z.push(z);
        self.speed.push(length * rate);
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

    /// Peak to valley of the nodes, in µm.
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
    /// It is the difference of positions, or of offsets to a corner that is nearest to both nodes.
    pub(crate) fn separation(&self, target: usize, source: usize) -> Separation {
        let (mut x, mut z) = (self.x[target] - self.x[source], self.z[target] - self.z[source]);
        let half = 0.5 * self.period;
        let mut periods = i32::from(x > half) - i32::from(x < -half);
        x -= self.period * f64::from(periods);
        let mut flat = false;
        if let (Some(a), Some(b)) = (self.on_edge.get(target), self.on_edge.get(source)) {
            let ((corner_a, period_a, offset_a), (corner_b, period_b, offset_b)) =
                (a.corner(self.edges), b.corner(self.edges));
            let (dx, dz) = (offset_a[0] - offset_b[0], offset_a[1] - offset_b[1]);
            // Both nodes are nearest to one corner: their offsets from it keep the digits that positions lose.
            if corner_a == corner_b && dx.abs() < SHARED_CORNER * self.period {
                (x, z, periods) = (dx, dz, period_a - period_b);
            }
            flat = a.straight && a.edge == b.edge && periods == 0;
        }
        let normal = self.normal[source];
        let along_normal = if flat { 0.0 } else { normal[0] * x + normal[1] * z };
        Separation { x, z, periods, along_normal }
    }

    /// Correction of the double layer's diagonal for the edge across the nearest corner.
    ///
    /// For a target next to a corner, the kernel `ν'·(r − r')/(2π|r − r'|²)` on the next edge varies over the target's
    /// own distance from the corner, which no grading resolves. For a constant field its integral is known: the angle
    /// that the edge subtends at the target, in turns. The correction is the angle minus the quadrature.
    pub(crate) fn corner_defect(&self, target: usize) -> f64 {
        let Some(own) = self.on_edge.get(target) else { return 0.0 };
        // The next edge begins at the corner where this one ends, or ends where this one begins.
        let (next, end) = ((own.edge + self.edges + 2 * own.nearer - 1) % self.edges, 1 - own.nearer);
        let node = own.offsets[own.nearer];
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        // `sum` is 2π times the quadrature, `chord` the vector between the ends of the next edge.
        let (mut sum, mut chord) = (0.0, [0.0; 2]);
        for (source, on) in self.on_edge.iter().enumerate().filter(|(_, on)| on.edge == next) {
            let [dx, dz] = [0, 1].map(|j| on.offsets[end][j] - node[j]);
            let [nx, nz] = self.normal[source];
            sum -= (nx * dx + nz * dz) / (dx * dx + dz * dz) * self.speed[source] * self.step();
            chord = [0, 1].map(|j| on.offsets[0][j] - on.offsets[1][j]);
        }
        let far = [0, 1].map(|j| if end == 0 { chord[j] } else { -chord[j] } - node[j]);
        let near = node.map(|c| -c);
        let (first, last) = if end == 0 { (near, far) } else { (far, near) };
        let angle = cross(first, last).atan2(first[0] * last[0] + first[1] * last[1]);
        (angle - sum) / TAU
    }
}

/// Number of nodes of each edge: `count` in total or a few more, an even number. A smooth profile has one count.
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

/// Position of a graded node on its edge, as fractions of the edge's parameter range.
struct Graded {
    from_start: f64,
    /// `1 − from_start`, with all its digits.
    from_end: f64,
    /// Derivative of `from_start` with respect to (i + ½)/n.
    rate: f64,
}

/// Node i of n on an edge, by Kress' substitution (Numer. Math. 58, 1990, eq. 2.3).
///
/// With σ = (i + ½)/n, the fraction from the start is `a^p/(a^p + b^p)`, where a = v(2σ − 1), b = v(1 − 2σ) and p is
/// [`GRADING`].
fn graded(i: usize, n: usize) -> Graded {
    let p = GRADING;
    let bend = 0.5 - 1.0 / p;
    // Kress' v(s) = bend·s³ + s/p + ½ for s in (−1, 1), in terms of the distance 1 + s to the end.
    let kress_v = |from_end: f64| {
        let s = from_end - 1.0;
        // s³ + 1 without cancellation.
        let cube = from_end * (1.0 - s + s * s);
        bend * cube + from_end / p
    };
    let (left, right) = ((2 * i + 1) as f64 / n as f64, (2 * (n - i) - 1) as f64 / n as f64);
    let (a, b) = (kress_v(left), kress_v(right));
    let (ap, bp) = (a.powf(p), b.powf(p));
    let s = left - 1.0;
    // The factor 2 is ds over d((i + ½)/n).
    let rate = 2.0 * p * (3.0 * bend * s * s + 1.0 / p) * (a * b).powf(p - 1.0) / ((ap + bp) * (ap + bp));
    Graded { from_start: ap / (ap + bp), from_end: bp / (ap + bp), rate }
}

/// Weights for the logarithm at nodes k apart, of n (even), minus those of the trapezium rule: Kress, *Linear Integral
/// Equations*, eq. 12.19.
fn log_weights(n: usize) -> Vec<f64> {
    let half = n / 2;
    let cosines: Vec<f64> = (0..n).map(|k| (TAU * k as f64 / n as f64).cos()).collect();
    (0..n)
        .map(|k| {
            let series: f64 = (1..half).map(|m| cosines[m * k % n] / m as f64).sum();
            let last = if k % 2 == 0 { 1.0 } else { -1.0 };
            let weight = -2.0 * PI / half as f64 * series - PI / (half * half) as f64 * last;
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
        // The graded rule on 56 and 8 nodes.
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
        // The last node and the first lie on either side of the corner at the end of the period.
        let across = nodes.separation(0, n - 1);
        assert_eq!(across.periods, -1);
        let (first, last) = (nodes.on_edge[0].offsets[0], nodes.on_edge[n - 1].offsets[1]);
        assert!(across.x == first[0] && across.z == -last[1] && across.x > 0.0 && across.z > 0.0);
        // The quadrature resolves the next edge from the middle of an edge, but not from a node beside the corner.
        assert!(nodes.corner_defect(80).abs() < 1e-6 && nodes.corner_defect(0).abs() > 1e-3);
    }
}
