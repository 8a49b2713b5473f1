//! The subcommands, one a file, and what they share: the surface ([`surface_args`]), the method of evaluation
//! ([`method_args`]), both together ([`reflector`]), the service that answers JSON lines ([`service`]), and the files that are
//! written ([`output`], [`encode`]).
//!
//! Results go to stdout as JSON; a failure is one line on stderr and exit status 2.

#![allow(missing_docs, clippy::missing_errors_doc)] // A library for the programs and tests of this workspace alone.

mod adapter;
mod bench;
pub mod benchmarks;
pub mod brdf_map;
mod chart;
mod compare;
pub mod comparison;
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

/// What a subcommand ends with.
pub type Outcome = Result<(), Box<dyn Error>>;

/// Diffraction colours of measured nanostructures.
///
/// Directions are in the surface's frame: z is its normal, wi and wo both point away from it. Lengths on the surface
/// are in µm, wavelengths in nm. Exit status 0, or 2 with one line that says what is wrong.
#[derive(Parser)]
#[command(name = "sunbeam", version, subcommand_required = true, arg_required_else_help = false)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

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

/// Runs the subcommand that the process was given.
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

/// Parses the process's arguments, and does with them what `run` does.
pub fn run_with<A: Parser>(run: impl FnOnce(&A) -> Outcome) -> ExitCode {
    let args = match parsed() {
        Ok(args) => args,
        Err(error) => return refuse(&error),
    };
    warnings::show();
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever read the answers has seen enough.
        Err(error) if is_broken_pipe(&*error) => ExitCode::SUCCESS,
        Err(error) => fail(&error.to_string()),
    }
}

/// The process's arguments, with outputs that can be written and differ from each other.
fn parsed<A: Parser>() -> Result<A, clap::Error> {
    let mut command = A::command();
    let matches = command.try_get_matches_from_mut(std::env::args_os())?;
    output::check_distinct(&command, &matches)?;
    A::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// The description of the command `sunbeam` and its subcommands.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Prints help or version, or what is wrong with the arguments.
fn refuse(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Nothing can be done where stdout is closed.
            let _ = error.print();
            ExitCode::SUCCESS
        }
        _ => {
            let rendered = error.render().to_string();
            let said = rendered.strip_prefix("error: ").unwrap_or(&rendered);
            let end = ["\n\nUsage:", "\n\nFor more information"].iter().filter_map(|mark| said.find(mark)).min();
            fail(&said[..end.unwrap_or(said.len())])
        }
    }
}

/// One line on stderr and status 2.
fn fail(message: &str) -> ExitCode {
    let line = message.split_whitespace().collect::<Vec<_>>().join(" ");
    eprintln!("sunbeam: {line}");
    ExitCode::from(2)
}

fn is_broken_pipe(error: &(dyn Error + 'static)) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// Prints a result as JSON over several lines.
fn print_json(value: &impl serde::Serialize) -> Outcome {
    let mut out = io::stdout().lock();
    let text = serde_json::to_string_pretty(value)?;
    writeln!(out, "{text}")?;
    Ok(())
}
