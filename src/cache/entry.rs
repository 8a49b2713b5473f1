//! One entry: what it is named by, and how its bytes are told from others.

use crate::height_field::HeightField;
use crate::reflectance::{Options, Surface};

const MAGIC: &[u8; 16] = b"sunbeam tables 1";
const HASH: usize = 32;
const HEADER: usize = MAGIC.len() + 2 * HASH;

/// A hash of the code that builds tables, so that those of another version are not believed (`build.rs`).
const CODE: &str = env!("SUNBEAM_TABLES_CODE");

/// What a surface's tables depend on, hashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key(blake3::Hash);

impl Key {
    pub fn new(field: &HeightField, options: &Options) -> Self {
        let mut hasher = blake3::Hasher::new();
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
        hasher.update(format!("{options:?}").as_bytes());
        Self(hasher.finalize())
    }

    /// The name of the entry's file.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.0.to_hex(), super::folder::EXTENSION)
    }
}

/// The bytes of an entry: what it is, its key, the hash of its contents, and these.
pub(super) fn encode(key: &Key, surface: &Surface) -> Result<Vec<u8>, postcard::Error> {
    let mut bytes = vec![0; HEADER];
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    bytes[MAGIC.len()..][..HASH].copy_from_slice(key.0.as_bytes());
    bytes = postcard::to_extend(surface, bytes)?;
    let contents = blake3::hash(&bytes[HEADER..]);
    bytes[MAGIC.len() + HASH..HEADER].copy_from_slice(contents.as_bytes());
    Ok(bytes)
}

/// The surface in an entry's bytes, `None` unless they are whole, of this key, and what was written.
pub(super) fn decode(key: &Key, bytes: &[u8]) -> Option<Surface> {
    let (header, contents) = bytes.split_at_checked(HEADER)?;
    let (magic, hashes) = header.split_at(MAGIC.len());
    let (own_key, own_hash) = hashes.split_at(HASH);
    let genuine = magic == MAGIC && own_key == key.0.as_bytes() && own_hash == blake3::hash(contents).as_bytes();
    genuine.then(|| postcard::from_bytes(contents).ok())?
}
