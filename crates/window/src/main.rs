//! The window of the realtime renderer, `sunbeam view`: a program of its own, since it takes minutes more to build.
//!
//! There are three kinds of threads. The window's own ([`app`]) never waits. Methods and the mesh are built on threads
//! of their own ([`task`]). One thread draws ([`drawer`], [`artist`]) the last order on the window's device, with
//! coarse pictures first where the method is slow ([`sunbeam_realtime::progressive`]). Its pictures are tone-mapped
//! into a texture of the window ([`tone`]).

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
    // SAFETY: no other thread exists yet.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run_with(args::run)
}
