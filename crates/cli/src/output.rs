//! Output files, which are checked when the arguments are parsed, before anything is computed.
//!
//! An argument that names an output file has the type [`Output`] and the parser [`output`]. The parser refuses an
//! extension that does not fit the contents, and a path that cannot be written. [`Output::write`] stores the contents.

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;
use std::ffi::OsStr;
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The file name that means stdout, where an argument accepts it.
const STDOUT: &str = "-";

/// Largest number of symbolic links that are followed from one path, that of Linux. Loops of links cannot be written
/// and are refused before.
const LINKS_MAX: usize = 40;

/// An output file, whose extension fits its contents and whose path can be written.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Output(PathBuf);

impl Output {
    /// The file's path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Whether the name means stdout. Only a parser with [`OutputParser::or_stdout`] lets it pass.
    pub fn is_stdout(&self) -> bool {
        self.0 == Path::new(STDOUT)
    }

    /// Whether the name has this extension, given in lower case without its dot. The case of the name does not matter.
    pub fn ends_in(&self, extension: &str) -> bool {
        extension_of(&self.0).is_some_and(|found| found == extension)
    }

    /// Stores the contents, and replaces an existing file. Callers print to stdout themselves ([`Output::is_stdout`]).
    ///
    /// # Errors
    /// The path with the system's message.
    pub fn write(&self, contents: &[u8]) -> Result<(), String> {
        write(&self.0, contents)
    }
}

/// Stores the contents of a file, and replaces an existing one.
///
/// # Errors
/// The path with the system's message.
pub fn write(path: &Path, contents: &[u8]) -> Result<(), String> {
    fs::write(path, contents).map_err(|error| format!("{}: cannot be written: {error}", path.display()))
}

/// A parser for an output file with one of these extensions (lower case, without dots).
pub fn output(extensions: &'static [&'static str]) -> OutputParser {
    OutputParser { extensions, accepts_stdout: false }
}

/// A parser that checks the extension and the path of an output file; see [`output`].
#[derive(Clone)]
pub struct OutputParser {
    extensions: &'static [&'static str],
    accepts_stdout: bool,
}

impl OutputParser {
    /// Accepts `-` as well, for stdout.
    #[must_use]
    pub fn or_stdout(self) -> Self {
        Self { accepts_stdout: true, ..self }
    }

    /// Refuses a path with a wrong extension, and a path that cannot be written. For a wrong extension, the message may
    /// name another argument of `command` that takes such a file ([`advice`]).
    fn check(&self, path: &Path, command: &Command) -> Result<(), String> {
        if self.accepts_stdout && path == Path::new(STDOUT) {
            return Ok(());
        }
        let found = extension_of(path);
        // A device or a pipe needs no extension, unless the extension chooses between formats.
        let needs_extension = self.extensions.len() > 1 || !is_device(path);
        if needs_extension && !found.as_deref().is_some_and(|found| self.extensions.contains(&found)) {
            return Err(format!("its name must end in {}{}", listed(self.extensions), advice(found, command)));
        }
        check_writable(path)
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

/// Refuses two outputs of a command that name the same file: one would overwrite the other. With a subcommand, the
/// outputs of the subcommand are checked.
///
/// # Errors
/// A message that names both arguments.
pub fn check_distinct(command: &Command, matches: &ArgMatches) -> Result<(), clap::Error> {
    if let Some((name, matches)) = matches.subcommand() {
        return command.find_subcommand(name).map_or(Ok(()), |command| check_distinct(command, matches));
    }
    let mut files: Vec<(PathBuf, &Arg)> = Vec::new();
    for argument in command.get_arguments() {
        // The error, for an argument of another type, means that it names no output.
        let given = matches.try_get_one::<Output>(argument.get_id().as_str()).ok().flatten();
        let Some(output) = given.filter(|output| !output.is_stdout() && !is_device(output.path())) else { continue };
        let file = resolved(output.path());
        if let Some((_, other)) = files.iter().find(|(earlier, _)| *earlier == file) {
            let message = format!("'{other}' and '{argument}' name the same file, {}", output.path().display());
            return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message).with_cmd(command));
        }
        files.push((file, argument));
    }
    Ok(())
}

/// The path with symbolic links and dots resolved, also where links lead to a file that does not exist yet. In a
/// missing folder the path stays as it is.
fn resolved(path: &Path) -> PathBuf {
    let mut file = path.to_owned();
    for _ in 0..LINKS_MAX {
        let Ok(target) = fs::read_link(&file) else { break };
        file = folder_of(&file).join(target);
    }
    let (folder, name) = (folder_of(&file), file.file_name().unwrap_or_default());
    let in_folder = || folder.canonicalize().unwrap_or(folder.to_owned()).join(name);
    file.canonicalize().unwrap_or_else(|_| in_folder())
}

/// A list of extensions in words, such as `.a, .b or .c`.
pub(crate) fn listed(extensions: &[&str]) -> String {
    let dotted: Vec<String> = extensions.iter().map(|extension| format!(".{extension}")).collect();
    match dotted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// A hint at the argument of the command that is named after the extension and takes a file, such as `--png`. The hint
/// is empty without such an argument: `--json` of `sunbeam orders`, for instance, is a flag and takes no file.
fn advice(extension: Option<String>, command: &Command) -> String {
    let takes_file = |name: &String| {
        let mut arguments = command.get_arguments().filter(|argument| argument.get_action().takes_values());
        arguments.any(|argument| argument.get_long() == Some(name.as_str()))
    };
    extension.filter(takes_file).map(|name| format!("; --{name} writes a .{name}")).unwrap_or_default()
}

/// The extension in lower case, without its dot.
fn extension_of(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

/// Whether the path names a device, a pipe or a socket.
fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// The parent folder of a path; the current folder for a bare name.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Refuses a path that cannot be written. It neither changes an existing file nor creates a new one.
fn check_writable(path: &Path) -> Result<(), String> {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Err("it is a folder".to_owned()),
        Ok(metadata) if metadata.is_file() => {
            OpenOptions::new().write(true).open(path).map(drop).map_err(|error| format!("cannot be written: {error}"))
        }
        // A pipe is not opened, since closing it again would end its reader.
        Ok(_) => Ok(()),
        Err(error) if is_missing(&error) => check_new(path),
        Err(error) => Err(format!("cannot be written: {error}")),
    }
}

/// Whether the error means that the path does not exist, or leads through a file.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// Refuses a path of a new file that cannot be created.
fn check_new(path: &Path) -> Result<(), String> {
    let folder = folder_of(path);
    match fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => return Err(format!("{} is no folder", folder.display())),
        Err(error) if is_missing(&error) => return Err(format!("there is no folder {}", folder.display())),
        Err(error) => return Err(format!("{}: {error}", folder.display())),
    }
    if let Ok(target) = fs::read_link(path) {
        // Writing to a dangling link creates its target. A loop of links never comes here: it has another error than
        // those of `is_missing`.
        return check_writable(&folder.join(target));
    }
    // Creating a file without a name tests the folder's permissions and file system, and leaves nothing behind.
    tempfile::tempfile_in(folder)
        .map(drop)
        .map_err(|error| format!("{} cannot be written to: {error}", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ArgAction;

    #[test]
    fn advice_names_arguments_with_a_value_and_no_flags() {
        let command = Command::new("orders")
            .arg(Arg::new("png").long("png"))
            .arg(Arg::new("json").long("json").action(ArgAction::SetTrue));
        assert_eq!(advice(Some("png".to_owned()), &command), "; --png writes a .png");
        assert_eq!(advice(Some("json".to_owned()), &command), "");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_new_file_names_that_file() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, other] = ["new.csv", "link.csv", "other.csv"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("link.csv", &other).unwrap();
        std::os::unix::fs::symlink("new.csv", &link).unwrap();
        assert_eq!(resolved(&other), resolved(&file));
        assert_ne!(resolved(&file), resolved(&folder.path().join("another.csv")));
    }
}
