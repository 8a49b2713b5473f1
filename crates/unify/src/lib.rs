//! No code: the dependencies in Cargo.toml give all builds of the workspace the same features.
//!
//! Cargo compiles a package with the features that the crates of one build ask for. Without this crate, a build of
//! another crate of the workspace would compile shared packages again.
