//! `sunbeam view`: starts the program `sunbeam-view`, which draws in a window.

use super::Outcome;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Draw the snake in a window
///
/// Starts the program `sunbeam-view`, which must be in the folder of this program. `sunbeam view --help` lists its
/// arguments.
// `--help` is passed on like the other arguments.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct ViewArgs {
    /// All arguments, which are passed on.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    passed_on: Vec<OsString>,
}

/// Runs `sunbeam view`.
pub(crate) fn run(args: &ViewArgs) -> Outcome {
    let window = std::env::current_exe()?.with_file_name(format!("sunbeam-view{}", std::env::consts::EXE_SUFFIX));
    if !window.exists() {
        return Err(format!("the viewer {} is missing; `make tool` builds it", window.display()).into());
    }
    replace_process(&window, &args.passed_on)
}

/// Replaces this process by the program, which keeps the process id. The process that started the command can therefore
/// wait for the program and end it. Returns only on failure.
#[cfg(unix)]
fn replace_process(program: &Path, args: &[OsString]) -> Outcome {
    use std::os::unix::process::CommandExt;
    Err(Command::new(program).args(args).exec().into())
}

/// Runs the program and exits with its status, or where it has none with 2, the status of this command's own failures.
#[cfg(not(unix))]
fn replace_process(program: &Path, args: &[OsString]) -> Outcome {
    std::process::exit(Command::new(program).args(args).status()?.code().unwrap_or(2))
}
