//! The command `sunbeam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    // SAFETY: this is the first thing the process does, so there is no other thread that could read variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run()
}
