//! The window of the realtime renderer, `sunbeam view`: a program of its own, since it takes minutes more to build.
//!
//! Three kinds of threads: the window's own ([`app`]) never waits for anything; methods and the mesh are made on
//! threads of their own ([`task`]); and one thread draws ([`drawer`], [`artist`]) on the window's device, what was asked
//! for last, coarsely first where the method is slow ([`sunbeam_realtime::levels`]). What it drew is tone-mapped into a texture of the
//! window ([`tone`]).

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

use settings::Settings;
use std::process::ExitCode;
use sun::Sun;

fn main() -> ExitCode {
    // SAFETY: this is the first thing the process does, so there is no other thread that could read variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run_with(args::run)
}
