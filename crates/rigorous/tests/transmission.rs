//! Orders on both sides of lossless dielectrics against closed forms and conservation laws.

// Helpers outside of `#[test]` functions unwrap as tests do.
#![allow(clippy::unwrap_used, reason = "tests panic on errors")]

use std::f64::consts::TAU;
use sunbeam_rigorous::{BothSides, Channel, Discretisation, Order, Profile, Resolution, solve_both_sides};

/// Pseudo-random numbers in [0, 1).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A direction at most 80° from the normal, on either side.
    fn direction(&mut self) -> [f64; 3] {
        let (theta, azimuth) = (self.between(0.0, 80.0).to_radians(), TAU * self.unit());
        let side = if self.unit() < 0.5 { 1.0 } else { -1.0 };
        [theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), side * theta.cos()]
    }

    /// A profile of a drawn shape, period in µm, and depth up to 0.4 of it.
    fn profile(&mut self, periods_um: [f64; 2]) -> (&'static str, Profile) {
        let period = self.between(periods_um[0], periods_um[1]);
        let height = period * self.between(0.02, 0.4);
        match (3.0 * self.unit()) as usize {
            0 => ("sinusoid", Profile::sinusoid(period, height).unwrap()),
            1 => ("blazed", Profile::blazed(period, height).unwrap()),
            _ => ("lamellar", Profile::lamellar(period, height, 0.5).unwrap()),
        }
    }
}

fn sum(solved: &BothSides, fraction: fn(&Order) -> f64) -> f64 {
    solved.above.iter().chain(&solved.below).map(fraction).sum()
}

/// The solver refuses what is off by more than 5e-4, so this tests that it refuses nothing.
#[test]
fn reflected_and_transmitted_light_is_all_light() {
    let mut random = Random(1);
    let mut worst = 0.0_f64;
    for _ in 0..40 {
        let (name, profile) = random.profile([0.3, 1.6]);
        let eta = random.between(1.05, 4.0);
        let (nm, wi) = (random.between(450.0, 700.0), random.direction());
        let solved = solve_both_sides(&profile, eta, nm, wi).unwrap_or_else(|error| panic!("{name} {eta}: {error}"));
        for fraction in [Order::te, Order::tm] {
            worst = worst.max((sum(&solved, fraction) - 1.0).abs());
        }
        assert!(worst < 1e-3, "{name} {eta} {nm} {wi:?}: {worst:.1e}");
    }
    println!("largest error of the power {worst:.1e}");
}

/// Fresnel's coefficients of power for the s and the p state, `[reflected, transmitted]`; `ratio` is the index of the
/// other medium over that of the light's.
fn fresnel(ratio: f64, cos: f64) -> [[f64; 2]; 2] {
    let below_squared = ratio * ratio - (1.0 - cos * cos);
    if below_squared <= 0.0 {
        return [[1.0, 0.0]; 2];
    }
    let below = below_squared.sqrt();
    [(cos - below) / (cos + below), (ratio * ratio * cos - below) / (ratio * ratio * cos + below)]
        .map(|r| [r * r, 1.0 - r * r])
}

#[test]
fn flat_boundaries_divide_light_as_fresnel_does() {
    /// Kress' weights on 64 nodes and Amos' functions leave 1e-7.
    const TOLERANCE: f64 = 1e-6;
    let mut random = Random(2);
    let mut worst = 0.0_f64;
    for i in 0..60 {
        let (eta, nm, wi) = (random.between(1.05, 4.0), random.between(450.0, 700.0), random.direction());
        let profile = Profile::flat(random.between(0.2, 1.2)).unwrap();
        // Every third incidence lies across the grooves, where s is the state without Hy.
        let length = wi[0].hypot(wi[2]);
        let wi = if i % 3 == 0 { [wi[0] / length, 0.0, wi[2] / length] } else { wi };
        let solved = solve_both_sides(&profile, eta, nm, wi).unwrap();
        let [s, p] = fresnel(if wi[2] > 0.0 { eta } else { 1.0 / eta }, wi[2].abs());
        let (own, other) = if wi[2] > 0.0 { (&solved.above, &solved.below) } else { (&solved.below, &solved.above) };
        for (orders, which) in [(own, 0), (other, 1)] {
            for order in orders {
                let expected = if order.index == 0 { [s[which], p[which]] } else { [0.0; 2] };
                worst = worst.max((order.efficiency() - 0.5 * (expected[0] + expected[1])).abs());
                if wi[1] == 0.0 {
                    worst = worst.max((order.te() - expected[0]).abs()).max((order.tm() - expected[1]).abs());
                }
            }
        }
        assert!(worst < TOLERANCE, "{eta} {nm} {wi:?}: {worst:.1e}");
    }
    println!("largest difference {worst:.1e}");
}

/// The solver compares amplitudes at −b. Here whole directions are reversed, with their indices of both media.
#[test]
fn reversed_light_has_the_same_efficiency() {
    /// Twice what the solver accepts for amplitudes, whose squares are compared.
    const TOLERANCE: f64 = 1e-3;
    let mut random = Random(3);
    for _ in 0..8 {
        let (name, profile) = random.profile([0.4, 1.2]);
        let (eta, nm, wi) = (random.between(1.05, 2.5), random.between(450.0, 700.0), random.direction());
        let solved = solve_both_sides(&profile, eta, nm, wi).unwrap();
        let side = wi[2] > 0.0;
        for order in solved.above.iter().chain(&solved.below).filter(|order| order.direction[2].abs() > 0.05) {
            let back = solve_both_sides(&profile, eta, nm, order.direction).unwrap();
            let orders = if side { &back.above } else { &back.below };
            let found = orders.iter().find(|each| each.index == order.index).expect("the way back").clone();
            let off = [0, 1].map(|i| (found.direction[i] - wi[i]).abs()).into_iter().fold(0.0, f64::max);
            assert!(off < 1e-9, "{wi:?} {:?}", found.direction);
            let (there, back) = (order.efficiency(), found.efficiency());
            assert!((there - back).abs() < TOLERANCE, "{name} {eta} {wi:?} {}: {there} {back}", order.index);
        }
    }
}

/// Perturbation of the first order (symbols: docs/model.md#bodies-that-transmit): an order's amplitude is in proportion
/// to the harmonic of the relief that makes it. Its power is `4·ζᵢ·ζₒ·(k·harmonic)²·(ε − 1)²·B²`.
#[test]
fn shallow_sinusoids_scatter_as_perturbation_says() {
    /// The next order of the perturbation: (k·height)² is 5e-4, times the index.
    const RELATIVE: f64 = 4e-3;
    let (period, height, wavelength) = (1.3, 0.002, 550.0);
    let k = TAU * 1e3 / wavelength;
    let k_harmonic = 0.25 * height * k;
    for eta in [1.3, 1.5, 2.4] {
        for wi in [[0.4, 0.0, 0.84_f64.sqrt()], [0.2, 0.0, -(0.96_f64.sqrt())]] {
            let solved = solve_both_sides(&Profile::sinusoid(period, height).unwrap(), eta, wavelength, wi).unwrap();
            let eps = eta * eta;
            let from_above = wi[2] > 0.0;
            let alpha_in = -wi[0] * if from_above { 1.0 } else { eta };
            // c1 and cn: normal components in air and in the medium, over k.
            let normals = |alpha: f64| [1.0 - alpha * alpha, eps - alpha * alpha].map(f64::sqrt);
            // ζ, v and e.
            let of_side = |above: bool, [c1, cn]: [f64; 2]| if above { (c1, cn, eta) } else { (cn, eta * c1, 1.0) };
            let (zeta0, v0, e0) = of_side(from_above, normals(alpha_in));
            // s and p.
            let divisors = |[c1, cn]: [f64; 2]| [c1 + cn, eps * c1 + cn];
            let [s0, p0] = divisors(normals(alpha_in));
            for (orders, above) in [(&solved.above, true), (&solved.below, false)] {
                for order in orders.iter().filter(|order| order.index.abs() == 1) {
                    let alpha = order.direction[0] * if above { 1.0 } else { eta };
                    if alpha.abs() >= 1.0 {
                        continue;
                    }
                    let (zeta, v, e) = of_side(above, normals(alpha));
                    let [s, p] = divisors(normals(alpha));
                    let sigma = if above == from_above { 1.0 } else { -1.0 };
                    let te = 1.0 / (s * s0);
                    let tm = (v * v0 - sigma * e * e0 * alpha * alpha_in) / (p * p0);
                    let scale = 4.0 * zeta * zeta0 * (eps - 1.0).powi(2) * k_harmonic * k_harmonic;
                    for (found, expected) in [(order.te(), scale * te * te), (order.tm(), scale * tm * tm)] {
                        assert!(
                            (found - expected).abs() < RELATIVE * expected.max(1e-3 * scale),
                            "{eta} {wi:?} {} {above}: {found} {expected}",
                            order.index
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn powers_behind_a_film_are_those_of_its_jones_matrices() {
    /// Rounding: both are closed forms of the same amplitudes.
    const ROUNDING: f64 = 1e-9;
    let mut random = Random(4);
    for _ in 0..10 {
        let (name, profile) = random.profile([0.5, 1.4]);
        let (eta, nm) = (random.between(1.05, 2.5), random.between(450.0, 700.0));
        let mut wi = random.direction();
        wi[2] = wi[2].abs();
        let solved = solve_both_sides(&profile, eta, nm, wi).unwrap();
        let periods = 1e3 * profile.period_um() / nm;
        let resolution = Resolution { nodes: solved.nodes, oversampling: 3 };
        let mesh = Discretisation::new(&profile, resolution).unwrap();
        let scattering = mesh.air(periods * wi[0].hypot(wi[2]), -wi[0] * periods).unwrap().scatter(eta, nm).unwrap();
        for order in &solved.below {
            let found = scattering.film_efficiency(Channel::below(order.index), Channel::above(0));
            let expected = order.through_flat_side(eta).map_or(0.0, |order| order.efficiency());
            // Another oversampling changes smooth profiles by the solver's error.
            let allowed = if name == "sinusoid" { 1e-6 } else { ROUNDING };
            assert!((found - expected).abs() < allowed, "{name} {eta} {wi:?} {}: {found} {expected}", order.index);
        }
    }
}
