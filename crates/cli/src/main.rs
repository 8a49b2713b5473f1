//! The program `sunbeam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    // Without the folder, some drivers of GPUs print a complaint on stderr.
    // SAFETY: the process has no other thread yet that could access environment variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run()
}
