//! The command line as users meet it: the binary is run, and what it prints is judged.

use super::service::{directions, eval, reflectance_of};
use super::support::{refused, run, run_with, succeeded};
use serde_json::{Value, json};
use std::f64::consts::PI;
use sunbeam::height_field::{FileScale, HeightField, Preset};

/// Rounding of values that are printed with 17 digits and computed twice in double precision.
const ROUNDING: f64 = 1e-12;

#[test]
fn every_subcommand_has_help() {
    for command in ["eval", "sample", "brdf-map", "height-field", "snake", "compare"] {
        let output = run(&[command, "--help"], "");
        assert_eq!(output.status.code(), Some(0), "{command}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(&format!("Usage: sunbeam {command}")), "{text}");
        if !["snake", "compare"].contains(&command) {
            for argument in ["--preset", "--height-field", "--coherence-length", "--conserve-energy", "--eta"] {
                assert!(text.contains(argument), "{command} does not mention {argument}");
            }
        }
    }
    assert_eq!(run(&["--version"], "").status.code(), Some(0));
}

#[test]
fn tables_are_kept_unless_it_is_told_not_to() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("tables").to_string_lossy().into_owned();
    let command = ["height-field", "--preset", "blazed", "--coherence-length", "8", "--tables", "--model", "patch"];
    let origin = |variables: &[(&str, &str)], more: &[&str]| {
        let output = run_with(variables, &[&command[..], more].concat(), "");
        let report: Value = serde_json::from_str(&succeeded(output)).unwrap();
        report["tables"]["origin"].as_str().unwrap().to_owned()
    };
    let here = ("SUNBEAM_CACHE_DIR", place.as_str());
    assert_eq!(origin(&[here], &["--no-cache"]), "built");
    assert_eq!(origin(&[here, ("SUNBEAM_CACHE", "off")], &[]), "built");
    assert!(!folder.path().join("tables").exists());
    assert_eq!(origin(&[here], &[]), "built, kept in the cache");
    assert_eq!(origin(&[here], &[]), "read from the cache");
    assert_eq!(origin(&[here], &["--no-cache"]), "built");
    assert!(origin(&[here, ("SUNBEAM_CACHE_LIMIT_MB", "0")], &["--period", "2"]).contains("not kept"));
    let output = run_with(&[("SUNBEAM_CACHE_LIMIT_MB", "lots")], &command, "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("SUNBEAM_CACHE_LIMIT_MB") && message.contains("lots"), "{message}");
}

#[test]
fn wrong_arguments_end_with_status_2_and_one_line_that_names_them() {
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["subcommand"]),
        (&["paint"], &["paint"]),
        (&["eval", "--preset", "cobra"], &["cobra", "--preset", "elaphe"]),
        (&["eval", "--model", "wavelet"], &["wavelet", "ensemble", "patch"]),
        (&["eval", "--colour", "red"], &["--colour"]),
        (&["eval", "--preset", "blazed", "--period", "-1"], &["\"period\"", "-1", "(0, 1e3]"]),
        (&["eval", "--period", "2"], &["\"period\"", "elaphe"]),
        (&["eval", "--preset", "blazed", "--height", "NaN"], &["\"height\"", "NaN"]),
        (&["eval", "--preset", "cd", "--height-field", "a.gsf"], &["\"preset\"", "\"filename\""]),
        (&["eval", "--height-field", "no/such.gsf"], &["no/such.gsf"]),
        (&["eval", "--tolerance", "1"], &["\"tolerance\"", "1e-6"]),
        (&["eval", "--conserve-energy", "maybe"], &["maybe", "--conserve-energy"]),
        (&["eval", "--k", "3"], &["\"k\"", "\"eta\""]),
        (&["eval", "--eta", "-1"], &["\"eta\"", "-1"]),
        (&["brdf-map", "--method", "magic", "-o", "a.exr"], &["magic", "exact, table, flss, nmm, pq, stam"]),
        (&["brdf-map", "--preset", "flat"], &["--output"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--theta-i", "90"], &["theta-i", "90"]),
        (&["brdf-map", "--preset", "flat", "-o", "no/such/a.exr", "--size", "1"], &["no/such/a.exr"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--lambda-step", "0"], &["lambda-step"]),
        (&["height-field", "--preset", "flat", "-o", "a.jpg"], &["a.jpg", ".gsf"]),
        (&["height-field", "--preset", "flat", "--term", "0", "-o", "a.png"], &["--term", "0 is not in 1..=256"]),
        (&["height-field", "--preset", "flat", "--term", "257", "-o", "a.png"], &["--term", "257 is not in 1..=256"]),
        (&["height-field", "--preset", "flat", "--term", "3", "-o", "a.gsf"], &["a.gsf", ".png or .npy"]),
        (&["height-field", "--preset", "flat", "--term", "3"], &["--output"]),
        (&["height-field", "--preset", "flat", "--crop", "1,2"], &["--crop", "X,Y,WIDTH,HEIGHT"]),
        (&["height-field", "--preset", "cd", "--crop", "-1,0,1,1"], &["(-1, 0) µm", "does not lie within"]),
        (&["height-field", "--preset", "cd", "--make-tileable=1e3"], &["blend of 1000 µm", "a third"]),
        (&["eval", "--preset", "cd", "--fill", "laplace"], &["\"fill\"", "\"filename\""]),
        (&["eval", "--channel", "Height"], &["\"channel\"", "\"filename\""]),
        (&["snake", "-o", "a.ply", "--resolution", "0"], &["resolution"]),
        (&["snake", "-o", "no/such/a.ply"], &["no/such/a.ply"]),
    ];
    for (arguments, mentioned) in cases {
        let message = refused(arguments);
        assert!(mentioned.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
}

#[test]
fn a_bad_line_is_refused_in_its_place() {
    let good = r#"{"wi":[0,0,1],"wo":[0,0.6,0.8],"wavelength":550}"#;
    let bad = [
        ("not json", "not JSON"),
        ("", "empty"),
        (r#"{"wi":[0,0,1],"wavelength":550}"#, "wo"),
        (r#"{"wi":[0,0],"wo":[0,0,1],"wavelength":550}"#, "2 components"),
        (r#"{"wi":[0,0,0],"wo":[0,0,1],"wavelength":550}"#, "zero vector"),
        (r#"{"wi":[0,0,1.01],"wo":[0,0,1],"wavelength":550}"#, "length"),
        (r#"{"wi":[0,0,1e999],"wo":[0,0,1],"wavelength":550}"#, "out of range"),
        (r#"{"wi":[0,0,NaN],"wo":[0,0,1],"wavelength":550}"#, "not JSON"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":0}"#, "wavelength"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":359}"#, "[360, 830]"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":[500,900]}"#, "900"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":[]}"#, "empty array"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":"red"}"#, "a number or an array"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":550,"u":1}"#, "unknown field"),
    ];
    let lines: Vec<&str> = bad.iter().flat_map(|(line, _)| [good, *line]).collect();
    let answers = eval(&["--preset", "sinusoidal"], &lines);
    assert_eq!(answers.len(), lines.len());
    for (pair, (line, reason)) in answers.chunks(2).zip(bad) {
        assert_eq!(pair[0], answers[0]);
        assert!(pair[0]["f"].as_f64().unwrap() >= 0.0);
        assert!(pair[1]["error"].as_str().unwrap_or_else(|| panic!("{line}: {}", pair[1])).contains(reason), "{line}");
    }
    // Bytes that are not text, and a last line without its end.
    let output = succeeded(run(&["eval", "--preset", "flat"], b"\xff\xfe\n{\"wi\":[0,0,1]" as &[u8]));
    assert_eq!(output.lines().filter(|line| line.contains("error")).count(), 2, "{output}");
    // The direct sum answers beyond the tables, whose sampler does not serve there.
    let line = r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":1000}"#;
    let answer = &eval(&["--preset", "flat", "--method", "exact"], &[line])[0];
    assert!(answer["f"].as_f64().unwrap() > 0.0 && answer["pdf"].is_null(), "{answer}");
    // 0.9998 is unit length as printed numbers go.
    let line = r#"{"wi":[0,0,0.9998],"wo":[0,0,1],"wavelength":550}"#;
    let exact = r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":550}"#;
    let answers = eval(&["--preset", "flat"], &[line, exact]);
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn answers_keep_the_order_of_many_lines() {
    // More than one read's worth; each wavelength has its own value at the mirror direction of a plane.
    let count = 20_000;
    let nm = |i: usize| 400.0 + 300.0 * i as f64 / count as f64;
    let lines: Vec<String> =
        (0..count).map(|i| json!({"wi": [0, 0, 1], "wo": [0, 0, 1], "wavelength": nm(i)}).to_string()).collect();
    let answers = eval(&["--preset", "flat"], &lines);
    assert_eq!(answers.len(), count);
    // Ensemble kernel at its peak, 4πs²/λ² with s = 16.25 µm.
    for (i, answer) in answers.iter().enumerate() {
        let expected = 4.0 * PI * (16.25 / (nm(i) * 1e-3)).powi(2);
        let found = answer["f"].as_f64().unwrap();
        // Tables are single precision.
        assert!((found / expected - 1.0).abs() < 1e-3, "{i}: {found}, {expected}");
    }
}

#[test]
fn an_array_of_wavelengths_is_answered_by_an_array_and_the_mean_density() {
    let line =
        |nm: Value| json!({"wi": [0.6, 0, 0.8], "wo": [-0.5, 0.1, 0.74f64.sqrt()], "wavelength": nm}).to_string();
    let lines = [line(json!(450.0)), line(json!(610.0)), line(json!([450.0, 610.0])), line(json!([450.0]))];
    let answers = eval(&["--preset", "blazed", "--coherence-length", "5", "--conserve-energy", "false"], &lines);
    assert_eq!(answers[2]["f"], json!([answers[0]["f"], answers[1]["f"]]));
    assert_eq!(answers[3]["f"], json!([answers[0]["f"]]));
    let mean = 0.5 * (answers[0]["pdf"].as_f64().unwrap() + answers[1]["pdf"].as_f64().unwrap());
    assert!((answers[2]["pdf"].as_f64().unwrap() / mean - 1.0).abs() < ROUNDING);
}

#[test]
fn swapping_the_directions_changes_nothing() {
    let pairs: Vec<_> = directions(200).zip(directions(400).skip(200)).collect();
    let line = |a: &[f64; 3], b: &[f64; 3]| json!({"wi": a, "wo": b, "wavelength": 520}).to_string();
    let forth: Vec<_> = pairs.iter().map(|(a, b)| line(a, b)).collect();
    let back: Vec<_> = pairs.iter().map(|(a, b)| line(b, a)).collect();
    for extra in [
        &["--eta", "0.2", "--k", "3"][..],
        &["--eta", "1.56"],
        &["--obliquity", "small_slope"],
        &["--model", "patch", "--shadowing"],
        &["--method", "exact"],
    ] {
        let arguments = [&["--preset", "blazed", "--coherence-length", "30"], extra].concat();
        for (a, b) in eval(&arguments, &forth).iter().zip(eval(&arguments, &back)) {
            let (a, b) = (a["f"].as_f64().unwrap(), b["f"].as_f64().unwrap());
            assert!((a - b).abs() <= ROUNDING * a.max(b), "{arguments:?}: {a} {b}");
        }
    }
}

#[test]
fn fresnel_reflectance_multiplies_the_value_and_not_the_density() {
    let line = [r#"{"wi":[0.6,0,0.8],"wo":[-0.6,0,0.8],"wavelength":550}"#];
    let bare = &eval(&["--preset", "flat"], &line)[0];
    let metal = &eval(&["--preset", "flat", "--eta", "0.2", "--k", "3"], &line)[0];
    let index = sunbeam::scattering::ComplexIndex { eta: 0.2, k: 3.0 };
    // At the mirror direction the half vector is the normal.
    let expected = sunbeam::scattering::fresnel_unpolarised(0.8, index) * bare["f"].as_f64().unwrap();
    assert!((metal["f"].as_f64().unwrap() / expected - 1.0).abs() < ROUNDING);
    assert_eq!(metal["pdf"], bare["pdf"]);
}

#[test]
fn samples_agree_with_eval() {
    let arguments = ["--preset", "blazed", "--coherence-length", "8", "--conserve-energy", "false", "--eta", "1.5"];
    let queries: Vec<Value> = directions(300)
        .zip(directions(600).skip(300))
        .enumerate()
        .map(|(i, (wi, r))| {
            let u = [r[0] * 0.499 + 0.5, r[1] * 0.499 + 0.5, r[2] * 0.999];
            json!({"wi": wi, "wavelength": if i % 2 == 0 { json!([450.0, 600.0]) } else { json!(550.0) }, "u": u})
        })
        .collect();
    let input: Vec<String> = queries.iter().map(Value::to_string).collect();
    let output = succeeded(run(&[&["sample"], &arguments[..]].concat(), input.join("\n")));
    let samples: Vec<Value> = output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(samples.len(), queries.len());
    let (mut kept, mut back) = (Vec::new(), Vec::new());
    for (query, sample) in queries.iter().zip(&samples) {
        if sample["wo"].is_null() {
            assert_eq!(sample["pdf"], json!(0.0));
            let zero = if query["wavelength"].is_array() { json!([0.0, 0.0]) } else { json!(0.0) };
            assert_eq!(sample["weight"], zero);
        } else {
            back.push(json!({"wi": query["wi"], "wo": sample["wo"], "wavelength": query["wavelength"]}).to_string());
            kept.push(sample);
        }
    }
    assert!(kept.len() > queries.len() / 2 && kept.len() < queries.len(), "{}", kept.len());
    for (sample, answer) in kept.iter().zip(eval(&arguments, &back)) {
        let (pdf, cos) = (sample["pdf"].as_f64().unwrap(), sample["wo"][2].as_f64().unwrap());
        // Normalising wo again moves it by a rounding, and the kernel's slope makes more of that.
        assert!((answer["pdf"].as_f64().unwrap() / pdf - 1.0).abs() < 1e-9, "{sample} {answer}");
        let list = |v: &Value| v.as_array().cloned().unwrap_or_else(|| vec![v.clone()]);
        for (weight, f) in list(&sample["weight"]).iter().zip(list(&answer["f"])) {
            let (weight, expected) = (weight.as_f64().unwrap(), f.as_f64().unwrap() * cos / pdf);
            assert!((weight - expected).abs() <= 1e-9 * expected.max(1e-3), "{sample} {answer}");
        }
    }
    let bad = [
        (json!({"wi": [0, 0, 1], "wavelength": 500, "u": [0.5, 1, 0.5]}), "[0, 1)"),
        (json!({"wi": [0, 0, 1], "wavelength": 300, "u": [0.5, 0.5, 0.5]}), "300"),
        (json!({"wi": [0, 0, 1], "wavelength": 500, "u": [0.5, 0.5]}), "2 components"),
    ];
    for (query, reason) in bad {
        let output = succeeded(run(&["sample", "--preset", "flat"], query.to_string()));
        assert!(output.contains("error") && output.contains(reason), "{output}");
    }
}

#[test]
fn a_height_field_written_is_the_one_read() {
    let folder = tempfile::tempdir().unwrap();
    let original = Preset::Blazed.build(Some(2.0), Some(0.3)).unwrap();
    for (name, tolerance_um) in [("f.exr", 1e-7), ("f.gsf", 1e-7), ("f.png", 0.3 / 65535.0)] {
        let path = folder.path().join(name);
        let path = path.to_str().unwrap();
        let arguments = ["height-field", "--preset", "blazed", "--period", "2", "--height", "0.3", "-o", path];
        let report: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
        assert_eq!(report["pixels"], json!([1024, 1]));
        assert_eq!(report["extent_um"], json!([2.0, 2.0]));
        assert!((report["periods"]["x"]["period_um"].as_f64().unwrap() - 2.0).abs() < ROUNDING);
        let read = HeightField::read(path, &FileScale::default()).unwrap();
        let difference = |a: f64, b: f64| (a - original.range_um().0 - (b - read.range_um().0)).abs();
        assert!(original.heights_um().iter().zip(read.heights_um()).all(|(&a, &b)| difference(a, b) <= tolerance_um));
        let arguments = ["height-field", "--height-field", path, "--level", "none", "--tiling", "periodic"];
        let again: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
        for key in ["peak_to_valley_um", "rms_um"] {
            let (a, b) = (report[key].as_f64().unwrap(), again[key].as_f64().unwrap());
            assert!((a - b).abs() <= 2.0 * tolerance_um, "{name}: {key} {a} {b}");
        }
        assert_eq!(again["chebyshev_terms"], report["chebyshev_terms"]);
    }
}

#[test]
fn a_term_is_the_transform_of_a_power_with_order_0_in_the_middle() {
    // cos³φ = 3/4 cos φ + 1/4 cos 3φ, half of each in either direction of the wave; 0.25 µm drops out of h/H.
    const AT_ONE: f64 = 3.0 / 8.0;
    const AT_THREE: f64 = 1.0 / 8.0;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    // One even and one odd side: the middle lies at half the side, rounded down.
    let (nx, ny) = (16, 15);
    let wave =
        |(iy, ix): (usize, usize)| 0.25 * (2.0 * PI * (ix as f64 / nx as f64 + 2.0 * iy as f64 / ny as f64)).cos();
    ndarray_npy::write_npy(path("wave.npy"), &ndarray::Array2::from_shape_fn((ny, nx), wave)).unwrap();
    let surface = ["height-field", "--height-field", &path("wave.npy"), "--pixel-size", "0.1", "--level", "none"];
    let term = |output: &str| {
        let report = succeeded(run(&[&surface[..], &["--term", "3", "-o", output]].concat(), ""));
        serde_json::from_str::<Value>(&report).unwrap()["term"].take()
    };
    let report = term(&path("term.npy"));
    assert_eq!(report["n"], json!(3));
    // Row 0 of the wave has its crest and its trough.
    assert!((report["half_range_um"].as_f64().unwrap() - 0.25).abs() < ROUNDING, "{report}");
    let magnitudes: ndarray::Array2<f64> = ndarray_npy::read_npy(path("term.npy")).unwrap();
    assert_eq!(magnitudes.dim(), (ny, nx));
    let expected = |iy: usize, ix: usize| match (iy as i32 - 7, ix as i32 - 8) {
        (2, 1) | (-2, -1) => AT_ONE,
        (6, 3) | (-6, -3) => AT_THREE,
        _ => 0.0,
    };
    for ((iy, ix), &found) in magnitudes.indexed_iter() {
        assert!((found - expected(iy, ix)).abs() < ROUNDING, "row {iy}, column {ix}: {found}");
    }
    term(&path("term.png"));
    let ((width, height), pixels) = grey_picture(&path("term.png"));
    assert_eq!((width, height), (nx, ny));
    for (row, greys) in pixels.chunks(width).enumerate() {
        for (ix, &grey) in greys.iter().enumerate() {
            // The first row is the highest order along y; five decades are 255 steps.
            let magnitude = expected(ny - 1 - row, ix);
            let shown = if magnitude > 0.0 { 255.0 + 51.0 * (magnitude / AT_ONE).log10() } else { 0.0 };
            assert_eq!(grey, shown.round() as u8, "row {row}, column {ix}");
        }
    }
}

/// Width, height and pixels of a grey PNG.
fn grey_picture(path: &str) -> ((usize, usize), Vec<u8>) {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(info.color_type, png::ColorType::Grayscale);
    ((info.width as usize, info.height as usize), pixels)
}

#[test]
fn a_height_field_shows_its_preview_and_its_tables() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("preview.png");
    let arguments = ["height-field", "--preset", "blazed", "--tables", "--preview", path.to_str().unwrap()];
    let report: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
    let tables = &report["tables"];
    assert!(tables["bytes"].as_u64().unwrap() > 0 && tables["build_seconds"].as_f64().unwrap() > 0.0);
    assert!(tables["table"]["relative_error"].as_f64().unwrap() <= 1e-3, "{tables}");
    // The estimate knows nothing of refinement, which closes knots to 0.4 of their spacing at most.
    let built = tables["table"]["bytes"].as_f64().unwrap();
    let estimate = report["table_bytes_estimate"].as_f64().unwrap();
    assert!((0.4 * built..=built).contains(&estimate), "{estimate} for {built}");
    assert!(tables["energy"]["albedo_mean_scaled"].as_f64().unwrap() <= 1.001, "{tables}");
    let (size, pixels) = grey_picture(path.to_str().unwrap());
    assert_eq!(size, (512, 512));
    // The sawtooth rises to the right.
    assert!(pixels[..512].is_sorted() && pixels[0] == 0 && pixels[511] >= 254, "{:?}", &pixels[..512]);
}

#[test]
fn the_snake_has_the_counts_it_reports() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, pigment) = (folder.path().join("snake.ply"), folder.path().join("pigment.png"));
    let arguments = ["snake", "-o", mesh.to_str().unwrap(), "--pigment", pigment.to_str().unwrap()];
    let report: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
    assert_eq!((&report["vertices"], &report["faces"]), (&json!(10_933), &json!(21_573)));
    let header = |path: &std::path::Path| String::from_utf8_lossy(&std::fs::read(path).unwrap()[..600]).into_owned();
    assert!(header(&mesh).contains("element vertex 10933\n") && header(&mesh).contains("element face 21573\n"));
    assert!(std::fs::metadata(&pigment).unwrap().len() > 1000);
    let arguments = ["snake", "-o", mesh.to_str().unwrap(), "--resolution", "0.5"];
    let report: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
    let vertices = report["vertices"].as_u64().unwrap();
    // Four cells along each edge of a scale, for six.
    assert!((5200..5400).contains(&vertices) && header(&mesh).contains(&format!("element vertex {vertices}\n")));
}

#[test]
fn a_blaze_lit_along_the_normal_is_bright_on_the_left() {
    // A facet that rises along +x by tanα = 0.25/2.5 mirrors the normal to wo.x = −sin 2α = −0.198 (docs/model.md#the-phase-screen); the
    // orders lie at multiples of λ/2.5 µm, so the middle of the visible, 500 nm in the first order, is right there.
    let expected = -(2.0 * 0.1f64.atan()).sin();
    let folder = tempfile::tempdir().unwrap();
    let (map, picture) = (folder.path().join("map.exr"), folder.path().join("map.png"));
    let size = 61;
    for method in ["table", "exact", "flss", "pq", "nmm"] {
        // nmm takes its wavelengths by the direction.
        let own: &[&str] = if method == "nmm" { &["--weighted"] } else { &["--lambda-step", "20"] };
        let (map, picture) = (map.to_str().unwrap(), picture.to_str().unwrap());
        let arguments = ["brdf-map", "--preset", "blazed", "--coherence-length", "20", "-o", map, "--png", picture];
        let rest = [&["--size", "61", "--method", method], own].concat();
        let report: Value = serde_json::from_str(&succeeded(run(&[&arguments[..], &rest].concat(), ""))).unwrap();
        assert_eq!(report["method"], json!(method));
        assert_eq!(report["wavelengths"], if method == "nmm" { Value::Null } else { json!(21) });
        let image = read_exr(map);
        assert_eq!(image.len(), size * size);
        let place = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
        let (mut sum, mut moment) = (0.0, 0.0);
        let mut brightest = (0.0, 0.0, 0.0);
        for (index, rgb) in image.iter().enumerate() {
            let (x, y) = (place(index % size), -place(index / size));
            assert!(rgb.iter().all(|value| value.is_finite()));
            if x * x + y * y >= 1.0 {
                assert_eq!(*rgb, [0.0; 3], "outside the disc at {x}, {y}");
            }
            let green = rgb[1] as f64;
            sum += green;
            moment += green * x;
            if green > brightest.2 {
                brightest = (x, y, green);
            }
        }
        assert!((brightest.0 - expected).abs() < 0.04 && brightest.1.abs() < 0.03, "{method}: {brightest:?}");
        assert!(moment / sum < -0.1, "{method}: centroid at {}", moment / sum);
        let mirrored = image[(size / 2) * size + (size - 1 - (brightest.0 * 30.5 + 30.0).round() as usize)];
        assert!((mirrored[1] as f64) < 0.1 * brightest.2, "{method}: {mirrored:?} {brightest:?}");
    }
}

#[test]
fn a_map_has_y_upwards() {
    // Light from azimuth 90° (+y) is mirrored to −y: the lower half of the picture.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.exr");
    let path = path.to_str().unwrap();
    let arguments = ["brdf-map", "--preset", "flat", "--coherence-length", "9", "--theta-i", "30", "--phi-i", "90"];
    succeeded(run(&[&arguments[..], &["--size", "40", "-o", path]].concat(), ""));
    let image = read_exr(path);
    let brightest = (0..image.len()).max_by(|&a, &b| image[a][1].total_cmp(&image[b][1])).unwrap();
    let (column, row) = (brightest % 40, brightest / 40);
    assert!((19..=20).contains(&column) && (29..=30).contains(&row), "column {column}, row {row}");
}

/// Pixels from the top row on.
fn read_exr(path: &str) -> Vec<[f32; 3]> {
    use exr::prelude::*;
    let create = |size: Vec2<usize>, _: &RgbaChannels| (size.width(), vec![[0.0f32; 3]; size.area()]);
    let set = |(width, pixels): &mut (usize, Vec<[f32; 3]>), at: Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        pixels[at.y() * *width + at.x()] = [r, g, b];
    };
    let image = read_first_rgba_layer_from_file(path, create, set).unwrap();
    image.layer_data.channel_data.pixels.1
}

/// How tables and direct sums are compared, and on what.
mod table_against_exact {
    use super::*;

    /// Relative error asked of the tables; what they report is its 99th percentile, so twice it is allowed here.
    const TOLERANCE: f64 = 1e-3;

    fn agree(surface: &[&str], count: usize) {
        let wavelengths = [380.0, 460.0, 550.0, 680.0, 780.0];
        let pairs: Vec<_> = directions(count).zip(directions(2 * count).skip(count)).collect();
        let lines: Vec<String> = pairs
            .iter()
            .enumerate()
            .map(|(i, (wi, wo))| json!({"wi": wi, "wo": wo, "wavelength": wavelengths[i % 5]}).to_string())
            .collect();
        let tolerance = TOLERANCE.to_string();
        let arguments = [surface, &["--tolerance", &tolerance]].concat();
        let built = crate::service::surface(&arguments);
        let table = eval(&[&arguments[..], &["--method", "table"]].concat(), &lines);
        let exact = eval(&[&arguments[..], &["--method", "exact"]].concat(), &lines);
        let mut lit = 0;
        for (i, ((wi, wo), (t, e))) in pairs.iter().zip(table.iter().zip(&exact)).enumerate() {
            assert_eq!(t["pdf"], e["pdf"], "one sampler serves both");
            let (f_table, f_exact) = (t["f"].as_f64().unwrap(), e["f"].as_f64().unwrap());
            let (_, mean) = crate::common::table_density(&built, *wi, *wo, wavelengths[i % 5]);
            let scale = reflectance_of(mean, *wi, *wo, wavelengths[i % 5]);
            let allowed = 2.0 * TOLERANCE * f_exact.max(scale);
            assert!((f_table - f_exact).abs() <= allowed, "{surface:?} {}: {f_table} {f_exact} {scale}", lines[i]);
            lit += usize::from(f_exact > scale);
        }
        println!("{surface:?}: {lit} of {count} pairs brighter than the scale of errors");
    }

    #[test]
    fn small_presets() {
        for preset in ["flat", "blazed", "sinusoidal", "lamellar"] {
            agree(&["--preset", preset], 300);
            // A short window lights most pairs; the scaling, which both methods share, is slow to find for it.
            agree(&["--preset", preset, "--shadowing", "--conserve-energy", "false", "--coherence-length", "3"], 300);
        }
        agree(&["--preset", "blazed", "--model", "patch", "--coherence-length", "8", "--obliquity", "unit"], 300);
    }

    #[test]
    fn large_presets() {
        for preset in ["cd", "elaphe", "xenopeltis"] {
            agree(&["--preset", preset], 3);
        }
    }

    #[test]
    fn measured_scans() {
        for file in ["afm/elaphe.gsf", "afm/xenopeltis.gsf"] {
            let Some(path) = sunbeam_testing::data(file) else { return };
            agree(&["--height-field", path.to_str().unwrap()], 40);
            agree(&["--height-field", path.to_str().unwrap(), "--model", "patch"], 40);
        }
    }
}

#[cfg(unix)]
#[test]
fn view_goes_on_as_the_window_that_lies_beside() {
    use std::os::unix::fs::PermissionsExt;
    use std::{fs, process::Command};
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("sunbeam");
    fs::copy(env!("CARGO_BIN_EXE_sunbeam"), &alone).unwrap();
    let view = |arguments: &[&str]| Command::new(&alone).arg("view").args(arguments).output().unwrap();

    let missing = view(&["--preset", "blazed"]);
    let message = String::from_utf8(missing.stderr).unwrap();
    assert_eq!((missing.status.code(), message.lines().count()), (Some(2), 1), "{message}");
    assert!(message.contains("sunbeam-view is missing") && message.contains("make tool"), "{message}");

    let window = folder.path().join("sunbeam-view");
    fs::write(&window, "#!/bin/sh\necho \"$@\"\nexit 3\n").unwrap();
    fs::set_permissions(&window, fs::Permissions::from_mode(0o755)).unwrap();
    let found = view(&["--preset", "blazed", "--help"]);
    assert_eq!((found.status.code(), &*found.stdout), (Some(3), b"--preset blazed --help\n".as_slice()));
}
