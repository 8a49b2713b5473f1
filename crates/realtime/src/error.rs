use std::path::PathBuf;

/// Why the GPU did not do what was asked.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // Each message says what its fields are.
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
    NoDevice {
        /// Its name.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// What the validation of the graphics interface, or the driver, said.
    #[error("the GPU adapter {adapter} refused the work: {reason}")]
    Refused {
        /// Its name.
        adapter: String,
        /// What was said.
        reason: String,
    },
    /// The device is gone; a new [`super::Gpu`] is needed.
    #[error("the GPU adapter {adapter} lost its device: {reason}")]
    Lost {
        /// Its name.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// Data that the adapter cannot bind in one piece.
    #[error("{what} takes {needed} bytes, but the GPU adapter {adapter} takes at most {most} in one piece")]
    TooLarge {
        /// The data.
        what: String,
        /// Their bytes.
        needed: u64,
        /// The most that is accepted.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// A picture or texture with longer sides than the adapter has.
    #[error("{what} has {needed} pixels along a side, but the GPU adapter {adapter} has at most {most}")]
    TooWide {
        /// The texture.
        what: &'static str,
        /// The longer of its sides.
        needed: u64,
        /// The most that is accepted.
        most: u64,
        /// The adapter's name.
        adapter: String,
    },
    /// Loops that the adapter ends too early, however small the parts of an answer.
    #[error("the GPU adapter {adapter} cuts the method's loops short; use fewer terms or a smaller neighbourhood")]
    CutShort {
        /// Its name.
        adapter: String,
    },
    /// The flag of [`super::Shader::stop_when`] was set.
    #[error("the work was stopped")]
    Stopped,
    /// A value out of range.
    #[error("parameter {parameter:?} is {found}, but must be {accepted}")]
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// The refused value.
        found: String,
        /// What is accepted.
        accepted: &'static str,
    },
    /// A file that cannot be read.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A mesh that cannot be drawn.
    #[error("the mesh has {found}, but must have {accepted}")]
    Mesh {
        /// What is wrong.
        found: String,
        /// What is accepted.
        accepted: &'static str,
    },
}
