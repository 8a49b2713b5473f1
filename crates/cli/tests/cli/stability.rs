//! Numerical stability, swept over the hard cases of docs/model.md#hard-cases. Single cases are in `hard_cases.rs` and
//! `transforms.rs`; here errors are followed as κH grows to 200 and directions graze, and questions are drawn at random
//! from surfaces drawn at random.

use std::sync::LazyLock;
use sunbeam_cli::benchmarks::stability::{DeepPoint, GrazingSurface, deep_relief, grazing, random_queries};

/// Sums of up to 400 bounded terms in single precision: a random walk of roundings of 6e-8, of which an order amplitude is a
/// mean over pixels.
const SINGLE: f64 = 2e-6;
/// The remainder that the number of terms is chosen for, and rounding of double precision far below it.
const DOUBLE: f64 = 1.1e-8;
/// Single look-ups may miss a table's tolerance by this factor; 99 of 100 keep it.
const WORST: f64 = 10.0;
/// The tolerance of the tables and of FLSS here, the default.
const TOLERANCE: f64 = 1e-3;
/// Reciprocity of look-ups whose arguments are sums of the two directions: rounding only, as in `hard_cases.rs`.
const RECIPROCITY: f64 = 1e-9;
/// The largest albedo of random surfaces, whose tolerances are up to 1e-2; none exceeds one by more than its own surface's
/// tolerance and a thousandth.
const ALBEDO: f64 = 1.0 + 1e-2 + 1e-3;
/// What an albedo may exceed one by, in units of the surface's tolerance.
const ALBEDO_EXCESS: f64 = 1.0;

/// The sweeps, which several tests judge.
static DEEP: LazyLock<Vec<DeepPoint>> = LazyLock::new(|| deep_relief(150).unwrap());
static GRAZING: LazyLock<Vec<GrazingSurface>> = LazyLock::new(|| grazing(150).unwrap());

fn at(points: &[DeepPoint], kappa_h: f64) -> &DeepPoint {
    points.iter().find(|point| point.kappa_h == kappa_h).unwrap()
}

#[test]
fn deep_relief_does_not_touch_our_series_and_tables() {
    let points = &*DEEP;
    for point in points {
        println!("{point:?}");
        let context = || format!("κH = {}: {point:?}", point.kappa_h);
        assert!(point.chebyshev_f32 <= SINGLE, "{}", context());
        assert!(point.chebyshev_f64 <= DOUBLE, "{}", context());
        // Truncation at the tolerance, and places and phases in single precision.
        assert!(point.flss_p99.unwrap() <= TOLERANCE, "{}", context());
        assert!(point.flss_largest.unwrap() <= WORST * TOLERANCE, "{}", context());
        assert!(point.table_p99 <= TOLERANCE && point.table_largest <= WORST * TOLERANCE, "{}", context());
    }
    assert_eq!(points.last().unwrap().kappa_h, 200.0);
}

#[test]
fn taylor_s_series_dies_where_its_terms_outgrow_the_precision() {
    let points = &*DEEP;
    // Terms reach e^κH/√(2πκH): 2.7 at κH = 2, 3e5 at 15; 1.7e6 at 17 times 6e-8 is a tenth of everything.
    assert!(at(points, 2.0).taylor_f32 <= SINGLE);
    for point in points {
        let lost = |epsilon: f64| epsilon * point.kappa_h.exp() / (2.0 * std::f64::consts::PI * point.kappa_h).sqrt();
        // Roundings of some ten terms near the largest, less in the mean over pixels; remainder beside them.
        assert!(point.taylor_f64 <= 10.0 * lost(1.1e-16) + DOUBLE, "{point:?}");
        // Beyond e^88 single precision has no numbers left.
        assert!(point.kappa_h > 80.0 || point.taylor_f32 <= 10.0 * lost(6e-8) + SINGLE, "{point:?}");
    }
    // No digit is left: amplitudes are at most 1.
    assert!(at(points, 25.0).taylor_f32 > 1.0, "{:?}", at(points, 25.0));
    assert!(at(points, 50.0).taylor_f64 > 1.0, "{:?}", at(points, 50.0));
    assert!(at(points, 200.0).taylor_f32.is_infinite());
    // The method says so rather than answering.
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
            // Negative control: without the scaling there is energy to take away.
            assert!(point.theta_deg < 60.0 || point.albedo_unscaled > 1.2, "{}", context());
        }
        assert_eq!(surface.points.last().unwrap().theta_deg, 89.99);
    }
}

#[test]
fn energy_is_kept_up_to_the_horizon() {
    for surface in &*GRAZING {
        for point in &surface.points {
            assert!(point.albedo <= 1.0 + ALBEDO_EXCESS * surface.tolerance, "{}: {point:?}", surface.name);
        }
    }
}

#[test]
fn random_questions_break_nothing() {
    judge(400_000);
}

#[test]
#[ignore = "takes minutes"]
fn ten_million_random_questions_break_nothing() {
    judge(10_000_000);
}

fn judge(count: u64) {
    let found = random_queries(count).unwrap();
    println!("{found:?}");
    assert_eq!(found.queries, count);
    assert_eq!((found.not_finite, found.negative, found.without_density), (0, 0, 0), "{found:?}");
    assert!(found.reciprocity <= RECIPROCITY, "{found:?}");
    // Negative control: there were albedos to judge, and samples.
    assert!(found.albedos > 0 && found.scaled_surfaces > 0 && found.samples > count / 2, "{found:?}");
    assert_eq!(found.albedos_above, 0, "{found:?}");
    assert!(found.albedo <= ALBEDO, "{found:?}");
    // A mean albedo four standard errors below what was found; tolerances are up to 1e-2.
    assert!(found.mean_weight <= 1.0 + 1e-2, "{found:?}");
}
