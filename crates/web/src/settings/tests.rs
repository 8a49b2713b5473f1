//! Tests of [`Settings`], and of the errors of [`Relief`] for bad files.

use crate::{Relief, Settings, WebError};
use std::f64::consts::TAU;
use sunbeam::table::Progress;
use sunbeam_realtime::Camera;

/// Message of the refusal of these settings.
fn refusal(json: &str) -> String {
    let error = Settings::from_json(json).expect_err(json);
    assert_eq!(error.kind(), "settings");
    error.to_string()
}

#[test]
fn missing_fields_take_their_defaults_and_survive_a_round_trip() {
    let settings = Settings::from_json("{}").unwrap();
    assert_eq!(settings, Settings::default());
    assert_eq!(settings.to_compact_json(), "{}");
    assert_eq!(Settings::from_json(&settings.to_json()).unwrap(), settings);
    let (camera, expected) = (settings.view(1).unwrap().camera, Camera::default());
    for c in 0..3 {
        // Settings round the distance in cm and the angles in degrees to 0.01; the camera moves by less than 0.01 cm.
        assert!((camera.origin[c] - expected.origin[c]).abs() < 0.01 && camera.target == expected.target);
    }
}

/// Compact settings are part of the page's link, which should stay short.
#[test]
fn compact_settings_are_read_back() {
    for json in [
        r#"{"surface": {"filename": "a.gsf"}}"#,
        r#"{"surface": {"preset": "elaphe", "coherence_length": 30}, "rotation_deg": -90}"#,
        r#"{"surface": {"preset": "xenopeltis", "conserve_energy": true}, "sun": {"elevation_deg": 20}}"#,
        r#"{"method": "pq", "options": {"repeats": [26, 1]}, "shape": "sphere", "camera": {"target": [0, 1, 2]}}"#,
    ] {
        let settings = Settings::from_json(json).unwrap();
        let compact = settings.to_compact_json();
        assert_eq!(Settings::from_json(&compact).unwrap(), settings, "{compact}");
        // The longest of these has about 100 characters; the settings with all fields have several hundred.
        assert!(compact.len() < 150, "{compact}");
    }
}

/// Each message names the setting, its value, or the method that the settings need.
#[test]
fn each_wrong_setting_is_named() {
    for (json, named) in [
        (r#"{"surface": {"preset": "blazd"}}"#, "preset"),
        (r#"{"surface": {"coherence_length": -1}}"#, "coherence_length"),
        (r#"{"surface": {"filename": "../a.gsf"}}"#, "filename"),
        (r#"{"surface": {"filename": "/etc/passwd"}}"#, "filename"),
        (r#"{"surface": {"preset": "blazed", "theory": "rigorous"}}"#, "theory"),
        (r#"{"method": "exact"}"#, "exact"),
        (r#"{"surface": {"transmission": "film"}}"#, "transmission"),
        (r#"{"surface": {"eta": 1.5, "transmission": "interface"}}"#, "transmission"),
        (r#"{"surface": {"eta": 1.5, "transmission": "film"}, "method": "flss"}"#, "table"),
        (r#"{"options": {"lambda_step_nm": 0}}"#, "lambda_step_nm"),
        (r#"{"shape": "cube"}"#, "cube"),
        (r#"{"sun": {"elevation_deg": 0}}"#, "sun elevation"),
        (r#"{"camera": {"distance_cm": 1e9}}"#, "camera distance"),
        (r#"{"camera": {"fov_deg": 180}}"#, "fov"),
        (r#"{"share": 2}"#, "share"),
        (r#"{"exposure": 1e3}"#, "exposure"),
        (r#"{"map": {"theta_deg": 90}}"#, "map theta"),
        (r#"{"colour": "red"}"#, "colour"),
        ("[", "JSON"),
    ] {
        let line = refusal(json);
        assert!(line.contains(named) && !line.contains('\n'), "{line}");
    }
}

/// The page builds relief, method's data and scene again only when their key changes.
#[test]
fn each_key_changes_only_with_its_own_data() {
    let keys = |json: &str| Settings::from_json(json).unwrap().keys();
    // The default preset is xenopeltis.
    let base = keys("{}");
    for same in [r#"{"sun": {"elevation_deg": 20}}"#, r#"{"exposure": 1, "rotation_deg": 3, "ground": false}"#] {
        assert_eq!(keys(same), base);
    }
    // The shader applies the index of an opaque surface, so its data stay.
    let metal = keys(r#"{"surface": {"preset": "xenopeltis", "eta": 1, "k": 6}}"#);
    assert_eq!(metal, base);
    let conserving = keys(r#"{"surface": {"preset": "xenopeltis", "conserve_energy": true}}"#);
    assert!(conserving.method != base.method && conserving.relief == base.relief);
    let preset = keys(r#"{"surface": {"preset": "cd"}}"#);
    assert!(preset.relief != base.relief && preset.method != base.method && preset.scene == base.scene);
    let resized = keys(r#"{"surface": {"preset": "xenopeltis", "scale": 0.5}}"#);
    assert!(resized.relief != base.relief && resized.method != base.method);
    let covered = keys(r#"{"surface": {"preset": "xenopeltis", "cover_eta": 1.5}}"#);
    assert!(covered.relief == base.relief && covered.method != base.method);
    // The tables of a film depend on its index.
    let film =
        |eta| keys(&format!(r#"{{"surface": {{"preset": "xenopeltis", "eta": {eta}, "transmission": "film"}}}}"#));
    assert!(film(1.5).relief == base.relief && film(1.5).method != base.method && film(1.5).method != film(1.6).method);
    let sphere = keys(r#"{"shape": "sphere"}"#);
    assert!(sphere.scene != base.scene && sphere.method == base.method);
    // Only the snake's mesh has a resolution.
    assert_eq!(keys(r#"{"shape": "sphere", "resolution": 4}"#), sphere);
}

/// `Settings::config` gives FLSS, a published method, its only model: patch without energy conservation.
#[test]
fn published_methods_are_built_with_a_model_they_support() {
    let settings = Settings::from_json(
        r#"{"surface": {"preset": "sinusoidal", "coherence_length": 10, "conserve_energy": true}, "method": "flss"}"#,
    )
    .unwrap();
    let relief = Relief::new(&settings, None).unwrap();
    relief.method(&settings, &Progress::none()).unwrap();
}

/// A scan with a period of 1.6 µm along x, in the format GSF, whose lengths are in metres. Its 900 µm of height would
/// take tables of gigabytes.
fn deep_scan() -> Vec<u8> {
    let header = "Gwyddion Simple Field 1.0\nXRes = 64\nYRes = 64\nXReal = 6.4e-6\nYReal = 6.4e-6\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend(b"XYUnits = m\nZUnits = m\n");
    // The header ends with zeros up to a multiple of four bytes, at least one.
    bytes.resize(bytes.len() / 4 * 4 + 4, 0);
    let heights = (0..64 * 64).map(|i| 4.5e-4 * (TAU * f64::from(i) / 16.0).sin());
    bytes.extend(heights.flat_map(|height| (height as f32).to_le_bytes()));
    bytes
}

#[test]
fn a_relief_too_deep_for_tables_is_refused_by_the_method_table_alone() {
    let settings = |method: &str| {
        let json = format!(r#"{{"surface": {{"filename": "a.gsf"}}, "method": "{method}"}}"#);
        Settings::from_json(&json).unwrap()
    };
    let (table, stam) = (settings("table"), settings("stam"));
    let relief = Relief::new(&table, Some(&deep_scan())).unwrap();
    let progress = Progress::none();
    assert!(matches!(relief.method(&table, &progress), Err(WebError::Limit(_))));
    assert!(matches!(relief.spectra(&table, &progress), Err(WebError::Limit(_))));
    relief.method(&stam, &progress).unwrap();
    relief.spectra(&stam, &progress).unwrap();
}

#[test]
fn unreadable_files_give_typed_errors_of_one_line() {
    let read = |name: &str, bytes: &[u8], more: &str| {
        let json = format!(r#"{{"surface": {{"filename": "{name}"{more}}}}}"#);
        Relief::new(&Settings::from_json(&json).unwrap(), Some(bytes)).map(|relief| relief.field().size())
    };
    let kind = |name: &str, bytes: &[u8], more: &str| {
        let error = read(name, bytes, more).unwrap_err();
        assert!(!error.to_string().contains('\n') && error.to_string().contains(name), "{error}");
        (error.kind(), error.parameter())
    };
    assert_eq!(kind("a.gsf", b"not one", ""), ("file", None));
    assert_eq!(kind("a.jpg", b"", ""), ("file", None));
    assert_eq!(kind("a.txt", b"", ""), ("file", None));
    assert_eq!(kind("a.txt", b"1 2 1 3\n3 4 5 2\n2 1 1 4\n", ""), ("scale", Some("pixel_size")));
    // Two columns are a profile, not a relief.
    assert_eq!(kind("a.txt", b"1 2\n3 4\n", ""), ("file", None));
    assert_eq!(read("a.txt", b"1 2 1 3\n3 4 5 2\n2 1 1 4\n", r#", "pixel_size": 0.1"#).unwrap(), (4, 3));
    let missing = Relief::new(&Settings::from_json(r#"{"surface": {"filename": "a.gsf"}}"#).unwrap(), None);
    assert!(matches!(missing, Err(WebError::File(_))));
}
