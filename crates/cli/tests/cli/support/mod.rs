//! Runs of the binary, and checks of their output.
#![allow(dead_code, reason = "each test binary uses a part")]

use crate::common::CACHE_FOLDER;
use std::io::Write;
use std::process::{Command, Output, Stdio};

/// A cache of tables that the tests share, apart from the user's.
const CACHE: (&str, &str) = ("SUNBEAM_CACHE_DIR", CACHE_FOLDER);

/// Runs the binary with `input` on stdin.
pub(crate) fn run(arguments: &[&str], input: impl AsRef<[u8]>) -> Output {
    run_with(&[CACHE], arguments, input)
}

/// Runs the binary with `input` on stdin and additional environment variables.
pub(crate) fn run_with(variables: &[(&str, &str)], arguments: &[&str], input: impl AsRef<[u8]>) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sunbeam"))
        .args(arguments)
        .envs(variables.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // A thread writes, since the answers fill the other pipe. A process with wrong arguments reads nothing.
    let input = input.as_ref().to_vec();
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

/// The stdout of a successful run, which has no NaN or infinity.
pub(crate) fn succeeded(output: Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert_eq!(stderr, "");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    text
}

/// The single line on stderr of a run that ends with status 2.
pub(crate) fn refused(arguments: &[&str]) -> String {
    let output = run(arguments, "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
    message
}
