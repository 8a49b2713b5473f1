//! The command as users meet it, and what it measures.

// As tests do, outside of `#[test]` functions too.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../../../tests/core/common.rs"]
mod common;
#[path = "../../../realtime/tests/realtime/support.rs"]
mod gpu_support;
#[path = "support/service.rs"]
mod service;
mod support;

mod bench;
mod commands;
mod compare;
mod methods;
mod outputs;
mod render;
mod sampler;
mod stability;
