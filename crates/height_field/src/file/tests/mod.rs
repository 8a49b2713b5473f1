//! Round trips of written files, and refusals.

mod containers;
mod damage;
mod measured;
mod samples;
mod text;

use super::*;
use crate::Preset;
use ndarray::Array2;
use std::path::PathBuf;

/// Rounding of heights up to 0.5 µm to 32-bit floats.
const FLOAT_UM: f64 = 3e-8;
/// Rounding to 16-bit grey, relative to full scale.
const GREY_16: f64 = 0.51 / 65535.0;

const NO_SCALE: FileScale = FileScale { pixel_size_um: None, max_height_um: None };

fn scale(pixel: impl Into<Option<f64>>, height: impl Into<Option<f64>>) -> FileScale {
    FileScale { pixel_size_um: pixel.into(), max_height_um: height.into() }
}

/// A field that is not square in pixels nor in extent, and differs from all of its reflections.
fn sample() -> HeightField {
    let heights = Array2::from_shape_fn((5, 7), |(iy, ix)| 0.1 + 0.03 * ix as f64 + 0.04 * (iy * iy) as f64 / 5.0);
    HeightField::new(heights, 0.065, 0.11).unwrap()
}

fn in_folder(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn refusal(name: &str, bytes: &[u8], scale: &FileScale) -> String {
    let (_folder, path) = in_folder(name, bytes);
    let error = HeightField::read(&path, scale).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.contains(name), "one line that names the file: {error}");
    error
}

fn largest_difference(a: &HeightField, b: &HeightField) -> f64 {
    assert_eq!(a.size(), b.size());
    (a.heights_um() - b.heights_um()).iter().fold(0.0, |m, d| m.max(d.abs()))
}

#[test]
fn exr_gsf_and_png_round_trip() {
    let field = sample();
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.exr", "a.GSF", "a.png"] {
        let path = folder.path().join(name);
        field.write(&path).unwrap();
        let back = HeightField::read(&path, &NO_SCALE).unwrap();
        assert!((back.dx_um() / 0.065 - 1.0).abs() < 1e-12 && (back.dy_um() / 0.11 - 1.0).abs() < 1e-12, "{name}");
        if name.ends_with("png") {
            let lowest = field.range_um().0;
            let risen = HeightField::new(back.heights_um() + lowest, 0.065, 0.11).unwrap();
            assert!(largest_difference(&risen, &field) < GREY_16 * field.peak_to_valley_um(), "{name}");
        } else {
            assert!(largest_difference(&back, &field) < FLOAT_UM, "{name}");
        }
    }
    let flat = Preset::Flat.build(None, None).unwrap();
    for name in ["f.exr", "f.gsf", "f.png"] {
        let path = folder.path().join(name);
        flat.write(&path).unwrap();
        assert_eq!(HeightField::read(&path, &NO_SCALE).unwrap().heights_um()[[0, 0]], 0.0, "{name}");
    }
    let path = folder.path().join("a.npy");
    field.write(&path).unwrap();
    let back = HeightField::read(&path, &scale(0.065, None)).unwrap();
    assert_eq!(back.heights_um(), field.heights_um());
    assert!(field.write(folder.path().join("a.tif")).unwrap_err().to_string().contains(".exr, .png, .gsf, .npy"));
    assert!(field.write(folder.path().join("none/a.exr")).unwrap_err().to_string().contains("cannot be written"));
}

/// A GSF of the heights 1, 2 (top row) and 3, 4 in `unit` on a tile of 4 × 2 `xy`; `extra` are lines of the header.
fn gsf_of(unit: &str, xy: &str, extra: &str) -> Vec<u8> {
    let mut bytes = format!("Gwyddion Simple Field 1.0\nXRes = 2\nYRes = 2\n{extra}").into_bytes();
    if !xy.is_empty() {
        bytes.extend(format!("XReal = 4\nYReal = 2\nXYUnits = {xy}\n").bytes());
    }
    if !unit.is_empty() {
        bytes.extend(format!("ZUnits = {unit}\n").bytes());
    }
    bytes.extend(vec![0; 4 - bytes.len() % 4]);
    bytes.extend([1.0_f32, 2.0, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

#[test]
fn gsf_units_rows_and_padding_are_read() {
    for (unit, factor) in [("m", 1e6), ("mm", 1e3), ("µm", 1.0), ("μm", 1.0), ("um", 1.0), ("nm", 1e-3), ("pm", 1e-6)]
    {
        // Titles of all lengths, for padding of one to four bytes.
        for title in ["", "a", "ab", "abc", "abcd"] {
            let (_folder, path) = in_folder("u.gsf", &gsf_of(unit, unit, &format!("Title = {title}\nXOffset = 7\n")));
            let field = HeightField::read(&path, &NO_SCALE).unwrap();
            // Rounding of one product.
            assert!((field.dx_um() / (2.0 * factor) - 1.0).abs() < 1e-15, "{unit}");
            assert!((field.dy_um() / factor - 1.0).abs() < 1e-15, "{unit}");
            // The first row of the file is the top, the largest y.
            for (at, value) in [([1, 0], 1.0), ([1, 1], 2.0), ([0, 0], 3.0), ([0, 1], 4.0)] {
                assert!((field.heights_um()[at] / (value * factor) - 1.0).abs() < 1e-15, "{unit} {at:?}");
            }
        }
    }
}

#[test]
fn unusable_gsf_is_refused() {
    let good = gsf_of("nm", "um", "");
    assert!(refusal("t.gsf", &good[..good.len() - 1], &NO_SCALE).contains("16 bytes, but 15"));
    assert!(refusal("t.gsf", &good[..40], &NO_SCALE).contains("NUL"));
    assert!(refusal("t.gsf", b"", &NO_SCALE).contains("begin with"));
    assert!(refusal("t.gsf", &gsf_of("V", "um", ""), &NO_SCALE).contains("\"V\" is not a known unit of length"));
    assert!(refusal("t.gsf", &gsf_of("qm", "um", ""), &NO_SCALE).contains("SI prefix"));
    assert!(refusal("t.gsf", &gsf_of("nm", "", ""), &NO_SCALE).contains("`pixel_size`"));
    assert!(refusal("t.gsf", &gsf_of("", "um", ""), &NO_SCALE).contains("`max_height`"));
    let huge = b"Gwyddion Simple Field 1.0\nXRes = 9999999999\nYRes = 9999999999\n\0\0\0\0";
    assert!(refusal("t.gsf", huge, &NO_SCALE).contains("too large"));
    assert!(refusal("t.gsf", b"Gwyddion Simple Field 1.0\nYRes = 2\n\0", &NO_SCALE).contains("no XRes"));
    let mut nan = good.clone();
    let at = nan.len() - 4;
    nan[at..].copy_from_slice(&f32::NAN.to_le_bytes());
    let message = refusal("t.gsf", &nan, &NO_SCALE);
    assert!(message.contains("row 1, column 1"), "file order: {message}");
    let (_folder, path) = in_folder("u.gsf", &gsf_of("", "um", ""));
    let field = HeightField::read(&path, &FileScale { pixel_size_um: None, max_height_um: Some(0.6) }).unwrap();
    assert_eq!(field.range_um(), (0.0, 0.6));
}

fn png_of(depth: ::png::BitDepth, colour: ::png::ColorType, data: &[u8], per_metre: Option<u32>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_depth(depth);
    encoder.set_color(colour);
    encoder.set_pixel_dims(per_metre.map(|n| ::png::PixelDimensions { xppu: n, yppu: n, unit: ::png::Unit::Meter }));
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn png_scales_are_read_or_refused() {
    use ::png::{BitDepth::*, ColorType::*};
    let plain = png_of(Eight, Grayscale, &[0, 51, 255, 102], None);
    let (_folder, path) = in_folder("p.png", &plain);
    let field = HeightField::read(&path, &scale(0.5, 0.5)).unwrap();
    assert_eq!(field.heights_um(), &ndarray::array![[0.5, 0.2], [0.0, 0.1]]);
    assert!(refusal("p.png", &plain, &NO_SCALE).contains("`pixel_size`"));
    assert!(refusal("p.png", &plain, &scale(0.5, None)).contains("`max_height`"));
    let metric = png_of(Sixteen, Grayscale, &[0, 0, 255, 255, 0, 0, 0, 0], Some(16_000_000));
    let (_folder, path) = in_folder("q.png", &metric);
    let field = HeightField::read(&path, &scale(None, 0.5)).unwrap();
    assert_eq!((field.dx_um(), field.heights_um()[[1, 1]]), (0.0625, 0.5));
    assert!(refusal("q.png", &metric, &scale(0.065, 0.5)).contains("0.065 µm but the file says 0.0625"));
    // 72 dots an inch is for printers and does not count as a scale.
    let printed = png_of(Eight, Grayscale, &[0; 4], Some(2835));
    assert!(refusal("q.png", &printed, &scale(None, 0.5)).contains("`pixel_size`"));
    assert!(refusal("c.png", &png_of(Eight, Rgb, &[0; 12], None), &scale(1.0, 1.0)).contains("grey is needed"));
    assert!(refusal("c.png", &png_of(Four, Grayscale, &[0; 2], None), &scale(1.0, 1.0)).contains("4 bits"));
    for length in [0, 20, plain.len() / 2, plain.len() - 6] {
        assert!(refusal("t.png", &plain[..length], &scale(1.0, 1.0)).contains("not a usable PNG"));
    }
}

#[test]
fn exr_scales_must_agree() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let square = HeightField::new(sample().heights_um().clone(), 0.065, 0.065).unwrap();
    square.write(&path).unwrap();
    let top = square.range_um().1;
    HeightField::read(&path, &scale(0.065, top)).unwrap();
    HeightField::read(&path, &scale(0.065 * (1.0 + 1e-7), square.peak_to_valley_um())).unwrap();
    for (bad, parameter) in [(scale(0.0651, None), "`pixel_size`"), (scale(None, 0.9), "`max_height`")] {
        assert!(HeightField::read(&path, &bad).unwrap_err().to_string().contains(parameter));
    }
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 10, 200, bytes.len() - 5] {
        assert!(refusal("t.exr", &bytes[..length], &NO_SCALE).contains("OpenEXR"), "{length}");
    }
    let three = folder.path().join("rgb.exr");
    ::exr::prelude::write_rgb_file(&three, 2, 2, |_, _| (0.0_f32, 0.0_f32, 0.0_f32)).unwrap();
    assert!(HeightField::read(&three, &scale(1.0, None)).unwrap_err().to_string().contains("3 channels"));
    // One channel of this size would fit into the file, three do not.
    let mut bytes = std::fs::read(&three).unwrap();
    let side = (1024.0 * bytes.len() as f64).sqrt() as i32;
    let window = b"dataWindow\0box2i\0";
    // The attribute's length, first column and first row come before the last column and row.
    let last = bytes.windows(window.len()).position(|found| found == window).unwrap() + window.len() + 12;
    bytes[last..last + 8].copy_from_slice(&[(side - 1).to_le_bytes(); 2].concat());
    assert!(refusal("t.exr", &bytes, &NO_SCALE).contains(&format!("{side} × {side} × 3 points do not fit")));
}

#[test]
fn matrices_keep_their_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.npy");
    ndarray_npy::write_npy(&path, &ndarray::array![[1.0_f32, 2.0, 3.0], [4.0, 5.0, 6.0]]).unwrap();
    let field = HeightField::read(&path, &scale(0.1, None)).unwrap();
    assert_eq!(field.heights_um(), &ndarray::array![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    let message = HeightField::read(&path, &NO_SCALE).unwrap_err().to_string();
    assert!(message.contains("`pixel_size`"), "{message}");
    ndarray_npy::write_npy(&path, &ndarray::array![[1.0_f64, 2.0], [3.0, 4.0]].reversed_axes()).unwrap();
    let field = HeightField::read(&path, &scale(0.1, None)).unwrap();
    assert_eq!(field.heights_um(), &ndarray::array![[1.0, 3.0], [2.0, 4.0]]);
    assert!(field.heights_um().is_standard_layout());
    ndarray_npy::write_npy(&path, &ndarray::array![[0_u16, 65535]]).unwrap();
    assert!(HeightField::read(&path, &scale(0.1, None)).unwrap_err().to_string().contains("`max_height`"));
    assert_eq!(HeightField::read(&path, &scale(0.1, 0.4)).unwrap().range_um(), (0.0, 0.4));
    let bytes = std::fs::read(&path).unwrap();
    assert!(refusal("t.npy", &bytes[..bytes.len() - 1], &scale(0.1, 0.4)).contains("NumPy"));
    ndarray_npy::write_npy(&path, &ndarray::array![0.0_f64, 1.0]).unwrap();
    assert!(HeightField::read(&path, &scale(0.1, None)).unwrap_err().to_string().contains("has 1 dimensions"));
    ndarray_npy::write_npy(&path, &ndarray::Array3::<f32>::zeros((2, 2, 3))).unwrap();
    assert!(HeightField::read(&path, &scale(0.1, None)).unwrap_err().to_string().contains("has 3 dimensions"));

    let (_folder, path) = in_folder("m.txt", b"# heights\n1 2, 3 7\n\n4;5\t6 8 # next\n3 1 2 9\n");
    let field = HeightField::read(&path, &scale(0.1, None)).unwrap();
    let rows = ndarray::array![[1.0, 2.0, 3.0, 7.0], [4.0, 5.0, 6.0, 8.0], [3.0, 1.0, 2.0, 9.0]];
    assert_eq!(field.heights_um(), &rows);
    assert!(refusal("t.txt", b"1 2\n3\n", &scale(0.1, None)).contains("line 2 has 1"));
    assert!(refusal("t.txt", b"1 x\n", &scale(0.1, None)).contains("\"x\" in line 1"));
    assert!(refusal("t.txt", b"1 2 1 1\n3 nan 2 2\n1 5 3 2\n", &scale(0.1, None)).contains("row 1, column 1"));
    assert!(refusal("t.txt", b"# nothing\n", &scale(0.1, None)).contains("no numbers"));
    assert!(refusal("t.txt", &[0xff, 0xfe], &scale(0.1, None)).contains("no numbers"));
    assert!(refusal("t.txt", b"1 2 3 4\n\0\x01", &scale(0.1, None)).contains("binary"));
}

#[test]
fn missing_files_extensions_and_bad_parameters_are_refused() {
    let read = |path: &str, scale: &FileScale| HeightField::read(path, scale).unwrap_err().to_string();
    assert!(read("/nowhere/a.exr", &NO_SCALE).contains("cannot be read"));
    assert!(read("a.jpeg", &NO_SCALE).contains("\"jpeg\" is not supported; accepted: .exr, .png"));
    assert!(read("a", &NO_SCALE).contains("\"\" is not supported"));
    assert!(read("my scan.ibw", &NO_SCALE).contains("convert \"my scan.ibw\" -o scan.gsf`"));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(read("a.png", &scale(bad, None)).contains("`pixel_size`"));
        assert!(read("a.png", &scale(None, bad)).contains("`max_height`"));
    }
}

#[test]
fn pictures_and_fields_of_a_scan_agree() {
    let Some(folder) = sunbeam_testing::data("afm") else { return };
    for name in ["elaphe", "xenopeltis"] {
        let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let scale = scale(json["pixel_size_um"].as_f64(), json["max_height_um"].as_f64());
        let picture = HeightField::read(folder.join(format!("{name}.png")), &scale).unwrap();
        let field = HeightField::read(folder.join(format!("{name}.gsf")), &NO_SCALE).unwrap();
        assert!((picture.dx_um() - field.dx_um()).abs() < 1e-12 && (picture.dy_um() - field.dy_um()).abs() < 1e-12);
        // The field was written as 32-bit floats; heights are below 1 µm.
        assert!(largest_difference(&picture, &field) < 2.0 * FLOAT_UM, "{name}");
    }
}

/// Number of missing points that [`Fill::Laplace`] fills, which is also that of the refusal without filling.
fn holes_of(path: &std::path::Path, scale: FileScale) -> usize {
    let refused = HeightField::read(path, &scale).unwrap_err().to_string();
    let options = ReadOptions { scale, fill: Fill::Laplace, ..Default::default() };
    let read = HeightField::read_with(path, &options).unwrap();
    assert!(refused.contains(&format!("{} of {} points", read.filled, read.field.heights_um().len())), "{refused}");
    assert!(
        read.field.heights_um().iter().all(|h| h.abs() < 10.0),
        "{}: {:?}",
        path.display(),
        read.field.heights_um()
    );
    read.filled
}

#[test]
fn implausible_numbers_are_missing_points() {
    let folder = tempfile::tempdir().unwrap();
    let mut heights = sample().heights_um().clone();
    for (place, nothing) in [([0, 0], 1e38), ([2, 3], -3.4e38), ([4, 6], 1.1e30)] {
        heights[place] = nothing;
    }
    let field = HeightField::new(heights, 0.065, 0.11).unwrap();
    for (name, scale) in [("a.exr", NO_SCALE), ("a.npy", scale(0.065, None))] {
        let path = folder.path().join(name);
        field.write(&path).unwrap();
        assert_eq!(holes_of(&path, scale), 3, "{name}");
    }
    for hole in ["1e38", "-inf", "1e30", "-1.70141e38", "1e999"] {
        let text = format!("1 2 3 4\n3 {hole} 5 6\n4 6 1 2\n");
        let (_folder, path) = in_folder("a.txt", text.as_bytes());
        assert_eq!(holes_of(&path, scale(0.1, None)), 1, "{text}");
    }
    let (_folder, path) = in_folder("a.xyz", samples::xyz().replace("0.125", "1e38").as_bytes());
    assert_eq!(holes_of(&path, NO_SCALE), 2);
    // The stored number counts, before the unit makes it smaller: 1e38 fm are 1e29 µm.
    let mut gsf = gsf_of("fm", "um", "");
    let end = gsf.len();
    gsf[end - 4..].copy_from_slice(&1e38_f32.to_le_bytes());
    let (_folder, path) = in_folder("a.gsf", &gsf);
    assert_eq!(holes_of(&path, NO_SCALE), 1);
    let values = [0.5, -0.25, 1.0, 1e35, 0.75, 0.25];
    let container = samples::component("/0/data", b'o', &samples::data_field("um", "um", &values));
    let gwy = [b"GWYP".to_vec(), samples::object("GwyContainer", &[container])].concat();
    let (_folder, path) = in_folder("a.gwy", &gwy);
    assert_eq!(holes_of(&path, NO_SCALE), 1);
    let (_folder, path) = in_folder("a.sdf", samples::sdf_text("1e31").as_bytes());
    assert_eq!(holes_of(&path, NO_SCALE), 1);
}

#[test]
fn no_data_number_of_a_tiff_is_a_missing_point() {
    use ::tiff::encoder::{TiffEncoder, colortype};
    use ::tiff::tags::Tag;
    let mut grey = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut grey).unwrap();
    let mut page = encoder.new_image::<colortype::Gray16>(3, 2).unwrap();
    page.encoder().write_tag(Tag::GdalNodata, "65535 ").unwrap();
    page.write_data(&[0, 65535, 30000, 65534, 65535, 6]).unwrap();
    let (_folder, path) = in_folder("a.tif", grey.get_ref());
    assert_eq!(holes_of(&path, scale(0.1, 0.4)), 2);
    let mut floats = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut floats).unwrap();
    let mut page = encoder.new_image::<colortype::Gray32Float>(3, 2).unwrap();
    // Not a number that 32 bits hold exactly.
    page.encoder().write_tag(Tag::GdalNodata, "-9999.9").unwrap();
    page.write_data(&[0.1, -9999.9, 0.3, 0.4, 0.5, -9999.9]).unwrap();
    let (_folder, path) = in_folder("b.tif", floats.get_ref());
    assert_eq!(holes_of(&path, scale(0.1, None)), 2);
}
