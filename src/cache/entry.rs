//! One entry: what it is named by, and how its bytes are told from others.

#[cfg(feature = "rigorous")]
use crate::grating::Profile;
use crate::height_field::HeightField;
use crate::scattering::{Options, SpectralIndex};
use serde::Serialize;
use serde::de::DeserializeOwned;

const MAGIC: &[u8; 16] = b"sunbeam tables 1";
const HASH: usize = 32;
const HEADER: usize = MAGIC.len() + 2 * HASH;

/// A hash of the code that builds tables, so that those of another version are not believed (`build.rs`).
const CODE: &str = env!("SUNBEAM_TABLES_CODE");

/// What a surface's tables depend on, hashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key(blake3::Hash);

impl Key {
    /// Of tables for all wavelengths.
    pub fn of_surface(field: &HeightField, options: &Options) -> Self {
        Self::new("surface", field, options)
    }

    /// Of tables of colours with the reflectance for an index, if there is one.
    pub fn of_colours(field: &HeightField, options: &Options, index: Option<&SpectralIndex>) -> Self {
        Self::new(&format!("colours {index:?}"), field, options)
    }

    /// Of a grating's tables, in the words of `what` they are.
    #[cfg(feature = "rigorous")]
    pub fn of_grating(what: &str, profile: &Profile, index: Option<&SpectralIndex>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(CODE.as_bytes());
        // Every number by the shortest decimal that reads back as the same.
        hasher.update(format!("{what} {profile:?} {index:?}").as_bytes());
        Self(hasher.finalize())
    }

    fn new(what: &str, field: &HeightField, options: &Options) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(what.len() as u64).to_le_bytes());
        hasher.update(what.as_bytes());
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
        // Every field by its name and the shortest decimal that reads back as the same number.
        // How much a build may take is no part of what is built.
        let built = Options { build_limit: 1.0, ..options.clone() };
        hasher.update(format!("{built:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// The name of the entry's file.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.0.to_hex(), super::folder::EXTENSION)
    }
}

/// The bytes of an entry: what it is, its key, the hash of its contents, and these.
pub(super) fn encode<T: Serialize>(key: &Key, tables: &T) -> Result<Vec<u8>, postcard::Error> {
    let mut bytes = vec![0; HEADER];
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    bytes[MAGIC.len()..][..HASH].copy_from_slice(key.0.as_bytes());
    bytes = postcard::to_extend(tables, bytes)?;
    let contents = blake3::hash(&bytes[HEADER..]);
    bytes[MAGIC.len() + HASH..HEADER].copy_from_slice(contents.as_bytes());
    Ok(bytes)
}

/// The tables in an entry's bytes, `None` unless they are whole, of this key, and what was written.
pub(super) fn decode<T: DeserializeOwned>(key: &Key, bytes: &[u8]) -> Option<T> {
    let (header, contents) = bytes.split_at_checked(HEADER)?;
    let (magic, hashes) = header.split_at(MAGIC.len());
    let (own_key, own_hash) = hashes.split_at(HASH);
    let genuine = magic == MAGIC && own_key == key.0.as_bytes() && own_hash == blake3::hash(contents).as_bytes();
    genuine.then(|| postcard::from_bytes(contents).ok())?
}
