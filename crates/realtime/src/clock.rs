//! Times of GPU passes.
//!
//! With timestamps, the GPU writes its tick counter at the beginning and the end of a pass into a query set. The two
//! values are copied into a buffer on the GPU and from there into a staging buffer, which the processor reads. Without
//! timestamps, the wall-clock time of the submission is measured.

use super::{Gpu, GpuError};
use web_time::Instant;

/// Measures the time of submissions that have one compute or render pass each. Submissions must not overlap, because
/// they share the memory for timestamps. Each stage has a clock of its own and awaits one submission before the next.
pub(super) struct Clock {
    /// `None` without [`Gpu::has_timestamps`]; then the wall clock is used.
    timestamps: Option<Timestamps>,
}

/// Memory for the two timestamps of a pass.
struct Timestamps {
    /// The two timestamps that a pass writes: 0 at its beginning, 1 at its end.
    query_set: wgpu::QuerySet,
    /// The two values, on the GPU.
    resolved: wgpu::Buffer,
    /// Copy of `resolved` for the processor.
    staging: wgpu::Buffer,
}

/// Bytes of two timestamps, which are `u64`.
const BYTES: u64 = 2 * wgpu::QUERY_SIZE as u64;

impl Clock {
    /// A clock for passes on this device.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let timestamps = gpu.has_timestamps().then(|| Timestamps {
            query_set: gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: BYTES,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            staging: gpu.staging(BYTES),
        });
        Self { timestamps }
    }

    /// The timestamps for the descriptor of a compute pass; `None` if the wall clock is used.
    pub(crate) fn compute(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.timestamps.as_ref().map(|timestamps| wgpu::ComputePassTimestampWrites {
            query_set: &timestamps.query_set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        })
    }

    /// The timestamps for the descriptor of a render pass; `None` if the wall clock is used.
    pub(crate) fn render(&self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.timestamps.as_ref().map(|timestamps| wgpu::RenderPassTimestampWrites {
            query_set: &timestamps.query_set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        })
    }

    /// Submits work whose pass has this clock's timestamps, and waits as [`Gpu::run`] does. Returns the time in ms. A
    /// browser's clock has no timestamps and does not wait, so the time is that of the submission alone.
    pub(crate) async fn run(&self, gpu: &Gpu, encoder: wgpu::CommandEncoder) -> Result<f64, GpuError> {
        Ok(self.run_and_read(gpu, encoder, None).await?.0)
    }

    /// [`Clock::run`] for work that fills a staging buffer. Returns the time in ms and the buffer's contents, which are
    /// empty without a buffer.
    pub(crate) async fn run_and_read(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        staging: Option<&wgpu::Buffer>,
    ) -> Result<(f64, Vec<u8>), GpuError> {
        let Some(timestamps) = &self.timestamps else {
            let start = Instant::now();
            gpu.run(encoder)?;
            let after_run = start.elapsed();
            let contents = gpu.read_staging_if(staging).await?;
            // In a browser only the reading waits for the work.
            let elapsed = if cfg!(target_arch = "wasm32") { start.elapsed() } else { after_run };
            return Ok((elapsed.as_secs_f64() * 1e3, contents));
        };
        encoder.resolve_query_set(&timestamps.query_set, 0..2, &timestamps.resolved, 0);
        encoder.copy_buffer_to_buffer(&timestamps.resolved, 0, &timestamps.staging, 0, BYTES);
        gpu.run(encoder)?;
        let ticks = gpu.read_staging(&timestamps.staging).await?;
        let [start, end] = bytemuck::pod_read_unaligned::<[u64; 2]>(&ticks);
        let ns_per_tick = f64::from(gpu.queue().get_timestamp_period());
        // A GPU may reset its counter between both timestamps; a negative difference counts as 0.
        let ms = end.saturating_sub(start) as f64 * ns_per_tick * 1e-6;
        Ok((ms, gpu.read_staging_if(staging).await?))
    }
}
