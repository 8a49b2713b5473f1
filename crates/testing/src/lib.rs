//! Optional parts of the machine that tests run on, such as a GPU: how a test skips where one is missing, and where the
//! measured scans are.
//!
//! `tests/needs.txt` lists the parts. The environment variable `SUNBEAM_REQUIRE`, such as `gpu,scans`, names the parts
//! that this machine has: a test that skips because one of them is missing fails. Other skips are printed, and appended
//! to the file that `SUNBEAM_SKIPS` names, if any. `tests/needs.py` does the same for Python.

use std::ffi::OsStr;
use std::fmt::Display;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::{env, thread};

/// The parts, one for each line: a name, then a description.
const NEEDS: &str = include_str!("../../../tests/needs.txt");

/// The root of the repository.
const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Reports that the running test is skipped because the part `need` is missing. The caller must then return.
///
/// # Panics
/// If `SUNBEAM_REQUIRE` names the part, if `tests/needs.txt` lacks the part or one that `SUNBEAM_REQUIRE` names, or if
/// the report cannot be written.
pub fn skip(need: &str, reason: impl Display) {
    let required = env::var("SUNBEAM_REQUIRE").unwrap_or_default();
    let line = match skip_line(need, &required, &reason) {
        Ok(line) => line,
        Err(error) => panic!("{error}"),
    };
    let skips = env::var_os("SUNBEAM_SKIPS");
    if let Err(error) = report(&line, skips.as_deref()) {
        panic!("the skip cannot be reported: {error}");
    }
}

/// The line that reports a skip of the running test. `required` is the value of `SUNBEAM_REQUIRE`.
///
/// # Errors
/// The reason why the test must fail instead.
fn skip_line(need: &str, required: &str, reason: &dyn Display) -> Result<String, String> {
    let known: Vec<&str> = NEEDS.lines().filter_map(|line| line.split_whitespace().next()).collect();
    let required: Vec<&str> = required.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
    if let Some(unknown) = required.iter().chain([&need]).find(|name| !known.contains(name)) {
        return Err(format!("{unknown:?} is none of the parts that tests need: {}", known.join(", ")));
    }
    if required.contains(&need) {
        return Err(format!("SUNBEAM_REQUIRE names {need}: {reason}"));
    }
    // The test harness names each test's thread after the test.
    let test = thread::current().name().unwrap_or("a test").to_owned();
    Ok(format!("SKIPPED {test} ({need}): {reason}"))
}

/// Writes the line to stderr, past the capture of test output, and appends it to the file `skips`, if given.
fn report(line: &str, skips: Option<&OsStr>) -> io::Result<()> {
    writeln!(io::stderr(), "{line}")?;
    if let Some(path) = skips {
        // One write, so that lines of processes that run at the same time stay whole.
        OpenOptions::new().create(true).append(true).open(path)?.write_all(format!("{line}\n").as_bytes())?;
    }
    Ok(())
}

/// The folder of measured data, which the repository lacks: `SUNBEAM_DATA`, or `../shared/data` from the repository.
///
/// Atomic-force scans are in its folder `afm`; crops of them with the orders' efficiencies by a Maxwell solver are in
/// `maxwell`.
pub fn data_folder() -> PathBuf {
    env::var_os("SUNBEAM_DATA").map_or_else(|| Path::new(REPOSITORY).join("../shared/data"), PathBuf::from)
}

/// The path of a file in [`data_folder`]; `None` where it is missing, which is reported by [`skip`].
///
/// # Panics
/// The panics of [`skip`].
pub fn data(file: &str) -> Option<PathBuf> {
    let path = data_folder().join(file);
    if path.exists() {
        return Some(path);
    }
    skip("scans", format_args!("{} is missing; SUNBEAM_DATA names the folder of measured data", path.display()));
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skips_name_the_test_and_the_reason() {
        let line = skip_line("gpu", "scans", &"no adapter").unwrap();
        assert_eq!(line, "SKIPPED tests::skips_name_the_test_and_the_reason (gpu): no adapter");
    }

    #[test]
    fn required_parts_fail() {
        let error = skip_line("gpu", "scans, gpu", &"no adapter").unwrap_err();
        assert_eq!(error, "SUNBEAM_REQUIRE names gpu: no adapter");
    }

    #[test]
    fn unknown_parts_fail() {
        assert!(skip_line("gpu", "gqu", &"").unwrap_err().starts_with("\"gqu\" is none of the parts"));
        assert!(skip_line("gqu", "", &"").unwrap_err().starts_with("\"gqu\" is none of the parts"));
    }

    #[test]
    fn reports_are_appended() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("skips");
        for line in ["one", "two"] {
            report(line, Some(path.as_os_str())).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path).unwrap(), "one\ntwo\n");
    }
}
