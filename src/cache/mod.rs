//! Cache of built tables on disk: a surface that was built once is read the next time.
//!
//! - One file, an *entry*, holds the tables of one surface. Its name is a hash of everything the tables depend on, the
//!   *key*: the relief, the options, and the code that builds tables.
//! - An entry is written under a temporary name and then renamed, so readers find a complete entry or none.
//! - An entry holds a hash of its contents and is ignored unless the hash agrees.
//! - An unusable folder or entry is no error: the tables are built instead.
//! - When all entries together exceed the size limit, the least recently used entries are removed.
//! - The arguments `progress` and `build_limit` matter only if tables are built. They are no part of the key.
//!
//! The `shared_…` functions also share tables within this process ([`Shared`]). While a caller holds tables, every call
//! whose other arguments give the same key returns these tables, whatever the state of the disk.
//!
//! ```
//! # let folder = tempfile::tempdir()?;
//! use sunbeam::cache::{Cache, Origin};
//! use sunbeam::height_field::Preset;
//! use sunbeam::scattering::Options;
//! use sunbeam::table::{Model, Progress};
//!
//! let cache = Cache::new(folder.path(), 100_000_000);
//! let field = Preset::Blazed.build(None, None)?;
//! // The patch model without energy conservation is the quickest to build.
//! let options = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
//! let (_, origin) = cache.surface(&field, &options, &Progress::none())?;
//! assert_eq!(origin, Origin::Kept);
//! let (_, origin) = cache.surface(&field, &options, &Progress::none())?;
//! assert_eq!(origin, Origin::Read);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod entry;
mod folder;
mod shared;

use crate::colour_table::ColourTableError;
#[cfg(feature = "rigorous")]
use crate::grating::{GratingBody, GratingColourSurface, GratingError, GratingSurface, JonesTable, Profile};
use crate::height_field::HeightField;
use crate::lobe::{ColourSurface, Surface};
use crate::scattering::{Options, SpectralIndex};
use crate::table::{Progress, TableError};
use entry::Key;
use serde::Serialize;
use serde::de::DeserializeOwned;
pub use shared::Shared;
use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// Environment variable that switches the cache `on` (the default) or `off`.
pub const SWITCH: &str = "SUNBEAM_CACHE";
/// Environment variable with the cache's folder; the default is the platform's folder for caches.
pub const FOLDER: &str = "SUNBEAM_CACHE_DIR";
/// Environment variable with the largest size of all entries together, in MB (10⁶ bytes).
pub const LIMIT: &str = "SUNBEAM_CACHE_LIMIT_MB";
/// Largest size of all entries in MB (10⁶ bytes) where [`LIMIT`] is not set. It holds about a hundred surfaces of 20 MB
/// each. Larger values take more disk; with smaller values surfaces are built again more often.
pub const DEFAULT_LIMIT_MB: u64 = 2000;

/// An environment variable whose value is not accepted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the environment variable {variable} is {found:?}, but must be {accepted}")]
#[allow(missing_docs, reason = "the message names each field")]
pub struct CacheError {
    pub variable: &'static str,
    pub found: String,
    pub accepted: &'static str,
}

/// A folder of tables with a size limit, or no cache at all ([`Cache::off`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    /// The folder; `None` where the cache is off.
    folder: Option<PathBuf>,
    /// Largest size of all entries together, in bytes; 0 where the cache is off.
    limit_bytes: u64,
}

/// Where tables came from: the cache or a build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Built, with the cache off.
    Built,
    /// Built, and written to the cache.
    Kept,
    /// Built. The text says why the tables could not be written to the cache, or why old entries could not be removed
    /// afterwards.
    NotKept(String),
    /// Read from the cache.
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
    /// A cache that never reads or writes.
    pub fn off() -> Self {
        Self { folder: None, limit_bytes: 0 }
    }

    /// A cache in `folder`, which is created with the first entry. All entries together may take `limit_bytes`.
    pub fn new(folder: impl Into<PathBuf>, limit_bytes: u64) -> Self {
        Self { folder: Some(folder.into()), limit_bytes }
    }

    /// The cache described by the environment variables [`SWITCH`], [`FOLDER`] and [`LIMIT`].
    ///
    /// The default folder is `sunbeam` in the platform's folder for caches: `$XDG_CACHE_HOME` or `~/.cache` on Linux,
    /// `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows. Where the platform has none, the cache is off.
    ///
    /// # Errors
    /// A variable whose value is not accepted.
    pub fn from_env() -> Result<Self, CacheError> {
        Self::from_variables(std::env::var_os)
    }

    /// [`Cache::from_env`] with `get` in place of the environment, for tests. `get` takes the name of a variable and
    /// returns its value, or `None` where it is not set. Empty values count as not set.
    fn from_variables(get: impl Fn(&'static str) -> Option<OsString>) -> Result<Self, CacheError> {
        let given = |name| get(name).filter(|value| !value.is_empty());
        let text = |name| given(name).map(|value| value.to_string_lossy().into_owned());
        let limit_mb = match text(LIMIT) {
            None => DEFAULT_LIMIT_MB,
            Some(found) => {
                found.parse().map_err(|_| CacheError { variable: LIMIT, found, accepted: "a whole number of MB" })?
            }
        };
        match text(SWITCH).as_deref() {
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

    /// The folder; `None` where the cache is off.
    pub fn folder(&self) -> Option<&PathBuf> {
        self.folder.as_ref()
    }

    /// The surface of `field`, read from the cache, or else built and written to it.
    ///
    /// # Errors
    /// The errors of [`Surface::new`]. A failed write to the cache is no error; [`Origin::NotKept`] gives its reason.
    pub fn surface(
        &self,
        field: &HeightField,
        options: &Options,
        progress: &Progress,
    ) -> Result<(Surface, Origin), TableError> {
        self.read_or_build(|| Key::of_surface(field, options), || Surface::watched(field, options, progress))
    }

    /// [`Cache::surface`], or the equal surface that this process already holds. The [`Origin`] is that of the earlier
    /// call which made the surface, by any [`Cache`] of this process.
    ///
    /// # Errors
    /// The errors of [`Cache::surface`].
    pub fn shared_surface(
        &self,
        field: &HeightField,
        options: &Options,
        progress: &Progress,
    ) -> Result<Arc<(Surface, Origin)>, TableError> {
        static IN_USE: Shared<Key, (Surface, Origin)> = Shared::new();
        let key = Key::of_surface(field, options);
        IN_USE.get(key, || self.read_or_build(|| key, || Surface::watched(field, options, progress)))
    }

    /// The surface of `field` with colours in linear sRGB under D65; shared as by [`Cache::shared_surface`].
    ///
    /// The colours include the Fresnel reflectance or small-slope factor for the refractive index `index`; `None`
    /// leaves it out.
    ///
    /// # Errors
    /// The errors of [`ColourSurface::new`].
    pub fn shared_colours(
        &self,
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
        progress: &Progress,
    ) -> Result<Arc<(ColourSurface, Origin)>, ColourTableError> {
        static IN_USE: Shared<Key, (ColourSurface, Origin)> = Shared::new();
        let key = Key::of_colours(field, options, index);
        let build = || ColourSurface::watched(field, options, index, progress);
        IN_USE.get(key, || self.read_or_build(|| key, build))
    }

    /// The rigorous tables (Maxwell's equations) of a grating with the relief `profile` on `body`; shared as by
    /// [`Cache::shared_surface`]. `coherence_length_um` and `build_limit` are those of [`GratingSurface::new`].
    ///
    /// # Errors
    /// The errors of [`GratingSurface::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_grating(
        &self,
        profile: &Profile,
        body: GratingBody<'_>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(GratingSurface, Origin)>, GratingError> {
        static IN_USE: Shared<(Key, u64), (GratingSurface, Origin)> = Shared::new();
        let key = Key::of_grating("grating", profile, body);
        // A float cannot be the key of a map, so its bits stand for it.
        IN_USE.get((key, coherence_length_um.to_bits()), || {
            let build = || GratingSurface::of_body(profile, body, coherence_length_um, build_limit, progress);
            let (grating, origin) = self.read_or_build(|| key, build)?;
            // One entry serves every coherence length, since the tables do not depend on it.
            Ok((grating.with_coherence_length(coherence_length_um), origin))
        })
    }

    /// [`Cache::shared_grating`] with colours in linear sRGB under D65.
    ///
    /// # Errors
    /// The errors of [`GratingSurface::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_grating_colours(
        &self,
        profile: &Profile,
        body: GratingBody<'_>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(GratingColourSurface, Origin)>, GratingError> {
        static IN_USE: Shared<(Key, u64), (GratingColourSurface, Origin)> = Shared::new();
        let key = Key::of_grating("grating in colours", profile, body);
        IN_USE.get((key, coherence_length_um.to_bits()), || {
            let build = || {
                let spectral = self.shared_grating(profile, body, coherence_length_um, build_limit, progress)?;
                Ok::<_, GratingError>(GratingColourSurface::new(spectral.0.clone()))
            };
            let (grating, origin) = self.read_or_build(|| key, build)?;
            // An entry may have been written for another coherence length.
            Ok((grating.with_coherence_length(coherence_length_um), origin))
        })
    }

    /// Jones matrices of the orders of [`Cache::shared_grating`], for every coherence length.
    ///
    /// # Errors
    /// The errors of [`JonesTable::new`].
    #[cfg(feature = "rigorous")]
    pub fn shared_jones(
        &self,
        profile: &Profile,
        body: GratingBody<'_>,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Arc<(JonesTable, Origin)>, GratingError> {
        static IN_USE: Shared<Key, (JonesTable, Origin)> = Shared::new();
        let key = Key::of_grating("polarisation of a grating", profile, body);
        IN_USE.get(key, || self.read_or_build(|| key, || JonesTable::new(profile, body, build_limit, progress)))
    }

    /// The tables of `key`, read from the cache, or else built and written to it. `key` is a function because computing
    /// a key hashes all heights, which is skipped where the cache is off.
    fn read_or_build<T: Serialize + DeserializeOwned, E>(
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
