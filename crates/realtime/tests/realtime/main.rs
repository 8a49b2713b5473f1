//! The realtime renderer on the available adapter.

#![allow(clippy::unwrap_used, reason = "also outside `#[test]` functions")]

#[path = "../../../../tests/core/common.rs"]
mod common;
mod support;

mod faults;
mod films;
mod gratings;
mod methods;
mod pictures;
mod progressive;
mod twins;
