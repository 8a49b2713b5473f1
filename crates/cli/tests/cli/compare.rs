//! `sunbeam compare`: figures of pictures with known differences.

use super::support::{refused, run, succeeded};
use exr::prelude::{WritableImage, write_rgb_file};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Relative rounding of sums over a few hundred single-precision pixels.
const ROUNDING: f64 = 1e-6;
const SIZE: (usize, usize) = (24, 16);

type Pixel = fn(usize, usize) -> [f32; 3];

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a picture and returns its path.
    fn exr(&self, name: &str, (width, height): (usize, usize), pixel: Pixel) -> String {
        let path = self.path(name);
        write_rgb_file(&path, width, height, |x, y| pixel(x, y).into()).unwrap();
        text(&path)
    }
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// The report of a comparison.
fn compare(arguments: &[&str]) -> Value {
    serde_json::from_str(&succeeded(run(&[&["compare"], arguments].concat(), ""))).unwrap()
}

fn number(report: &Value, path: &str) -> f64 {
    report.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {path} in {report}"))
}

/// Colours from black to values above 1.
fn ramp(x: usize, y: usize) -> [f32; 3] {
    [x as f32 / 20.0, y as f32 / 20.0, (x * y) as f32 / 200.0]
}

fn mid_grey(_: usize, _: usize) -> [f32; 3] {
    [0.5; 3]
}

fn darker_grey(_: usize, _: usize) -> [f32; 3] {
    [0.4; 3]
}

#[test]
fn equal_pictures_have_zero_differences() {
    let folder = Folder::new();
    let a = folder.exr("a.exr", SIZE, ramp);
    let report = compare(&[&a, &a]);
    for path in [
        "/rmse",
        "/relative_mse",
        "/delta_e_2000/mean",
        "/delta_e_2000/median",
        "/delta_e_2000/p99",
        "/flip/mean",
        "/flip/p99",
    ] {
        assert_eq!(number(&report, path), 0.0, "{path}");
    }
    // It is infinite, which JSON cannot represent.
    assert_eq!(report["psnr_db"], Value::Null);
    assert_eq!((&report["size"], &report["pixels"]), (&json!([24, 16]), &json!(384)));
}

#[test]
fn a_constant_difference_has_the_defined_figures() {
    let folder = Folder::new();
    let (a, b) = (folder.exr("a.exr", SIZE, mid_grey), folder.exr("b.exr", SIZE, darker_grey));
    let report = compare(&[&a, &b, "--exposure", "0"]);
    let close = |path: &str, expected: f64, tolerance: f64| {
        let found = number(&report, path);
        assert!((found / expected - 1.0).abs() < tolerance, "{path}: {found}, not {expected}");
    };
    close("/rmse", 0.1, ROUNDING);
    close("/relative_mse", 0.01 / (0.25 + 0.005f64.powi(2)), ROUNDING);
    let encoded = |v: f64| 1.055 * v.powf(1.0 / 2.4) - 0.055;
    close("/psnr_db", -20.0 * (encoded(0.5) - encoded(0.4)).log10(), 1e-5);
    // Greys differ in L* only: ΔL'/S_L, with S_L of G. Sharma et al. (2005) at the mean lightness.
    let lightness = |y: f64| 116.0 * y.cbrt() - 16.0;
    let (high, low) = (lightness(0.5), lightness(0.4));
    let from_50 = ((high + low) / 2.0 - 50.0).powi(2);
    let delta_e = (high - low) / (1.0 + 0.015 * from_50 / (20.0 + from_50).sqrt());
    // The white point has four digits, which leaves a grey with a little chroma.
    close("/delta_e_2000/mean", delta_e, 1e-3);
    close("/delta_e_2000/median", delta_e, 1e-3);
    close("/delta_e_2000/p99", delta_e, 1e-3);
    assert!(number(&report, "/flip/mean") > 0.0);
    assert_eq!(report["exposure_stops"], json!(0.0));
}

#[test]
fn exposure_changes_perceptual_figures_only() {
    let folder = Folder::new();
    let (a, b) = (folder.exr("a.exr", SIZE, mid_grey), folder.exr("b.exr", SIZE, darker_grey));
    let (plain, dark) = (compare(&[&a, &b, "--exposure", "0"]), compare(&[&a, &b, "--exposure", "-3"]));
    for name in ["rmse", "relative_mse"] {
        assert_eq!(plain[name], dark[name]);
    }
    for path in ["/delta_e_2000/mean", "/flip/mean"] {
        assert!(number(&dark, path) < number(&plain, path), "{path}");
    }
    // The exposure that clips 1 % of a grey picture makes its grey white.
    assert!((number(&compare(&[&a, &b]), "/exposure_stops") - 1.0).abs() < ROUNDING);
    // At a high exposure every pixel is white.
    let white = compare(&[&a, &b, "--exposure", "8"]);
    assert_eq!((number(&white, "/flip/mean"), &white["psnr_db"]), (0.0, &Value::Null));
}

#[test]
fn flip_is_symmetric() {
    let folder = Folder::new();
    let a = folder.exr("a.exr", SIZE, |x, y| [f32::from(u8::from((x / 4 + y / 4) % 2 == 0)), 0.2, 0.1]);
    let b = folder.exr("b.exr", SIZE, |x, y| [0.1, f32::from(u8::from((x / 4 + y / 4) % 2 == 0)), 0.2]);
    let forth = number(&compare(&[&a, &b, "--exposure", "0"]), "/flip/mean");
    let back = number(&compare(&[&b, &a, "--exposure", "0"]), "/flip/mean");
    assert!((0.1..=1.0).contains(&forth), "{forth}");
    assert!((forth - back).abs() < 1e-3, "{forth} {back}");
}

#[test]
fn a_black_reference_has_no_relative_error() {
    let folder = Folder::new();
    let (a, b) = (folder.exr("a.exr", SIZE, |_, _| [0.0; 3]), folder.exr("b.exr", SIZE, mid_grey));
    let report = compare(&[&a, &b]);
    assert_eq!((&report["relative_mse"], number(&report, "/rmse")), (&Value::Null, 0.5));
    assert_eq!(number(&compare(&[&a, &a]), "/relative_mse"), 0.0);
}

#[test]
fn pixels_outside_the_mask_do_not_count() {
    let folder = Folder::new();
    let a = folder.exr("a.exr", SIZE, mid_grey);
    let b = folder.exr("b.exr", SIZE, |x, _| [if x < 12 { 0.5 } else { 0.4 }; 3]);
    let left = folder.exr("left.exr", SIZE, |x, _| [0.0, f32::from(u8::from(x < 12)), 0.0]);
    let right = folder.path("right.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&right).unwrap(), 24, 16);
    encoder.set_color(png::ColorType::Grayscale);
    let bytes: Vec<u8> = (0..384).map(|i| u8::from(i % 24 >= 12)).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();

    // FLIP's filters reach across the edge of the mask, where both pictures are black.
    let report = compare(&[&a, &b, "--mask", &left]);
    assert_eq!((number(&report, "/rmse"), number(&report, "/flip/mean")), (0.0, 0.0));
    let report = compare(&[&a, &b, "--mask", &text(&right)]);
    assert!((number(&report, "/rmse") / 0.1 - 1.0).abs() < ROUNDING);
    assert_eq!(report["pixels"], json!(192));
}

#[test]
fn the_sheet_shows_both_pictures_and_the_map() {
    let folder = Folder::new();
    let (a, b) = (folder.exr("a.exr", SIZE, mid_grey), folder.exr("b.exr", SIZE, darker_grey));
    let sheet = folder.path("sheet.png");
    compare(&[&a, &b, "--exposure", "0", "--png", &text(&sheet)]);
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&sheet).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (72, 16, png::ColorType::Rgb));
    let pixel = |x: usize| &bytes[3 * (72 * 8 + x)..][..3];
    // The sRGB values of 0.5 and 0.4, and a colour of the map.
    assert_eq!((pixel(12), pixel(36)), (&[188; 3][..], &[170; 3][..]));
    assert!(pixel(60).iter().any(|&v| v > 0) && pixel(60) != pixel(36), "{:?}", pixel(60));
}

#[test]
fn pictures_that_cannot_be_compared_are_named() {
    let folder = Folder::new();
    let a = folder.exr("a.exr", SIZE, ramp);
    let small = folder.exr("small.exr", (8, 8), ramp);
    let bad = folder.exr("bad.exr", SIZE, |x, y| [0.0, 0.0, if (x, y) == (3, 5) { f32::NAN } else { 0.0 }]);
    let black = folder.exr("black.exr", SIZE, |_, _| [0.0; 3]);
    let grey = text(&folder.path("grey.exr"));
    let channel = exr::prelude::AnyChannel::new("Y", exr::prelude::FlatSamples::F32(vec![0.5; 384]));
    exr::prelude::Image::from_channels(SIZE, exr::prelude::AnyChannels::sort(std::iter::once(channel).collect()))
        .write()
        .to_file(&grey)
        .unwrap();
    let notes = text(&folder.path("notes.txt"));
    std::fs::write(&notes, "not a picture").unwrap();
    let cases: &[(&[&str], &[&str])] = &[
        (&[&a], &["<B>"]),
        (&[&a, &small], &["8 x 8", "24 x 16", "same size"]),
        (&[&a, &bad], &["bad.exr", "column 3, row 5", "B = NaN", "finite"]),
        (&[&grey, &a], &["grey.exr", "no channel R", "only Y"]),
        (&[&a, "no/such.exr"], &["no/such.exr"]),
        (&[&a, &notes], &["notes.txt", "OpenEXR"]),
        (&[&a, &a, "--mask", &small], &["mask", "8 x 8"]),
        (&[&a, &a, "--mask", &black], &["leaves no pixel"]),
        (&[&a, &a, "--mask", &notes], &["notes.txt", ".exr or .png"]),
        (&[&a, &a, "--exposure", "NaN"], &["exposure", "NaN", "[-100, 100]"]),
        (&[&a, &a, "--png", "no/such/sheet.png"], &["no/such/sheet.png"]),
    ];
    for (arguments, mentioned) in cases {
        let message = refused(&[&["compare"], *arguments].concat());
        assert!(mentioned.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
}
