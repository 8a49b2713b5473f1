//! Files that a command writes, checked when its arguments are read: before anything is computed.
//!
//! An argument that names such a file is an [`Output`] with the parser [`output`], which refuses an extension that does not
//! fit the contents and a place that cannot be written. Encoders make bytes, and [`Output::write`] stores them.

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;
use std::ffi::OsStr;
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The name that stands for stdout where an argument accepts it.
const STDOUT: &str = "-";

/// A file to be written, whose extension fits its contents and whose place can be written.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Output(PathBuf);

impl Output {
    /// The file's path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Whether the name stands for stdout.
    pub fn is_stdout(&self) -> bool {
        self.0 == Path::new(STDOUT)
    }

    /// Whether the name ends in this extension (lower case, without its dot), in either case.
    pub fn ends_in(&self, extension: &str) -> bool {
        extension_of(&self.0).is_some_and(|found| found == extension)
    }

    /// Stores the contents, replacing those of a file that is there.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn write(&self, contents: &[u8]) -> Result<(), String> {
        write(&self.0, contents)
    }
}

/// Stores the contents of a file.
///
/// # Errors
/// The path and the system's reason.
pub fn write(path: &Path, contents: &[u8]) -> Result<(), String> {
    fs::write(path, contents).map_err(|error| format!("{}: cannot be written: {error}", path.display()))
}

/// A parser of an argument that names a file to be written as one of these extensions (lower case, without dots).
pub fn output(extensions: &'static [&'static str]) -> OutputParser {
    OutputParser { extensions, stdout: false }
}

/// Checks the name and the place of a file to be written; see [`output`].
#[derive(Clone)]
pub struct OutputParser {
    extensions: &'static [&'static str],
    stdout: bool,
}

impl OutputParser {
    /// Accepts `-` as well, for stdout.
    #[must_use]
    pub fn or_stdout(self) -> Self {
        Self { stdout: true, ..self }
    }

    /// Refuses a path whose extension or place does not do; `siblings` is the command that the argument belongs to.
    fn check(&self, path: &Path, siblings: &Command) -> Result<(), String> {
        if self.stdout && path == Path::new(STDOUT) {
            return Ok(());
        }
        let found = extension_of(path);
        // The name of a device or a pipe says nothing of what goes into it, unless it has to choose between formats.
        let named = self.extensions.len() > 1 || !is_device(path);
        if named && !found.as_deref().is_some_and(|found| self.extensions.contains(&found)) {
            return Err(format!("its name must end in {}{}", listed(self.extensions), advice(found, siblings)));
        }
        check_place(path)
    }
}

impl TypedValueParser for OutputParser {
    type Value = Output;

    fn parse_ref(&self, command: &Command, argument: Option<&Arg>, value: &OsStr) -> Result<Output, clap::Error> {
        let path = PathBuf::from(value);
        match self.check(&path, command) {
            Ok(()) => Ok(Output(path)),
            Err(reason) => {
                let argument = argument.map(|argument| format!(" for '{argument}'")).unwrap_or_default();
                let message = format!("invalid value '{}'{argument}: {reason}", path.display());
                Err(clap::Error::raw(ErrorKind::ValueValidation, message).with_cmd(command))
            }
        }
    }
}

/// Refuses two outputs of a command that name the same file, of which one would be lost.
///
/// # Errors
/// A message that names both arguments.
pub fn check_distinct(command: &Command, matches: &ArgMatches) -> Result<(), clap::Error> {
    if let Some((name, matches)) = matches.subcommand() {
        return command.find_subcommand(name).map_or(Ok(()), |command| check_distinct(command, matches));
    }
    let mut places: Vec<(PathBuf, &Arg)> = Vec::new();
    for argument in command.get_arguments() {
        let given = matches.try_get_one::<Output>(argument.get_id().as_str()).ok().flatten();
        let Some(output) = given.filter(|output| !output.is_stdout() && !is_device(output.path())) else { continue };
        let place = resolved(output.path());
        if let Some((_, other)) = places.iter().find(|(taken, _)| *taken == place) {
            let message = format!("'{other}' and '{argument}' name the same file, {}", output.path().display());
            return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message).with_cmd(command));
        }
        places.push((place, argument));
    }
    Ok(())
}

/// The path with symbolic links and dots resolved, as far as it is there.
fn resolved(path: &Path) -> PathBuf {
    let (folder, name) = (folder_of(path), path.file_name().unwrap_or_default());
    let in_folder = || folder.canonicalize().unwrap_or(folder.to_owned()).join(name);
    path.canonicalize().unwrap_or_else(|_| in_folder())
}

/// `.a`, `.a or .b`, `.a, .b or .c`.
pub fn listed(extensions: &[&str]) -> String {
    let dotted: Vec<String> = extensions.iter().map(|extension| format!(".{extension}")).collect();
    match dotted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// The argument of the same command that writes the extension found, where its name says so: `--png`.
fn advice(found: Option<String>, siblings: &Command) -> String {
    let writes = |found: &String| siblings.get_arguments().any(|sibling| sibling.get_long() == Some(found.as_str()));
    found.filter(writes).map(|found| format!("; --{found} writes a .{found}")).unwrap_or_default()
}

fn extension_of(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

/// Whether the path is something other than a file or a folder: a device, a pipe, a socket.
fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// The folder that holds a path; the current one of a bare name.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Refuses a file that cannot be written. Leaves a file that is there as it is, and none where there was none.
fn check_place(path: &Path) -> Result<(), String> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err("it is a folder".to_owned()),
        Ok(found) if found.is_file() => {
            OpenOptions::new().write(true).open(path).map(drop).map_err(|error| format!("cannot be written: {error}"))
        }
        // Opening a pipe to close it again would end its reader.
        Ok(_) => Ok(()),
        Err(error) if is_missing(&error) => check_new(path),
        Err(error) => Err(format!("cannot be written: {error}")),
    }
}

/// Whether a path is not there, or leads through a file.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// Refuses a file that is not there and cannot be made.
fn check_new(path: &Path) -> Result<(), String> {
    let folder = folder_of(path);
    match fs::metadata(folder) {
        Ok(found) if found.is_dir() => {}
        Ok(_) => return Err(format!("{} is no folder", folder.display())),
        Err(error) if is_missing(&error) => return Err(format!("there is no folder {}", folder.display())),
        Err(error) => return Err(format!("{}: {error}", folder.display())),
    }
    if let Ok(target) = fs::read_link(path) {
        // A link to nothing yet: what it points to is made.
        return check_place(&folder.join(target));
    }
    // Only the system knows about permissions and read-only file systems. A file without a name leaves nothing behind.
    tempfile::tempfile_in(folder)
        .map(drop)
        .map_err(|error| format!("{} cannot be written to: {error}", folder.display()))
}
