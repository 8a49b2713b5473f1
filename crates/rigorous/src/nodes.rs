//! Nodes on one period of the curve, and what Nyström's method needs of them.

use crate::profile::{Edge, Profile, Shape, smooth_height};
use std::f64::consts::{PI, TAU};

/// Exponent of the grading towards corners, where fields are singular: node i from a corner lies at (i/n)^5 of the edge. 3 leaves
/// several times the error.
const GRADING: f64 = 5.0;

/// Fewest nodes of an edge.
const EDGE_NODES_MIN: usize = 8;

/// Share of the nodes that edges get alike; the rest goes by length.
const ALIKE: f64 = 0.4;

/// Where a node lies on its edge.
#[derive(Clone, Copy, Debug)]
struct OnEdge {
    edge: usize,
    straight: bool,
    /// From the edge's first corner, and from its last. Differences of offsets from one corner keep their digits where
    /// coordinates would cancel.
    offsets: [[f64; 2]; 2],
    /// Which of them is the nearer: 0 or 1.
    nearer: usize,
}

impl OnEdge {
    /// Number of the nearer corner among `edges`, the periods at whose end it is, and the offset from it.
    fn corner(&self, edges: usize) -> (usize, i32, [f64; 2]) {
        let corner = self.edge + self.nearer;
        (corner % edges, i32::from(corner == edges), self.offsets[self.nearer])
    }
}

/// Nodes at parameters `2π(i + ½)/n`, in order along the curve; lengths in µm.
#[derive(Clone, Debug)]
pub(crate) struct Nodes {
    pub(crate) period: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) z: Vec<f64>,
    /// Length of arc for a unit of the parameter.
    pub(crate) speed: Vec<f64>,
    /// Unit normal into the air.
    pub(crate) normal: Vec<[f64; 2]>,
    /// `ν·r''/|r'|²`, negative where the relief is convex.
    pub(crate) curvature: Vec<f64>,
    /// Kress' weights for the logarithm `ln(4 sin²((t − τ)/2))` of nodes k apart, less those of the trapezium rule, which at
    /// k = 0 leaves the logarithm out.
    pub(crate) log_weights: Vec<f64>,
    /// Nothing for a smooth profile.
    on_edge: Vec<OnEdge>,
    edges: usize,
}

/// From a source node to a target node, by way of the source's nearest image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    pub(crate) x: f64,
    pub(crate) z: f64,
    /// Periods by which the source was moved along x.
    pub(crate) turn: i32,
    /// Component along the source's normal.
    pub(crate) along_normal: f64,
}

impl Nodes {
    /// `counts` nodes on the edges; a smooth profile has one count.
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

    fn push_edge(&mut self, edge: &Edge, index: usize, n: usize, count: usize) {
        for i in 0..n {
            let Graded { from_start, from_end, rate } = graded(i, n);
            let (at, ends) = (edge.at(from_start), edge.ends());
            let offsets = if edge.is_straight() {
                [from_start, -from_end].map(|share| at.first.map(|along| along * share))
            } else {
                ends.map(|end| [0, 1].map(|j| at.position[j] - end[j]))
            };
            let nearer = usize::from(from_start > from_end);
            let position = [0, 1].map(|j| ends[nearer][j] + offsets[nearer][j]);
            // The parameter of all the nodes, 2π over `count`, against that of the edge, 1 over n.
            let rate = rate * count as f64 / (TAU * n as f64);
            self.push(position, at.first, at.second, rate);
            self.on_edge.push(OnEdge { edge: index, straight: edge.is_straight(), offsets, nearer });
        }
    }

    /// `first` and `second` are derivatives over a parameter that itself changes at `rate` with that of the nodes.
    fn push(&mut self, [x, z]: [f64; 2], first: [f64; 2], second: [f64; 2], rate: f64) {
        let length = first[0].hypot(first[1]);
        let normal = [-first[1] / length, first[0] / length];
        self.x.push(x);
        self.z.push(z);
        self.speed.push(length * rate);
        self.normal.push(normal);
        self.curvature.push((normal[0] * second[0] + normal[1] * second[1]) / (length * length));
    }

    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// Step of the parameter between nodes.
    pub(crate) fn step(&self) -> f64 {
        TAU / self.len() as f64
    }

    /// Largest difference of heights, in µm.
    pub(crate) fn height(&self) -> f64 {
        let high = self.z.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - self.z.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Smallest distance of neighbours along the curve.
    pub(crate) fn spacing_min(&self) -> f64 {
        let n = self.len();
        (0..n)
            .map(|i| {
                let s = self.separation(i, (i + 1) % n);
                s.x.hypot(s.z)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// From node `source` to node `target`.
    pub(crate) fn separation(&self, target: usize, source: usize) -> Separation {
        let (mut x, mut z) = (self.x[target] - self.x[source], self.z[target] - self.z[source]);
        let half = 0.5 * self.period;
        let mut turn = i32::from(x > half) - i32::from(x < -half);
        x -= self.period * f64::from(turn);
        let mut flat = false;
        if let (Some(a), Some(b)) = (self.on_edge.get(target), self.on_edge.get(source)) {
            let ((corner_a, turn_a, offset_a), (corner_b, turn_b, offset_b)) =
                (a.corner(self.edges), b.corner(self.edges));
            let (dx, dz) = (offset_a[0] - offset_b[0], offset_a[1] - offset_b[1]);
            if corner_a == corner_b && dx.abs() < 0.25 * self.period {
                (x, z, turn) = (dx, dz, turn_a - turn_b);
            }
            flat = a.straight && a.edge == b.edge && turn == 0;
        }
        let normal = self.normal[source];
        let along_normal = if flat { 0.0 } else { normal[0] * x + normal[1] * z };
        Separation { x, z, turn, along_normal }
    }

    /// What the quadrature of `ν'·(r − r')/(2π|r − r'|²)` misses on the edge beyond the corner next to a node: the share of a
    /// circle that the edge is seen under, less the sum. Nodes next to a corner see the edge beyond change over their own
    /// distance from the corner, which no grading resolves.
    pub(crate) fn corner_defect(&self, target: usize) -> f64 {
        let Some(own) = self.on_edge.get(target) else { return 0.0 };
        // The edge beyond begins where this one ends, or the other way round.
        let (beyond, end) = ((own.edge + self.edges + 2 * own.nearer - 1) % self.edges, 1 - own.nearer);
        let at = own.offsets[own.nearer];
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let (mut sum, mut chord) = (0.0, [0.0; 2]);
        for (source, on) in self.on_edge.iter().enumerate().filter(|(_, on)| on.edge == beyond) {
            let to = [0, 1].map(|j| on.offsets[end][j] - at[j]);
            let [nx, nz] = self.normal[source];
            sum -= (nx * to[0] + nz * to[1]) / (to[0] * to[0] + to[1] * to[1]) * self.speed[source] * self.step();
            chord = [0, 1].map(|j| on.offsets[0][j] - on.offsets[1][j]);
        }
        let far = [0, 1].map(|j| if end == 0 { chord[j] } else { -chord[j] } - at[j]);
        let near = at.map(|c| -c);
        let (first, last) = if end == 0 { (near, far) } else { (far, near) };
        let angle = cross(first, last).atan2(first[0] * last[0] + first[1] * last[1]);
        (angle - sum) / TAU
    }
}

/// Nodes of each edge such that all are `count` or a few more, an even number; one count for a smooth profile.
pub(crate) fn share(profile: &Profile, count: usize) -> Vec<usize> {
    let Shape::Edges(edges) = &profile.shape else { return vec![count.next_multiple_of(2)] };
    let chords: Vec<f64> = edges.iter().map(Edge::chord).collect();
    let total: f64 = chords.iter().sum();
    let mut counts: Vec<usize> = chords
        .iter()
        .map(|chord| {
            let share = ALIKE / edges.len() as f64 + (1.0 - ALIKE) * chord / total;
            ((count as f64 * share).round() as usize).max(EDGE_NODES_MIN)
        })
        .collect();
    counts[0] += counts.iter().sum::<usize>() % 2;
    counts
}

struct Graded {
    /// Share of the edge before the node, and after it; each with all its digits.
    from_start: f64,
    from_end: f64,
    /// Derivative of `from_start` over (i + ½)/n.
    rate: f64,
}

/// Node i of n on an edge: Kress' substitution (Numer. Math. 58, 1990, eq. 2.3).
fn graded(i: usize, n: usize) -> Graded {
    let p = GRADING;
    let bend = 0.5 - 1.0 / p;
    // With s in (−1, 1), v = bend·s³ + s/p + ½, written from the end that it is nearer to.
    let share = |from_end: f64| {
        let s = from_end - 1.0;
        // 1 + s and s³ + 1 in terms of the distance to the end.
        let cube = from_end * (1.0 - s + s * s);
        bend * cube + from_end / p
    };
    let (left, right) = ((2 * i + 1) as f64 / n as f64, (2 * (n - i) - 1) as f64 / n as f64);
    let (a, b) = (share(left), share(right));
    let (ap, bp) = (a.powf(p), b.powf(p));
    let s = left - 1.0;
    // Two from the change of variables, s = 2v − 1.
    let rate = 2.0 * p * (3.0 * bend * s * s + 1.0 / p) * (a * b).powf(p - 1.0) / ((ap + bp) * (ap + bp));
    Graded { from_start: ap / (ap + bp), from_end: bp / (ap + bp), rate }
}

/// Kress, *Linear Integral Equations*, eq. 12.19, at nodes k apart of n (even), less the trapezium rule.
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
    fn weights_measure_the_arc() {
        let blazed = Profile::blazed(2.5, 0.5).unwrap();
        let nodes = Nodes::new(&blazed, &share(&blazed, 64));
        let arc: f64 = nodes.speed.iter().map(|v| v * nodes.step()).sum();
        // The graded rule on 56 and 8 nodes.
        assert!((arc / blazed.arc_um() - 1.0).abs() < 1e-3, "{arc}");
        // The circumference of an ellipse: spectral accuracy.
        let sinusoid = Profile::sinusoid(1.0, 0.2).unwrap();
        let of = |n| Nodes::new(&sinusoid, &[n]).speed.iter().sum::<f64>() * TAU / n as f64;
        assert!((of(48) - of(96)).abs() < 1e-12);
    }

    #[test]
    fn logarithms_are_integrated_exactly() {
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
    fn separations_keep_their_digits_at_corners() {
        let lamellar = Profile::lamellar(1.6, 0.12, 0.5).unwrap();
        let nodes = Nodes::new(&lamellar, &share(&lamellar, 480));
        let n = nodes.len();
        // The last node and the first lie on either side of the corner at the end of the period.
        let across = nodes.separation(0, n - 1);
        assert_eq!(across.turn, -1);
        let (first, last) = (nodes.on_edge[0].offsets[0], nodes.on_edge[n - 1].offsets[1]);
        assert!(across.x == first[0] && across.z == -last[1] && across.x > 0.0 && across.z > 0.0);
        // In the middle of an edge the quadrature resolves what is beyond the corner, next to one it does not.
        assert!(nodes.corner_defect(80).abs() < 1e-6 && nodes.corner_defect(0).abs() > 1e-3);
    }
}
