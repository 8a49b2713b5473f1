//! Small sample files of all formats.

use std::io::{Cursor, Write};

/// Heights of all samples in µm, from the bottom row on; different from all reflections.
pub(crate) const HEIGHTS: [[f64; 3]; 2] = [[0.5, -0.25, 1.0], [0.125, 0.75, 0.25]];

/// Heights in metres, from the bottom or the top row on.
fn metres(top_down: bool) -> Vec<f64> {
    let mut rows = HEIGHTS;
    if top_down {
        rows.reverse();
    }
    rows.iter().flatten().map(|h| h * 1e-6).collect()
}

/// A component of a Gwyddion object: name, letter and value.
pub(crate) fn component(name: &str, letter: u8, value: &[u8]) -> Vec<u8> {
    [name.as_bytes(), &[0, letter], value].concat()
}

pub(crate) fn object(type_name: &str, components: &[Vec<u8>]) -> Vec<u8> {
    let body = components.concat();
    [type_name.as_bytes(), &[0], &(body.len() as u32).to_le_bytes(), &body].concat()
}

fn doubles(values: &[f64]) -> Vec<u8> {
    let bytes = values.iter().flat_map(|v| v.to_le_bytes());
    (values.len() as u32).to_le_bytes().into_iter().chain(bytes).collect()
}

fn unit(name: &str) -> Vec<u8> {
    object("GwySIUnit", &[component("unitstr", b's', &[name.as_bytes(), &[0]].concat())])
}

/// A field of 3 × 2 values with an extent of 1.5 by 0.5 in the unit `xy`.
pub(crate) fn data_field(xy: &str, z: &str, values: &[f64]) -> Vec<u8> {
    let real = |value: f64| value.to_le_bytes();
    let parts = [
        component("xres", b'i', &3_i32.to_le_bytes()),
        component("yres", b'i', &2_i32.to_le_bytes()),
        component("xreal", b'd', &real(1.5)),
        component("yreal", b'd', &real(0.5)),
        component("xoff", b'd', &real(7.0)),
        component("si_unit_xy", b'o', &unit(xy)),
        component("si_unit_z", b'o', &unit(z)),
        component("data", b'D', &doubles(values)),
    ];
    object("GwyDataField", &parts)
}

/// Three channels: 0 is a phase; 2 are heights in metres with pixels of 0.5 × 0.25 µm; 11 are negative heights in nm.
pub(crate) fn gwy(with_mask: bool) -> Vec<u8> {
    let title = |text: &str| [text.as_bytes(), &[0]].concat();
    let heights = metres(true);
    let in_nm: Vec<f64> = heights.iter().map(|h| -1e9 * h).collect();
    let mut parts = vec![
        component("/filename", b's', &title("skin.gwy")),
        component("/0/data/visible", b'b', &[1]),
        component("/0/data", b'o', &data_field("µm", "deg", &[0.0; 6])),
        component("/0/data/title", b's', &title("Phase")),
        component("/11/data", b'o', &data_field("µm", "nm", &in_nm)),
        component("/11/data/title", b's', &title("Height (inverted)")),
        component("/2/base/palette", b's', &title("Gold")),
        component("/2/data", b'o', &data_field("µm", "m", &heights)),
        component("/2/data/title", b's', &title("Height")),
        component("/2/meta", b'o', &object("GwyContainer", &[component("Version", b's', &title("2.60"))])),
        component("/2/log", b'S', &[&2_u32.to_le_bytes()[..], b"opened\0saved\0"].concat()),
        component("/list", b'O', &[&1_u32.to_le_bytes()[..], &unit("V")].concat()),
        component("/numbers", b'I', &[&1_u32.to_le_bytes()[..], &[1, 0, 0, 0]].concat()),
    ];
    if with_mask {
        parts.push(component("/2/mask", b'o', &data_field("µm", "", &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0])));
    }
    [b"GWYP".to_vec(), object("GwyContainer", &parts)].concat()
}

/// Surface data file in binary, with heights in nm as 16-bit integers (`code` 5) or as doubles (7); the second point is
/// missing.
pub(crate) fn sdf_binary(revision: &str, code: u8) -> Vec<u8> {
    let mut bytes = format!("b{revision}Sunbeam   010120260000010120260000").into_bytes();
    let counts = [3_u32, 2];
    for count in counts {
        let count = count.to_le_bytes();
        bytes.extend(if revision == "ISO-2.0" { &count[..] } else { &count[..2] });
    }
    for scale in [5e-7, 2.5e-7, 1e-9, -1.0_f64] {
        bytes.extend(scale.to_le_bytes());
    }
    bytes.extend([0, code, 0]);
    let is_bcr = revision == "BCR-1.0";
    for (at, height) in metres(is_bcr).iter().enumerate() {
        let stored = height * 1e9;
        match code {
            5 if at == 1 => bytes.extend((if is_bcr { i16::MAX } else { i16::MIN }).to_le_bytes()),
            5 => bytes.extend((stored.round() as i16).to_le_bytes()),
            _ if at == 1 => bytes.extend((if is_bcr { f64::MAX } else { f64::MIN }).to_le_bytes()),
            _ => bytes.extend(stored.to_le_bytes()),
        }
    }
    bytes
}

/// ISO 25178-71 as text, with heights in µm; `second` stands for the second one.
pub(crate) fn sdf_text(second: &str) -> String {
    let heights: Vec<String> = metres(false).iter().map(|h| format!("{}", h * 1e6)).collect();
    format!(
        "aISO-1.0\r\nManufacID = Sunbeam\r\nCreateDate = 010120260000\r\nModDate = 010120260000\r\nNumPoints = 3\r\n\
         NumProfiles = 2\r\nXscale = 5.0e-7\r\nYscale = 2.5E-07\r\nZscale = 1.0E-6\r\nZresolution = -1\r\n\
         Compression = 0\r\n\
         DataType = 7\r\nCheckType = 0\r\n*\r\n{} {second} {}\r\n{}\r\n*\r\nOperator = nobody\r\n*",
        heights[0],
        heights[2],
        heights[3..].join(" ")
    )
}

pub(crate) const X3P_LINK: &str = "<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink>";

pub(crate) fn x3p_description(axis: &str, z: &str, layers: usize, data: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
        <p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1><Revision>ISO5436 - 2000</Revision>
        <FeatureType>SUR</FeatureType><Axes>
        <CX><AxisType>{axis}</AxisType><DataType>D</DataType><Increment>5e-7</Increment><Offset>0</Offset></CX>
        <CY><AxisType>I</AxisType><Increment>2.5E-7</Increment></CY>
        <CZ><AxisType>A</AxisType>{z}</CZ></Axes></Record1>
        <Record3><MatrixDimension><SizeX>3</SizeX><SizeY>2</SizeY><SizeZ>{layers}</SizeZ>\
        </MatrixDimension>{data}</Record3>
        <Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>"#
    )
}

pub(crate) fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        archive.start_file(*name, options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// X3P with heights as 16-bit integers of 1 nm and an offset of 0.25 µm; with a mask the second point is not valid.
pub(crate) fn x3p(with_mask: bool) -> Vec<u8> {
    let z = "<DataType>I</DataType><Increment>1e-9</Increment><Offset>2.5e-7</Offset>";
    let stored: Vec<u8> =
        metres(false).iter().flat_map(|h| (((h - 2.5e-7) * 1e9).round() as i16).to_le_bytes()).collect();
    let valid = "<ValidPointsLink>bindata/valid.bin</ValidPointsLink></DataLink>";
    let link = if with_mask { X3P_LINK.replace("</DataLink>", valid) } else { X3P_LINK.to_owned() };
    let xml = x3p_description("I", z, 1, &link);
    archive(&[("main.xml", xml.as_bytes()), ("bindata/data.bin", &stored), ("bindata/valid.bin", &[0b0011_1101])])
}

/// Step of the heights of [`nanoscope`].
pub(crate) const NANOSCOPE_STEP_UM: f64 = 10.0 / 65536.0;

/// NanoScope file of three channels: a phase, heights, and heights of the backward scan; `wide` stores four bytes a
/// number.
pub(crate) fn nanoscope(wide: bool) -> Vec<u8> {
    let rows = metres(false);
    let size = if wide { 4 } else { 2 };
    // 200 V at 50 nm/V over the full range of 16 bits.
    let lsb = NANOSCOPE_STEP_UM * 1e-6;
    let offset = 4096;
    let image = |place: usize, title: &str, soft: &str, direction: &str| {
        format!(
            "\\*Ciao image list\r\n\\Data offset: {}\r\n\\Data length: {}\r\n\\Bytes/pixel: 2\r\n\\Samps/line: 3\r\n\
             \\Number of lines: 2\r\n\\Aspect ratio: 1:1\r\n\
             \\Scan Size: 1.5 0.5 ~m\r\n\\Line Direction: {direction}\r\n\
             \\@2:Image Data: S [{title}] \"{title}\"\r\n\\@Z magnify: C [2:Z scale] 1.000000\r\n\
             \\@2:Z scale: V [{soft}] (0.000305 V/LSB) 200.0000 V\r\n",
            offset + place * 6 * size,
            6 * size
        )
    };
    let mut header =
        "\\*File list\r\n\\Version: 0x09200000\r\n\\*Ciao scan list\r\n\\@Sens. Zsens: V 50.00000 nm/V\r\n\
                      \\@Sens. Phase: V 1.000000 \r\n"
            .to_owned();
    header += &image(0, "Phase", "Sens. Phase", "Trace");
    header += &image(1, "Height", "Sens. Zsens", "Trace");
    header += &image(2, "Height", "Sens. Zsens", "Retrace");
    header += "\\*File list end\r\n";
    let mut bytes = header.into_bytes();
    bytes.push(0x1a);
    bytes.resize(offset, b'?');
    for sign in [0.0, 1.0, -1.0] {
        for height in &rows {
            let stored = (sign * height / lsb).round() as i32;
            bytes.extend(&stored.to_le_bytes()[..size]);
        }
    }
    bytes
}

/// A TIFF page of 16-bit grey: heights above −0.25 µm in steps of 0.125 µm. `resolution` is the code of its unit and
/// the pixels per unit along x; along y it is doubled.
pub(crate) fn tiff(description: Option<&str>, resolution: Option<(u16, u32)>) -> Vec<u8> {
    use tiff::encoder::{Rational, TiffEncoder, colortype::Gray16};
    use tiff::tags::{ResolutionUnit, Tag};
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    let mut page = encoder.new_image::<Gray16>(3, 2).unwrap();
    if let Some(text) = description {
        page.encoder().write_tag(Tag::ImageDescription, text).unwrap();
    }
    if let Some((unit, per_unit)) = resolution {
        let unit = [ResolutionUnit::None, ResolutionUnit::Inch, ResolutionUnit::Centimeter][usize::from(unit) - 1];
        page.resolution_unit(unit);
        page.x_resolution(Rational { n: per_unit, d: 1 });
        page.y_resolution(Rational { n: 2 * per_unit, d: 1 });
    }
    let stored: Vec<u16> = metres(true).iter().map(|h| ((h * 1e6 + 0.25) / 0.125).round() as u16).collect();
    page.write_data(&stored).unwrap();
    file.into_inner()
}

/// The points of the grid from the last to the first, without the second one.
pub(crate) fn xyz() -> String {
    let mut lines = Vec::new();
    for (iy, row) in HEIGHTS.iter().enumerate() {
        for (ix, height) in row.iter().enumerate() {
            lines.push(format!("{} {} {height}", 7.0 + 0.5 * ix as f64, -1.0 + 0.25 * iy as f64));
        }
    }
    lines.remove(1);
    lines.reverse();
    format!("# x y z in µm\n{}\n", lines.join("\n"))
}

/// Texts: a bare matrix with a missing point, one with decimal commas, and some with headers of Gwyddion, SPIP, ESRI,
/// NanoScope and WSxM.
pub(crate) fn texts() -> Vec<Vec<u8>> {
    let rows = "0.1 0.2 0.3 0.5\n0.4 0.1 0.2 0.6\n0.3 0.2 0.1 0.7\n";
    let tabs = rows.replace(' ', "\t");
    let points: String = (0..12).map(|at| format!("{} {} {}\n", 3 * (at % 4), 2 * (at / 4), 5 * at % 7)).collect();
    let column = rows.split_whitespace().collect::<Vec<_>>().join("\n");
    let gwyddion = format!("# Channel: Z\n# Width: 2.4 µm\n# Height: 1600 nm\n# Value units: µm\n{tabs}");
    let utf16 = gwyddion.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let spip = "# File Format = ASCII\n# x-pixels = 4\n# y-pixels = 3\n# x-length = 2400\n# y-length = 1600\n\
        # z-unit = µm\n\
                # voidpixels = 0\n# Start of Data:\n";
    let esri = "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 0.5\nNODATA_value -9999\n";
    let nanoscope = "\\*File list\n\\*Ciao image list\n\\Scan Size: 2 1.5 ~m\n\\Samps/line: 4\n\\Number of lines: 3\n\
                     \\Aspect Ratio: 1:1\n\\*File list end\nHeight(nm)\n";
    vec![
        rows.replace("0.6", "-1e38").into_bytes(),
        tabs.replace('.', ",").into_bytes(),
        gwyddion.clone().into_bytes(),
        utf16,
        format!("{spip}{tabs}").into_bytes(),
        format!("{esri}{rows}").into_bytes(),
        format!("{nanoscope}{column}\n").into_bytes(),
        format!("WSxM file copyright UAM\nX[nm] Y[nm] Z[nm]\n{points}").into_bytes(),
        format!("Scan size: 2 x 1.5 µm\nPixels: 4 x 3\nUnit: nm\n{}", rows.replace(' ', ";")).into_bytes(),
    ]
}

/// A text grid of Surfer of 4 × 3 nodes.
pub(crate) fn surfer() -> String {
    "DSAA\n4 3\n0 1.5\n0 1\n0.1 0.7\n0.1 0.2 0.3 0.5\n\n0.4 0.1 0.2 0.6\n\n0.3 0.2 1.70141e38 0.7\n".to_owned()
}
