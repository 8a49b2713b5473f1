//! One entry of the cache: the key, the file name, and the bytes of the file.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 15 | magic: a text that marks the format |
//! | 16 to 47 | key: BLAKE3 hash of everything that the tables depend on |
//! | 48 to 79 | BLAKE3 hash of the contents, which reveals damaged files |
//! | from 80 on | contents: the tables in postcard's encoding |

#[cfg(feature = "rigorous")]
use crate::grating::{GratingBody, Profile};
use crate::height_field::HeightField;
use crate::scattering::{Options, SpectralIndex};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// First bytes of an entry. The digit is the version of the layout above.
const MAGIC: &[u8; 16] = b"sunbeam tables 1";
/// Bytes of a BLAKE3 hash, 32.
const HASH_BYTES: usize = blake3::OUT_LEN;
/// Number of bytes before the contents: magic, key and hash of the contents.
const HEADER_BYTES: usize = MAGIC.len() + 2 * HASH_BYTES;
/// Extension of an entry's file name. The digits before it are the key in hexadecimal.
const EXTENSION: &str = ".tables";

/// Hash of the source code that builds tables, set by the build script (`build.rs`). It is part of every key, so
/// entries that other versions of the code wrote are never read.
const CODE: &str = env!("SUNBEAM_TABLES_CODE");

/// Hash of everything that an entry's tables depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key(blake3::Hash);

impl Key {
    /// Key of a [`Surface`](crate::lobe::Surface), whose tables serve all wavelengths.
    pub(super) fn of_surface(field: &HeightField, options: &Options) -> Self {
        Self::new("surface", field, options)
    }

    /// Key of a [`ColourSurface`](crate::lobe::ColourSurface). `index` is the refractive index for which its colours
    /// include the interface's factor; `None` leaves the factor out.
    pub(super) fn of_colours(field: &HeightField, options: &Options, index: Option<&SpectralIndex>) -> Self {
        Self::new(&format!("colours {index:?}"), field, options)
    }

    /// Key of a grating's tables, which do not depend on the coherence length. `kind` separates the several kinds of
    /// tables of one grating. The few kinds are fixed texts, so that they need no length as in [`Key::new`].
    #[cfg(feature = "rigorous")]
    pub(super) fn of_grating(kind: &str, profile: &Profile, body: GratingBody<'_>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(CODE.as_bytes());
        // `Debug` writes numbers as the shortest decimals that read back unchanged.
        hasher.update(format!("{kind} {profile:?} {body:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// Key of a height field's tables. `kind` separates the several kinds of tables of one height field.
    fn new(kind: &str, field: &HeightField, options: &Options) -> Self {
        let mut hasher = blake3::Hasher::new();
        // The length separates the kind, a text of any length, from the bytes after it: two different lists of inputs
        // must not give the same bytes.
        hasher.update(&(kind.len() as u64).to_le_bytes());
        hasher.update(kind.as_bytes());
        hasher.update(CODE.as_bytes());
        let (nx, ny) = field.size();
        hasher.update(&(nx as u64).to_le_bytes());
        hasher.update(&(ny as u64).to_le_bytes());
        hasher.update(&field.dx_um().to_le_bytes());
        hasher.update(&field.dy_um().to_le_bytes());
        let mut row = Vec::with_capacity(8 * nx);
        for heights in field.heights_um().rows() {
            row.clear();
            row.extend(heights.iter().flat_map(|h| h.to_le_bytes()));
            hasher.update(&row);
        }
        // The limit on memory and time decides whether tables are built, but does not change them.
        let options = Options { build_limit: 1.0, ..options.clone() };
        // `Debug` writes every field's name, and numbers as the shortest decimals that read back unchanged.
        hasher.update(format!("{options:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// File name of the entry, without folder.
    pub(super) fn file_name(&self) -> String {
        format!("{}{EXTENSION}", self.0.to_hex())
    }
}

/// Whether a file name has the form of [`Key::file_name`].
pub(super) fn is_file_name(name: &str) -> bool {
    let digits = name.strip_suffix(EXTENSION);
    digits.is_some_and(|digits| digits.len() == 2 * HASH_BYTES && digits.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Bytes of the entry that stores `tables` under `key`.
pub(super) fn encode<T: Serialize>(key: &Key, tables: &T) -> Result<Vec<u8>, postcard::Error> {
    let mut bytes = vec![0; HEADER_BYTES];
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    bytes[MAGIC.len()..][..HASH_BYTES].copy_from_slice(key.0.as_bytes());
    bytes = postcard::to_extend(tables, bytes)?;
    let contents_hash = blake3::hash(&bytes[HEADER_BYTES..]);
    bytes[MAGIC.len() + HASH_BYTES..HEADER_BYTES].copy_from_slice(contents_hash.as_bytes());
    Ok(bytes)
}

/// Tables in an entry's bytes. `None` unless the magic, the key and the hash of the contents agree and the contents can
/// be decoded.
pub(super) fn decode<T: DeserializeOwned>(key: &Key, bytes: &[u8]) -> Option<T> {
    let (header, contents) = bytes.split_at_checked(HEADER_BYTES)?;
    let (magic, hashes) = header.split_at(MAGIC.len());
    let (stored_key, stored_hash) = hashes.split_at(HASH_BYTES);
    if magic != MAGIC || stored_key != key.0.as_bytes() || stored_hash != blake3::hash(contents).as_bytes() {
        return None;
    }
    postcard::from_bytes(contents).ok()
}
