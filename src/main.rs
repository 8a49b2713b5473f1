//! The command line of `sunbeam`: a consumer of the library, like the Mitsuba plugin.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
