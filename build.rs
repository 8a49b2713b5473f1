//! Build script: hashes the sources that determine tables into `SUNBEAM_TABLES_CODE`, a part of the cache's keys.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-env=SUNBEAM_TABLES_CODE={:016x}", tables_code());
}

/// Folders of sources that determine the contents of tables. Heights and options are parts of the cache's keys
/// themselves, so the sources that read them are left out.
const TABLES_FOLDERS: [&str; 12] = [
    "src/colour",
    "src/colour_table",
    "src/grating",
    "src/numeric",
    "src/energy",
    "src/lobe",
    "src/sampling",
    "src/scattering",
    "src/table",
    "src/transform",
    "crates/fourier/src",
    "crates/rigorous/src",
];

/// Hash of the names and contents of all files in [`TABLES_FOLDERS`], by which `src/cache/` refuses tables that other
/// code has built. The sources of dependencies are not part of it.
///
/// Another release of Rust may give another hash for the same files. Tables are then built again, which is harmless.
fn tables_code() -> u64 {
    let mut sources = Vec::new();
    let mut folders: Vec<PathBuf> = TABLES_FOLDERS.iter().map(PathBuf::from).collect();
    while let Some(folder) = folders.pop() {
        println!("cargo:rerun-if-changed={}", folder.display());
        // A folder that is missing, such as a renamed one, must not hash as an empty one.
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() { folders.push(path) } else { sources.push(path) }
        }
    }
    // Folders list their files in any order.
    sources.sort();
    let mut hasher = DefaultHasher::new();
    for path in sources {
        (path.to_string_lossy(), fs::read(&path).ok()).hash(&mut hasher);
    }
    hasher.finish()
}
