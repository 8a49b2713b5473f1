//! Tables kept on disk, so that a surface which was built once is read the next time.
//!
//! An entry's name is the hash of all that its tables depend on: the heights, the options, and the code that builds
//! tables. It is written whole under another name first, and only believed if its own hash agrees; whatever is wrong with
//! the folder or an entry, the tables are built, so a cache can be slow but not wrong. The least recently used entries go
//! when the folder grows beyond its limit.

mod entry;
mod folder;
mod shared;

use crate::colour_table::ColourTableError;
#[cfg(feature = "rigorous")]
use crate::grating::{GratingColourSurface, GratingError, GratingSurface, JonesTable, Profile};
use crate::height_field::HeightField;
use crate::lobe::{ColourSurface, Surface};
use crate::scattering::{Options, SpectralIndex};
use crate::table::{Progress, TableError};
use entry::Key;
use serde::Serialize;
use serde::de::DeserializeOwned;
pub use shared::Shared;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// Set to `off`, nothing is read or written; `on` is the default.
pub const SWITCH: &str = "SUNBEAM_CACHE";
/// The folder, instead of the one that the platform keeps for caches.
pub const FOLDER: &str = "SUNBEAM_CACHE_DIR";
/// The largest size of the folder in MB.
pub const LIMIT: &str = "SUNBEAM_CACHE_LIMIT_MB";
/// The largest size of the folder in MB unless [`LIMIT`] is set.
pub const DEFAULT_LIMIT_MB: u64 = 2000;

/// Why the environment does not describe a cache.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the environment variable {variable} is {found:?}, but must be {accepted}")]
#[allow(missing_docs)] // Each message says what its fields are.
pub struct CacheError {
    pub variable: &'static str,
    pub found: String,
    pub accepted: &'static str,
}

/// Where tables are kept, or that none are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: Option<PathBuf>,
    limit_bytes: u64,
}

/// Where a surface's tables came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// They were built, and no cache was asked.
    Built,
    /// They were built and kept.
    Kept,
    /// They were built, and could not be kept for this reason.
    NotKept(String),
    /// They were read.
    Read,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Built => f.write_str("built"),
            Self::Kept => f.write_str("built, kept in the cache"),
            Self::NotKept(reason) => write!(f, "built, not kept in the cache: {reason}"),
            Self::Read => f.write_str("read from the cache"),
        }
    }
}

impl Serialize for Origin {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Cache {
    /// Nothing is kept.
    pub fn off() -> Self {
        Self { folder: None, limit_bytes: 0 }
    }

    /// Tables are kept in a folder, which is made when the first of them is; it may grow to `limit_bytes`.
    pub fn new(folder: impl Into<PathBuf>, limit_bytes: u64) -> Self {
        Self { folder: Some(folder.into()), limit_bytes }
    }

    /// The cache that the environment describes by [`SWITCH`], [`FOLDER`] and [`LIMIT`]; by default the folder `sunbeam` where
    /// the platform has caches (`$XDG_CACHE_HOME` or `~/.cache` on Linux, `~/Library/Caches`, `%LOCALAPPDATA%`), or none where
    /// there is no such place.
    ///
    /// # Errors
    /// A variable whose value is not accepted.
    pub fn from_env() -> Result<Self, CacheError> {
        Self::from_variables(|name| std::env::var_os(name).map(|value| value.to_string_lossy().into_owned()))
    }

    fn from_variables(get: impl Fn(&str) -> Option<String>) -> Result<Self, CacheError> {
        let given = |name| get(name).filter(|value| !value.is_empty());
        let limit_mb = match given(LIMIT) {
            None => DEFAULT_LIMIT_MB,
            Some(found) => {
                found.parse().map_err(|_| CacheError { variable: LIMIT, found, accepted: "a whole number of MB" })?
            }
        };
        match given(SWITCH).as_deref() {
            Some("off") => return Ok(Self::off()),
            None | Some("on") => {}
            Some(found) => {
                let (variable, accepted) = (SWITCH, "on or off");
                return Err(CacheError { variable, found: found.to_owned(), accepted });
            }
        }
        let folder =
            given(FOLDER).map(PathBuf::from).or_else(|| dirs::cache_dir().map(|caches| caches.join("sunbeam")));
        Ok(Self { folder, limit_bytes: limit_mb.saturating_mul(1_000_000) })
    }

    /// The folder, `None` where nothing is kept.
    pub fn folder(&self) -> Option<&PathBuf> {
        self.folder.as_ref()
    }

    /// As [`Cache::surface`], but one that this process has in use is not read or built again.
    ///
    /// # Errors
    /// As [`Cache::surface`].
    pub fn shared_surface(
        &self,
        field: &HeightField,
        options: &Options,
        progress: &Progress,
    ) -> Result<Arc<(Surface, Origin)>, TableError> {
        static SURFACES: Shared<Key, (Surface, Origin)> = Shared::new();
        SURFACES.get(Key::of_surface(field, options), || self.surface_watched(field, options, progress))
    }

    /// The surface of `field`: its tables read if they are kept, else built, and kept.
    ///
    /// # Errors
    /// As [`Surface::new`]; nothing that is wrong with the cache is one.
    pub fn surface(&self, field: &HeightField, options: &Options) -> Result<(Surface, Origin), TableError> {
        self.surface_watched(field, options, &Progress::none())
    }

    /// As [`Cache::surface`], telling `progress` how far building has come, if anything is built.
    ///
    /// # Errors
    /// As [`Surface::new`].
    pub fn surface_watched(
        &self,
        field: &HeightField,
        options: &Options,
        progress: &Progress,
    ) -> Result<(Surface, Origin), TableError> {
        self.tables(|| Key::of_surface(field, options), || Surface::watched(field, options, progress))
    }

    /// The surface of `field` in colours, with the reflectance for `index` inside if there is one: as
    /// [`Cache::shared_surface`].
    ///
    /// # Errors
    /// As [`ColourSurface::new`].
    pub fn shared_colours(
        &self,
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
        progress: &Progress,
    ) -> Result<Arc<(ColourSurface, Origin)>, ColourTableError> {
        static SURFACES: Shared<Key, (ColourSurface, Origin)> = Shared::new();
        let key = Key::of_colours(field, options, index);
        SURFACES.get(key, || self.tables(|| key, || ColourSurface::watched(field, options, index, progress)))
    }

    /// The grating of a profile above a medium of this index, or a perfect conductor: as [`Cache::shared_surface`].
    ///
    /// # Errors
    /// As [`GratingSurface::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_grating(
        &self,
        profile: &Profile,
        index: Option<&SpectralIndex>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(GratingSurface, Origin)>, GratingError> {
        static SURFACES: Shared<(Key, u64), (GratingSurface, Origin)> = Shared::new();
        let key = Key::of_grating("grating", profile, index);
        SURFACES.get((key, coherence_length_um.to_bits()), || {
            let build = || GratingSurface::new(profile, index, coherence_length_um, build_limit, progress);
            let (grating, origin) = self.tables(|| key, build)?;
            // What is kept is the same for all coherence lengths.
            Ok((grating.with_coherence_length(coherence_length_um), origin))
        })
    }

    /// The same in colours.
    ///
    /// # Errors
    /// As [`GratingSurface::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_grating_colours(
        &self,
        profile: &Profile,
        index: Option<&SpectralIndex>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(GratingColourSurface, Origin)>, GratingError> {
        static SURFACES: Shared<(Key, u64), (GratingColourSurface, Origin)> = Shared::new();
        let key = Key::of_grating("grating in colours", profile, index);
        SURFACES.get((key, coherence_length_um.to_bits()), || {
            let build = || {
                let made = self.shared_grating(profile, index, coherence_length_um, build_limit, progress)?;
                Ok::<_, GratingError>(GratingColourSurface::new(made.0.clone()))
            };
            let (grating, origin) = self.tables(|| key, build)?;
            Ok((grating.with_coherence_length(coherence_length_um), origin))
        })
    }

    /// How the orders of [`Cache::shared_grating`] polarise.
    ///
    /// # Errors
    /// As [`JonesTable::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_jones(
        &self,
        profile: &Profile,
        index: Option<&SpectralIndex>,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(JonesTable, Origin)>, GratingError> {
        static TABLES: Shared<Key, (JonesTable, Origin)> = Shared::new();
        let key = Key::of_grating("polarisation of a grating", profile, index);
        TABLES.get(key, || self.tables(|| key, || JonesTable::new(profile, index, build_limit, progress)))
    }

    /// Tables: read if they are kept, else built, and kept.
    fn tables<T: Serialize + DeserializeOwned, E>(
        &self,
        key: impl FnOnce() -> Key,
        build: impl FnOnce() -> Result<T, E>,
    ) -> Result<(T, Origin), E> {
        let Some(folder) = &self.folder else { return Ok((build()?, Origin::Built)) };
        let key = key();
        if let Some(tables) = folder::read(folder, &key) {
            return Ok((tables, Origin::Read));
        }
        let tables = build()?;
        let origin = match folder::keep(folder, &key, &tables, self.limit_bytes) {
            Ok(()) => Origin::Kept,
            Err(reason) => Origin::NotKept(reason.to_string()),
        };
        Ok((tables, origin))
    }
}

#[cfg(test)]
mod tests;
