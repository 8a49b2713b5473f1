//! The folder of entries: reading, atomic writing, and removal of old entries.

use super::entry::{Key, decode, encode, is_file_name};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Prefix of the temporary name of an entry that is being written.
const UNFINISHED: &str = ".unfinished-";
/// Age after which a temporary file counts as left behind by a process that ended. A day is far longer than any write;
/// a shorter age could remove a file that is still being written, a longer one keeps useless files.
const STALE_AGE: Duration = Duration::from_secs(24 * 3600);

/// Reason why an entry was not written, or why old entries were not removed after the new one was written.
#[derive(Debug, thiserror::Error)]
pub(super) enum KeepError {
    #[error("the entry has {size_bytes} bytes, more than the {limit_bytes} bytes of the whole cache")]
    TooLarge { size_bytes: u64, limit_bytes: u64 },
    #[error("{}: {source}", path.display())]
    Folder { path: PathBuf, source: io::Error },
    #[error("the tables cannot be encoded: {0}")]
    Encode(#[from] postcard::Error),
}

/// Tables stored under `key`; `None` unless the folder holds a valid entry of that key. Marks the entry as just used.
pub(super) fn read<T: DeserializeOwned>(folder: &Path, key: &Key) -> Option<T> {
    let path = folder.join(key.file_name());
    let tables = decode(key, &fs::read(&path).ok()?)?;
    // The modification time serves as the time of last use. Setting it needs a file that is open for writing; opening
    // with `append` leaves the bytes unchanged. If setting it fails, the entry may be removed too early.
    if let Ok(file) = File::options().append(true).open(&path) {
        let _ = file.set_modified(SystemTime::now());
    }
    Some(tables)
}

/// Writes an entry under a temporary name and renames it. Then removes old entries until all entries together take at
/// most `limit_bytes`.
///
/// Readers find a complete entry or none. Concurrent writers of one key write equal tables, so any of them may be the
/// last.
pub(super) fn keep<T: Serialize>(folder: &Path, key: &Key, tables: &T, limit_bytes: u64) -> Result<(), KeepError> {
    let bytes = encode(key, tables)?;
    let size_bytes = bytes.len() as u64;
    if size_bytes > limit_bytes {
        return Err(KeepError::TooLarge { size_bytes, limit_bytes });
    }
    let in_folder = |source| KeepError::Folder { path: folder.to_owned(), source };
    fs::create_dir_all(folder).map_err(in_folder)?;
    let mut file = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder).map_err(in_folder)?;
    file.write_all(&bytes).map_err(in_folder)?;
    file.persist(folder.join(key.file_name())).map_err(|error| in_folder(error.error))?;
    make_room(folder, limit_bytes).map_err(in_folder)
}

/// Removes stale temporary files, and the least recently used entries until the remaining ones together take at most
/// `limit_bytes`. Leaves files with other names alone.
fn make_room(folder: &Path, limit_bytes: u64) -> io::Result<()> {
    let now = SystemTime::now();
    // Time of last use, size in bytes and path of each entry. Sorting is by the first, the time.
    let mut entries = Vec::new();
    for file in fs::read_dir(folder)?.flatten() {
        // Reading the metadata fails for a file that another process has just removed.
        let Ok(metadata) = file.metadata() else { continue };
        // Time of last use of an entry ([`read`]), of last writing of a temporary file.
        let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        let name = file.file_name().to_string_lossy().into_owned();
        if name.starts_with(UNFINISHED) && now.duration_since(modified).is_ok_and(|age| age > STALE_AGE) {
            // Another process may have removed it.
            let _ = fs::remove_file(file.path());
        } else if is_file_name(&name) && metadata.is_file() {
            entries.push((modified, metadata.len(), file.path()));
        }
    }
    entries.sort();
    let mut total_bytes: u64 = entries.iter().map(|(_, size_bytes, _)| size_bytes).sum();
    for (_, size_bytes, path) in entries {
        if total_bytes <= limit_bytes {
            break;
        }
        // An entry that cannot be removed still takes its bytes.
        if fs::remove_file(path).is_ok() {
            total_bytes -= size_bytes;
        }
    }
    Ok(())
}
