//! Output files are checked before anything is computed: the extension, and whether the path can be written.

use crate::support::{refused, run, succeeded};
use std::any::TypeId;
use std::fs;
use std::path::{Path, PathBuf};
use sunbeam_cli::output::Output;

/// Commands, their arguments for output files, and the accepted extensions.
const OUTPUTS: [(&str, &str, &[&str]); 14] = [
    ("bench", "--json", &["json"]),
    ("bench", "--plot", &["svg"]),
    ("brdf-map", "--output", &["exr"]),
    ("brdf-map", "--png", &["png"]),
    ("compare", "--png", &["png"]),
    ("evaluate", "--plot", &["svg"]),
    ("evaluate", "--response", &["npy"]),
    ("height-field", "--output", &["exr", "gsf", "npy", "png"]),
    ("height-field", "--preview", &["png"]),
    ("orders", "--plot", &["svg"]),
    ("render", "--output", &["exr"]),
    ("render", "--pairs", &["npy"]),
    ("render", "--png", &["png"]),
    ("snake", "--output", &["ply"]),
];
/// The output whose extension chooses the contents; a device has none.
const PIGMENT: (&str, &str, &[&str]) = ("snake", "--pigment", &["png", "exr"]);

/// Arguments for input files.
const INPUTS: [&str; 5] = ["a", "b", "height_field", "mask", "mesh"];

fn outputs() -> Vec<(&'static str, &'static str, &'static [&'static str])> {
    OUTPUTS.into_iter().chain([PIGMENT]).collect()
}

#[test]
fn every_path_is_an_input_or_a_checked_output() {
    let mut found = Vec::new();
    for command in sunbeam_cli::command().get_subcommands() {
        for argument in command.get_arguments() {
            let kind = argument.get_value_parser().type_id();
            if kind == TypeId::of::<Output>() {
                found.push((command.get_name().to_owned(), format!("--{}", argument.get_long().unwrap())));
            }
            // Any other path would be written without a check.
            let path = kind == TypeId::of::<PathBuf>();
            assert!(!path || INPUTS.contains(&argument.get_id().as_str()), "{} {argument}", command.get_name());
        }
    }
    let mut expected: Vec<_> =
        outputs().iter().map(|(command, flag, _)| ((*command).to_owned(), (*flag).to_owned())).collect();
    found.sort();
    expected.sort();
    assert_eq!(found, expected);
}

/// Names and contents of the files in a folder.
fn listing(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), fs::read(path).unwrap_or_default())).collect()
}

#[test]
fn wrong_extensions_and_unwritable_paths_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    fs::write(path("file"), "text").unwrap();
    for (command, flag, extensions) in outputs() {
        for extension in extensions {
            fs::create_dir_all(path(&format!("folder.{extension}"))).unwrap();
        }
        let before = listing(folder.path());
        let mut cases = vec![
            (path("name.wrong"), "must end in"),
            (path("name"), "must end in"),
            (path(&format!(".{}", extensions[0])), "must end in"),
        ];
        for extension in extensions {
            cases.push((path(&format!("none/name.{extension}")), "there is no folder"));
            cases.push((path(&format!("file/name.{extension}")), "no folder"));
            cases.push((path(&format!("file/below/name.{extension}")), "no folder"));
            cases.push((path(&format!("folder.{extension}")), "is a folder"));
            cases.push((path(&format!("{}.{extension}", "n".repeat(300))), "cannot be written"));
            #[cfg(target_os = "linux")]
            cases.push((format!("/proc/name.{extension}"), "cannot be written"));
        }
        for (value, reason) in cases {
            let message = refused(&[command, flag, &value]);
            let named = message.contains(flag) && message.contains(&value) && message.contains(reason);
            assert!(named, "{command} {flag} {value}: {message}");
            let accepted = extensions.iter().all(|extension| message.contains(&format!(".{extension}")));
            assert!(reason != "must end in" || accepted, "{command} {flag} {value}: {message}");
        }
        assert!(listing(folder.path()) == before, "{command} {flag} left something behind");
    }
}

#[test]
fn every_extension_in_either_case_is_accepted() {
    let folder = tempfile::tempdir().unwrap();
    for (command, flag, extensions) in outputs() {
        for extension in extensions.iter().flat_map(|extension| [(*extension).to_owned(), extension.to_uppercase()]) {
            let value = folder.path().join(format!("name.{extension}"));
            // A wrong value is reported before a missing argument.
            let parsed =
                sunbeam_cli::command().try_get_matches_from(["sunbeam", command, flag, value.to_str().unwrap()]);
            let kind = parsed.err().map(|error| error.kind());
            let is_accepted = kind.is_none_or(|kind| kind == clap::error::ErrorKind::MissingRequiredArgument);
            assert!(is_accepted, "{command} {flag} {value:?}: {kind:?}");
        }
    }
    assert!(listing(folder.path()).is_empty());
}

#[test]
fn a_wrong_extension_names_the_argument_for_it() {
    let message = refused(&["brdf-map", "-o", "map.png"]);
    assert!([".exr", "--png", "--output"].iter().all(|part| message.contains(part)), "{message}");
    let message = refused(&["snake", "-o", "snake.png"]);
    assert!(message.contains(".ply") && !message.contains("--png"), "{message}");
}

#[test]
fn an_error_leaves_files_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    fs::write(path("old.exr"), "years of work").unwrap();
    let before = listing(folder.path());
    for (first, second) in [("old.exr", "none/map.png"), ("new.exr", "none/map.png"), ("old.exr", "map.jpg")] {
        refused(&["brdf-map", "--preset", "flat", "-o", &path(first), "--png", &path(second)]);
        assert!(listing(folder.path()) == before, "{first} {second}");
    }
    // The error may be in another argument.
    refused(&["brdf-map", "-o", &path("old.exr"), "--height-field", &path("none.gsf")]);
    assert!(listing(folder.path()) == before);
}

#[test]
fn two_outputs_must_be_two_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    for (first, second) in [("a.png", "a.png"), ("a.png", "./a.png"), ("a.png", "../SELF/a.png")] {
        let itself = folder.path().file_name().unwrap().to_string_lossy().into_owned();
        let second = path(&second.replace("SELF", &itself));
        let message = refused(&["height-field", "--preset", "blazed", "-o", &path(first), "--preview", &second]);
        assert!(message.contains("--output") && message.contains("--preview") && message.contains("same"), "{message}");
    }
    assert!(listing(folder.path()).is_empty());
    #[cfg(unix)]
    {
        fs::write(path("old.png"), "years of work").unwrap();
        std::os::unix::fs::symlink(path("old.png"), path("link.png")).unwrap();
        let arguments = ["brdf-map", "-o", "/dev/null", "--png", &path("link.png")];
        assert!(sunbeam_cli::command().try_get_matches_from([&["sunbeam"], &arguments[..]].concat()).is_ok());
        let arguments = ["height-field", "-o", &path("old.png"), "--preview", &path("link.png")];
        assert!(refused(&arguments).contains("same file"));
    }
}

#[test]
fn the_file_of_a_term_is_checked_before_the_relief_is_read() {
    let message = refused(&["height-field", "--height-field", "none.gsf", "--term", "2", "-o", "term.exr"]);
    assert!(message.contains("term.exr") && message.contains(".png or .npy"), "{message}");
}

#[cfg(unix)]
#[test]
fn devices_and_links_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    succeeded(run(&["snake", "-o", "/dev/null", "--resolution", "0.3"], ""));
    let maps = ["brdf-map", "--preset", "flat", "--size", "8", "-o", "/dev/null", "--png", "/dev/null"];
    succeeded(run(&maps, ""));
    // Without an extension the format is unknown.
    assert!(refused(&["snake", "-o", &path("a.ply"), "--pigment", "/dev/null"]).contains(".exr"));
    std::os::unix::fs::symlink(path("later.ply"), path("link.ply")).unwrap();
    succeeded(run(&["snake", "-o", &path("link.ply"), "--resolution", "0.3"], ""));
    assert!(fs::read(path("later.ply")).unwrap().starts_with(b"ply"));
    std::os::unix::fs::symlink(path("none/later.ply"), path("lost.ply")).unwrap();
    assert!(refused(&["snake", "-o", &path("lost.ply")]).contains("there is no folder"));
}

/// Runs the command as a user without the permission: the tests' own, or `nobody` if that one may write everywhere.
#[cfg(unix)]
#[test]
fn paths_without_permission_are_refused() {
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;
    /// User and group `nobody`.
    const NOBODY: u32 = 65_534;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let set_mode = |name: &str, mode| fs::set_permissions(path(name), fs::Permissions::from_mode(mode)).unwrap();
    fs::create_dir(path("closed")).unwrap();
    fs::write(path("kept.ply"), "years of work").unwrap();
    // Other users may have no access to the checkout.
    fs::copy(env!("CARGO_BIN_EXE_sunbeam"), path("sunbeam")).unwrap();
    for (name, mode) in [("", 0o755), ("sunbeam", 0o755), ("closed", 0o555), ("kept.ply", 0o444)] {
        set_mode(name, mode);
    }
    let may_write_anywhere = tempfile::tempfile_in(path("closed")).is_ok();
    for name in ["closed/new.ply", "kept.ply"] {
        let mut command = std::process::Command::new(path("sunbeam"));
        command.args(["snake", "-o"]).arg(path(name));
        if may_write_anywhere {
            command.uid(NOBODY).gid(NOBODY);
        }
        let output = command.output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("cannot be written") && message.contains("ermission"), "{message}");
    }
    set_mode("closed", 0o755);
    assert_eq!(fs::read(path("kept.ply")).unwrap(), b"years of work");
}
