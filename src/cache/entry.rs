//! One entry of the cache: its key, its file name, and its bytes.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 15 | magic |
//! | 16 to 47 | key: BLAKE3 hash of everything that the tables depend on |
//! | 48 to 79 | BLAKE3 hash of the contents |
//! | from 80 on | contents: the tables in postcard's encoding |

#[cfg(feature = "rigorous")]
use crate::grating::Profile;
use crate::height_field::HeightField;
use crate::scattering::{Options, SpectralIndex};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// First bytes of an entry, with the version of this layout.
const MAGIC: &[u8; 16] = b"sunbeam tables 1";
/// Bytes of a BLAKE3 hash.
const HASH: usize = blake3::OUT_LEN;
/// Bytes before the contents.
const HEADER: usize = MAGIC.len() + 2 * HASH;
/// Extension of an entry's file name; the digits before it are the key in hexadecimal.
const EXTENSION: &str = ".tables";

/// Hash of the code that builds tables (`build.rs`), so that entries of another version are not found.
const CODE: &str = env!("SUNBEAM_TABLES_CODE");

/// Hash of everything that an entry's tables depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key(blake3::Hash);

impl Key {
    /// Key of a [`Surface`](crate::lobe::Surface): tables for all wavelengths.
    pub(super) fn of_surface(field: &HeightField, options: &Options) -> Self {
        Self::new("surface", field, options)
    }

    /// Key of a [`ColourSurface`](crate::lobe::ColourSurface), whose Fresnel factor is that of `index`.
    pub(super) fn of_colours(field: &HeightField, options: &Options, index: Option<&SpectralIndex>) -> Self {
        Self::new(&format!("colours {index:?}"), field, options)
    }

    /// Key of a grating's tables; `kind` names the kind of tables, so that entries of several kinds differ.
    #[cfg(feature = "rigorous")]
    pub(super) fn of_grating(kind: &str, profile: &Profile, index: Option<&SpectralIndex>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(CODE.as_bytes());
        // `Debug` writes numbers as the shortest decimals that read back unchanged.
        hasher.update(format!("{kind} {profile:?} {index:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// Key of tables of a height field: hash of `kind`, the code, the heights and the options.
    fn new(kind: &str, field: &HeightField, options: &Options) -> Self {
        let mut hasher = blake3::Hasher::new();
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
        // The limit on building does not change what is built.
        let options = Options { build_limit: 1.0, ..options.clone() };
        // `Debug` writes every field's name, and numbers as the shortest decimals that read back unchanged.
        hasher.update(format!("{options:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// File name of the entry.
    pub(super) fn file_name(&self) -> String {
        format!("{}{EXTENSION}", self.0.to_hex())
    }
}

/// Whether a file name is that of some entry.
pub(super) fn is_file_name(name: &str) -> bool {
    let digits = name.strip_suffix(EXTENSION);
    digits.is_some_and(|digits| digits.len() == 2 * HASH && digits.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Bytes of the entry of `key` with these tables.
pub(super) fn encode<T: Serialize>(key: &Key, tables: &T) -> Result<Vec<u8>, postcard::Error> {
    let mut bytes = vec![0; HEADER];
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    bytes[MAGIC.len()..][..HASH].copy_from_slice(key.0.as_bytes());
    bytes = postcard::to_extend(tables, bytes)?;
    let contents = blake3::hash(&bytes[HEADER..]);
    bytes[MAGIC.len() + HASH..HEADER].copy_from_slice(contents.as_bytes());
    Ok(bytes)
}

/// Tables in an entry's bytes; `None` unless magic, key and hash of the contents agree and the contents can be decoded.
pub(super) fn decode<T: DeserializeOwned>(key: &Key, bytes: &[u8]) -> Option<T> {
    let (header, contents) = bytes.split_at_checked(HEADER)?;
    let (magic, hashes) = header.split_at(MAGIC.len());
    let (own_key, own_hash) = hashes.split_at(HASH);
    let genuine = magic == MAGIC && own_key == key.0.as_bytes() && own_hash == blake3::hash(contents).as_bytes();
    genuine.then(|| postcard::from_bytes(contents).ok())?
}
