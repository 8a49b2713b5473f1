//! Conditions under which solvers break: cut-offs, grazing incidence, short periods, corners; and size limits.

use std::time::{Duration, Instant};
use sunbeam_rigorous::{
    Air, Amplitudes, Discretisation, Error, Estimate, Medium, MetalTable, Profile, Resolution, check_size, solve_orders,
};

const WAVELENGTH_NM: f64 = 550.0;

/// Bound on the violation of power balance and reciprocity: ten times that of 64 nodes in the cases below.
const CHECKS: f64 = 1e-3;

fn profiles() -> [Profile; 3] {
    [Profile::sinusoid(1.1, 0.3), Profile::blazed(1.1, 0.25), Profile::lamellar(1.1, 0.2, 0.4)]
        .map(|profile| profile.expect("in range"))
}

/// A perfect conductor, silver and a dielectric.
fn media() -> [Medium; 3] {
    let index = |eta, k| Medium::index(eta, k).expect("in range");
    [Medium::Perfect, index(0.06, 3.59), index(1.56, 0.0)]
}

fn mesh(profile: &Profile, medium: &Medium) -> Discretisation {
    let resolution = Resolution::new(profile, medium, WAVELENGTH_NM).expect("in range");
    Discretisation::new(profile, resolution).expect("in range")
}

fn solved(air: &Air<'_>, medium: &Medium) -> Amplitudes {
    air.solve(medium, WAVELENGTH_NM).expect("solvable")
}

/// Solves at one (t, b) and asserts power balance and reciprocity.
fn check(mesh: &Discretisation, medium: &Medium, t: f64, b: f64) -> Amplitudes {
    let there = solved(&mesh.air(t, b).expect("in range"), medium);
    let back = solved(&mesh.air(t, -b).expect("in range"), medium);
    let (balance, reciprocity) = (there.balance_error(), there.reciprocity_error(&back));
    assert!(balance < CHECKS && reciprocity < CHECKS, "{medium:?} {t} {b}: {balance:.1e} {reciprocity:.1e}");
    there
}

#[test]
fn power_balance_and_reciprocity_hold() {
    for profile in profiles() {
        for medium in media() {
            let mesh = mesh(&profile, &medium);
            for (t, b) in [(1.7, 0.3), (2.0 - 0.07, -0.45), (0.6, 0.1), (1.2, 1.15)] {
                check(&mesh, &medium, t, b);
            }
        }
    }
}

/// Amplitudes go as the square root of the distance from the cut-off: 1e-7 away they change by some 1e-3, on both
/// sides.
#[test]
fn efficiencies_are_continuous_at_cutoffs() {
    const STEP_MAX: f64 = 5e-3;
    for profile in profiles() {
        for medium in media() {
            let mesh = mesh(&profile, &medium);
            let of = |t: f64| check(&mesh, &medium, t, 0.3).efficiency(0, 0);
            // The cut-off of order 1 is at t = 1.3.
            let at: Vec<f64> = [-1e-4, -1e-7, 0.0, 1e-7, 1e-4].iter().map(|apart| of(1.3 + apart)).collect();
            assert!((at[1] - at[3]).abs() < STEP_MAX && (at[2] - at[1]).abs() < STEP_MAX, "{medium:?} {at:?}");
        }
    }
}

/// Towards the horizon every relief is a mirror.
#[test]
fn grazing_light_is_reflected_specularly() {
    let wi = |cos: f64| [(1.0 - cos * cos).sqrt(), 0.0, cos];
    for profile in profiles() {
        for medium in media() {
            let orders = solve_orders(&profile, &medium, WAVELENGTH_NM, wi(1e-5)).unwrap();
            let mirrored = orders.orders.iter().find(|order| order.index == 0).unwrap().efficiency();
            // The rest is proportional to the cosine, 1e-5, by a factor of the metal's impedance or the relief.
            assert!((mirrored - 1.0).abs() < 2e-3, "{medium:?} {mirrored}");
        }
    }
    // Grazing light along the grooves, where κ vanishes.
    let along = [0.0, (1.0_f64 - 1e-8).sqrt(), 1e-4];
    let [_, silver, _] = media();
    for profile in profiles() {
        let orders = solve_orders(&profile, &silver, WAVELENGTH_NM, along).unwrap();
        assert_eq!(orders.orders.len(), 1);
    }
}

/// With a period below half a wavelength only order 0 propagates, and a relief far below a wavelength acts as a plane.
#[test]
fn short_periods_have_only_order_zero() {
    let wi = [0.6, 0.3, (1.0_f64 - 0.45).sqrt()];
    for medium in media() {
        let shallow = Profile::sinusoid(0.1, 0.001).unwrap();
        let flat = Profile::flat(0.1).unwrap();
        let [relief, mirror] = [shallow, flat].map(|p| solve_orders(&p, &medium, WAVELENGTH_NM, wi).unwrap());
        assert_eq!(relief.orders.len(), 1);
        // First order in the height over the period.
        assert!((relief.orders[0].efficiency() - mirror.orders[0].efficiency()).abs() < 5e-3, "{medium:?}");
        for profile in [Profile::lamellar(0.12, 0.05, 0.5).unwrap(), Profile::blazed(0.2, 0.1).unwrap()] {
            assert_eq!(solve_orders(&profile, &medium, WAVELENGTH_NM, wi).unwrap().orders.len(), 1);
        }
    }
}

/// Samples of a rectangle give the efficiencies of the lamellar profile.
#[test]
fn sampled_lamellar_grating_matches_the_profile() {
    let heights: Vec<f64> = (0..512).map(|i| if i < 256 { 0.2 } else { 0.0 }).collect();
    let from_file = Profile::samples(1.1, &heights).unwrap();
    let preset = Profile::lamellar(1.1, 0.2, 0.5).unwrap();
    let (wi, [_, silver, _]) = ([0.5, 0.0, 0.75_f64.sqrt()], media());
    let [a, b] = [from_file, preset].map(|p| solve_orders(&p, &silver, WAVELENGTH_NM, wi).unwrap());
    for (a, b) in a.orders.iter().zip(&b.orders) {
        // Corners agree to rounding; the edges begin at other points of the period.
        assert!((a.efficiency() - b.efficiency()).abs() < 1e-4, "{a:?} {b:?}");
    }
}

/// Cases include periods of few skin depths, which need several Bloch phases, and t beyond the horizon.
#[test]
fn metal_table_matches_the_direct_solution() {
    const TOLERANCE: f64 = 1e-5;
    for (profile, b) in
        [(Profile::lamellar(1.6, 0.12, 0.5).unwrap(), 0.37), (Profile::sinusoid(0.3, 0.08).unwrap(), 0.21)]
    {
        for (eta, k) in [(0.96, 6.69), (0.06, 3.59), (0.42, 2.35)] {
            let medium = Medium::index(eta, k).unwrap();
            let mesh = mesh(&profile, &medium);
            let table = MetalTable::new(&mesh, &medium, WAVELENGTH_NM).unwrap().expect("a metal has a table");
            let horizon = profile.period_um() * 1e3 / WAVELENGTH_NM;
            for t in [0.3 * horizon, 0.95 * horizon, 1.12 * horizon] {
                let air = mesh.air(t, b).unwrap();
                let (direct, read) = (solved(&air, &medium), air.solve_tabulated(&table).unwrap());
                for &out in direct.orders() {
                    for &from in direct.orders() {
                        let apart = (direct.efficiency(out, from) - read.efficiency(out, from)).abs();
                        assert!(apart < TOLERANCE, "{eta} {t} {out} {from}: {apart:.1e}");
                    }
                }
            }
        }
    }
    let glass = Medium::index(1.5, 0.0).unwrap();
    let mesh = mesh(&profiles()[0], &glass);
    assert!(MetalTable::new(&mesh, &glass, WAVELENGTH_NM).unwrap().is_none());
}

#[test]
fn concurrent_solutions_are_identical() {
    let [_, blazed, _] = profiles();
    let [_, silver, _] = media();
    let mesh = mesh(&blazed, &silver);
    let alone = solved(&mesh.air(1.7, 0.3).unwrap(), &silver);
    std::thread::scope(|scope| {
        let beside: Vec<_> = (0..3).map(|_| scope.spawn(|| solved(&mesh.air(1.7, 0.3).unwrap(), &silver))).collect();
        for thread in beside {
            assert!(thread.join().unwrap() == alone);
        }
    });
}

#[test]
fn errors_name_the_refused_quantity() {
    let [profile, ..] = profiles();
    let refused = |wi: [f64; 3], wavelength: f64| {
        solve_orders(&profile, &Medium::Perfect, wavelength, wi).unwrap_err().to_string()
    };
    assert!(refused([0.0, 0.0, 2.0], 550.0).contains("length of wi is 2"));
    assert!(refused([0.0, 0.0, f64::NAN], 550.0).contains("length of wi"));
    assert!(refused([0.6, 0.0, -0.8], 550.0).contains("z of wi is -0.8"));
    assert!(refused([0.0, 0.0, 1.0], 0.0).contains("wavelength in nm is 0"));
    for (eta, k) in [(-1.0, 1.0), (f64::NAN, 0.0), (0.0, 0.0), (1.0, 1e6)] {
        assert!(Medium::index(eta, k).unwrap_err().to_string().contains("accepted"), "{eta} {k}");
    }
    let estimate = Estimate::new(&Profile::blazed(20.0, 1.0).unwrap(), &Medium::Perfect, 550.0).unwrap();
    assert!(estimate.nodes < 2048 && estimate.seconds < 60.0, "{estimate:?}");
}

/// Refusals by the lattice sum of the air, by that of a transparent medium, and by the number of nodes.
#[test]
fn oversized_reliefs_are_refused_at_once() {
    /// Longest time of a refusal on a busy machine; it solves nothing.
    const AT_ONCE: Duration = Duration::from_secs(2);
    let [flat, lamellar] = [Profile::flat(50.0), Profile::lamellar(50.0, 0.5, 0.5)].map(Result::unwrap);
    let [deep, blazed] = [Profile::sinusoid(40.0, 35.0), Profile::blazed(58.0, 30.0)].map(Result::unwrap);
    let [glass, gold] = [(1.5, 0.0), (0.4, 2.4)].map(|(eta, k)| Medium::index(eta, k).unwrap());
    let millimetre = Profile::sinusoid(1000.0, 1.0).unwrap();
    let cases: [(&Profile, &Medium, f64, &[&str]); 6] = [
        (&millimetre, &Medium::Perfect, 550.0, &["period of 1000 µm is 1818.2", "in air", "at most 108", "59.400 µm"]),
        (&flat, &gold, 400.0, &["125.0 wavelengths of 400 nm in air", "at most 108", "43.200 µm"]),
        (&lamellar, &glass, 500.0, &["150.0 wavelengths of 500 nm in the medium below", "at most 108", "36.000 µm"]),
        (&deep, &Medium::Perfect, 550.0, &["height of 35", "63.6 wavelengths", "at most 62", "34.100 µm"]),
        (&blazed, &gold, 550.0, &["nodes are needed at 550 nm", "about", "at most 2048", "times as large"]),
        (&millimetre, &glass, 1.0, &["1000000.0 wavelengths"]),
    ];
    for (profile, medium, wavelength, named) in cases {
        let start = Instant::now();
        let error = solve_orders(profile, medium, wavelength, [0.0, 0.0, 1.0]).unwrap_err();
        assert!(start.elapsed() < AT_ONCE, "{error} after {:?}", start.elapsed());
        let message = error.to_string();
        assert!(named.iter().all(|part| message.contains(part)) && message.contains("accepted"), "{message}");
        assert!(matches!(error, Error::TooManyWaves { .. } | Error::TooLarge { .. }), "{message}");
    }
    // In a metal fields decay within a few periods, so only the air limits the period.
    assert!(check_size(&lamellar, &gold, 500.0, 0.0).is_ok());
    // Light along the grooves has fewer wavelengths across them, in air and in glass.
    assert!(check_size(&lamellar, &Medium::Perfect, 400.0, 0.0).is_err());
    assert!(check_size(&lamellar, &Medium::Perfect, 400.0, 0.6).is_ok());
    assert!(check_size(&lamellar, &glass, 640.0, 0.0).is_err() && check_size(&lamellar, &glass, 640.0, 0.8).is_ok());
    for accepted in [(Profile::flat(59.0), &Medium::Perfect), (Profile::flat(39.0), &glass)] {
        assert!(check_size(&accepted.0.unwrap(), accepted.1, 550.0, 0.0).is_ok());
    }
}
