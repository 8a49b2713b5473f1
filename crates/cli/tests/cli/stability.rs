//! Numerical stability over the hard cases of docs/model.md#hard-cases: κH up to 200, grazing directions, and random
//! queries of random surfaces. Single cases are in `hard_cases.rs` and `transforms.rs`.

use std::sync::LazyLock;
use sunbeam_cli::benchmarks::stability::{DeepPoint, GrazingSurface, deep_relief, grazing, random_queries};

/// Rounding of an order's amplitude in single precision: sums of up to 400 terms of modulus 1, with roundings of 6e-8
/// each that add up as a random walk.
const SINGLE: f64 = 2e-6;
/// Error of an order's amplitude in double precision: the remainder of the series, 1e-8, and a far smaller rounding.
const DOUBLE: f64 = 1.1e-8;
/// Factor by which a single look-up may exceed a table's tolerance; 99 % of the look-ups keep it.
const WORST: f64 = 10.0;
/// Tolerance of the tables and of FLSS, the default.
const TOLERANCE: f64 = 1e-3;
/// Relative rounding of a reflectance when the directions are exchanged, as in `hard_cases.rs`.
const RECIPROCITY: f64 = 1e-9;
/// Largest albedo of random surfaces: 1 plus the largest of their tolerances, 1e-2, and 1e-3.
const ALBEDO: f64 = 1.0 + 1e-2 + 1e-3;
/// Largest excess of an albedo over 1, in units of the surface's tolerance.
const ALBEDO_EXCESS: f64 = 1.0;

/// The sweep over deep relief, shared by the tests.
static DEEP: LazyLock<Vec<DeepPoint>> = LazyLock::new(|| deep_relief(150).unwrap());
/// The sweep over grazing directions, shared by the tests.
static GRAZING: LazyLock<Vec<GrazingSurface>> = LazyLock::new(|| grazing(150).unwrap());

fn at(points: &[DeepPoint], kappa_h: f64) -> &DeepPoint {
    points.iter().find(|point| point.kappa_h == kappa_h).unwrap()
}

#[test]
fn chebyshev_series_and_tables_stand_deep_relief() {
    let points = &*DEEP;
    for point in points {
        println!("{point:?}");
        let context = || format!("κH = {}: {point:?}", point.kappa_h);
        assert!(point.chebyshev_f32 <= SINGLE, "{}", context());
        assert!(point.chebyshev_f64 <= DOUBLE, "{}", context());
        // Truncation at the tolerance, and phases in single precision.
        assert!(point.flss_p99.unwrap() <= TOLERANCE, "{}", context());
        assert!(point.flss_largest.unwrap() <= WORST * TOLERANCE, "{}", context());
        assert!(point.table_p99 <= TOLERANCE && point.table_largest <= WORST * TOLERANCE, "{}", context());
    }
    assert_eq!(points.last().unwrap().kappa_h, 200.0);
}

#[test]
fn taylor_series_loses_all_digits_where_its_terms_outgrow_the_precision() {
    let points = &*DEEP;
    // Terms reach e^κH/√(2πκH): 2.7 at κH = 2, 3e5 at 15; 1.7e6 at 17 times 6e-8 is a tenth of everything.
    assert!(at(points, 2.0).taylor_f32 <= SINGLE);
    for point in points {
        let lost = |epsilon: f64| epsilon * point.kappa_h.exp() / (2.0 * std::f64::consts::PI * point.kappa_h).sqrt();
        // Roundings of some ten terms near the largest one, and the remainder.
        assert!(point.taylor_f64 <= 10.0 * lost(1.1e-16) + DOUBLE, "{point:?}");
        // Single precision overflows beyond e^88.
        assert!(point.kappa_h > 80.0 || point.taylor_f32 <= 10.0 * lost(6e-8) + SINGLE, "{point:?}");
    }
    // Amplitudes are at most 1, so no digit is correct.
    assert!(at(points, 25.0).taylor_f32 > 1.0, "{:?}", at(points, 25.0));
    assert!(at(points, 50.0).taylor_f64 > 1.0, "{:?}", at(points, 50.0));
    assert!(at(points, 200.0).taylor_f32.is_infinite());
    // The method refuses the depth.
    assert!(at(points, 50.0).flss_taylor_p99.is_none() && at(points, 10.0).flss_taylor_p99.is_some());
}

#[test]
fn grazing_directions_keep_the_tolerance_and_reciprocity() {
    for surface in &*GRAZING {
        for point in &surface.points {
            let context = || format!("{}: {point:?}", surface.name);
            assert_eq!(point.broken, 0, "{}", context());
            assert!(point.error_p99 <= surface.tolerance, "{}", context());
            assert!(point.error_largest <= WORST * surface.tolerance, "{}", context());
            assert!(point.reciprocity <= RECIPROCITY, "{}", context());
            if surface.name == "blazed" {
                assert!(point.albedo <= 1.0 + ALBEDO_EXCESS * surface.tolerance, "{}", context());
            }
            // Negative control: without the scaling the albedo exceeds 1.
            assert!(point.theta_deg < 60.0 || point.albedo_unscaled > 1.2, "{}", context());
        }
        assert_eq!(surface.points.last().unwrap().theta_deg, 89.99);
    }
}

#[test]
fn albedos_stay_below_one_up_to_the_horizon() {
    for surface in &*GRAZING {
        for point in &surface.points {
            assert!(point.albedo <= 1.0 + ALBEDO_EXCESS * surface.tolerance, "{}: {point:?}", surface.name);
        }
    }
}

#[test]
fn answers_to_random_queries_are_valid() {
    assert_valid(400_000);
}

#[test]
#[ignore = "takes minutes"]
fn answers_to_ten_million_random_queries_are_valid() {
    assert_valid(10_000_000);
}

fn assert_valid(count: u64) {
    let found = random_queries(count).unwrap();
    println!("{found:?}");
    assert_eq!(found.queries, count);
    assert_eq!((found.not_finite, found.negative, found.without_density), (0, 0, 0), "{found:?}");
    assert!(found.reciprocity <= RECIPROCITY, "{found:?}");
    // Negative control: albedos and samples were computed.
    assert!(found.albedos > 0 && found.scaled_surfaces > 0 && found.samples > count / 2, "{found:?}");
    assert_eq!(found.albedos_above, 0, "{found:?}");
    assert!(found.albedo <= ALBEDO, "{found:?}");
    // The mean weight less four standard errors is a lower bound of the mean albedo; tolerances are up to 1e-2.
    assert!(found.mean_weight <= 1.0 + 1e-2, "{found:?}");
}
