//! No code: the dependencies in Cargo.toml give third-party packages the same features in every build.
//!
//! Cargo compiles a package with the features that the members selected for a build request together. Without this
//! crate, building one member after another would compile shared packages again. `scripts/check_workspace.py` finds
//! features that members use and Cargo.toml lacks.
