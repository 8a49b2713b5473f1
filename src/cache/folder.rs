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
/// Age after which a temporary file counts as left behind by a process that ended. Chosen: no write takes a day.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// Reason why an entry was not written.
#[derive(Debug, thiserror::Error)]
pub(super) enum KeepError {
    #[error("{size} bytes are more than the whole cache may have, {limit}")]
    TooLarge { size: u64, limit: u64 },
    #[error("{}: {source}", path.display())]
    Folder { path: PathBuf, source: io::Error },
    #[error("the tables cannot be written down: {0}")]
    Encode(#[from] postcard::Error),
}

/// Tables of `key`; `None` unless there is a valid entry for it. Marks the entry as just used.
pub(super) fn read<T: DeserializeOwned>(folder: &Path, key: &Key) -> Option<T> {
    let path = folder.join(key.file_name());
    let tables = decode(key, &fs::read(&path).ok()?)?;
    // The modification time serves as time of last use. Where it cannot be set, the entry is only removed earlier.
    if let Ok(file) = File::options().append(true).open(&path) {
        let _ = file.set_modified(SystemTime::now());
    }
    Some(tables)
}

/// Writes an entry under a temporary name and renames it; then removes old entries beyond `limit_bytes`.
///
/// Readers find a complete entry or none. Several writers of one key write equal bytes, so the last may replace the
/// others.
pub(super) fn keep<T: Serialize>(folder: &Path, key: &Key, tables: &T, limit_bytes: u64) -> Result<(), KeepError> {
    let bytes = encode(key, tables)?;
    let size = bytes.len() as u64;
    if size > limit_bytes {
        return Err(KeepError::TooLarge { size, limit: limit_bytes });
    }
    let wrong = |source| KeepError::Folder { path: folder.to_owned(), source };
    fs::create_dir_all(folder).map_err(wrong)?;
    let mut file = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder).map_err(wrong)?;
    file.write_all(&bytes).map_err(wrong)?;
    file.persist(folder.join(key.file_name())).map_err(|error| wrong(error.error))?;
    make_room(folder, limit_bytes).map_err(wrong)
}

/// Removes stale temporary files, and the least recently used entries until the rest is within `limit_bytes`.
///
/// Files with other names are not touched.
fn make_room(folder: &Path, limit_bytes: u64) -> io::Result<()> {
    let mut entries = Vec::new();
    for file in fs::read_dir(folder)? {
        // A file without metadata has been removed by another process meanwhile.
        let (Ok(file), now) = (file, SystemTime::now()) else { continue };
        let Ok(facts) = file.metadata() else { continue };
        let used = facts.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        let name = file.file_name().to_string_lossy().into_owned();
        if name.starts_with(UNFINISHED) && now.duration_since(used).is_ok_and(|age| age > STALE) {
            let _ = fs::remove_file(file.path());
        } else if is_file_name(&name) && facts.is_file() {
            entries.push((used, facts.len(), file.path()));
        }
    }
    entries.sort();
    let mut total: u64 = entries.iter().map(|(_, size, _)| size).sum();
    for (_, size, path) in entries {
        if total <= limit_bytes {
            break;
        }
        if fs::remove_file(path).is_ok() {
            total -= size;
        }
    }
    Ok(())
}
