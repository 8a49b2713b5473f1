//! `sunbeam height-field` and `sunbeam snake`: reports and files.

use super::support::{run, succeeded};
use serde_json::{Value, json};
use std::f64::consts::PI;
use sunbeam::height_field::{FileScale, HeightField, Preset};

/// Relative rounding of values that are computed twice in double precision and printed with 17 digits.
const ROUNDING: f64 = 1e-12;

#[test]
fn written_height_fields_read_back() {
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
fn a_term_is_the_transform_of_a_power() {
    // cos³φ = 3/4 cos φ + 1/4 cos 3φ, with half of each amplitude in orders ±1 and ±3. The height cancels in h/H.
    const AT_ONE: f64 = 3.0 / 8.0;
    const AT_THREE: f64 = 1.0 / 8.0;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    // One even and one odd side: order 0 is at half the side, rounded down.
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
    // Row 0 contains the crest and the trough of the wave.
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
            // The first row is the highest order along y. Five decades are 255 steps.
            let magnitude = expected(ny - 1 - row, ix);
            let shown = if magnitude > 0.0 { 255.0 + 51.0 * (magnitude / AT_ONE).log10() } else { 0.0 };
            assert_eq!(grey, shown.round() as u8, "row {row}, column {ix}");
        }
    }
}

#[test]
fn previews_and_tables_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("preview.png");
    let arguments = ["height-field", "--preset", "blazed", "--tables", "--preview", path.to_str().unwrap()];
    let report: Value = serde_json::from_str(&succeeded(run(&arguments, ""))).unwrap();
    let tables = &report["tables"];
    assert!(tables["bytes"].as_u64().unwrap() > 0 && tables["build_seconds"].as_f64().unwrap() > 0.0);
    assert!(tables["table"]["relative_error"].as_f64().unwrap() <= 1e-3, "{tables}");
    // The estimate ignores refinement, which narrows knots to 0.4 of their spacing at most.
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
fn the_mesh_has_the_reported_counts() {
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
    // Four cells along each edge of a scale in place of six.
    assert!((5200..5400).contains(&vertices) && header(&mesh).contains(&format!("element vertex {vertices}\n")));
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
