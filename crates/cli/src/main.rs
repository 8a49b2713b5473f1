//! The program `sunbeam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    // SAFETY: the process has no other thread yet that could read environment variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run()
}
