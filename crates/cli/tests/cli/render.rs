//! `sunbeam render` and `sunbeam brdf-map --backend gpu`: pictures, and agreement with the CPU.

use super::gpu_support::gpu;
use super::support::{refused, run, succeeded};
use ndarray::{Array3, s};
use serde_json::Value;
use std::path::Path;

/// Rounding of both sides' single precision, relative to the value or to a thousandth of the map's mean; the same
/// tolerance as in the tests of the realtime renderer.
const MAP_TOLERANCE: f32 = 1e-3;
/// Difference relative to the map's peak for a grating by Maxwell's equations; orders close to the horizon dominate it.
const GRATING_TOLERANCE: f32 = 4e-3;
/// The arguments of a grating in aluminium whose orders are wide enough for a coarse map.
const GRATING: [&str; 15] = [
    "--preset",
    "sinusoidal",
    "--period",
    "0.7",
    "--height",
    "0.1",
    "--theory",
    "rigorous",
    "--coherence-length",
    "8",
    "--eta",
    "1.0",
    "--k",
    "6.9",
    "--theta-i=35",
];

/// The linear sRGB of an EXR file, (height, width, 3).
fn exr(path: &Path) -> Array3<f32> {
    use exr::prelude::*;
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| Array3::zeros((size.height(), size.width(), 3)),
        |pixels: &mut Array3<f32>, at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels.slice_mut(s![at.y(), at.x(), ..]).assign(&ndarray::arr1(&[r, g, b]));
        },
    );
    image.unwrap().layer_data.channel_data.pixels
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&succeeded(run(arguments, ""))).unwrap()
}

#[test]
fn render_writes_a_picture_its_png_and_its_directions() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (picture, png, pairs) = (path("a.exr"), path("a.png"), path("a.npy"));
    let common = ["render", "--method", "stam", "--preset", "blazed", "--size", "48x32", "--resolution", "1"];
    let own = ["-o", &picture, "--png", &png, "--pairs", &pairs, "--rotation", "-90", "--light-from", "-1,-0.6,0.9"];
    let report = json(&[&common[..], &own].concat());
    assert!(report["gpu_ms"].as_f64().unwrap() > 0.0 && report["gpu_stages_ms"]["locate"].as_f64().unwrap() > 0.0);
    assert!(!report["adapter"].as_str().unwrap().is_empty());
    assert_eq!(report["method"], "stam");
    let pixels = exr(Path::new(&picture));
    assert_eq!(pixels.dim(), (32, 48, 3));
    assert!(pixels.iter().all(|value| value.is_finite()) && pixels.iter().sum::<f32>() > 0.0);
    assert!(std::fs::read(&png).unwrap().starts_with(b"\x89PNG"));

    let pairs: Array3<f32> = ndarray_npy::read_npy(&pairs).unwrap();
    assert_eq!(pairs.dim(), (32, 48, 8));
    let lit = pairs.slice(s![.., .., 6]).sum();
    assert_eq!(f64::from(lit), report["answered"].as_f64().unwrap());
    for pixel in pairs.lanes(ndarray::Axis(2)) {
        let length = |from: usize| (from..from + 3).map(|i| pixel[i] * pixel[i]).sum::<f32>();
        let on_the_mesh = pixel.iter().any(|value| *value != 0.0);
        let expected = if on_the_mesh { 1.0 } else { 0.0 };
        assert!((length(0) - expected).abs() < 1e-5 && (length(3) - expected).abs() < 1e-5, "{pixel}");
        assert!(pixel[7] == pixel[2] && pixel.iter().all(|value| value.is_finite()));
    }

    // Without ground and pigment, pixels beside the snake are black. The mesh comes from a file.
    let (bare, ply) = (path("b.exr"), path("snake.ply"));
    json(&["snake", "-o", &ply]);
    let common = ["render", "--method", "stam", "--preset", "blazed", "--size", "48x32", "--mesh", &ply];
    let own = ["-o", &bare, "--ground", "false", "--blend", "none", "--supersample", "2"];
    json(&[&common[..], &own].concat());
    assert!(exr(Path::new(&bare)).iter().filter(|value| **value == 0.0).count() > 1000);
}

/// Light from below passes a film, but no other surface.
#[test]
fn a_film_transmits_and_what_it_excludes_is_refused() {
    let film = ["--preset", "blazed", "--coherence-length", "10", "--eta", "1.5", "--transmission", "film"];
    for (own, named) in [
        (&["render", "--method", "flss", "-o", "a.exr"][..], "the method table knows it"),
        (&["render", "--method", "table", "--blend", "mix", "-o", "a.exr"], "--transmission none"),
        (&["brdf-map", "--backend", "gpu", "--method", "table", "-o", "a.exr"], "reflected light"),
    ] {
        let message = refused(&[own, &film].concat());
        assert!(message.contains(named) && message.contains("transmission"), "{message}");
    }
    let interface = [&["render", "--method", "table", "-o", "a.exr"], &film[..7], &["interface"]].concat();
    assert!(refused(&interface).contains("transmission = interface, only none and film"));

    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (through, opaque) = (path("film.exr"), path("opaque.exr"));
    let common = ["render", "--method", "table", "--shape", "flat", "--size", "48x32", "--light-from", "0.1,0.5,-0.8"];
    json(&[&common[..], &film, &["-o", &through]].concat());
    json(&[&common[..], &film[..6], &["-o", &opaque]].concat());
    let (through, opaque) = (exr(Path::new(&through)), exr(Path::new(&opaque)));
    assert!(opaque.iter().all(|value| *value == 0.0));
    let bright = through.iter().filter(|value| **value > 0.01).count();
    assert!(through.iter().all(|value| value.is_finite()) && bright > 100, "{bright}");
}

#[test]
fn maps_of_both_backends_match() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cpu, gpu) = (path("cpu.exr"), path("gpu.exr"));
    for (method, preset) in [("flss", "elaphe"), ("nmm", "blazed"), ("pq", "blazed"), ("stam", "elaphe")] {
        let common = ["brdf-map", "--method", method, "--preset", preset, "--size", "48", "--theta-i", "35"];
        let optics = ["--eta", "1.56", "--shadowing", "--phi-i", "20"];
        json(&[&common[..], &optics, &["-o", &cpu]].concat());
        let report = json(&[&common[..], &optics, &["-o", &gpu, "--backend", "gpu"]].concat());
        assert!(report["gpu_ms"].as_f64().unwrap() > 0.0);
        let (a, b) = (exr(Path::new(&gpu)), exr(Path::new(&cpu)));
        let floor = 1e-3 * b.iter().map(|value| value.abs()).sum::<f32>() / b.len() as f32;
        assert!(floor > 0.0, "{method}: the map is black");
        let error = |(a, b): (&f32, &f32)| (a - b).abs() / (b.abs() + floor);
        let worst = |b: &Array3<f32>| a.iter().zip(b).map(error).fold(0.0, f32::max);
        assert!(worst(&b) < MAP_TOLERANCE, "{method}: {}", worst(&b));
        // Negative control: the map upside down.
        assert!(worst(&b.slice(s![..;-1, .., ..]).to_owned()) > MAP_TOLERANCE, "{method}");
    }
}

#[test]
fn a_rigorous_grating_matches_on_both_backends() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cpu, gpu, picture) = (path("cpu.exr"), path("gpu.exr"), path("a.exr"));
    let common = [&["brdf-map", "--size", "64", "--phi-i", "20"], &GRATING[..]].concat();
    json(&[&common[..], &["--method", "colour-table", "-o", &cpu]].concat());
    json(&[&common[..], &["--method", "table", "--backend", "gpu", "-o", &gpu]].concat());
    let (a, b) = (exr(Path::new(&gpu)), exr(Path::new(&cpu)));
    let peak = b.iter().fold(0.0, |most: f32, value| most.max(value.abs()));
    let worst = |b: &Array3<f32>| a.iter().zip(b).map(|(a, b)| (a - b).abs() / peak).fold(0.0, f32::max);
    assert!(peak > 0.0 && worst(&b) < GRATING_TOLERANCE, "{} of {peak}", worst(&b));
    assert!(worst(&b.slice(s![..;-1, .., ..]).to_owned()) > GRATING_TOLERANCE);
    let own = ["render", "-o", &picture, "--size", "48x32", "--resolution", "1"];
    let report = json(&[&own[..], &GRATING[..14]].concat());
    assert_eq!(report["method"], "table");
    assert!(exr(Path::new(&picture)).iter().all(|value| value.is_finite()));
}

#[test]
fn colours_of_gpu_gems_have_no_factor() {
    // The highlight covers all directions, and the spacing is too narrow for any order.
    let options =
        ["--method", "stam", "--stam-form", "gems", "--gems-sharpness", "0", "--gems-highlight", "0.5,0.25,0.125"];
    let common = [&options[..], &["--preset", "blazed", "--period-um", "0.1"]].concat();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A colour of 1 is that of a white diffuse surface that faces the light: 1/π over the cosine of 60° in 1/sr.
    let map = path("map.exr");
    json(&[&["brdf-map", "-o", &map, "--size", "8", "--theta-i", "60"], &common[..]].concat());
    let pixels = exr(Path::new(&map));
    for (c, colour) in [0.5, 0.25, 0.125].into_iter().enumerate() {
        let expected = colour * 2.0 / std::f32::consts::PI;
        assert!((pixels[[4, 4, c]] - expected).abs() < 1e-6, "{} {expected}", pixels[[4, 4, c]]);
    }
    let Some(_) = gpu() else { return };
    let (picture, pairs) = (path("a.exr"), path("a.npy"));
    let own = ["render", "-o", &picture, "--pairs", &pairs, "--size", "48x32", "--resolution", "1"];
    json(&[&own[..], &["--blend", "none", "--ground", "false"], &common[..]].concat());
    let (pixels, pairs): (_, Array3<f32>) = (exr(Path::new(&picture)), ndarray_npy::read_npy(&pairs).unwrap());
    let mut lit = 0;
    for (pixel, pair) in pixels.lanes(ndarray::Axis(2)).into_iter().zip(pairs.lanes(ndarray::Axis(2))) {
        let seen = pair[6] == 1.0 && pair[5] > 0.0;
        lit += usize::from(seen);
        for (value, colour) in pixel.iter().zip([0.5, 0.25, 0.125]) {
            assert!((value - if seen { colour } else { 0.0 }).abs() < 1e-5, "{pixel} {pair}");
        }
    }
    assert!(lit > 100, "{lit}");
}

#[test]
fn wrong_arguments_of_render_are_named_in_one_line() {
    let Some(_) = gpu() else { return };
    let cases: &[(&[&str], &[&str])] = &[
        (&["--method", "exact"], &["exact", "flss, nmm, pq, stam"]),
        (&["--method", "flss", "--model", "ensemble"], &["--model", "patch"]),
        (&["--method", "stam", "--size", "384"], &["--size", "384x256"]),
        (&["--method", "stam", "--size", "0x9"], &["\"width\"", "1 to 16384"]),
        (&["--method", "stam", "--camera-origin", "1,2"], &["--camera-origin", "three numbers"]),
        (&["--method", "stam", "--light-elevation", "-3"], &["light-elevation", "(0, 90]"]),
        (&["--method", "stam", "--light-from", "0,0,0"], &["light-from", "zero"]),
        (&["--method", "stam", "--blend", "add"], &["blend", "physical"]),
        (&["--method", "stam", "--share", "0.5"], &["share", "mix"]),
        (&["--method", "stam", "--supersample", "99"], &["supersample", "1 to 64"]),
        (&["--method", "stam", "--supersample", "2", "--pairs", "a.npy"], &["pairs", "--supersample 1"]),
        (&["--method", "stam", "--mesh", "no/such.ply"], &["--mesh", "--resolution"]),
        (&["--method", "stam", "--adapter", "fast"], &["--adapter", "software"]),
        (&["--method", "stam", "--preset", "flat", "--period-um", "-2"], &["period_um"]),
    ];
    for (arguments, mentioned) in cases {
        let message = refused(&[&["render", "-o", "a.exr", "--resolution", "0.2"], *arguments].concat());
        assert!(mentioned.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
    for shape in ["flat", "sphere"] {
        let message = refused(&["render", "-o", "a.exr", "--method", "stam", "--shape", shape, "--resolution", "2"]);
        assert!(message.contains("\"resolution\" needs --shape snake"), "{message}");
    }
    let message = refused(&["render", "-o", "a.exr", "--method", "stam", "--mesh", "no/such.ply"]);
    assert!(message.contains("no/such.ply"), "{message}");
}
