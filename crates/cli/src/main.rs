//! The program `sunbeam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    // Some GPU drivers complain on stderr if the variable XDG_RUNTIME_DIR, a folder for sockets, is not set.
    // SAFETY: the process has no other thread yet that could access environment variables.
    unsafe { sunbeam_realtime::give_drivers_a_runtime_folder() };
    sunbeam_cli::run()
}
