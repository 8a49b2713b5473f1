//! Texts of many programs: one relief in the form of each program, read back.

use super::*;

/// Points along x and y of the relief, with pixels of 0.05 × 0.08 µm.
const SIZE: (usize, usize) = (7, 5);
const PIXEL_UM: (f64, f64) = (0.05, 0.08);
/// Rounding of heights below 0.3 µm to eight digits.
const DIGITS_UM: f64 = 3e-9;

/// Heights in µm from the bottom row on; different from all reflections.
fn relief() -> Array2<f64> {
    Array2::from_shape_fn((SIZE.1, SIZE.0), |(iy, ix)| {
        0.1 * (1.3 * ix as f64).sin() + 0.02 * iy as f64 + 0.003 * (ix * iy) as f64
    })
}

/// Rows of numbers, from the top or the bottom row on, in a unit of `um` µm.
fn rows(top_down: bool, um: f64, separator: &str) -> String {
    let mut lines: Vec<String> = relief()
        .rows()
        .into_iter()
        .map(|row| row.iter().map(|h| format!("{:.8e}", h / um)).collect::<Vec<_>>().join(separator))
        .collect();
    if top_down {
        lines.reverse();
    }
    lines.join("\n") + "\n"
}

/// Lines of x, y and z, in units of `xy_um` and `z_um` µm.
fn point_lines(xy_um: f64, z_um: f64, separator: &str) -> String {
    let line = |((iy, ix), h): ((usize, usize), &f64)| {
        let (x, y) = (ix as f64 * PIXEL_UM.0 / xy_um, iy as f64 * PIXEL_UM.1 / xy_um);
        format!("{x:.9e}{separator}{y:.9e}{separator}{:.8e}\n", h / z_um)
    };
    relief().indexed_iter().map(line).collect()
}

fn latin(text: &str) -> Vec<u8> {
    text.chars().map(|c| c as u8).collect()
}

fn utf16(text: &str) -> Vec<u8> {
    [0xff, 0xfe].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect()
}

fn read(name: &str, bytes: &[u8], scale: &FileScale) -> FileField {
    let (_folder, path) = in_folder(name, bytes);
    let options = ReadOptions { scale: *scale, ..Default::default() };
    HeightField::read_with(&path, &options)
        .unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(bytes)))
}

/// Reads a file with size and unit, and compares it with the relief.
fn check(name: &str, bytes: &[u8]) -> FileField {
    let read = read(name, bytes, &NO_SCALE);
    compare(&read, (PIXEL_UM.0, PIXEL_UM.1), &String::from_utf8_lossy(bytes));
    read
}

fn compare(read: &FileField, (dx, dy): (f64, f64), what: &str) {
    let field = &read.field;
    assert_eq!(field.size(), SIZE, "{what}");
    let off = (field.dx_um() / dx - 1.0).abs().max((field.dy_um() / dy - 1.0).abs());
    assert!(off < 1e-6, "pixels of {} × {} µm: {what}", field.dx_um(), field.dy_um());
    let error = (field.heights_um() - &relief()).iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    assert!(error < DIGITS_UM, "off by {error} µm: {what}");
}

/// Origins of pixel size, unit of heights, and first row.
fn sources(read: &FileField) -> [Source; 3] {
    let provenance = read.provenance.as_ref().unwrap();
    [provenance.pixel_size.source, provenance.height_unit.source, provenance.rows.source]
}

#[test]
fn gwyddion_headers_are_read_in_any_language_and_encoding() {
    let body = rows(true, 1e6, "\t");
    let headers = [
        "# Channel: Height\n# Width: 350.000 nm\n# Height: 0.40000 µm\n# Value units: m\n",
        "# Kanal: Topographie\n# Breite: 350,000 nm\n# Höhe: 0,40000 µm\n# Werteeinheiten: m\n",
        "# Kanál: Výška\n# Šířka: 0.35 µm\n# Výška: 0.4 µm\n# Jednotky hodnot: m\n",
        "# Канал: Z\n# Ширина: 0,35 µm\n# Высота: 0,4 µm\n# Единицы: m\n",
        "# チャネル： Z\n# 幅： 350 nm\n# 高さ： 400 nm\n# 値の単位： m\n",
    ];
    for header in headers {
        let text = format!("{header}{body}");
        let read = check("skin.txt", text.as_bytes());
        assert_eq!(sources(&read), [Source::File, Source::File, Source::Format], "{header}");
        assert!(read.channel.is_some(), "{header}");
        check("skin.asc", &utf16(&text));
        check("skin.dat", text.replace('\n', "\r\n").as_bytes());
        check("skin.txt", text.replace('\n', "\r").as_bytes());
        check("skin.txt", (text.replace('\n', "\r\n") + "\u{1a}").as_bytes());
        check("skin.txt", &utf16(&text)[2..]);
        check("skin.txt", text.replace('.', ",").as_bytes());
        if text.chars().all(|c| u32::from(c) < 256) {
            check("skin.txt", &latin(&text));
        }
    }
    // A channel in V is no relief, one without a unit needs a scale, and a size in a strange unit is refused by its
    // line.
    let with = |from: &str, to: &str| refusal("skin.txt", (headers[0].replace(from, to) + &body).as_bytes(), &NO_SCALE);
    assert!(with("units: m", "units: V").contains("unit \"V\" is not a known unit of length"));
    assert!(with("units: m", "units: ").contains("`max_height`"));
    assert!(with("350.000 nm", "350.000 parsec").contains("line 2, \"# Width: 350.000 parsec\""));
    assert!(with("# Width: 350.000 nm\n", "").contains("a size along y and none along x"));
    let czech = headers[2].replace("hodnot: m", "hodnot: deg") + &body;
    assert!(refusal("skin.txt", czech.as_bytes(), &NO_SCALE).contains("\"deg\" is not a known unit of length"));
}

#[test]
fn gwyddion_points_are_read_in_any_language() {
    for header in [
        "# Channel: Height\n# Lateral units: m\n# Value units: m\n",
        "# Kanal: Höhe\n# Seitliche Einheiten: m\n# Werteeinheiten: m\n",
    ] {
        for name in ["skin.xyz", "skin.txt"] {
            check(name, format!("{header}{}", point_lines(1e6, 1e6, "\t")).as_bytes());
        }
    }
}

#[test]
fn spip_headers_units_and_masks_are_read() {
    let header = "# File Format = ASCII\r\n# Created by SPIP 6.7.3\r\n# Original file: skin 2.spm\r\n# x-pixels = 7\r\n\
                  # y-pixels = 5\r\n# x-length = 350\r\n# y-length = 400\r\n# x-offset = 12\r\n\
                  # y-offset = 0\r\n# z-unit = nm\r\n\
                  # scanspeed = 12.5\r\n# voidpixels =0\r\n# description: 3 µm away\r\n# Start of Data:\r\n";
    let body = rows(true, 1e-3, "\t");
    let text = format!("{header}{body}");
    let read = check("skin.asc", text.as_bytes());
    assert_eq!(sources(&read), [Source::File, Source::File, Source::Format]);
    check("skin.txt", &latin(&text));
    check("skin.asc", text.replace("# z-unit = nm\r\n", "# Bit2nm = 1.0\r\n").as_bytes());
    check("skin.asc", format!("{}{}", header.replace("z-unit = nm", "z-unit = µm"), rows(true, 1.0, "\t")).as_bytes());
    // Twice as many numbers: the second half is 0 where a point is missing.
    let mask = "1\t1\t1\t1\t1\t1\t1\n".repeat(4) + "1\t0\t1\t1\t1\t1\t1\n";
    let masked = format!("{}{body}{mask}", header.replace("voidpixels =0", "voidpixels =1"));
    let message = refusal("skin.asc", masked.as_bytes(), &NO_SCALE);
    assert!(message.contains("1 of 35 points") && message.contains("row 4, column 1"), "{message}");
    let with = |from: &str, to: &str| refusal("skin.asc", text.replace(from, to).as_bytes(), &NO_SCALE);
    assert!(with("x-pixels = 7", "x-pixels = 8").contains("promises 8 × 5 heights, but 35 numbers follow"));
    assert!(with("z-unit = nm", "z-unit = V").contains("\"V\" is not a known unit of length"));
    assert!(with("x-length = 350", "x-length = wide").contains("line 6, \"# x-length = wide\""));
}

#[test]
fn wsxm_matrices_and_points_are_read() {
    let header = "WSxM file copyright UAM\nWSxM ASCII Matrix file\nX Amplitude: 350 nm\nY Amplitude: 0.4 µm\n\
        Z Amplitude: 0.29 nm\n\n";
    check("skin.txt", format!("{header}{}", rows(true, 1e-3, "\t")).as_bytes());
    let points = format!(
        "WSxM file copyright Nanotec Electronica\nWSxM ASCII XYZ file\nX[nm]\tY[nm]\tZ[nm]\n\n{}",
        point_lines(1e-3, 1e-3, "\t")
    );
    check("skin.txt", points.as_bytes());
    check("skin.xyz", points.as_bytes());
    // Heights in ångström, in Latin-1.
    let angstroms = points.replace("Z[nm]", "Z[Å]");
    let (low, high) = read("skin.txt", &latin(&angstroms), &NO_SCALE).field.range_um();
    let expected = relief().iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
    assert!((low * 10.0 - expected.0).abs() < DIGITS_UM && (high * 10.0 - expected.1).abs() < DIGITS_UM);
}

#[test]
fn geographic_grids_are_read() {
    let header = "ncols         7\nnrows         5\nxllcorner     0.0\nyllcorner     3.5\ndx            0.05\n\
        dy            0.08\n\
                  NODATA_value  -9999\n";
    let body = rows(true, 1.0, " ");
    let read = check("skin.asc", format!("{header}{body}").as_bytes());
    assert_eq!(sources(&read), [Source::File, Source::Default, Source::Format]);
    let square = header.replace("dx            0.05\ndy            0.08", "cellsize 0.05");
    compare(&self::read("skin.asc", format!("{square}{body}").as_bytes(), &NO_SCALE), (0.05, 0.05), &square);
    // Lines may be wrapped, since the header has the numbers of points.
    let wrapped = format!("{header}{}", body.replacen(' ', "\n", 3));
    check("skin.asc", wrapped.as_bytes());
    let first = body.split(' ').next().unwrap();
    let holed = format!("{header}{}", body.replacen(first, "-9999", 1));
    assert!(refusal("skin.asc", holed.as_bytes(), &NO_SCALE).contains("1 of 35 points"));
    let surfer = format!("DSAA\n7 5\n0 0.30\n1 1.32\n-0.1 0.3\n{}", rows(false, 1.0, " ").replace('\n', "\n\n"));
    for name in ["skin.grd", "skin.txt"] {
        assert_eq!(sources(&check(name, surfer.as_bytes())), [Source::File, Source::Default, Source::Format]);
    }
    assert!(refusal("skin.grd", b"DSBB\x07\0\x05\0", &NO_SCALE).contains("binary grid of Surfer"));
    assert!(
        refusal("skin.grd", surfer.replace("7 5", "8 5").as_bytes(), &NO_SCALE).contains("8 × 5 heights are promised")
    );
}

#[test]
fn nanoscope_exports_are_read() {
    let header = "\\*File list\n\\Version: 0x09700204\n\\*Ciao scan list\n\
                  \\Scan Size: 0.35 0.4 ~m\n\\*Ciao image list\n\
                  \\Samps/line: 7\n\\Number of lines: 5\n\
                  \\Aspect Ratio: 1:1\n\\Scan Size: 0.35 0.4 ~m\n\\*File list end\n";
    let heights: Vec<String> = relief().iter().map(|h| format!("{:.8e}", h * 1e3)).collect();
    let column = format!("{header}Height(nm)\n{}\n", heights.join("\n"));
    assert_eq!(check("skin.txt", column.as_bytes()).channel.as_deref(), Some("Height"));
    let errors: Vec<String> = heights.iter().map(|h| format!("7.5\t{h}\t1.25")).collect();
    let three = format!("{header}Deflection_Error(nm)\tHeight_Sensor(nm)\tPhase(Deg)\n{}\n", errors.join("\n"));
    assert_eq!(check("skin.txt", &latin(&three)).channel.as_deref(), Some("Height Sensor"));
    let (_folder, path) = in_folder("skin.txt", three.as_bytes());
    let channel = |channel: &str| ReadOptions { channel: Some(channel.to_owned()), ..Default::default() };
    let phase = HeightField::read_with(&path, &channel("3")).unwrap_err().to_string();
    assert!(phase.contains("3 \"Phase\" (Deg) is not a length"), "{phase}");
    assert_eq!(HeightField::read_with(&path, &channel("Deflection Error")).unwrap().field.range_um(), (7.5e-3, 7.5e-3));
    assert!(
        refusal("skin.txt", column.replace("(nm)", "(V)").as_bytes(), &NO_SCALE)
            .contains("\"V\" is not a known unit of length")
    );
    assert!(refusal("skin.txt", column.replace("lines: 5", "lines: 6").as_bytes(), &NO_SCALE).contains("7 × 6 points"));
}

#[test]
fn headers_of_keys_and_values_are_read_or_refused() {
    let body = rows(false, 1e-3, ";");
    for header in [
        "Channel name;Z Height\nX Scan Size;0.35 µm\nY Scan Size;0.4 µm\nZ unit;nm\nX Pixels;7\nY Pixels;5\n",
        "Scan size: 350 x 400 nm\nResolution: 7 x 5\nUnit: nm\n",
        "# Width [µm]: 0.35\n# Height [µm]: 0.4\n# Units: nanometers\n",
        "% pixel size = 0.05 µm x 0.08 µm\n% heights in nm\n",
        "w=7 h=5\npixel width: 50 nm/pixel\npixel height: 80 nm/pixel\nData unit=nm\nScan rate: 1.2 Hz\n\
            Tip radius: 8 nm\n",
    ] {
        // Width, height and unit in Gwyddion's order imply that the top row is first. The default is the bottom row.
        let top_down = header.contains("Width [µm]");
        check("skin.csv", format!("{header}{}", rows(top_down, 1e-3, ";")).as_bytes());
    }
    // A hologram in radians, with the height of one radian.
    let hologram = "h=5 w=7\npixel size=5e-008 m x 8e-008 m\ndata unit=rad\nheight conversion factor (-> m)=2.5e-008\n";
    check("skin.txt", format!("{hologram}{}", rows(false, 2.5e-2, " ")).as_bytes());
    let no_factor = hologram.replace("height conversion factor (-> m)=2.5e-008\n", "");
    let message = refusal("skin.txt", format!("{no_factor}{body}").as_bytes(), &NO_SCALE);
    assert!(message.contains("\"rad\" is not a known unit of length"), "{message}");
    // A field of three columns, since its header has a size.
    let small = "# Width: 12.34 µm\n# Height: 5678.9 nm\n# Value units: m\n1e-6 1.5e-6 3e-6\n\
        -2e-6 -3e-6 -6e-6\n0 0 0\n9e-6 9e-6 9e-6\n";
    assert_eq!(self::read("skin.txt", small.as_bytes(), &NO_SCALE).field.size(), (3, 4));
    // A size for both axes: square pixels.
    let read = self::read("skin.txt", format!("Scan Size: 0.35 µm\nz unit: nm\n{body}").as_bytes(), &NO_SCALE);
    compare(&read, (0.05, 0.05), "scan size");
    assert_eq!(sources(&read)[0], Source::Guess);
    for (header, word) in [
        ("# field of view 12 µm\n", "line 1"),
        ("# taken with a scan of 12 µm\n", "line 1"),
        ("Size: big\n", "line 1"),
        ("spacing: 0.05\n", "line 1"),
        ("lengths in furlong: 3 nm\n", "line 1"),
        ("Scan size: 350 x 400 nm\npixel size: 2 µm\n", "a spacing of 2 µm and a length of 0.35 µm for 7 points"),
        ("Scan size: 350 x 400 nm\npixel size: 0 µm\n", "a spacing of 0 µm and a length of 0.35 µm for 7 points"),
        ("Number of points: 36\n", "36 points, but 7 × 5 follow"),
    ] {
        let message = refusal("skin.txt", format!("{header}{body}").as_bytes(), &scale(0.05, None));
        assert!(message.contains(word), "{header}: {message}");
    }
    // Header lines without a size or a unit.
    for header in
        ["# made on 2026-11-26\n", "# heights\n", "Instrument: AFM 3\nSerial: 12 m\n", "# Number of points: 35\n"]
    {
        let read = self::read("skin.txt", format!("{header}{}", rows(false, 1.0, " ")).as_bytes(), &scale(0.05, None));
        compare(&read, (0.05, 0.05), header);
        assert_eq!(sources(&read), [Source::Option, Source::Default, Source::Default]);
    }
}

#[test]
fn points_are_recognised_with_any_extension() {
    for separator in [" ", "\t", ",", ";"] {
        for name in ["skin.txt", "skin.csv", "skin.asc", "skin.dat", "skin.xyz"] {
            let read = check(name, point_lines(1.0, 1.0, separator).as_bytes());
            assert_eq!(sources(&read), [Source::Default, Source::Default, Source::File]);
        }
    }
    check("skin.csv", format!("x (nm),y (nm),z (µm)\n{}", point_lines(1e-3, 1.0, ",")).as_bytes());
    check("skin.csv", format!("X;Y;Z\n{}", point_lines(1.0, 1.0, ";").replace('.', ",")).as_bytes());
    let more: String = point_lines(1.0, 1.0, " ").lines().map(|line| format!("{line} 255\n")).collect();
    let numbered: String =
        point_lines(1.0, 1.0, ",").lines().enumerate().map(|(at, line)| format!("{at},{line}\n")).collect();
    for text in [more, numbered] {
        assert!(refusal("skin.txt", text.as_bytes(), &scale(0.05, None)).contains("keep the columns x, y and z"));
    }
}

#[test]
fn lists_profiles_and_tables_with_coordinates_are_refused() {
    let with_index = |separator: &str| -> String {
        let mut text = (0..7).map(|ix| format!("{separator}{ix}")).collect::<String>() + "\n";
        for (iy, line) in rows(false, 1.0, separator).lines().enumerate() {
            text += &format!("{iy}{separator}{line}\n");
        }
        text
    };
    let profile: String = (0..40).map(|at| format!("{at} {}\n", (f64::from(at) * 0.3).sin())).collect();
    let scattered: String = (0..40)
        .map(|at| {
            let a = f64::from(at);
            format!("{} {} {}\n", (a * 0.37).sin(), (a * 1.7).cos(), a * 0.01)
        })
        .collect();
    for (text, word) in [
        ("1 2 3 4 5 6".to_owned(), "one row of 6 numbers, a list or a profile"),
        ("1\n2\n3\n".to_owned(), "one column of 3 numbers"),
        (profile, "two columns of 40 numbers, a profile"),
        ("1 2 3 4\n5 6 7 8\n".to_owned(), "2 rows of 4 numbers"),
        (scattered, "neither points x, y, z"),
        (with_index(","), "first row and column counts in equal steps"),
        ("0,41,0,40,0,05\n".repeat(4), "write decimal points"),
    ] {
        let message = refusal("skin.csv", text.as_bytes(), &scale(0.05, None));
        assert!(message.contains(word), "{message}\n{text}");
    }
}

#[test]
fn isolated_numbers_are_missing_points() {
    let values = |fill: &str| rows(false, 1.0, " ").replacen(rows(false, 1.0, " ").split(' ').nth(2).unwrap(), fill, 1);
    for number in ["-999", "-9999", "-32768", "99"] {
        let text = values(number);
        let message = refusal("skin.txt", text.as_bytes(), &scale(0.05, None));
        assert!(message.contains(&format!("1 of them {number}, isolated")) && message.contains("`fill`"), "{message}");
        let (_folder, path) = in_folder("skin.txt", text.as_bytes());
        let options = ReadOptions { scale: scale(0.05, None), fill: Fill::Laplace, ..Default::default() };
        let read = HeightField::read_with(&path, &options).unwrap();
        assert_eq!((read.filled, read.provenance.unwrap().holes.source), (1, Source::Guess));
        assert_eq!(read.doubts, [Doubt::Isolated { value: number.parse().unwrap(), count: 1 }]);
    }
}

#[test]
fn exact_levels_are_no_missing_points() {
    // A lamellar grating as a tip with rounded corners images it: 20 of 40 heights are 0.
    let row: Vec<f64> =
        (0..40).map(|ix| [0.0, 0.125, 0.1275][usize::from(ix % 20 > 9) + usize::from(ix % 20 == 15)]).collect();
    let line = row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ") + "\n";
    let grating = self::read("grating.txt", line.repeat(6).as_bytes(), &scale(0.05, None));
    assert!(grating.doubts.is_empty(), "{:?}", grating.doubts);
    assert_eq!(grating.field.range_um(), (0.0, 0.1275));
    let marked = line.repeat(6).replacen("0.1275", "-9999", 1);
    let message = refusal("grating.txt", marked.as_bytes(), &scale(0.05, None));
    assert!(message.contains("1 of 240 points") && message.contains("1 of them -9999"), "{message}");
}

#[test]
fn implausible_reliefs_are_doubted() {
    let metres = self::read("skin.txt", rows(false, 1e6, " ").as_bytes(), &scale(0.05, None));
    assert!(matches!(metres.doubts[..], [Doubt::Shallow { .. }]), "{:?}", metres.doubts);
    let long = format!("pixel size: 0.05 x 0.5 µm\nunit: µm\n{}", rows(false, 1.0, " "));
    let doubts = self::read("skin.txt", long.as_bytes(), &NO_SCALE).doubts;
    assert_eq!(doubts, [Doubt::LongPixels { dx_um: 0.05, dy_um: 0.5 }]);
    assert!(check("skin.xyz", point_lines(1.0, 1.0, " ").as_bytes()).doubts.is_empty());
}

#[test]
fn all_formats_give_one_relief() {
    let folder = tempfile::tempdir().unwrap();
    let field = HeightField::new(relief(), PIXEL_UM.0, PIXEL_UM.1).unwrap();
    for name in ["a.exr", "a.gsf"] {
        let path = folder.path().join(name);
        field.write(&path).unwrap();
        let back = HeightField::read(&path, &NO_SCALE).unwrap();
        assert!(largest_difference(&back, &field) < FLOAT_UM, "{name}");
    }
    // Digits enough for doubles.
    let exact: String = relief()
        .rows()
        .into_iter()
        .map(|row| row.iter().map(|h| format!("{h:?} ")).collect::<String>() + "\n")
        .collect();
    let text = format!("dx: 0.05 µm\ndy: 0.08 µm\nunit: µm\n{exact}");
    assert_eq!(self::read("a.txt", text.as_bytes(), &NO_SCALE).field, field);
}
