use std::path::PathBuf;

/// Why the GPU did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter, or none of the kind asked for.
    #[error(
        "no {wanted} GPU adapter (found: {found}); install a Vulkan driver, for which Mesa's software one will do: \
         apt-get install libvulkan1 mesa-vulkan-drivers on Debian"
    )]
    NoAdapter {
        /// The kind asked for.
        wanted: String,
        /// The adapters there are.
        found: String,
    },
    /// An adapter that gives no device.
    #[error("the GPU adapter {adapter} gives no device: {reason}")]
    NoDevice { adapter: String, reason: String },
    /// What the validation of the graphics interface, or the driver, said.
    #[error("the GPU adapter {adapter} refused the work: {reason}")]
    Refused { adapter: String, reason: String },
    /// The device is gone; a new [`super::Gpu`] is needed.
    #[error("the GPU adapter {adapter} lost its device: {reason}")]
    Lost { adapter: String, reason: String },
    /// Data that the adapter cannot bind in one piece.
    #[error("{what} takes {needed} bytes, but the GPU adapter {adapter} takes at most {most} in one piece")]
    TooLarge { what: String, needed: u64, most: u64, adapter: String },
    /// Loops that the adapter ends too early, however small the parts of an answer.
    #[error("the GPU adapter {adapter} cuts the method's loops short; use fewer terms or a smaller neighbourhood")]
    CutShort { adapter: String },
    /// The flag of [`super::Shader::stop_when`] was set.
    #[error("the work was stopped")]
    Stopped,
    /// A value out of range.
    #[error("parameter {parameter:?} is {found}, but must be {accepted}")]
    Parameter { parameter: &'static str, found: String, accepted: &'static str },
    /// A file that cannot be read.
    #[error("{path}: {reason}")]
    File { path: PathBuf, reason: String },
    /// A mesh that cannot be drawn.
    #[error("the mesh has {found}, but must have {accepted}")]
    Mesh { found: String, accepted: &'static str },
}
