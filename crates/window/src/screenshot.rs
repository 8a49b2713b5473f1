//! File names of screenshots. A screenshot is a PNG with an EXR of the same name.

use std::path::{Path, PathBuf};

/// The first of `NAME.png`, `NAME-2.png`, `NAME-3.png`, … that exists neither as PNG nor as EXR, where `NAME` is `path`
/// without its extension. If all numbers are taken, it is `NAME.png`.
pub(crate) fn free_name(path: &Path) -> PathBuf {
    let png = path.with_extension("png");
    let taken = |path: &Path| path.exists() || path.with_extension("exr").exists();
    if !taken(&png) {
        return png;
    }
    let stem = png.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = |number: u32| png.with_file_name(format!("{stem}-{number}.png"));
    (2..u32::MAX).map(numbered).find(|candidate| !taken(candidate)).unwrap_or_else(|| png.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_existing_files_are_skipped() {
        let folder = tempfile::tempdir().unwrap();
        let wanted = folder.path().join("a.exr");
        assert_eq!(free_name(&wanted), folder.path().join("a.png"));
        std::fs::write(folder.path().join("a.exr"), "").unwrap();
        std::fs::write(folder.path().join("a-2.png"), "").unwrap();
        assert_eq!(free_name(&wanted), folder.path().join("a-3.png"));
    }
}
