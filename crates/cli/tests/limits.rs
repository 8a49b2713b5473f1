//! Limits: builds are estimated before they begin and refused beyond a limit, and implausible lengths are refused by
//! name.

#![allow(clippy::unwrap_used, reason = "helpers of tests are outside of `#[test]` functions")]

#[path = "../../../tests/core/common.rs"]
mod common;
#[path = "cli/support/mod.rs"]
mod support;

use cpu_time::ProcessTime;
use ndarray::Array2;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use sunbeam::cache::Cache;
use sunbeam::colour_table::{ColourTable, ColourTableError, ColourTableOptions};
use sunbeam::config::SurfaceConfig;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::Surface;
use sunbeam::scattering::{Options, SizeRange};
use sunbeam::table::{BuildDemand, Model, Progress, Purpose, TableError, Tiling};
use support::{refused, run};

/// Largest time of a refusal on a loaded machine; it takes a few milliseconds.
const AT_ONCE: Duration = Duration::from_secs(10);
/// Largest ratio between the estimated and the measured time of a build, either way. The estimate is good to 2; the
/// rest is the machine's load.
const FAR_OFF: f64 = 5.0;

#[test]
fn surfaces_in_wrong_units_are_refused_at_once() {
    let depth = ["GB and", "min on two cores", "the limit is 8.0 GB and 2.0 min", "Is the height in µm?", "would do"];
    let cases: [(&[&str], &[&str]); 8] = [
        (&["--preset", "sinusoidal", "--height", "500"], &depth),
        (&["--preset", "sinusoidal", "--height", "250"], &depth),
        (&["--preset", "blazed", "--height", "1000", "--model", "patch", "--conserve-energy", "true"], &depth),
        (&["--preset", "blazed", "--period", "1e6"], &["\"period\"", "1000000 µm", "(0, 1e3]", "meant in nm?"]),
        (&["--preset", "blazed", "--height", "2500"], &["\"height\"", "2500 µm", "meant in nm?"]),
        (&["--height-field", "a.gsf", "--pixel-size", "1001"], &["\"pixel_size\"", "1001 µm", "meant in nm?"]),
        (
            &["--preset", "sinusoidal", "--height", "100", "--tolerance", "1e-6", "--conserve-energy", "true"],
            &["GB and", "a tolerance of 0.0"],
        ),
        (&["--preset", "blazed", "--build-limit", "0.5"], &["\"build_limit\"", "0.5", "[1e0, 1e6]"]),
    ];
    for (surface, mentioned) in cases {
        let start = Instant::now();
        let message = refused(&[&["eval", "--no-cache"], surface].concat());
        assert!(start.elapsed() < AT_ONCE, "{surface:?} took {:?}", start.elapsed());
        assert!(mentioned.iter().all(|part| message.contains(part)), "{surface:?}: {message}");
    }
    // A description needs no tables.
    let start = Instant::now();
    assert_eq!(run(&["height-field", "--preset", "sinusoidal", "--height", "500"], "").status.code(), Some(0));
    assert!(start.elapsed() < AT_ONCE);
}

/// Every command refuses such a grating, and a curve is refused before its first point is solved.
#[test]
fn gratings_of_too_many_wavelengths_are_refused_at_once() {
    let grating = ["--theory", "rigorous", "--preset", "lamellar", "--period", "50", "--height", "0.5", "--eta", "1.5"];
    let medium =
        ["period of 50 µm is 150.0 wavelengths of 500 nm in the medium below", "at most 108", "36.000 µm", "scalar"];
    let air = ["138.9 wavelengths of 360 nm in air", "at most 108", "38.880 µm", "scalar"];
    let cases: [(&[&str], &[&str]); 5] = [
        (&["orders", "--wavelength", "500"], &medium),
        (&["orders", "--over", "wavelength", "--range", "900,500,3"], &medium),
        (&["orders", "--over", "theta-i", "--range", "0,80,3", "--wavelength", "500"], &medium),
        // The limits of a build do not matter.
        (&["eval", "--no-cache", "--build-limit", "1e6"], &air),
        (&["brdf-map", "-o", "/dev/null", "--method", "colour-table", "--no-cache", "--build-limit", "1e6"], &air),
    ];
    for (command, mentioned) in cases {
        let start = Instant::now();
        let message = refused(&[command, &grating].concat());
        assert!(start.elapsed() < AT_ONCE, "{command:?} took {:?}", start.elapsed());
        assert!(mentioned.iter().all(|part| message.contains(part)), "{command:?}: {message}");
    }
    // A service that solves each query continues with the next.
    let line = |nm: f64| format!(r#"{{"wi":[0,0,1],"wo":[0,0,1],"wavelength":{nm}}}"#);
    let start = Instant::now();
    let output =
        run(&[&["eval", "--method", "exact"], &grating[..]].concat(), format!("{}\n{}\n", line(500.0), line(1.0)));
    assert!(start.elapsed() < AT_ONCE && output.status.success());
    let answers = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<&str> = answers.lines().collect();
    assert!(answers[0].contains(medium[0]) && answers[1].contains("50000.0 wavelengths of 1 nm in air"), "{answers:?}");
}

fn demand(size: (usize, usize), pixel_um: f64, range_um: f64) -> BuildDemand {
    BuildDemand {
        size,
        pixel_um: (pixel_um, pixel_um),
        range_um,
        model: Model::Ensemble,
        tiling: Tiling::Aperiodic,
        coherence_length_um: 65.0,
        magnification: 1.0,
        tolerance: 1e-3,
        purpose: Purpose::Surface { energy: 1.0 },
    }
}

/// The number that follows `words` in a message.
fn suggested(message: &str, words: &str) -> Option<f64> {
    let rest = &message[message.find(words)? + words.len()..];
    rest.split_whitespace().next()?.trim_end_matches([',', ':', ';', '.']).parse().ok()
}

#[test]
fn suggested_values_are_accepted() {
    let mut seen = [0; 5];
    for size in [512, 1024, 2048, 4096] {
        for range_um in [0.1, 1.0, 30.0, 400.0] {
            for (tiling, coherence_length_um, tolerance, magnification) in [
                (Tiling::Aperiodic, 65.0, 1e-3, 1.0),
                // A length of 10 µm fits as it is and not as 30 µm.
                (Tiling::Aperiodic, 195.0, 1e-3, 3.0),
                (Tiling::Periodic, 1e3, 1e-4, 1.0),
                (Tiling::Periodic, 1e5, 1e-6, 1.0),
            ] {
                let base = demand((size, size), 0.1, range_um);
                let asked = BuildDemand { tiling, coherence_length_um, tolerance, magnification, ..base };
                let Err(error) = asked.check(1.0) else { continue };
                assert!(matches!(error, TableError::TooMuch { .. }));
                let message = error.to_string();
                assert!(!message.contains('\n') && !message.contains("NaN"), "{message}");
                let passes = |changed: BuildDemand, limit: f64| {
                    assert_eq!(changed.check(limit), Ok(()), "{message}");
                    1
                };
                if let Some(tolerance) = suggested(&message, "a tolerance of ") {
                    seen[0] += passes(BuildDemand { tolerance, ..asked.clone() }, 1.0);
                }
                if let Some(given_um) = suggested(&message, "a coherence length of ") {
                    let coherence_length_um = given_um * magnification;
                    seen[1] += passes(BuildDemand { coherence_length_um, ..asked.clone() }, 1.0);
                }
                if let Some(pixels) = suggested(&message, " × ") {
                    let pixel_um = 0.1 * size as f64 / pixels;
                    let size = (pixels as usize, pixels as usize);
                    seen[2] += passes(BuildDemand { size, pixel_um: (pixel_um, pixel_um), ..asked.clone() }, 1.0);
                }
                if message.contains("Is the height in µm?") {
                    seen[3] += passes(BuildDemand { range_um: range_um * 1e-3, ..asked.clone() }, 1.0);
                }
                if let Some(limit) = suggested(&message, "a build_limit of ") {
                    seen[4] += passes(asked, limit);
                }
            }
        }
    }
    assert!(seen.iter().all(|count| *count > 0), "a kind of advice is never given: {seen:?}");
}

#[test]
fn advice_states_lengths_as_given() {
    let relief = r#""preset": "sinusoidal", "height": 900, "coherence_length": 1e5, "tolerance": 1e-5"#;
    let covered = r#""cover_eta": 1.5, "eta": 1.0, "k": 6.9"#;
    let film = r#""transmission": "film", "eta": 1.5"#;
    for medium in [covered, film] {
        let config = SurfaceConfig::from_json(&format!("{{{relief}, {medium}}}")).unwrap();
        let demand = config.options().demand(&config.height_field_inside().unwrap());
        let message = demand.check(config.build_limit).unwrap_err().to_string();
        assert!(message.contains("It is 900 µm; 0.9 µm would do"), "{message}");
    }
}

#[test]
fn estimates_are_fast_and_grow_with_the_build() {
    let start = Instant::now();
    let small = demand((64, 64), 0.1, 0.3).estimate();
    assert!(small.limit() == 1.0 && small.seconds < 20.0, "{small:?}");
    let lengths = [f64::MIN_POSITIVE, 1e-9, 0.1, 1e3, 1e30, f64::MAX];
    for pixel_um in lengths {
        for range_um in [0.0, 1e-300, 1.0, 1e30, f64::MAX, f64::INFINITY] {
            for size in [(1, 1), (1, 1_000_000), (usize::MAX >> 20, 3)] {
                for tiling in [Tiling::Periodic, Tiling::Aperiodic] {
                    for (model, tolerance) in [(Model::Ensemble, 1e-6), (Model::Patch, 0.1)] {
                        let asked = BuildDemand { model, tiling, tolerance, ..demand(size, pixel_um, range_um) };
                        // Accepted or refused; a refusal has one line.
                        if let Err(error) = asked.check(1.0) {
                            assert!(!error.to_string().contains('\n'));
                        }
                    }
                }
            }
        }
    }
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());
    let base = demand((256, 256), 0.1, 0.5);
    let more = [
        BuildDemand { size: (512, 512), ..base.clone() },
        BuildDemand { range_um: 2.0, ..base.clone() },
        BuildDemand { tolerance: 1e-5, ..base.clone() },
    ];
    for more in more {
        let (a, b) = (base.estimate(), more.estimate());
        assert!(b.seconds > a.seconds && b.bytes > a.bytes, "{more:?}: {b:?} is not above {a:?}");
    }
}

#[test]
fn the_ensemble_of_a_patch_has_no_sampler() {
    let seconds = |model, purpose| BuildDemand { model, purpose, ..demand((256, 256), 0.1, 0.5) }.estimate().seconds;
    // Time of the division by the albedo.
    let energy =
        |model| seconds(model, Purpose::Surface { energy: 1.0 }) - seconds(model, Purpose::Surface { energy: 0.0 });
    let expected = energy(Model::Ensemble) + seconds(Model::Ensemble, Purpose::Table);
    assert!((energy(Model::Patch) / expected - 1.0).abs() < 1e-9, "{} {expected}", energy(Model::Patch));
}

#[test]
fn gratings_along_both_axes_cost_the_same() {
    let along_x = Preset::Blazed.build(None, None).unwrap();
    let along_y = HeightField::new(along_x.heights_um().t().to_owned(), along_x.dy_um(), along_x.dx_um()).unwrap();
    let sizes = Some(SizeRange { scale: [0.5, 1.0], depth: [0.5, 1.0] });
    let options = Options { sizes, ..Options::default() };
    assert_eq!(options.demand(&along_x).purpose, options.demand(&along_y).purpose);
}

/// Held by tests with long builds: one of them measures this process's time.
static BUILDING: Mutex<()> = Mutex::new(());

#[test]
fn estimated_times_match_builds() {
    let _alone = BUILDING.lock();
    let mut surfaces = vec![
        r#"{"preset": "elaphe"}"#.to_owned(),
        r#"{"preset": "xenopeltis"}"#.to_owned(),
        r#"{"preset": "xenopeltis", "model": "patch"}"#.to_owned(),
        r#"{"preset": "xenopeltis", "coherence_length": 10}"#.to_owned(),
        r#"{"preset": "sinusoidal", "height": 100}"#.to_owned(),
    ];
    if let Some(scan) = sunbeam_testing::data("afm/xenopeltis.gsf") {
        surfaces.push(format!(r#"{{"filename": {scan:?}}}"#));
    }
    for json in surfaces {
        let config = SurfaceConfig { conserve_energy: Some(false), ..SurfaceConfig::from_json(&json).unwrap() };
        let field = config.height_field().unwrap();
        let options = config.options();
        let table = BuildDemand { purpose: Purpose::Table, ..options.demand(&field) };
        let start = ProcessTime::now();
        let surface = Surface::new(&field, &options).unwrap();
        // The process's own time excludes the load by others.
        let on_two_cores = 0.5 * start.elapsed().as_secs_f64();
        let (whole, table_seconds) = (options.demand(&field).estimate().seconds, table.estimate().seconds);
        let report = surface.report();
        println!(
            "{json}: the table in {table_seconds:.2} s, all {whole:.2} s, took {on_two_cores:.2} s; {:.3} GB, \
             tables of {:.1} MB, {} estimated",
            options.demand(&field).estimate().bytes / 1e9,
            report.table.bytes as f64 / 1e6,
            table.table_bytes() / 1e6
        );
        let ratio = whole / on_two_cores;
        assert!((1.0 / FAR_OFF..FAR_OFF).contains(&ratio), "{json}: {whole} s estimated, {on_two_cores} s taken");
    }
}

#[test]
fn build_limit_raises_the_limits() {
    let asked = demand((2048, 2048), 0.1, 50.0);
    let limit = asked.estimate().limit();
    assert!(limit > 2.0 && asked.check(0.99 * limit).is_err() && asked.check(1.01 * limit).is_ok());
    for bad in [0.0, 0.99, -1.0, f64::NAN, f64::INFINITY, 1e7] {
        assert!(matches!(asked.check(bad), Err(TableError::OutOfRange { name: "build_limit", .. })), "{bad}");
    }
    // The colour table is checked before it is built, too.
    let heights = Array2::from_shape_fn((2048, 2048), |(iy, ix)| if (ix * iy) % 7 == 0 { 50.0 } else { 0.0 });
    let options = ColourTableOptions {
        coherence_length_um: 65.0,
        model: Model::Ensemble,
        tiling: Tiling::Aperiodic,
        tolerance: 1e-3,
        resolution: 0.25,
        build_limit: 1.0,
    };
    let error = ColourTable::build(&HeightField::new(heights, 0.1, 0.1).unwrap(), &options).err();
    assert!(matches!(error, Some(ColourTableError::Table(TableError::TooMuch { .. }))), "{error:?}");
    // From the configuration to the check.
    let config = SurfaceConfig::from_json(r#"{"preset": "sinusoidal", "height": 250, "build_limit": 50}"#).unwrap();
    let demand = config.options().demand(&config.height_field().unwrap());
    assert!(demand.check(1.0).is_err() && demand.check(config.options().build_limit).is_ok());
}

#[test]
fn a_constant_offset_does_not_count_as_height() {
    let heights = |offset: f64, range: f64| {
        let rows = Array2::from_shape_fn((8, 8), |(iy, ix)| offset + range * ((3 * ix + 5 * iy) % 7) as f64 / 6.0);
        HeightField::new(rows, 0.1, 0.1).unwrap()
    };
    let config = SurfaceConfig { conserve_energy: Some(false), coherence_length: 2.0, ..Default::default() };
    config.build_of(&heights(1000.0, 0.2), &Cache::off()).unwrap();
    config.build_of(&heights(-5000.0, 0.2), &Cache::off()).unwrap();
    let error = config.build_of(&heights(0.0, 1200.0), &Cache::off()).err().unwrap().to_string();
    assert!(error.contains("the range of heights is 1200 µm") && error.contains("nm"), "{error}");
    let tiny = HeightField::new(Array2::zeros((2, 2)), 0.1, 6.5e-8).unwrap();
    let error = config.build_of(&tiny, &Cache::off()).err().unwrap().to_string();
    assert!(error.contains("`pixel_size` along y is 0.000000065 µm") && error.contains("in m?"), "{error}");
    let wide = HeightField::new(Array2::zeros((2, 2)), 2000.0, 0.1).unwrap();
    let error = config.build_of(&wide, &Cache::off()).err().unwrap().to_string();
    assert!(error.contains("`pixel_size` along x is 2000 µm"), "{error}");
}

#[test]
fn values_of_1e38_in_a_file_are_missing_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.npy");
    let mut heights = Array2::from_shape_fn((12, 10), |(iy, ix)| 0.05 * (0.7 * ix as f32).sin() + 0.01 * iy as f32);
    heights[[3, 4]] = 1e38;
    heights[[7, 2]] = -3.4e38;
    heights[[8, 8]] = f32::INFINITY;
    ndarray_npy::write_npy(&path, &heights).unwrap();
    let name = path.to_str().unwrap();
    let surface = ["--height-field", name, "--pixel-size", "0.1", "--coherence-length", "2", "--no-cache"];
    let message = refused(&[&["eval"], &surface[..]].concat());
    assert!(message.contains("3 of 120 points") && message.contains("row 3, column 4"), "{message}");
    let tables = ["height-field", "--tables", "--fill", "laplace", "--conserve-energy", "false"];
    let output = run(&[&tables, &surface[..]].concat(), "");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["filled_points"], 3);
    assert!(report["peak_to_valley_um"].as_f64().unwrap() < 0.2, "{report}");
    // A height that no relief has in µm.
    let wide =
        refused(&["eval", "--height-field", name, "--pixel-size", "0.1", "--fill", "laplace", "--max-height", "2000"]);
    assert!(wide.contains("\"max_height\""), "{wide}");
}

#[test]
fn progress_rises_to_the_end() {
    let _alone = BUILDING.lock();
    let config = SurfaceConfig::from_json(r#"{"preset": "sinusoidal", "coherence_length": 20}"#).unwrap();
    let field = config.height_field().unwrap();
    for model in [Model::Ensemble, Model::Patch] {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let listener = heard.clone();
        let progress = Progress::new(move |share| listener.lock().unwrap().push(share));
        let options = Options { model, ..config.options() };
        Surface::watched(&field, &options, &progress).unwrap();
        let heard = heard.lock().unwrap();
        assert!(heard.len() > 10 && heard.iter().all(|share| (0.0..=1.0).contains(share)), "{heard:?}");
        assert_eq!(heard.last(), Some(&1.0));
        // Threads may overtake each other by a few knots, and no step takes long.
        let mut highest: f64 = 0.0;
        for share in heard.iter() {
            assert!((*share - highest).abs() < 0.2, "{heard:?}");
            highest = highest.max(*share);
        }
    }
}
