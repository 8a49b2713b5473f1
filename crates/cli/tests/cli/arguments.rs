//! Help, wrong arguments, the cache of tables, and the start of the viewer.

use super::support::{refused, run, run_with, succeeded};
use serde_json::Value;

#[test]
fn every_subcommand_has_help() {
    for command in sunbeam_cli::command().get_subcommands().map(|command| command.get_name().to_owned()) {
        let command = command.as_str();
        if command == "view" {
            // The help is the viewer's own.
            continue;
        }
        let output = run(&[command, "--help"], "");
        assert_eq!(output.status.code(), Some(0), "{command}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(&format!("Usage: sunbeam {command}")), "{text}");
        if !["snake", "compare", "adapter"].contains(&command) {
            for argument in ["--preset", "--height-field", "--coherence-length", "--conserve-energy", "--eta"] {
                assert!(text.contains(argument), "{command} does not mention {argument}");
            }
        }
    }
    assert_eq!(run(&["--version"], "").status.code(), Some(0));
}

#[test]
fn wrong_arguments_are_named_in_one_line() {
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["subcommand"]),
        (&["paint"], &["paint"]),
        (&["eval", "--preset", "cobra"], &["cobra", "--preset", "elaphe"]),
        (&["eval", "--model", "wavelet"], &["wavelet", "ensemble", "patch"]),
        (&["eval", "--colour", "red"], &["--colour"]),
        (&["eval", "--preset", "blazed", "--period", "-1"], &["\"period\"", "-1", "(0, 1e3]"]),
        (&["eval", "--period", "2"], &["\"period\"", "elaphe"]),
        (&["eval", "--preset", "blazed", "--height", "NaN"], &["\"height\"", "NaN"]),
        (&["eval", "--preset", "cd", "--height-field", "a.gsf"], &["\"preset\"", "\"filename\""]),
        (&["eval", "--height-field", "no/such.gsf"], &["no/such.gsf"]),
        (&["eval", "--tolerance", "1"], &["\"tolerance\"", "1e-6"]),
        (&["eval", "--conserve-energy", "maybe"], &["maybe", "--conserve-energy"]),
        (&["eval", "--k", "3"], &["\"k\"", "\"eta\""]),
        (&["eval", "--eta", "-1"], &["\"eta\"", "-1"]),
        (&["brdf-map", "--method", "magic", "-o", "a.exr"], &["magic", "exact, table, flss, nmm, pq, stam"]),
        (&["brdf-map", "--preset", "flat"], &["--output"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--theta-i", "90"], &["theta-i", "90"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--size", "-1"], &["--size", "-1", "invalid"]),
        (&["brdf-map", "--preset", "flat", "-o", "no/such/a.exr", "--size", "1"], &["no/such/a.exr"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--lambda-step", "0"], &["lambda-step"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--exposure", "2"], &["--png"]),
        (&["brdf-map", "--preset", "flat", "-o", "a.exr", "--adapter", "any"], &["--adapter", "--backend gpu"]),
        (&["render", "-o", "a.exr", "--exposure", "2"], &["--png"]),
        (&["render", "-o", "a.exr", "--supersample", "-1"], &["--supersample", "-1", "invalid"]),
        (&["render", "-o", "a.exr", "--repeat", "-1"], &["--repeat", "-1", "invalid"]),
        (&["orders", "--over", "wavelength", "--range", "500,600,2", "--wavelength", "550"], &["--wavelength has no"]),
        (&["orders", "--over", "theta-i", "--range", "0,60,2", "--theta-i", "0"], &["--theta-i has no"]),
        (&["orders", "--over", "phi-i", "--range", "0,60,2", "--phi-i", "0"], &["--phi-i has no"]),
        (
            &["orders", "--preset", "blazed", "--over", "height", "--range", "0.1,0.2,2", "--height", "0.3"],
            &["--height has no"],
        ),
        (&["height-field", "--preset", "flat", "-o", "a.jpg"], &["a.jpg", ".gsf"]),
        (&["height-field", "--preset", "flat", "--term", "0", "-o", "a.png"], &["--term", "0 is not in 1..=256"]),
        (&["height-field", "--preset", "flat", "--term", "257", "-o", "a.png"], &["--term", "257 is not in 1..=256"]),
        (&["height-field", "--preset", "flat", "--term", "-1", "-o", "a.png"], &["--term", "-1", "invalid"]),
        (&["height-field", "--preset", "flat", "--term", "3", "-o", "a.gsf"], &["a.gsf", ".png or .npy"]),
        (&["height-field", "--preset", "flat", "--term", "3"], &["--output"]),
        (&["height-field", "--preset", "flat", "--crop", "1,2"], &["--crop", "X,Y,WIDTH,HEIGHT"]),
        (&["height-field", "--preset", "cd", "--crop", "-1,0,1,1"], &["(-1, 0) µm", "does not lie within"]),
        (&["height-field", "--preset", "cd", "--make-tileable=1e3"], &["blend of 1000 µm", "a third"]),
        (&["eval", "--preset", "cd", "--fill", "laplace"], &["\"fill\"", "\"filename\""]),
        (&["eval", "--channel", "Height"], &["\"channel\"", "\"filename\""]),
        (&["snake", "-o", "a.ply", "--resolution", "0"], &["resolution"]),
        (&["snake", "-o", "no/such/a.ply"], &["no/such/a.ply"]),
    ];
    for (arguments, mentioned) in cases {
        let message = refused(arguments);
        assert!(mentioned.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
}

#[test]
fn tables_are_cached_unless_the_cache_is_off() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("tables").to_string_lossy().into_owned();
    let command = ["height-field", "--preset", "blazed", "--coherence-length", "8", "--tables", "--model", "patch"];
    let origin = |variables: &[(&str, &str)], more: &[&str]| {
        let output = run_with(variables, &[&command[..], more].concat(), "");
        let report: Value = serde_json::from_str(&succeeded(output)).unwrap();
        report["tables"]["origin"].as_str().unwrap().to_owned()
    };
    let here = ("SUNBEAM_CACHE_DIR", place.as_str());
    assert_eq!(origin(&[here], &["--no-cache"]), "built");
    assert_eq!(origin(&[here, ("SUNBEAM_CACHE", "off")], &[]), "built");
    assert!(!folder.path().join("tables").exists());
    assert_eq!(origin(&[here], &[]), "built, kept in the cache");
    assert_eq!(origin(&[here], &[]), "read from the cache");
    assert_eq!(origin(&[here], &["--no-cache"]), "built");
    assert!(origin(&[here, ("SUNBEAM_CACHE_LIMIT_MB", "0")], &["--period", "2"]).contains("not kept"));
    let output = run_with(&[("SUNBEAM_CACHE_LIMIT_MB", "lots")], &command, "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("SUNBEAM_CACHE_LIMIT_MB") && message.contains("lots"), "{message}");
}

#[cfg(unix)]
#[test]
fn view_becomes_the_viewer_in_the_same_folder() {
    use std::os::unix::fs::PermissionsExt;
    use std::{fs, io::ErrorKind, process::Command};
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("sunbeam");
    fs::copy(env!("CARGO_BIN_EXE_sunbeam"), &alone).unwrap();
    // A process that another test starts during the copy briefly holds the copy open for writing.
    let view = |arguments: &[&str]| loop {
        match Command::new(&alone).arg("view").args(arguments).output() {
            Err(error) if error.kind() == ErrorKind::ExecutableFileBusy => std::thread::yield_now(),
            output => break output.unwrap(),
        }
    };

    let missing = view(&["--preset", "blazed"]);
    let message = String::from_utf8(missing.stderr).unwrap();
    assert_eq!((missing.status.code(), message.lines().count()), (Some(2), 1), "{message}");
    assert!(message.contains("sunbeam-view is missing") && message.contains("make tool"), "{message}");

    let window = folder.path().join("sunbeam-view");
    fs::write(&window, "#!/bin/sh\necho \"$@\"\nexit 3\n").unwrap();
    fs::set_permissions(&window, fs::Permissions::from_mode(0o755)).unwrap();
    let found = view(&["--preset", "blazed", "--help"]);
    assert_eq!((found.status.code(), &*found.stdout), (Some(3), b"--preset blazed --help\n".as_slice()));
}
