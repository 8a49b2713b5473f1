//! Access to a GPU through wgpu: choice of an adapter, its device and queue, buffers, submissions, and errors.
//!
//! wgpu reports two kinds of errors by callbacks only: refused calls (validation, memory) and the loss of the device.
//! The callbacks store the errors in [`Faults`], and [`Gpu::check`] returns them as values after each step.
//!
//! A *submission* is a list of commands that the queue executes in order. A *staging buffer* is memory that both the
//! GPU and the processor can reach; results are copied into it and then read. On native platforms [`Gpu`] blocks until
//! each submission is done. In a browser the thread must not block, so only reading and [`Gpu::idle_async`] wait, as
//! futures.

use super::GpuError;
use futures_channel::oneshot;
use std::str::FromStr;
use std::sync::{Arc, Mutex};
#[cfg(not(target_arch = "wasm32"))]
use sunbeam_guard::{Panic, guard};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// The environment variable that [`AdapterChoice::from_env`] reads.
pub const ADAPTER_VARIABLE: &str = "SUNBEAM_ADAPTER";

/// Kinds of adapter that [`Gpu::open_async`] may open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A real GPU if there is one, else the software adapter.
    #[default]
    Any,
    /// The software adapter only: results do not depend on the machine's GPU.
    Software,
}

impl FromStr for AdapterChoice {
    type Err = GpuError;

    fn from_str(name: &str) -> Result<Self, GpuError> {
        match name {
            "any" => Ok(Self::Any),
            "software" => Ok(Self::Software),
            _ => Err(GpuError::Parameter {
                parameter: "adapter",
                found: format!("{name:?}"),
                accepted: "\"any\" or \"software\"",
            }),
        }
    }
}

impl AdapterChoice {
    /// The choice in the environment variable [`ADAPTER_VARIABLE`]; [`AdapterChoice::Any`] where it is not set or not
    /// Unicode.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] for a value other than `any` or `software`.
    pub fn from_env() -> Result<Self, GpuError> {
        std::env::var(ADAPTER_VARIABLE).map_or(Ok(Self::Any), |name| name.parse())
    }
}

/// Errors that the device reports by callbacks.
#[derive(Default)]
struct Faults {
    /// Message of the first refused call since the last [`Gpu::check`].
    refused: Option<String>,
    /// The reason for the loss of the device.
    lost: Option<String>,
    /// Called with the reason when the device is lost.
    listener: Option<Listener>,
}

/// Callback with the reason for the loss of the device.
type Listener = Box<dyn FnOnce(&str) + Send>;

/// Size in bytes of a storage buffer without contents. A binding must hold at least one element of the shader's array;
/// the largest element, `Query` in query.wgsl, has 48 bytes.
const EMPTY_BYTES: u64 = 64;

/// An adapter with its device and queue. No window is needed.
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// Errors that the device's callbacks have stored.
    faults: Arc<Mutex<Faults>>,
}

impl Gpu {
    /// Opens the best accepted adapter: discrete GPUs before integrated ones, then virtual ones, unknown kinds and
    /// software. The environment variable `WGPU_BACKEND` restricts the graphics interfaces.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoDevice`].
    pub async fn open_async(choice: AdapterChoice) -> Result<Self, GpuError> {
        Self::open_on_async(choice, wgpu::Backends::all().with_env()).await
    }

    /// [`Gpu::open_async`] restricted to the graphics interfaces in `backends`.
    ///
    /// # Errors
    /// The errors of [`Gpu::open_async`].
    pub async fn open_on_async(choice: AdapterChoice, backends: wgpu::Backends) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle().with_env();
        descriptor.backends = backends;
        let instance = wgpu::Instance::new(descriptor);
        let adapters = instance.enumerate_adapters(backends).await;
        let adapter = Self::choose(choice, &adapters)?;
        Self::open_adapter_async(adapter).await
    }

    /// Opens an adapter that the caller has chosen.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`].
    pub async fn open_adapter_async(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let request = adapter.request_device(&Self::device_descriptor(adapter));
        let (device, queue) = request
            .await
            .map_err(|error| GpuError::NoDevice { adapter: adapter.get_info().name, reason: error.to_string() })?;
        Ok(Self::adopt(device, queue))
    }

    /// The best accepted adapter of a list, in the order of [`Gpu::open_async`].
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] where none is accepted.
    pub fn choose(choice: AdapterChoice, adapters: &[wgpu::Adapter]) -> Result<&wgpu::Adapter, GpuError> {
        let kind = |adapter: &&wgpu::Adapter| adapter.get_info().device_type;
        let allowed = |adapter: &&wgpu::Adapter| choice == AdapterChoice::Any || kind(adapter) == wgpu::DeviceType::Cpu;
        adapters.iter().filter(allowed).min_by_key(|adapter| rank(kind(adapter))).ok_or_else(|| {
            let wanted = if choice == AdapterChoice::Software { "software" } else { "usable" };
            let found = adapters.iter().map(|adapter| adapter.get_info().name).collect::<Vec<_>>().join(", ");
            let found = if found.is_empty() { "none".to_owned() } else { found };
            GpuError::NoAdapter { wanted: wanted.to_owned(), found }
        })
    }

    /// The request for a device. It asks for the adapter's own limits, because tables may be large, and for timestamps
    /// if the adapter has them. The number of storage buffers is limited to WebGPU's default, so that a program that
    /// runs on one adapter runs on all.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let limits = adapter.limits();
        wgpu::DeviceDescriptor {
            label: Some("sunbeam"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: wgpu::Limits {
                max_storage_buffers_per_shader_stage: limits
                    .max_storage_buffers_per_shader_stage
                    .min(wgpu::Limits::default().max_storage_buffers_per_shader_stage),
                ..limits
            },
            ..Default::default()
        }
    }

    /// Wraps a device that was opened elsewhere with [`Gpu::device_descriptor`], for instance by a window. Its error
    /// handlers are replaced.
    pub fn adopt(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let faults = Arc::<Mutex<Faults>>::default();
        // The first error is kept: it is the cause of the later ones.
        let on_error = Arc::clone(&faults);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let message = error.to_string();
            lock(&on_error).refused.get_or_insert(message);
        }));
        let on_loss = Arc::clone(&faults);
        device.set_device_lost_callback(move |_, message| {
            // The lock is released before the call, because the listener may use the GPU's functions.
            let listener = {
                let mut faults = lock(&on_loss);
                faults.lost.get_or_insert_with(|| message.clone());
                faults.listener.take()
            };
            if let Some(listener) = listener {
                listener(&message);
            }
        });
        Self { device, queue, faults }
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The queue of [`Gpu::device`].
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Name of the adapter, for instance `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub fn adapter(&self) -> String {
        self.device.adapter_info().name
    }

    /// The graphics interface, for instance `vulkan`.
    pub fn backend(&self) -> &'static str {
        self.device.adapter_info().backend.to_str()
    }

    /// Whether the adapter renders on the processor.
    pub fn is_software(&self) -> bool {
        self.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether times come from timestamps of the GPU. Otherwise they are wall-clock times around each submission, also
    /// for software adapters: llvmpipe takes both timestamps of a compute pass after it.
    pub fn has_timestamps(&self) -> bool {
        // In a browser, timestamps are coarse and reading them would cost one more wait per pass.
        !cfg!(target_arch = "wasm32")
            && !self.is_software()
            && self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Returns the error that the device has reported by a callback, if any.
    ///
    /// # Errors
    /// [`GpuError::Lost`] in every call after the loss of the device; else [`GpuError::Refused`] for the first call
    /// that wgpu has refused since the last check.
    pub fn check(&self) -> Result<(), GpuError> {
        let mut faults = lock(&self.faults);
        if let Some(reason) = faults.lost.clone() {
            return Err(GpuError::Lost { adapter: self.adapter(), reason });
        }
        faults.refused.take().map_or(Ok(()), |reason| Err(GpuError::Refused { adapter: self.adapter(), reason }))
    }

    /// Registers a function that is called once, with the reason, when the device is lost. It replaces an earlier
    /// function. A function registered after the loss is never called.
    pub fn when_lost(&self, listener: impl FnOnce(&str) + Send + 'static) {
        lock(&self.faults).listener = Some(Box::new(listener));
    }

    /// Submits work and blocks until it is done. In a browser it only submits: submissions are executed in order, so a
    /// later read waits for all of them.
    pub(super) fn run(&self, encoder: wgpu::CommandEncoder) -> Result<(), GpuError> {
        let commands = encoder.finish();
        // wgpu reports wrong commands when the list is finished.
        self.check()?;
        let submission = self.queue.submit([commands]);
        self.check()?;
        self.wait(submission)
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn idle_async(&self) -> Result<(), GpuError> {
        let (sender, receiver) = oneshot::channel();
        self.queue.on_submitted_work_done(move || {
            // The receiver is gone if this future was dropped.
            let _ = sender.send(());
        });
        #[cfg(not(target_arch = "wasm32"))]
        self.poll(wgpu::PollType::wait_indefinitely())?;
        // Whether the callback was called does not matter here: `poll` has waited, or in a browser `received` waits.
        self.received(receiver).await.map(|_| ())
    }

    /// Does nothing: the thread of a browser must not block.
    #[cfg(target_arch = "wasm32")]
    #[allow(clippy::unused_self, clippy::unnecessary_wraps, reason = "the native twin waits and can fail")]
    fn wait(&self, _: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        Ok(())
    }

    /// Blocks until this submission is done. It does not wait for later submissions, which a window may have made.
    #[cfg(not(target_arch = "wasm32"))]
    fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
    }

    /// Waits for the value that a callback sends; `None` if the callback is dropped without being called. The browser
    /// calls the callback when the work submitted before is done.
    #[cfg(target_arch = "wasm32")]
    async fn received<T>(&self, receiver: oneshot::Receiver<T>) -> Result<Option<T>, GpuError> {
        let value = receiver.await.ok();
        self.check()?;
        Ok(value)
    }

    /// The value that a callback sends; `None` if the callback is not called. The caller has waited for the work, so
    /// the poll here calls the callback if wgpu has not called it before.
    #[cfg(not(target_arch = "wasm32"))]
    async fn received<T>(&self, mut receiver: oneshot::Receiver<T>) -> Result<Option<T>, GpuError> {
        self.poll(wgpu::PollType::Poll)?;
        Ok(receiver.try_recv().ok().flatten())
    }

    /// Waits for the work that `until` names, then lets wgpu call the callbacks of finished work.
    /// [`wgpu::PollType::Poll`] names no work.
    #[cfg(not(target_arch = "wasm32"))]
    fn poll(&self, until: wgpu::PollType) -> Result<(), GpuError> {
        // If the device is lost during a wait, wgpu panics or returns an error; both become `Panic`. `check` comes
        // first, since it knows the driver's reason.
        let waited = guard(|| self.device.poll(until).map_err(|e| Panic(e.to_string())));
        self.check()?;
        waited.map_err(|Panic(reason)| GpuError::Lost { adapter: self.adapter(), reason })?;
        Ok(())
    }

    /// An empty list of commands.
    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// A storage buffer of `bytes` bytes, or [`EMPTY_BYTES`] for 0, whose contents can be copied in and out. The error
    /// is [`GpuError::TooLarge`]; errors of wgpu appear in the caller's next [`Gpu::check`].
    pub(super) fn storage(&self, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.check_size(label, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: if bytes == 0 { EMPTY_BYTES } else { bytes },
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// A storage buffer with these contents. wgpu refuses a length that is not a multiple of 4 bytes.
    pub(super) fn storage_of(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.storage(label, contents.len() as u64)?;
        self.queue.write_buffer(&buffer, 0, contents);
        self.check()?;
        Ok(buffer)
    }

    /// A uniform buffer with these contents, which can be overwritten.
    pub(super) fn uniform_of(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some(label),
            contents,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        self.check()?;
        Ok(buffer)
    }

    /// The first `bytes` bytes of a buffer, a multiple of 4, after all submitted work is done.
    pub(super) async fn read(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, GpuError> {
        let staging = self.staging(bytes);
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
        self.run(encoder)?;
        self.read_staging(&staging).await
    }

    /// A buffer to copy results into, for [`Gpu::read_staging`].
    pub(super) fn staging(&self, bytes: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// [`Gpu::read_staging`] if there is a buffer; otherwise no bytes.
    pub(super) async fn read_staging_if(&self, staging: Option<&wgpu::Buffer>) -> Result<Vec<u8>, GpuError> {
        match staging {
            Some(staging) => self.read_staging(staging).await,
            None => Ok(Vec::new()),
        }
    }

    /// The contents of a staging buffer. In a browser this call waits for the work that fills it; elsewhere
    /// [`Gpu::run`] has.
    pub(super) async fn read_staging(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let refused = |reason: String| GpuError::Refused { adapter: self.adapter(), reason };
        let (sender, receiver) = oneshot::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |mapped| {
            // The receiver is gone if this future was dropped.
            let _ = sender.send(mapped);
        });
        let mapped = self.received(receiver).await?;
        match mapped {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(refused(error.to_string())),
            None => return Err(refused("a buffer was not mapped for reading".to_owned())),
        }
        let view = staging.get_mapped_range(..).map_err(|error| refused(error.to_string()))?;
        let contents = view.to_vec();
        drop(view);
        staging.unmap();
        Ok(contents)
    }

    /// Refuses a storage buffer of more bytes than the adapter can bind.
    fn check_size(&self, what: &str, needed: u64) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        if needed <= most {
            return Ok(());
        }
        Err(GpuError::TooLarge { what: what.to_owned(), needed, most, adapter: self.adapter() })
    }
}

/// Rank of a kind of adapter; 0 is the best.
fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// Locks a mutex; a panic of another thread leaves its value intact.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
