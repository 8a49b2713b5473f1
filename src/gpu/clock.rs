use super::{Gpu, GpuError};
use std::time::Instant;

/// How long the passes of one submission take on the GPU.
///
/// Each pass is a *span*, numbered from 0. Without timestamps there is only the wall clock around the whole submission,
/// and its time is counted to the first span.
pub(super) struct Clock {
    spans: u32,
    timestamps: Option<Timestamps>,
}

struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
}

impl Clock {
    pub fn new(gpu: &Gpu, spans: u32) -> Self {
        let bytes = u64::from(2 * spans) * u64::from(wgpu::QUERY_SIZE);
        let timestamps = gpu.has_timestamps().then(|| Timestamps {
            queries: gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * spans,
            }),
            resolved: gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: bytes,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            staging: gpu.staging(bytes),
        });
        Self { spans, timestamps }
    }

    /// For the descriptor of the compute pass that is this span.
    pub fn compute(&self, span: u32) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.timestamps.as_ref().map(|timestamps| wgpu::ComputePassTimestampWrites {
            query_set: &timestamps.queries,
            beginning_of_pass_write_index: Some(2 * span),
            end_of_pass_write_index: Some(2 * span + 1),
        })
    }

    /// For the descriptor of the render pass that is this span.
    pub fn render(&self, span: u32) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.timestamps.as_ref().map(|timestamps| wgpu::RenderPassTimestampWrites {
            query_set: &timestamps.queries,
            beginning_of_pass_write_index: Some(2 * span),
            end_of_pass_write_index: Some(2 * span + 1),
        })
    }

    /// Submits the work, which must have every span in it, waits, and gives the spans' times in ms.
    pub fn run(&self, gpu: &Gpu, mut encoder: wgpu::CommandEncoder) -> Result<Vec<f64>, GpuError> {
        let Some(timestamps) = &self.timestamps else {
            let start = Instant::now();
            gpu.run(encoder)?;
            let mut spans = vec![0.0; self.spans as usize];
            spans[0] = start.elapsed().as_secs_f64() * 1e3;
            return Ok(spans);
        };
        encoder.resolve_query_set(&timestamps.queries, 0..2 * self.spans, &timestamps.resolved, 0);
        encoder.copy_buffer_to_buffer(&timestamps.resolved, 0, &timestamps.staging, 0, timestamps.resolved.size());
        gpu.run(encoder)?;
        let ticks = gpu.read_staging(&timestamps.staging)?;
        let ms_per_tick = f64::from(gpu.queue().get_timestamp_period()) * 1e-6;
        let time = |bytes: &[u8]| bytemuck::pod_read_unaligned::<u64>(bytes);
        let span = |pair: &[u8]| time(&pair[8..]).saturating_sub(time(&pair[..8])) as f64 * ms_per_tick;
        Ok(ticks.chunks_exact(16).map(span).collect())
    }
}
