//! The boundary between the Rust core and the Mitsuba plugin in `cpp_shim/`: all of it is in this file.
//!
//! Every function that C++ calls runs inside [`guard()`]: an error or a panic becomes an `Err`, which cxx throws as a C++
//! exception and the plugin rethrows as one of Mitsuba's. Only [`init_plugin`] is meant for others to call.

use std::ffi::{c_char, c_void};

use crate::config::{ConfigError, Source, SurfaceConfig};
use crate::guard::{Panic, guard};

#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    extern "Rust" {
        /// A validated surface.
        type Surface;

        /// Builds a surface from a JSON object whose keys are the plugin's parameters.
        fn new_surface(config_json: &str) -> Result<Box<Surface>>;

        /// One line that tells the surface, for `str(bsdf)`.
        fn describe(self: &Surface) -> Result<String>;

        /// Refuses to run in a Mitsuba (`running`, empty when unknown) that was not compiled against (`compiled`).
        fn check_version(compiled: &str, running: &str) -> Result<()>;
    }
}

/// Why a call across the boundary failed.
#[derive(Debug, thiserror::Error)]
enum PluginError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(
        "the diffraction plugin was compiled for Mitsuba {compiled}, but is being loaded into {running}; their memory \
         layouts differ, so it would render garbage. Install mitsuba=={compiled}, or rebuild with `make plugin`"
    )]
    Version { compiled: String, running: String },
    #[error(transparent)]
    Panic(#[from] Panic),
}

/// What a BSDF instance owns on the Rust side.
struct Surface {
    config: SurfaceConfig,
}

impl Surface {
    fn describe(&self) -> Result<String, PluginError> {
        guard(|| Ok(describe(&self.config)))
    }
}

fn new_surface(config_json: &str) -> Result<Box<Surface>, PluginError> {
    guard(|| Ok(Box::new(Surface { config: SurfaceConfig::from_json(config_json)? })))
}

fn check_version(compiled: &str, running: &str) -> Result<(), PluginError> {
    guard(|| {
        if compiled == running {
            return Ok(());
        }
        let running =
            if running.is_empty() { "a Mitsuba of unknown version".into() } else { format!("Mitsuba {running}") };
        Err(PluginError::Version { compiled: compiled.into(), running })
    })
}

fn describe(config: &SurfaceConfig) -> String {
    let source = match config.source() {
        Source::Preset(preset) => {
            let size = |name, given: Option<f64>| given.map(|v| format!(", {name} {v} µm")).unwrap_or_default();
            format!("{}{}{}", preset.name(), size("period", config.period), size("height", config.height))
        }
        Source::File(path) => path.display().to_string(),
    };
    format!(
        "{source}; {:?} over {} µm, {:?} tiling, {:?} obliquity, level {:?}, conserve_energy {}, shadowing {}, tolerance {:e}",
        config.model,
        config.coherence_length,
        config.tiling(),
        config.obliquity,
        config.level(),
        config.conserve_energy(),
        config.shadowing,
        config.tolerance
    )
}

// SAFETY: `cpp_shim/diffraction.cpp` defines this function with exactly this signature on the x86-64 System V ABI,
// where a `std::string_view` by value is `{length, pointer}` in two integer registers.
unsafe extern "C-unwind" {
    fn sunbeam_register_variants(name_len: usize, name: *const c_char, register: *const c_void);
}

/// The symbol that Mitsuba looks up in a plugin: `void init_plugin(std::string_view, PluginRegisterFn)`.
///
/// It is here and not in C++ because Cargo exports only Rust symbols from a `cdylib`. C++ exceptions pass through.
///
/// # Safety
/// Only for Mitsuba's plugin manager, with arguments as in `mitsuba/core/object.h`.
#[unsafe(no_mangle)] // SAFETY: no other symbol of this name exists in a plugin; Mitsuba prescribes it.
pub unsafe extern "C-unwind" fn init_plugin(name_len: usize, name: *const c_char, register: *const c_void) {
    // SAFETY: the arguments are handed on as they came; the callee has the signature that Mitsuba calls.
    unsafe { sunbeam_register_variants(name_len, name, register) }
}
