//! `include/sunbeam.h` is what cbindgen makes of `src/capi/`. `make header` writes it.

use std::path::Path;

/// The files of the room that hold exports and their types.
const SOURCES: [&str; 4] = ["status.rs", "foreign.rs", "handle.rs", "batch.rs"];

#[test]
fn the_header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("include/cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in SOURCES {
        builder = builder.with_src(root.join("src/capi").join(source));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    let (header, path) = (String::from_utf8(header).unwrap(), root.join("include/sunbeam.h"));
    if std::env::var_os("SUNBEAM_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == header, "include/sunbeam.h is out of date: run `make header`");
}
