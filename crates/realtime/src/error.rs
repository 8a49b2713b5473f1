//! Errors of the renderer. An *adapter* is a GPU or a software renderer; its *device* is an open connection to it
//! (device.rs).

use std::path::PathBuf;

/// Reason why a call to the GPU failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum GpuError {
    /// No adapter, or none of the requested kind.
    #[error(
        "no {wanted} GPU adapter (found: {found}); install a Vulkan driver, for which Mesa's software one will do: \
         apt-get install libvulkan1 mesa-vulkan-drivers on Debian"
    )]
    NoAdapter {
        /// The requested kind.
        wanted: String,
        /// Names of the adapters found.
        found: String,
    },
    /// An adapter that gives no device.
    #[error("the GPU adapter {adapter} gives no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The message of the driver.
        reason: String,
    },
    /// An error of the graphics interface's validation, or of the driver.
    #[error("the GPU adapter {adapter} refused the work: {reason}")]
    Refused {
        /// The adapter's name.
        adapter: String,
        /// The message of the interface or driver.
        reason: String,
    },
    /// The device is gone; a new [`super::Gpu`] is needed.
    #[error("the GPU adapter {adapter} lost its device: {reason}")]
    Lost {
        /// The adapter's name.
        adapter: String,
        /// The message of the driver.
        reason: String,
    },
    /// Data that the adapter cannot bind in one piece.
    #[error("{what} takes {needed} bytes, but the GPU adapter {adapter} takes at most {most} in one piece")]
    TooLarge {
        /// The data.
        what: String,
        /// Size of the data in bytes.
        needed: u64,
        /// The adapter's limit in bytes.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// A picture or texture whose sides exceed the adapter's limit.
    #[error("{what} has {needed} pixels along a side, but the GPU adapter {adapter} has at most {most}")]
    TooWide {
        /// The texture.
        what: &'static str,
        /// Its longer side in pixels.
        needed: u64,
        /// The adapter's limit in pixels.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// Loops that the adapter ends too early even in the smallest parts of an answer.
    #[error("the GPU adapter {adapter} cuts the method's loops short; use fewer terms or a smaller neighbourhood")]
    CutShort {
        /// The adapter's name.
        adapter: String,
    },
    /// The flag of [`super::Shader::stop_when`] was set.
    #[error("the work was stopped")]
    Stopped,
    /// A value out of range.
    #[error("parameter {parameter:?} is {found}, but must be {accepted}")]
    Parameter {
        /// The parameter.
        parameter: &'static str,
        /// The refused value.
        found: String,
        /// The accepted values.
        accepted: &'static str,
    },
    /// A file that cannot be read.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// A mesh that cannot be drawn.
    #[error("the mesh has {found}, but must have {accepted}")]
    Mesh {
        /// The fault.
        found: String,
        /// The condition of a valid mesh.
        accepted: &'static str,
    },
}
