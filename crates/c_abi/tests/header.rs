//! `include/sunbeam.h` equals the output of cbindgen for `src/`. `make header` writes it.

#![allow(clippy::unwrap_used, reason = "helpers of tests unwrap as tests do")]

use std::path::Path;

/// Files with exports and their types, in the order of the header.
const SOURCES: [&str; 5] = ["version.rs", "status.rs", "foreign.rs", "handle.rs", "batch.rs"];

#[test]
fn header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("include/cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in SOURCES {
        builder = builder.with_src(root.join("src").join(source));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    // Rust's heading of the contract of unsafe functions, in words for C.
    let header = String::from_utf8(header).unwrap().replace("// # Safety\n", "// Requirements:\n");
    let path = root.join("include/sunbeam.h");
    if std::env::var_os("SUNBEAM_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == header, "include/sunbeam.h is out of date: run `make header`");
}
