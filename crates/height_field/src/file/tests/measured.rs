//! Formats of instruments: NanoScope, surface data files, X3P.

use super::samples::{self, HEIGHTS};
use super::*;

/// Rounding of products of heights below 1 µm.
const ROUNDING_UM: f64 = 1e-12;

/// Reads with [`Fill::Laplace`], and checks size, pixels and all heights but the missing ones.
pub(super) fn check(
    name: &str,
    bytes: &[u8],
    channel: Option<&str>,
    missing: Option<[usize; 2]>,
    tolerance_um: f64,
) -> FileField {
    let (_folder, path) = in_folder(name, bytes);
    let fill = if missing.is_some() { Fill::Laplace } else { Fill::None };
    let options = ReadOptions { channel: channel.map(str::to_owned), fill, ..Default::default() };
    let read = HeightField::read_with(&path, &options).unwrap();
    assert_eq!(read.filled, usize::from(missing.is_some()), "{name}");
    let field = &read.field;
    assert_eq!(field.size(), (3, 2), "{name}");
    assert!((field.dx_um() / 0.5 - 1.0).abs() < 1e-9 && (field.dy_um() / 0.25 - 1.0).abs() < 1e-9, "{name}");
    for ((iy, ix), height) in field.heights_um().indexed_iter() {
        if missing != Some([iy, ix]) {
            let expected = HEIGHTS[iy][ix];
            assert!((height - expected).abs() <= tolerance_um, "{name} row {iy} column {ix}: {height}, not {expected}");
        }
    }
    read
}

#[test]
fn surface_data_files_of_all_revisions_are_read() {
    for (revision, missing) in [("ISO-1.0", [0, 1]), ("ISO-2.0", [0, 1]), ("BCR-1.0", [1, 1])] {
        for code in [5, 7] {
            let bytes = samples::sdf_binary(revision, code);
            check("s.sdf", &bytes, None, Some(missing), ROUNDING_UM);
            // Rows and columns of messages are those of the file.
            let message = refusal("s.sdf", &bytes, &NO_SCALE);
            assert!(message.contains("1 of 6 points") && message.contains("row 0, column 1"), "{message}");
            assert!(message.contains("`fill`") && message.contains("laplace"), "{message}");
        }
    }
    for bad in ["BAD", "bad", "NaN", "-1.7976931348623157e308"] {
        check("s.SDF", samples::sdf_text(bad).as_bytes(), None, Some([0, 1]), ROUNDING_UM);
    }
    check("s.sdf", samples::sdf_text("-0.25").as_bytes(), None, None, ROUNDING_UM);
    let bcr = samples::sdf_text("-0.25").replace("aISO-1.0", "aBCR-1.0").replace("= 7\r", "= DOUBLE ; eight bytes\r");
    let bcr = bcr.replace("Compression = 0", "Compression = NULL");
    let (_folder, path) = in_folder("b.sdf", bcr.as_bytes());
    let turned = HeightField::read(path, &NO_SCALE).unwrap();
    assert!((turned.heights_um()[[1, 0]] - HEIGHTS[0][0]).abs() < ROUNDING_UM);
}

#[test]
fn unusable_surface_data_files_are_refused() {
    let text = samples::sdf_text("-0.25");
    let with = |from: &str, to: &str| refusal("s.sdf", text.replace(from, to).as_bytes(), &NO_SCALE);
    assert!(with("ISO-1.0", "XYZ-1.0").contains("XYZ-1.0"));
    assert!(with("NumPoints = 3", "NumPoints = 4").contains("4 × 2 heights are promised, but 6 follow"));
    assert!(with("NumPoints = 3", "NumPoints = many").contains("\"many\""));
    assert!(with("NumPoints = 3", "NumPoints = 0").contains("at least one point"));
    assert!(with("NumProfiles = 2\r\n", "").contains("no NumProfiles"));
    assert!(with("DataType = 7", "DataType = 8").contains("DataType is 8"));
    assert!(with("Compression = 0", "Compression = 1").contains("Compression"));
    assert!(with("-0.25", "rough").contains("\"rough\""));
    assert!(with("Xscale = 5.0e-7", "Xscale = -5.0e-7").contains("finite and positive"));
    let binary = samples::sdf_binary("ISO-2.0", 7);
    assert!(refusal("s.sdf", &binary[..binary.len() - 1], &NO_SCALE).contains("48 bytes are wanted, 47 are left"));
    let mut huge = binary.clone();
    huge[42..50].copy_from_slice(&[0xff; 8]);
    assert!(refusal("s.sdf", &huge, &NO_SCALE).contains("surface data file"));
    let chosen = ReadOptions { channel: Some("1".into()), ..Default::default() };
    let (_folder, path) = in_folder("s.sdf", &binary);
    assert!(HeightField::read_with(path, &chosen).unwrap_err().to_string().contains("single channel"));
}

#[test]
fn x3p_of_all_kinds_is_read() {
    check("s.x3p", &samples::x3p(false), None, None, ROUNDING_UM);
    check("s.x3p", &samples::x3p(true), None, Some([0, 1]), ROUNDING_UM);
    // Two layers of floats, the second chosen; and heights in the description itself, of which one is missing.
    let z = "<DataType>F</DataType>";
    let layers: Vec<u8> =
        [[9.0_f64; 3]; 2].iter().chain(&HEIGHTS).flatten().flat_map(|h| ((h * 1e-6) as f32).to_le_bytes()).collect();
    let xml = samples::x3p_description("I", z, 2, samples::X3P_LINK);
    let bytes = samples::archive(&[("main.xml", xml.as_bytes()), ("bindata/data.bin", &layers)]);
    let read = check("s.x3p", &bytes, Some("1"), None, FLOAT_UM);
    assert_eq!(read.channel.as_deref(), Some("1"));
    let mut list = String::from("<DataList>");
    for (at, height) in HEIGHTS.iter().flatten().enumerate() {
        list += &if at == 1 { "<Datum/>".to_owned() } else { format!("<Datum>{:e}</Datum>", height * 1e-6) };
    }
    let xml = samples::x3p_description("I", "<DataType>D</DataType>", 1, &(list + "</DataList>"));
    // The second folder's name is shorter in lower case: the Kelvin sign becomes k.
    for name in ["main.xml", "\u{212a}é/Main.xml"] {
        check("s.x3p", &samples::archive(&[(name, xml.as_bytes())]), None, Some([0, 1]), ROUNDING_UM);
    }
}

#[test]
fn unusable_x3p_is_refused() {
    let z = "<DataType>D</DataType>";
    let zeros = [0; 48];
    let with = |xml: &str, data: &[u8]| {
        refusal("s.x3p", &samples::archive(&[("main.xml", xml.as_bytes()), ("bindata/data.bin", data)]), &NO_SCALE)
    };
    let good = samples::x3p_description("I", z, 1, samples::X3P_LINK);
    assert!(with(&good, &zeros[..40]).contains("40 bytes, not the 48"));
    assert!(with(&samples::x3p_description("A", z, 1, samples::X3P_LINK), &zeros).contains("regular grids"));
    assert!(with(&samples::x3p_description("I", z, 1, ""), &zeros).contains("neither DataLink"));
    assert!(
        with(&samples::x3p_description("I", "<DataType>Q</DataType>", 1, samples::X3P_LINK), &zeros).contains("type Q")
    );
    assert!(with(&good.replace("<SizeX>3", "<SizeX>0"), &zeros).contains("SizeX is 0"));
    assert!(with(&good.replace("SizeX>", "ListDimension>"), &zeros).contains("lists of points"));
    let huge = good.replace("<SizeX>3", "<SizeX>4000000000").replace("<SizeY>2", "<SizeY>4000000000");
    assert!(with(&huge, &zeros).contains("too large"));
    assert!(with("<p>", &zeros).contains("main.xml"));
    assert!(with(&good.replace("data.bin<", "other.bin<"), &zeros).contains("other.bin"));
    assert!(refusal("s.x3p", &samples::archive(&[("other.xml", b"")]), &NO_SCALE).contains("main.xml"));
    assert!(refusal("s.x3p", b"PK", &NO_SCALE).contains("X3P"));
    // The last entry of the archive's directory, that of the heights, has its CRC at byte 16.
    let mut damaged = samples::archive(&[("main.xml", good.as_bytes()), ("bindata/data.bin", &zeros)]);
    let entry = damaged.windows(4).rposition(|found| found == b"PK\x01\x02").unwrap();
    damaged[entry + 16] ^= 1;
    assert!(refusal("s.x3p", &damaged, &NO_SCALE).contains("checksum"));
    let two = samples::x3p_description("I", z, 2, samples::X3P_LINK);
    let (_folder, path) =
        in_folder("s.x3p", &samples::archive(&[("main.xml", two.as_bytes()), ("bindata/data.bin", &[0; 96])]));
    let third = ReadOptions { channel: Some("2".into()), ..Default::default() };
    let message = HeightField::read_with(path, &third).unwrap_err().to_string();
    assert!(message.contains("there are 0 (m), 1 (m)"), "{message}");
}

#[test]
fn nanoscope_heights_of_16_and_32_bits_are_read() {
    let half_a_step = 0.51 * samples::NANOSCOPE_STEP_UM;
    for wide in [false, true] {
        let bytes = samples::nanoscope(wide);
        for (name, channel) in [("s.spm", None), ("s.007", Some("2")), ("s.SPM", Some("height"))] {
            let read = check(name, &bytes, channel, None, half_a_step);
            assert_eq!(read.channel.as_deref(), Some("Height"));
        }
        let (_folder, path) = in_folder("s.spm", &bytes);
        let back = ReadOptions { channel: Some("3".into()), ..Default::default() };
        let read = HeightField::read_with(path, &back).unwrap();
        assert!((read.field.heights_um()[[0, 1]] + HEIGHTS[0][1]).abs() <= half_a_step);
    }
    // A scan that was stopped: a third row was to come.
    let stopped = String::from_utf8_lossy(&samples::nanoscope(false)[..4096])
        .replace("Number of lines: 2", "Number of lines: 3\r\n\\Valid data len Y: 2")
        .replace("Scan Size: 1.5 0.5", "Scan Size: 1.5 0.75");
    let bytes = [&stopped.as_bytes()[..4096], &samples::nanoscope(false)[4096..]].concat();
    check("s.spm", &bytes, None, None, half_a_step);
}

#[test]
fn unusable_nanoscope_files_are_refused() {
    let good = samples::nanoscope(true);
    let text = String::from_utf8_lossy(&good[..4096]).into_owned();
    let with = |from: &str, to: &str| {
        let mut bytes = text.replace(from, to).into_bytes();
        bytes.resize(4096, b'?');
        bytes.extend(&good[4096..]);
        refusal("s.spm", &bytes, &NO_SCALE)
    };
    let (_folder, path) = in_folder("s.spm", &good);
    let phase = ReadOptions { channel: Some("Phase".into()), ..Default::default() };
    let message = HeightField::read_with(path, &phase).unwrap_err().to_string();
    assert!(message.contains("not a length") && message.contains("2 \"Height\" (nm, trace)"), "{message}");
    assert!(with("nm/V", "pA/V").contains("no channel is in units of length"));
    assert!(with("Samps/line: 3", "Samps/line: 4").contains("4 × 2 points"));
    assert!(with("Data length: 24", "Data length: 24000").contains("24000 bytes"));
    assert!(with("Scan Size: 1.5 0.5 ~m", "Scan Size: none").contains("Scan Size"));
    assert!(with("Aspect ratio: 1:1", "Aspect ratio: 2:1").contains("`pixel_size`"));
    assert!(with("Bytes/pixel: 2", "Bytes/pixel: 3").contains("Bytes/pixel is 3, not 2 or 4"));
    assert!(with("Ciao image list", "AFM image list").contains("no channels"));
    assert!(with("\\@Sens. Zsens", "\\@Sens. Other").contains("no channel is in units"));
    assert!(refusal("s.000", b"Data_File_Type 7\n", &NO_SCALE).contains("\\*File list"));
    assert!(refusal("s.spm", &good[..good.len() - 25], &NO_SCALE).contains("ends early"));
}
