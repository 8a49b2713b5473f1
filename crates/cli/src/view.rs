use super::Outcome;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Draw the snake in a window
///
/// That is a program of its own, `sunbeam-view`, which has to lie beside this one. `sunbeam view --help` says more.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub struct ViewArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    all: Vec<OsString>,
}

/// Runs `sunbeam view`.
pub fn run(args: &ViewArgs) -> Outcome {
    let window = std::env::current_exe()?.with_file_name(format!("sunbeam-view{}", std::env::consts::EXE_SUFFIX));
    if !window.exists() {
        return Err(format!("there is no window: {} is missing; `make tool` builds it", window.display()).into());
    }
    become_program(&window, &args.all)
}

/// Goes on as that program, so that whoever started this one still has hold of it.
#[cfg(unix)]
fn become_program(program: &Path, args: &[OsString]) -> Outcome {
    use std::os::unix::process::CommandExt;
    Err(Command::new(program).args(args).exec().into())
}

/// Runs that program, and ends as it does.
#[cfg(not(unix))]
fn become_program(program: &Path, args: &[OsString]) -> Outcome {
    std::process::exit(Command::new(program).args(args).status()?.code().unwrap_or(2))
}
