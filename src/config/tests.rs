//! Defaults, JSON and refusals of [`SurfaceConfig`], and rigorous surfaces built from it.

use super::*;

/// Message of the error for a configuration that must be refused.
fn refusal(json: &str) -> String {
    SurfaceConfig::from_json(json).expect_err(json).to_string()
}

#[test]
fn defaults_follow_the_source_and_the_model() {
    let preset = SurfaceConfig::from_json("{}").unwrap();
    assert_eq!(preset, SurfaceConfig::default());
    assert_eq!(preset.source(), Source::Preset(Preset::Elaphe));
    assert_eq!((preset.level(), preset.tiling(), preset.conserve_energy()), (Level::None, Tiling::Periodic, true));
    let file = SurfaceConfig::from_json(r#"{"filename": "a.gsf", "model": "patch"}"#).unwrap();
    assert_eq!((file.level(), file.tiling(), file.conserve_energy()), (Level::Plane, Tiling::Aperiodic, false));
}

#[test]
fn json_round_trip_keeps_every_field() {
    let json = r#"{"preset":"lamellar","period":1.5,"height":0.1,"level":"mean","tiling":"aperiodic",
        "scale":0.5,"depth":0.25,"coherence_length":10.0,"model":"patch","obliquity":"unit",
        "conserve_energy":true,"shadowing":true,
        "eta":0.2,"k":3.0,"cover_eta":1.5,"tolerance":1e-5,"build_limit":3.5}"#;
    let file = r#"{"filename":"a.gwy","pixel_size":0.1,"max_height":0.5,"channel":"Height","fill":"laplace"}"#;
    let regions = r#"{"preset":"xenopeltis","region_size":20.0,"region_spread":0.05}"#;
    let film = r#"{"preset":"sinusoidal","theory":"rigorous","transmission":"film","eta":1.5,"coherence_length":20.0}"#;
    // JSON never has the field `sizes`.
    for json in [json, file, regions, film] {
        let config = SurfaceConfig::from_json(json).unwrap();
        assert_eq!(SurfaceConfig::from_json(&serde_json::to_string(&config).unwrap()).unwrap(), config);
    }
}

#[test]
fn errors_of_numbers_name_parameter_and_range() {
    // Parameter that the message names, configuration, and accepted range in the message.
    let cases = [
        ("period", r#"{"preset":"blazed","period":0}"#, "(0, 1e3]"),
        ("height", r#"{"preset":"blazed","height":-1}"#, "(0, 1e3]"),
        ("pixel_size", r#"{"filename":"a.png","pixel_size":-1}"#, "(0, 1e3]"),
        ("max_height", r#"{"filename":"a.png","max_height":1e7}"#, "(0, 1e3]: no relief"),
        ("period", r#"{"preset":"blazed","period":1e6}"#, "was it meant in nm?"),
        ("coherence_length", r#"{"coherence_length":1e6}"#, "[1e-3, 1e5]"),
        ("eta", r#"{"eta":0}"#, "[1e-3, 1e3]"),
        ("k", r#"{"eta":1.5,"k":-1}"#, "[0e0, 1e3]"),
        ("tolerance", r#"{"tolerance":1e-7}"#, "[1e-6, 1e-1]"),
        ("cover_eta", r#"{"cover_eta":0.9}"#, "[1e0, 2.6e0]"),
        ("scale", r#"{"scale":0}"#, "[1e-3, 1e0]"),
        ("depth", r#"{"depth":1.5}"#, "[1e-3, 1e0]"),
        ("build_limit", r#"{"build_limit":0.5}"#, "[1e0, 1e6]"),
        ("region_size", r#"{"region_size":2,"region_spread":0.05}"#, "[3e0, 3.3e1]"),
        ("region_spread", r#"{"region_size":20,"region_spread":0.2}"#, "[0e0, 1e-1]"),
    ];
    for (parameter, json, accepted) in cases {
        let message = refusal(json);
        assert!(message.contains(&format!("{parameter:?}")) && message.contains(accepted), "{message}");
    }
    assert!(SurfaceConfig { tolerance: f64::NAN, ..Default::default() }.validate().is_err());
    assert!(SurfaceConfig { scale: f64::NAN, ..Default::default() }.validate().is_err());
    assert!(SurfaceConfig { coherence_length: f64::NAN, ..Default::default() }.validate().is_err());
}

#[test]
fn errors_of_choices_and_types_name_the_accepted_ones() {
    // Parameter that the message names, configuration, and one accepted name or type in the message.
    let cases = [
        ("preset", r#"{"preset":"blazd"}"#, "xenopeltis"),
        ("level", r#"{"level":"flat"}"#, "plane"),
        ("fill", r#"{"filename":"a.gwy","fill":"zero"}"#, "laplace"),
        ("channel", r#"{"filename":"a.gwy","channel":true}"#, "a channel's title or its number"),
        ("tiling", r#"{"tiling":"both"}"#, "aperiodic"),
        ("model", r#"{"model":"speckle"}"#, "ensemble"),
        ("obliquity", r#"{"obliquity":"cos"}"#, "small_slope"),
        ("shadowing", r#"{"shadowing":"yes"}"#, "boolean"),
        ("tolerance", r#"{"tolerance":"low"}"#, "f64"),
        ("coherence", r#"{"coherence":1.0}"#, "coherence_length"),
    ];
    for (parameter, json, accepted) in cases {
        let message = refusal(json);
        assert!(message.contains(parameter) && message.contains(accepted), "{message}");
        // Positions in the JSON, such as serde's "at line 1 column 18", mean nothing to users.
        assert!(!message.contains("column"), "{message}");
    }
}

#[test]
fn contradictions_are_named() {
    for (parameter, json) in [
        ("preset", r#"{"preset":"blazed","filename":"a.gsf"}"#),
        ("period", r#"{"filename":"a.gsf","period":1}"#),
        ("height", r#"{"preset":"elaphe","height":1}"#),
        ("pixel_size", r#"{"preset":"elaphe","pixel_size":1}"#),
        ("max_height", r#"{"max_height":1}"#),
        ("channel", r#"{"channel":"Height"}"#),
        ("fill", r#"{"preset":"cd","fill":"none"}"#),
        ("k", r#"{"k":1}"#),
        ("region_size", r#"{"region_size":20}"#),
        ("region_spread", r#"{"region_spread":0.05}"#),
        ("region_size", r#"{"preset":"cd","region_size":20,"region_spread":0.05}"#),
        ("region_spread", r#"{"filename":"a.gsf","region_spread":0.05}"#),
    ] {
        let message = refusal(json);
        assert!(message.starts_with(&format!("parameter {parameter:?} contradicts")), "{message}");
    }
}

#[test]
fn parameters_of_presets_and_files_contradict_an_array() {
    for (parameter, json) in [
        ("preset", r#"{"preset":"flat"}"#),
        ("period", r#"{"period":2}"#),
        ("pixel_size", r#"{"pixel_size":0.1,"theory":"rigorous"}"#),
    ] {
        let message = SurfaceConfig::from_json_for_array(json).expect_err(json).to_string();
        assert!(
            message.starts_with(&format!("parameter {parameter:?} contradicts heights from an array")),
            "{message}"
        );
    }
}

#[test]
fn broken_json_is_an_error_and_not_a_default() {
    assert!(refusal("{} x").contains("JSON"));
    assert!(refusal("[1").contains("JSON"));
    assert!(refusal(r#"{"tolerance":"#).contains("JSON"));
}

#[test]
fn a_channel_is_a_number_or_a_title() {
    let channel = |value: &str| {
        SurfaceConfig::from_json(&format!(r#"{{"filename": "a.gwy", "channel": {value}}}"#))
            .map(|config| config.channel)
    };
    for (value, expected) in [("0", Some("0")), ("\"0\"", Some("0")), ("\"Height\"", Some("Height")), ("null", None)] {
        assert_eq!(channel(value).unwrap().as_deref(), expected, "{value}");
    }
    for value in ["-1", "1.5", "true", "[0]"] {
        let error = channel(value).unwrap_err().to_string();
        assert!(error.contains("\"channel\"") && error.contains("title or its number"), "{error}");
    }
}

#[cfg(feature = "full")]
#[test]
fn a_rigorous_film_from_an_array_equals_its_preset() {
    use crate::cache::Cache;
    use crate::table::Progress;
    /// Largest relative difference; the array's profile is fitted to its samples.
    const TOLERANCE: f64 = 0.05;
    let film = r#""theory": "rigorous", "transmission": "film", "eta": 1.5, "coherence_length": 20"#;
    let json = format!(r#"{{"preset": "sinusoidal", "period": 0.5, "height": 0.05, {film}}}"#);
    let preset = SurfaceConfig::from_json(&json).unwrap();
    let array = SurfaceConfig::from_json_for_array(&format!(r#"{{"level": "none", {film}}}"#)).unwrap();
    let heights = preset.height_field().unwrap();
    let (expected, _) = preset.build_by_theory(&Cache::off(), &Progress::none()).unwrap();
    let (found, _) = array.build_of(&heights, &Cache::off()).unwrap();
    // Order 1 of 400 nm at normal incidence.
    let value = |surface: &BuiltSurface| {
        let mut value = 0.0;
        surface.eval([0.0, 0.0, 1.0], [0.8, 0.0, 0.6], &[400.0], |_, f| value = f);
        value
    };
    let ratio = value(&found) / value(&expected);
    assert!((ratio - 1.0).abs() < TOLERANCE, "{ratio}");
}

#[cfg(feature = "full")]
#[test]
fn a_rigorous_interface_of_index_1_transmits_all_light() {
    use crate::cache::Cache;
    use crate::table::Progress;
    let body = r#""theory": "rigorous", "transmission": "interface", "eta": 1, "coherence_length": 20"#;
    let json = format!(r#"{{"preset": "sinusoidal", "period": 0.5, "height": 0.05, {body}}}"#);
    let (surface, _) =
        SurfaceConfig::from_json(&json).unwrap().build_by_theory(&Cache::off(), &Progress::none()).unwrap();
    let value = |wo: [f64; 3]| {
        let mut value = 0.0;
        surface.eval([0.0, 0.0, 1.0], wo, &[550.0], |_, f| value = f);
        value
    };
    // All light is in the narrow transmitted order 0, whose value at the centre is in the hundreds or more.
    let (reflected, transmitted) = (value([0.0, 0.0, 1.0]), value([0.0, 0.0, -1.0]));
    assert!(transmitted > 100.0 && reflected < 1e-3 * transmitted, "{reflected} {transmitted}");
}
