//! Gwyddion, TIFF and XYZ files.

use super::measured::check;
use super::samples;
use super::*;

/// Rounding of products of heights below 1 µm.
const ROUNDING_UM: f64 = 1e-12;

fn read_channel(name: &str, bytes: &[u8], channel: &str) -> Result<FileField, String> {
    let (_folder, path) = in_folder(name, bytes);
    let options = ReadOptions { channel: Some(channel.to_owned()), ..Default::default() };
    HeightField::read_with(path, &options).map_err(|error| error.to_string())
}

#[test]
fn gwyddion_channels_units_and_masks_are_read() {
    let read = check("g.gwy", &samples::gwy(false), None, None, ROUNDING_UM);
    assert_eq!(read.channel.as_deref(), Some("Height"));
    for channel in ["2", "Height", "height "] {
        check("g.GWY", &samples::gwy(false), Some(channel), None, ROUNDING_UM);
    }
    // The mask begins with the top row, as its channel does.
    check("g.gwy", &samples::gwy(true), None, Some([1, 1]), ROUNDING_UM);
    let message = refusal("g.gwy", &samples::gwy(true), &NO_SCALE);
    assert!(message.contains("1 of 6 points") && message.contains("row 0, column 1"), "{message}");
    // The other channel has no mask, and negative heights.
    let inverted = read_channel("g.gwy", &samples::gwy(true), "11").unwrap();
    assert!((inverted.field.heights_um()[[0, 0]] + samples::HEIGHTS[0][0]).abs() < ROUNDING_UM);
}

#[test]
fn gwyddion_refusals_list_the_channels() {
    let bytes = samples::gwy(false);
    let list = "0 \"Phase\" (deg), 2 \"Height\" (m), 11 \"Height (inverted)\" (nm)";
    for (channel, reason) in [("1", "no `channel` \"1\""), ("Hight", "\"Hight\""), ("Phase", "not a length")] {
        let message = read_channel("g.gwy", &bytes, channel).unwrap_err();
        assert!(message.contains(reason) && message.contains(list), "{message}");
    }
    let with = |field: Vec<u8>| {
        let container = samples::object("GwyContainer", &[samples::component("/0/data", b'o', &field)]);
        refusal("g.gwy", &[b"GWYP".to_vec(), container].concat(), &NO_SCALE)
    };
    assert!(
        with(samples::data_field("m", "V", &[0.0; 6])).contains("no channel is in units of length; there are 0 (V)")
    );
    assert!(with(samples::data_field("m", "", &[0.0; 6])).contains("unit of height; give `max_height`"));
    assert!(with(samples::data_field("m", "m", &[0.0; 5])).contains("3 × 2 points holds 5 values"));
    assert!(with(samples::data_field("s", "m", &[0.0; 6])).contains("\"s\" is not a known unit of length"));
    assert!(with(samples::data_field("", "m", &[0.0; 6])).contains("`pixel_size`"));
    assert!(with(samples::object("GwyBrick", &[])).contains("GwyBrick"));
    let odd = [b"GWYP".to_vec(), samples::object("GwyContainer", &[samples::component("/0/data", b'x', &[])])].concat();
    assert!(refusal("g.gwy", &odd, &NO_SCALE).contains("unknown type 'x'"));
    let empty = [b"GWYP".to_vec(), samples::object("GwyContainer", &[])].concat();
    assert!(refusal("g.gwy", &empty, &NO_SCALE).contains("no channels"));
    assert!(refusal("g.gwy", b"GWYO", &NO_SCALE).contains("GWYP"));
    for length in [4, 16, bytes.len() / 2, bytes.len() - 1] {
        assert!(refusal("g.gwy", &bytes[..length], &NO_SCALE).contains("ends"), "{length}");
    }
}

#[test]
fn deeply_nested_objects_are_skipped() {
    let mut nested = samples::object("GwyContainer", &[]);
    for _ in 0..20_000 {
        nested = samples::object("A", &[samples::component("b", b'o', &nested)]);
    }
    let container = samples::object("GwyContainer", &[samples::component("/0/data", b'o', &nested)]);
    assert!(refusal("g.gwy", &[b"GWYP".to_vec(), container].concat(), &NO_SCALE).contains("GwyDataField"));
}

/// ImageJ's description of a TIFF, with heights calibrated as −0.25 µm + 0.125 µm a step.
const IMAGEJ: &str = "ImageJ=1.54f\nunit=\\u00B5m\nspacing=1.0\ncf=0\nc0=-250\nc1=125\nvunit=nm\n";

#[test]
fn tiff_scales_are_read() {
    // 20 000 pixels a centimetre along x, twice as many along y.
    let metric = samples::tiff(None, Some((3, 20_000)));
    let (_folder, path) = in_folder("t.tif", &metric);
    let field = HeightField::read(path, &scale(None, 65535.0 * 0.125)).unwrap();
    assert_eq!((field.dx_um(), field.dy_um()), (0.5, 0.25));
    for ((iy, ix), height) in field.heights_um().indexed_iter() {
        assert!((height - 0.25 - samples::HEIGHTS[iy][ix]).abs() < ROUNDING_UM);
    }
    check("t.TIFF", &samples::tiff(Some(IMAGEJ), Some((1, 2))), None, None, ROUNDING_UM);
}

#[test]
fn unusable_tiff_is_refused() {
    // 300 dots an inch is for printers, and no unit is no measure.
    for resolution in [None, Some((2, 300)), Some((1, 20_000))] {
        let message = refusal("t.tif", &samples::tiff(None, resolution), &scale(None, 1.0));
        assert!(message.contains("`pixel_size`"), "{message}");
    }
    let plain = samples::tiff(None, None);
    assert!(refusal("t.tif", &plain, &scale(1.0, None)).contains("`max_height`"));
    assert!(read_channel("t.tif", &plain, "1").unwrap_err().contains("there are 0 (page)"));
    let metric = samples::tiff(None, Some((3, 20_000)));
    assert!(refusal("t.tif", &metric, &scale(0.25, 1.0)).contains("0.25 µm but the file says 0.5"));
    for length in [0, 7, plain.len() / 2, plain.len() - 8] {
        assert!(refusal("t.tif", &plain[..length], &scale(1.0, 1.0)).contains("not a usable TIFF"), "{length}");
    }
    let mut colour = std::io::Cursor::new(Vec::new());
    ::tiff::encoder::TiffEncoder::new(&mut colour)
        .unwrap()
        .write_image::<::tiff::encoder::colortype::RGB8>(1, 1, &[1, 2, 3])
        .unwrap();
    assert!(refusal("t.tif", &colour.into_inner(), &scale(1.0, 1.0)).contains("grey"));
}

#[test]
fn xyz_points_are_sorted_into_their_grid() {
    check("p.xyz", samples::xyz().as_bytes(), None, Some([0, 1]), ROUNDING_UM);
    // Three digits of a third, over a hundred points: no step is exact, the mean of them nearly.
    let rounded: String = (0..100).map(|i| format!("{:.3}\t5\t{}\n", i as f64 / 3.0, i % 7)).collect();
    let (_folder, path) = in_folder("p.xyz", rounded.as_bytes());
    let field = HeightField::read(path, &NO_SCALE).unwrap();
    assert_eq!(field.size(), (100, 1));
    assert!((field.dx_um() * 3.0 - 1.0).abs() < 1e-4 && field.dx_um() == field.dy_um());
    let with = |text: &str| refusal("p.xyz", text.as_bytes(), &NO_SCALE);
    assert!(with("0 0 1\n1 0 1\n0 1 1\n1.5 1 1\n3 0 1\n").contains("not on a regular grid"));
    assert!(with("0 0 1\n1 0 1\n1 0 2\n").contains("share the node"));
    assert!(with("0 0 1\n1 1 1\n2 2 1\n3 3 1\n4 4 1\n").contains("fill little of a grid of 5 × 5"));
    assert!(with("0 0 1\n1 nan 1\n").contains("finite"));
    assert!(with("0 0\n1 1\n").contains("2 numbers"));
    assert!(with("0 0 1\n").contains("`pixel_size`"));
    assert!(with("").contains("no numbers"));
}

#[test]
fn matrices_are_read_from_all_text_extensions() {
    let rows = [["1", "2", "3", "nan"], ["4", "5", "6", "7"], ["3", "6", "2", "6"]];
    let matrix = |separator: &str, end: &str| rows.map(|row| row.join(separator)).join(end);
    for (name, text) in [("m.csv", format!("\u{feff}{}\r\n", matrix(",", "\r\n"))), ("m.asc", matrix("\t", "\n"))] {
        let (_folder, path) = in_folder(name, text.as_bytes());
        let fill = |fill| ReadOptions { scale: scale(0.1, None), fill, ..Default::default() };
        let read = HeightField::read_with(&path, &fill(Fill::Mean)).unwrap();
        // The mean of the eleven others.
        let heights = ndarray::array![[1.0, 2.0, 3.0, 45.0 / 11.0], [4.0, 5.0, 6.0, 7.0], [3.0, 6.0, 2.0, 6.0]];
        assert!((read.field.heights_um() - &heights).iter().all(|d| d.abs() < ROUNDING_UM));
        assert_eq!(read.filled, 1);
        let film = HeightField::read_with(&path, &fill(Fill::Laplace)).unwrap();
        // Between 3 and 7 at the corner.
        assert!((film.field.heights_um()[[0, 3]] - 5.0).abs() < 1e-10);
        let nothing = ["nan nan nan nan\n"; 3].concat();
        assert!(refusal(name, nothing.as_bytes(), &scale(0.1, None)).contains("12 of 12 points"));
        let (_folder, path) = in_folder(name, nothing.as_bytes());
        assert!(HeightField::read_with(&path, &fill(Fill::Laplace)).is_err());
    }
}
