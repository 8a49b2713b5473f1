//! The command `sunbeam`, one module for each subcommand, and the modules that they share.
//!
//! - [`surface_args`], [`method_args`], [`scene_args`]: arguments for the surface, the method and the scene.
//! - `reflector`: a surface and its method of evaluation on the CPU; [`realtime`]: the same on the GPU.
//! - `service`, `query`: answers to queries, JSON lines on stdin.
//! - [`output`], [`encode`], `chart`: files that are written.
//! - [`benchmarks`], `comparison`: the measurements of `sunbeam bench` and `sunbeam compare`.
//!
//! Public modules serve the program `sunbeam-view` (crates/window) and tests as well.
//!
//! Results go to stdout as JSON, except for the table of `sunbeam orders`. A failure is one line on stderr and exit
//! status 2.

mod adapter;
mod arguments;
mod bench;
pub mod benchmarks;
mod brdf_map;
mod chart;
mod compare;
mod comparison;
pub mod encode;
mod eval;
mod evaluate;
mod height_field;
pub mod method_args;
mod orders;
pub mod output;
mod progress;
mod query;
pub mod realtime;
mod reflector;
mod render;
mod sample;
pub mod scene_args;
mod service;
mod snake;
pub mod surface_args;
mod term;
mod view;
mod warnings;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use std::error::Error;
use std::io::{self, Write};
use std::process::ExitCode;

/// The result of a subcommand, which writes its output itself.
pub type Outcome = Result<(), Box<dyn Error>>;

/// Compute the diffraction colours of measured nanostructures
///
/// Directions are in the surface's frame: z is the normal, and wi and wo both point away from the surface. Lengths on
/// the surface are in µm, wavelengths in nm. The exit status is 0, or 2 with one line on stderr that names the error.
// Without `arg_required_else_help = false`, clap would answer a missing subcommand by the whole help, not by one line.
#[derive(Parser)]
#[command(name = "sunbeam", version, subcommand_required = true, arg_required_else_help = false)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The subcommands. Their help texts are the documentation of the arguments' types.
#[derive(Subcommand)]
enum Command {
    Eval(eval::EvalArgs),
    Evaluate(evaluate::EvaluateArgs),
    Sample(sample::SampleArgs),
    BrdfMap(brdf_map::BrdfMapArgs),
    HeightField(height_field::HeightFieldArgs),
    Orders(Box<orders::OrdersArgs>),
    Render(render::RenderArgs),
    Snake(snake::SnakeArgs),
    Compare(compare::CompareArgs),
    Adapter(adapter::AdapterArgs),
    Bench(Box<bench::BenchArgs>),
    View(view::ViewArgs),
}

/// Runs the program `sunbeam`: the subcommand that the process's arguments name.
pub fn run() -> ExitCode {
    run_with(|cli: &Cli| match &cli.command {
        Command::Eval(args) => eval::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Sample(args) => sample::run(args),
        Command::BrdfMap(args) => brdf_map::run(args),
        Command::HeightField(args) => height_field::run(args),
        Command::Orders(args) => orders::run(args),
        Command::Render(args) => render::run(args),
        Command::Snake(args) => snake::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Adapter(args) => adapter::run(args),
        Command::Bench(args) => bench::run(args),
        Command::View(args) => view::run(args),
    })
}

/// Parses the process's arguments and runs `program` on them.
///
/// `--help` and `--version` print their text instead. An error is printed on stderr, and the status is 2, unless the
/// error is a closed pipe at stdout.
pub fn run_with<A: Parser>(program: impl FnOnce(&A) -> Outcome) -> ExitCode {
    let args = match parse_arguments() {
        Ok(args) => args,
        Err(error) => return exit_after_parsing(&error),
    };
    // From here on, warnings that the library logs are printed on stderr.
    warnings::show();
    match program(&args) {
        Ok(()) => ExitCode::SUCCESS,
        // The process that reads stdout has closed the pipe, as `head` does.
        Err(error) if is_broken_pipe(&*error) => ExitCode::SUCCESS,
        Err(error) => fail(&error.to_string()),
    }
}

/// Parses the process's arguments. Refuses an output file that cannot be written, and two outputs to one file.
fn parse_arguments<A: Parser>() -> Result<A, clap::Error> {
    let mut command = A::command();
    let matches = command.try_get_matches_from_mut(std::env::args_os())?;
    output::check_distinct(&command, &matches)?;
    A::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// clap's description of the program `sunbeam` and its subcommands, for tests of the arguments.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Prints help or the version with status 0, or the error in the arguments with status 2.
fn exit_after_parsing(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Printing fails only where stdout is closed, and then nobody reads the help.
            let _ = error.print();
            ExitCode::SUCCESS
        }
        _ => {
            // Only the message of clap's text is kept, without its prefix, the usage and the hint at --help.
            let rendered = error.render().to_string();
            let message = rendered.strip_prefix("error: ").unwrap_or(&rendered);
            let end = ["\n\nUsage:", "\n\nFor more information"].iter().filter_map(|mark| message.find(mark)).min();
            fail(&message[..end.unwrap_or(message.len())])
        }
    }
}

/// Prints the message as one line on stderr and returns status 2.
fn fail(message: &str) -> ExitCode {
    let line = message.split_whitespace().collect::<Vec<_>>().join(" ");
    eprintln!("sunbeam: {line}");
    ExitCode::from(2)
}

/// Whether the error means that the reader of an output has closed its pipe.
fn is_broken_pipe(error: &(dyn Error + 'static)) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// Prints a result on stdout as indented JSON.
fn print_json(value: &impl serde::Serialize) -> Outcome {
    let mut out = io::stdout().lock();
    let text = serde_json::to_string_pretty(value)?;
    writeln!(out, "{text}")?;
    Ok(())
}
