//! The realtime renderer on the available adapter.

#![allow(clippy::unwrap_used)] // As tests do, outside of `#[test]` functions too.

#[path = "../../../../tests/core/common.rs"]
mod common;
mod support;

mod faults;
mod gratings;
mod methods;
mod pictures;
mod twins;
