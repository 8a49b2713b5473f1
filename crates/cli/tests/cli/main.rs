//! Tests of the command: the binary is run, and its output is checked.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are outside of `#[test]` functions")]

#[path = "../../../../tests/core/common.rs"]
mod common;
#[path = "../../../realtime/tests/realtime/support.rs"]
mod gpu_support;
#[path = "support/service.rs"]
mod service;
mod support;

mod agreement;
mod arguments;
mod bench;
mod compare;
mod height_fields;
mod maps;
mod methods;
mod orders;
mod outputs;
mod render;
mod sampler;
mod services;
mod stability;
