//! The command line of `sunbeam`: a consumer of the library, like the Mitsuba plugin.

mod cli;
#[cfg(feature = "viewer")]
mod viewer;

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(all(feature = "gpu", target_os = "linux"))]
    give_drivers_a_runtime_folder();
    cli::run()
}

/// Mesa's Vulkan drivers complain on stderr, where errors of ours belong, unless `XDG_RUNTIME_DIR` is set, which it is
/// not in containers. They only look for a window system there.
#[cfg(all(feature = "gpu", target_os = "linux"))]
fn give_drivers_a_runtime_folder() {
    const VARIABLE: &str = "XDG_RUNTIME_DIR";
    if std::env::var_os(VARIABLE).is_none() {
        // SAFETY: this is the first thing the process does, so there is no other thread that could read variables.
        unsafe { std::env::set_var(VARIABLE, std::env::temp_dir()) };
    }
}
