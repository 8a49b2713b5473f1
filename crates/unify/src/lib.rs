//! No code: the dependencies in Cargo.toml give all builds of the workspace the same features.
