//! `sunbeam brdf-map`: orientation and position of the light in the map.

use super::support::{run, succeeded};
use serde_json::{Value, json};

#[test]
fn a_blazed_grating_is_bright_at_its_facets_mirror_direction() {
    // A facet that rises along +x by tanα = 0.25/2.5 mirrors the normal to wo.x = −sin 2α = −0.198
    // (docs/model.md#the-phase-screen); the orders lie at multiples of λ/2.5 µm, so the middle of the visible, 500 nm
    // in the first order, is right there.
    let expected = -(2.0 * 0.1f64.atan()).sin();
    let folder = tempfile::tempdir().unwrap();
    let (map, picture) = (folder.path().join("map.exr"), folder.path().join("map.png"));
    let size = 61;
    for method in ["table", "exact", "flss", "pq", "nmm"] {
        // The directions determine the wavelengths of nmm.
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
    // Light from azimuth 90° (+y) is mirrored to −y, in the lower half of the picture.
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

/// The largest map, of 16 384² pixels, must fit the memory that `SIDE_PIXELS` of `brdf_map.rs` states.
#[cfg(target_os = "linux")]
#[test]
fn a_map_takes_24_bytes_a_pixel() {
    use std::fs;
    use std::process::{Command, Stdio};
    const SIDE: usize = 2048;
    /// Memory in bytes of the program and of the method's data.
    const OTHER_BYTES: usize = 60_000_000;
    let folder = tempfile::tempdir().unwrap();
    let (map, picture) = (folder.path().join("map.exr"), folder.path().join("map.png"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_sunbeam"))
        .args(["brdf-map", "--preset", "blazed", "--method", "stam", "--size", &SIDE.to_string()])
        .args([["-o".as_ref(), map.as_os_str()], ["--png".as_ref(), picture.as_os_str()]].concat())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // The peak of the memory until now, in kB; encoding the PNG at the end takes longer than the pause.
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kb = 0;
    while child.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak_kb = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse().ok()).unwrap_or(peak_kb);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(child.wait().unwrap().success());
    let (found, allowed) = (1000 * peak_kb, 24 * SIDE * SIDE + OTHER_BYTES);
    assert!(found > 12 * SIDE * SIDE && found < allowed, "{found} bytes, {allowed} allowed");
}

/// The pixels, by rows from the top.
fn read_exr(path: &str) -> Vec<[f32; 3]> {
    use exr::prelude::*;
    let create = |size: Vec2<usize>, _: &RgbaChannels| (size.width(), vec![[0.0f32; 3]; size.area()]);
    let set = |(width, pixels): &mut (usize, Vec<[f32; 3]>), at: Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        pixels[at.y() * *width + at.x()] = [r, g, b];
    };
    let image = read_first_rgba_layer_from_file(path, create, set).unwrap();
    image.layer_data.channel_data.pixels.1
}
