use super::GpuError;
use futures_channel::oneshot;
use std::str::FromStr;
use std::sync::{Arc, Mutex};
#[cfg(not(target_arch = "wasm32"))]
use sunbeam_guard::{Panic, guard};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// The environment variable that [`AdapterChoice::from_env`] reads.
pub const ADAPTER_VARIABLE: &str = "SUNBEAM_ADAPTER";

/// Which adapters may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A real GPU if there is one, else the software adapter.
    #[default]
    Any,
    /// The software adapter only, for results that do not depend on the machine's GPU.
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
    /// The choice that [`ADAPTER_VARIABLE`] makes, [`AdapterChoice::Any`] where it is not set.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] for another value than `any` or `software`.
    pub fn from_env() -> Result<Self, GpuError> {
        std::env::var(ADAPTER_VARIABLE).map_or(Ok(Self::Any), |name| name.parse())
    }
}

/// What went wrong outside the calls that return errors.
#[derive(Default)]
struct Faults {
    refused: Option<String>,
    lost: Option<String>,
    /// Called with the reason when the device is lost.
    listener: Option<Listener>,
}

type Listener = Box<dyn FnOnce(&str) + Send>;

/// An adapter with its device and queue. Nothing here needs a window.
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    faults: Arc<Mutex<Faults>>,
}

impl Gpu {
    /// Opens the best adapter of the kinds allowed: discrete before integrated before virtual before software.
    /// The backends are those of `WGPU_BACKEND` where that is set, else all that were compiled in.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoDevice`].
    pub async fn open_async(choice: AdapterChoice) -> Result<Self, GpuError> {
        Self::open_on_async(choice, wgpu::Backends::all().with_env()).await
    }

    /// As [`Gpu::open_async`] on the given backends only.
    ///
    /// # Errors
    /// As [`Gpu::open_async`].
    pub async fn open_on_async(choice: AdapterChoice, backends: wgpu::Backends) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle().with_env();
        descriptor.backends = backends;
        let instance = wgpu::Instance::new(descriptor);
        let adapters = instance.enumerate_adapters(backends).await;
        let adapter = Self::choose(choice, &adapters)?;
        Self::open_adapter_async(adapter).await
    }

    /// Opens this adapter.
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

    /// The adapter that [`Gpu::open_async`] would take of these.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] where none is of a kind allowed.
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

    /// What is asked of an adapter: all it can do in size, since the tables of a method may be large, and timestamps; but
    /// no more storage buffers in a stage than every adapter has, so that what one runs, all run.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let most = adapter.limits();
        wgpu::DeviceDescriptor {
            label: Some("sunbeam"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: wgpu::Limits {
                max_storage_buffers_per_shader_stage: most
                    .max_storage_buffers_per_shader_stage
                    .min(wgpu::Limits::default().max_storage_buffers_per_shader_stage),
                ..most
            },
            ..Default::default()
        }
    }

    /// Takes over a device that was made elsewhere, for instance by a window, with [`Gpu::device_descriptor`]. Its
    /// error handlers are replaced.
    pub fn adopt(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let faults = Arc::<Mutex<Faults>>::default();
        // The first message is the cause; those after it are its consequences.
        let refused = Arc::clone(&faults);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let message = error.to_string();
            lock(&refused).refused.get_or_insert(message);
        }));
        let lost = Arc::clone(&faults);
        device.set_device_lost_callback(move |_, message| {
            let listener = {
                let mut faults = lock(&lost);
                faults.lost.get_or_insert_with(|| message.clone());
                faults.listener.take()
            };
            if let Some(listener) = listener {
                listener(&message);
            }
        });
        Self { device, queue, faults }
    }

    /// The device, for whoever draws on it too.
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

    /// Whether the adapter is a program rather than a GPU.
    pub fn is_software(&self) -> bool {
        self.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether times are those of the GPU's own clock; else they are wall-clock times around each submission. A software
    /// adapter is on the wall clock: llvmpipe has timestamps, but takes both of a compute pass after it.
    pub fn has_timestamps(&self) -> bool {
        // Reading them would be one more wait for each pass in a browser, whose clock is coarse.
        !cfg!(target_arch = "wasm32")
            && !self.is_software()
            && self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// The first error since the last call, if any.
    ///
    /// # Errors
    /// [`GpuError::Lost`], then [`GpuError::Refused`].
    pub fn check(&self) -> Result<(), GpuError> {
        let mut faults = lock(&self.faults);
        if let Some(reason) = faults.lost.clone() {
            return Err(GpuError::Lost { adapter: self.adapter(), reason });
        }
        faults.refused.take().map_or(Ok(()), |reason| Err(GpuError::Refused { adapter: self.adapter(), reason }))
    }

    /// Has `listener` called with the reason when the device is lost, in the place of one that was given before.
    pub fn when_lost(&self, listener: impl FnOnce(&str) + Send + 'static) {
        lock(&self.faults).listener = Some(Box::new(listener));
    }

    /// Submits the work and waits until it is done; in a browser it only submits. There a wait costs a message to another
    /// process and back, work is done in the order of its submission, and who reads waits.
    pub(super) async fn run(&self, encoder: wgpu::CommandEncoder) -> Result<(), GpuError> {
        let commands = encoder.finish();
        self.check()?;
        let submission = self.queue.submit([commands]);
        self.check()?;
        self.wait(submission)
    }

    /// When all that was submitted is done.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn idle_async(&self) -> Result<(), GpuError> {
        let (sender, receiver) = oneshot::channel();
        // The receiver may be gone.
        self.queue.on_submitted_work_done(move || {
            let _ = sender.send(());
        });
        #[cfg(not(target_arch = "wasm32"))]
        self.poll(wgpu::PollType::wait_indefinitely())?;
        self.received(receiver).await.map(|_| ())
    }

    #[cfg(target_arch = "wasm32")]
    #[allow(clippy::unused_self, clippy::unnecessary_wraps)]
    fn wait(&self, _: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        Ok(())
    }

    /// Not for what a window may have submitted since.
    #[cfg(not(target_arch = "wasm32"))]
    fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
    }

    /// The value that a callback sends, `None` where it never will. A browser calls it by itself when the work submitted
    /// before is done.
    #[cfg(target_arch = "wasm32")]
    async fn received<T>(&self, receiver: oneshot::Receiver<T>) -> Result<Option<T>, GpuError> {
        let value = receiver.await.ok();
        self.check()?;
        Ok(value)
    }

    /// The value that a callback has sent, `None` where it has not. The work has been waited for before.
    #[cfg(not(target_arch = "wasm32"))]
    async fn received<T>(&self, mut receiver: oneshot::Receiver<T>) -> Result<Option<T>, GpuError> {
        self.poll(wgpu::PollType::Poll)?;
        Ok(receiver.try_recv().ok().flatten())
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn poll(&self, until: wgpu::PollType) -> Result<(), GpuError> {
        // wgpu panics where a wait finds the device lost.
        let waited = guard(|| self.device.poll(until).map_err(|e| Panic(e.to_string())));
        self.check()?;
        waited.map_err(|Panic(reason)| GpuError::Lost { adapter: self.adapter(), reason })?;
        Ok(())
    }

    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// A buffer for shaders to read and write, whose contents can be copied in and out.
    pub(super) fn storage(&self, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.fits(label, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: if bytes == 0 { EMPTY_BYTES } else { bytes },
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// As [`Gpu::storage`] with these contents.
    pub(super) fn storage_of(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.storage(label, contents.len() as u64)?;
        // A copy of whole words; what is left over fits in one more.
        let whole = contents.len() / 4 * 4;
        self.queue.write_buffer(&buffer, 0, &contents[..whole]);
        if whole < contents.len() {
            let mut word = [0; 4];
            word[..contents.len() - whole].copy_from_slice(&contents[whole..]);
            self.queue.write_buffer(&buffer, whole as u64, &word);
        }
        self.check()?;
        Ok(buffer)
    }

    pub(super) fn uniform_of(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some(label),
            contents,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        self.check()?;
        Ok(buffer)
    }

    /// The first `bytes` of a buffer, a multiple of 4, when the GPU is done with it.
    pub(super) async fn read(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, GpuError> {
        let staging = self.staging(bytes);
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
        self.run(encoder).await?;
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

    pub(super) async fn read_staging_if(&self, staging: Option<&wgpu::Buffer>) -> Result<Vec<u8>, GpuError> {
        match staging {
            Some(staging) => self.read_staging(staging).await,
            None => Ok(Vec::new()),
        }
    }

    pub(super) async fn read_staging(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let refused = |reason: String| GpuError::Refused { adapter: self.adapter(), reason };
        let (sender, receiver) = oneshot::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |mapped| {
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

    fn fits(&self, what: &str, needed: u64) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        if needed <= most {
            return Ok(());
        }
        Err(GpuError::TooLarge { what: what.to_owned(), needed, most, adapter: self.adapter() })
    }
}

/// What stands in for an empty buffer, which shaders may not bind: an element of any of the arrays.
const EMPTY_BYTES: u64 = 64;

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// Whoever panicked while holding the lock left a whole value.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
