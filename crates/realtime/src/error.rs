//! Errors of the renderer. An *adapter* is a GPU or a software renderer; its *device* is an open connection to it
//! (device.rs).

use std::path::PathBuf;

/// Reason why a call to the GPU failed.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter of the requested kind.
    #[error(
        "no {wanted} GPU adapter (found: {found}); install a Vulkan driver, for instance Mesa's software driver: \
         apt-get install libvulkan1 mesa-vulkan-drivers on Debian"
    )]
    NoAdapter {
        /// The requested kind: `usable` or `software`.
        wanted: String,
        /// Names of the adapters found, separated by commas, or `none`.
        found: String,
    },
    /// An adapter that refuses to open a device.
    #[error("the GPU adapter {adapter} gives no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The message of the driver.
        reason: String,
    },
    /// Work that the validation of the graphics interface or the driver refuses.
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
    /// Data larger than the largest buffer that the adapter can bind to a shader.
    #[error("{what} takes {needed} bytes, but the GPU adapter {adapter} takes at most {most} in one buffer")]
    TooLarge {
        /// Name of the data in the message.
        what: String,
        /// Size of the data in bytes.
        needed: u64,
        /// The adapter's limit in bytes.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// A picture with a side that exceeds the adapter's limit.
    #[error("{what} has {needed} pixels along a side, but the GPU adapter {adapter} has at most {most}")]
    TooWide {
        /// Name of the picture in the message.
        what: &'static str,
        /// Length in pixels of the side that exceeds the limit.
        needed: u64,
        /// The adapter's limit in pixels.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// A method whose loops over terms and orders are too long for the adapter. Some adapters, such as Mesa's software
    /// renderer, end a shader's loops after a number of iterations. The terms of each answer are then divided among up
    /// to 4096 submissions (shader.rs), but in this case the loops were still ended early.
    #[error(
        "the GPU adapter {adapter} ends the method's loops early, even when they are divided among submissions; give \
         the method smaller options `terms` and `neighbourhood`"
    )]
    CutShort {
        /// The adapter's name.
        adapter: String,
    },
    /// The flag of [`super::Shader::stop_when`] was set.
    #[error("the work was stopped")]
    Stopped,
    /// A parameter out of range.
    #[error("parameter {parameter:?} is {found}, but must be {accepted}")]
    Parameter {
        /// Name of the parameter.
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
    /// A mesh that cannot be drawn, or bytes that are not those of a [`super::SceneData`].
    #[error("the mesh has {found}, but must have {accepted}")]
    Mesh {
        /// The defect.
        found: String,
        /// The condition of a valid mesh.
        accepted: &'static str,
    },
}
