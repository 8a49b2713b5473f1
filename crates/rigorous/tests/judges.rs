//! The solver against other programs and closed forms.

use num_complex::Complex64;
use std::f64::consts::TAU;
use sunbeam_rigorous::{Jones, Medium, Orders, Profile, solve_orders, transverse_basis};

/// Unit vector towards light at a polar angle and azimuth (degrees).
fn direction(theta: f64, azimuth: f64) -> [f64; 3] {
    let (theta, azimuth) = (theta.to_radians(), azimuth.to_radians());
    [theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos()]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Electric vectors of the s state (perpendicular to the plane of incidence) and the p state (s × d) of a wave along d.
fn s_and_p(wi: [f64; 3], d: [f64; 3]) -> [[f64; 3]; 2] {
    let sine = wi[0].hypot(wi[1]);
    let s = if sine < 1e-9 { [0.0, 1.0, 0.0] } else { [wi[1] / sine, -wi[0] / sine, 0.0] };
    [s, cross(s, d)]
}

/// Efficiencies of an order for s and for p polarised light.
fn efficiencies(jones: &Jones, wi: [f64; 3]) -> [f64; 2] {
    let d = wi.map(|c| -c);
    let basis = transverse_basis(d);
    s_and_p(wi, d).map(|state| {
        let [a, b] = basis.map(|e| dot(e, state));
        jones.iter().map(|row| (row[0] * a + row[1] * b).norm_sqr()).sum()
    })
}

/// Rows of a CSV table after its head: a name and `N` numbers.
fn rows<const N: usize>(table: &str) -> Vec<(String, [f64; N])> {
    table
        .lines()
        .skip(1)
        .map(|line| {
            let (name, numbers) = line.split_once(',').expect("a name and numbers");
            let numbers: Vec<f64> = numbers.split(',').map(|n| n.parse().expect("a number")).collect();
            (name.to_owned(), <[f64; N]>::try_from(numbers).expect("a number in each column"))
        })
        .collect()
}

fn order(solved: &Orders, index: f64) -> &sunbeam_rigorous::Order {
    solved.orders.iter().find(|order| f64::from(order.index) == index).expect("the order propagates")
}

/// `tests/judges/gratings/boundary_integral.py` solves other integral equations, for TE and TM across the grooves. With
/// three times its usual number of nodes its power is off by up to 2e-5.
#[test]
fn perfect_conductors_agree_with_the_python_solver() {
    const TOLERANCE: f64 = 1e-4;
    let mut worst = 0.0_f64;
    for (name, row) in rows::<7>(include_str!("data/perfect.csv")) {
        let [period, height, nm, theta, index, te, tm] = row;
        let profile = match name.as_str() {
            "sinusoid" => Profile::sinusoid(period, height),
            "blazed" => Profile::blazed(period, height),
            _ => Profile::lamellar(period, height, 0.5),
        };
        let solved = solve_orders(&profile.unwrap(), &Medium::Perfect, nm, direction(theta, 0.0)).unwrap();
        let order = order(&solved, index);
        worst = worst.max((order.te() - te).abs()).max((order.tm() - tm).abs());
        assert!(worst < TOLERANCE, "{name} {row:?}: {} {}", order.te(), order.tm());
    }
    println!("largest difference {worst:.1e}");
}

/// SCATMECH of NIST (`tests/judges/gratings/scatmech.py`) solves coupled-wave equations, in conical mounts. Each row
/// holds its own convergence error.
#[test]
fn metals_agree_with_scatmech() {
    /// A row is extrapolated from two numbers of waves. Its error is below its difference from the larger number.
    const UNSETTLED_SHARE: f64 = 1.0;
    const TOLERANCE: f64 = 5e-4;
    let mut squares = (0.0, 0);
    let mut last: Option<([f64; 6], Orders)> = None;
    for (metal, row) in rows::<10>(include_str!("data/metals.csv")) {
        let [eta, k, period, height, theta, azimuth, index, s, p, unsettled] = row;
        let setting = [eta, k, period, height, theta, azimuth];
        let wi = direction(theta, azimuth);
        if last.as_ref().is_none_or(|(before, _)| *before != setting) {
            let profile = Profile::lamellar(period, height, 0.5).unwrap();
            let solved = solve_orders(&profile, &Medium::index(eta, k).unwrap(), 550.0, wi).unwrap();
            last = Some((setting, solved));
        }
        let Some((_, solved)) = &last else { unreachable!() };
        let found = efficiencies(&order(solved, index).jones, wi);
        for (found, judge) in found.iter().zip([s, p]) {
            squares = (squares.0 + (found - judge).powi(2), squares.1 + 1);
            let allowed = TOLERANCE + UNSETTLED_SHARE * unsettled;
            assert!((found - judge).abs() < allowed, "{metal} {row:?}: {found}, allowed {allowed}");
        }
    }
    let rms = (squares.0 / f64::from(squares.1)).sqrt();
    println!("RMS {rms:.1e} of {} shares", squares.1);
    assert!(rms < TOLERANCE, "{rms}");
}

/// The Jones matrix of a flat mirror, in the basis of both waves.
fn fresnel(index: Option<Complex64>, wi: [f64; 3]) -> Jones {
    let (cos, sin2) = (wi[2], 1.0 - wi[2] * wi[2]);
    let [of_s, of_p] = index.map_or([Complex64::from(-1.0), Complex64::ONE], |n| {
        let below = (n * n - sin2).sqrt();
        [(cos - below) / (cos + below), (n * n * cos - below) / (n * n * cos + below)]
    });
    let (d_in, d_out) = (wi.map(|c| -c), [-wi[0], -wi[1], wi[2]]);
    let (states_in, states_out) = (s_and_p(wi, d_in), s_and_p(wi, d_out));
    let (basis_in, basis_out) = (transverse_basis(d_in), transverse_basis(d_out));
    [0, 1].map(|i| {
        [0, 1].map(|j| {
            let through = |k: usize| dot(basis_out[i], states_out[k]) * dot(states_in[k], basis_in[j]);
            of_s * through(0) + of_p * through(1)
        })
    })
}

#[test]
fn flat_mirrors_have_fresnel_amplitudes_and_phases() {
    /// Kress' weights on 64 nodes and Amos' functions leave 1e-7.
    const TOLERANCE: f64 = 1e-6;
    let mut worst = 0.0_f64;
    for index in
        [None, Some((0.96, 6.69)), Some((0.06, 3.59)), Some((1.38, 1.91)), Some((1.56, 0.0)), Some((4.0, 0.03))]
    {
        let medium = index.map_or(Medium::Perfect, |(eta, k)| Medium::index(eta, k).unwrap());
        for (theta, azimuth) in [(0.0, 0.0), (40.0, 0.0), (40.0, 35.0), (70.0, -60.0), (55.0, 90.0), (80.0, 200.0)] {
            let wi = direction(theta, azimuth);
            // A period below half a wavelength, and one above a wavelength.
            for period in [0.21, 0.9] {
                let solved = solve_orders(&Profile::flat(period).unwrap(), &medium, 550.0, wi).unwrap();
                let expected = fresnel(index.map(|(eta, k)| Complex64::new(eta, k)), wi);
                for order in &solved.orders {
                    for i in [0, 1] {
                        for j in [0, 1] {
                            let expected = if order.index == 0 { expected[i][j] } else { Complex64::ZERO };
                            worst = worst.max((order.jones[i][j] - expected).norm());
                        }
                    }
                }
                assert!(
                    worst < TOLERANCE,
                    "{index:?} {theta} {azimuth} {period}: {worst:.1e}, {solved:?} {expected:?}"
                );
            }
        }
    }
    println!("largest difference {worst:.1e}");
}

/// Rice's perturbation of the first order (Rice 1951; with a metal as in Maradudin & Mills, Phys. Rev. B 11, 1975): an
/// order's amplitude is proportional to the harmonic of the relief that makes it.
#[test]
fn shallow_sinusoids_match_rice_perturbation() {
    /// The next order of the perturbation: (k·height)² is 5e-4.
    const RELATIVE: f64 = 2e-3;
    let (period, height, wavelength) = (1.3, 0.002, 550.0);
    let k = TAU * 1e3 / wavelength;
    let harmonic = 0.25 * height;
    for (eta, kappa) in [(0.0, 0.0), (0.96, 6.69), (0.42, 2.35), (1.56, 0.0)] {
        let perfect = eta == 0.0;
        let medium = if perfect { Medium::Perfect } else { Medium::index(eta, kappa).unwrap() };
        let wi = direction(25.0, 0.0);
        let solved = solve_orders(&Profile::sinusoid(period, height).unwrap(), &medium, wavelength, wi).unwrap();
        for order in solved.orders.iter().filter(|order| order.index.abs() == 1) {
            let (alpha_in, alpha) = (-k * wi[0], k * order.direction[0]);
            let (beta_in, beta) = (k * wi[2], k * order.direction[2]);
            let permittivity = Complex64::new(eta, kappa).powi(2);
            let below = |alpha: f64| (permittivity * k * k - alpha * alpha).sqrt();
            let (in_below, out_below) = (below(alpha_in), below(alpha));
            let (te, tm) = if perfect {
                (Complex64::ONE, Complex64::from((alpha * alpha_in - k * k) / (beta * beta_in)))
            } else {
                let te = (permittivity - 1.0) * k * k / ((beta_in + in_below) * (beta + out_below));
                let across = permittivity * alpha * alpha_in - in_below * out_below;
                let (first, second) = (permittivity * beta_in + in_below, permittivity * beta + out_below);
                (te, (permittivity - 1.0) * across / (first * second))
            };
            let scale = 4.0 * beta_in * beta * harmonic * harmonic;
            for (found, expected) in [(order.te(), scale * te.norm_sqr()), (order.tm(), scale * tm.norm_sqr())] {
                assert!((found / expected - 1.0).abs() < RELATIVE, "{eta} {kappa} {}: {found} {expected}", order.index);
            }
        }
    }
}

/// Light along the normal is mirrored by a facet of slope α that rises along +x to x = −sin 2α.
#[test]
fn blazed_gratings_are_brightest_in_the_mirror_direction_of_the_facet() {
    let (period, wavelength) = (6.0, 450.0);
    let slope = 0.5 * (4.0_f64 * wavelength * 1e-3 / period).asin();
    let profile = Profile::blazed(period, period * slope.tan()).unwrap();
    let solved = solve_orders(&profile, &Medium::Perfect, wavelength, [0.0, 0.0, 1.0]).unwrap();
    let brightest = solved.orders.iter().max_by(|a, b| a.efficiency().total_cmp(&b.efficiency())).unwrap();
    assert_eq!(brightest.index, -4);
    assert!((brightest.direction[0] + (2.0 * slope).sin()).abs() < 1e-12);
    assert!(brightest.efficiency() > 0.5, "{}", brightest.efficiency());
}

/// Coupled waves of `meent` and of SCATMECH (`tests/judges/gratings/dielectrics.py`), for light across the grooves and
/// in conical mounts. Each row holds the change between two resolutions.
#[test]
fn orders_on_both_sides_of_dielectrics_agree_with_coupled_waves() {
    /// The accepted root mean square of an order.
    const RMS: f64 = 2e-3;
    /// Coupled waves converge slowly for p states; the last change is a measure of what is left.
    const UNSETTLED_SHARE: f64 = 2.0;
    let (mut squares, mut count, mut largest) = (0.0, 0, 0.0_f64);
    let mut last: Option<([f64; 6], sunbeam_rigorous::BothSides)> = None;
    for (shape, row) in rows::<11>(include_str!("data/dielectrics.csv")) {
        let [eta, period, height, nm, theta, azimuth, side, index, s, p, unsettled] = row;
        let (setting, wi) = ([eta, period, height, nm, theta, azimuth], direction(theta, azimuth));
        if last.as_ref().is_none_or(|(before, _)| *before != setting) {
            let profile = match shape.as_str() {
                "sinusoid" => Profile::sinusoid(period, height),
                "blazed" => Profile::blazed(period, height),
                _ => Profile::lamellar(period, height, 0.5),
            };
            last = Some((setting, sunbeam_rigorous::solve_both_sides(&profile.unwrap(), eta, nm, wi).unwrap()));
        }
        let Some((_, solved)) = &last else { unreachable!() };
        let orders = if side == 0.0 { &solved.above } else { &solved.below };
        let order = orders.iter().find(|order| f64::from(order.index) == index).expect("the order propagates");
        for (found, judge) in efficiencies(&order.jones, wi).iter().zip([s, p]) {
            let off = (found - judge).abs();
            (squares, count, largest) = (squares + off * off, count + 1, largest.max(off));
            assert!(off < RMS + UNSETTLED_SHARE * unsettled, "{shape} {row:?}: {found}");
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("RMS {rms:.1e} and at most {largest:.1e} of {count} shares");
    assert!(rms < RMS, "{rms}");
}
