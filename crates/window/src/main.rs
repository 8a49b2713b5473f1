//! The window of the realtime renderer, `sunbeam view`. It is a separate program, because its dependencies take minutes
//! to build.
//!
//! There are three kinds of threads. The window's own thread ([`app`]) never waits. Methods and the mesh are built on
//! threads of their own ([`task`]). One thread ([`drawer`], [`artist`]) draws on the window's device, coarse pictures
//! first if the method is slow ([`sunbeam_realtime::progressive`]). The window's thread tone-maps the pictures into a
//! texture of the window ([`tone`]).

mod app;
mod args;
mod artist;
mod controls;
mod drawer;
mod facts;
mod hemisphere;
mod open;
mod picture_view;
mod screenshot;
mod settings;
mod sun;
mod surface_form;
mod task;
mod tone;
mod widgets;

use std::process::ExitCode;

fn main() -> ExitCode {
    // SAFETY: no other thread exists yet that could access environment variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run_with(args::run)
}
