//! Pipelines and bind groups, whose layouts come from the WGSL.

use super::{Gpu, GpuError};

pub(super) fn module(gpu: &Gpu, label: &str, source: String) -> wgpu::ShaderModule {
    gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// How a compute shader uses a buffer.
#[derive(Clone, Copy)]
pub(super) enum Access {
    Uniform,
    Read,
    Write,
}

/// A group of buffers at the bindings 0, 1, …, for a shader that need not use all of them.
pub(super) fn layout(gpu: &Gpu, accesses: &[Access]) -> wgpu::BindGroupLayout {
    let kind = |access: &Access| match access {
        Access::Uniform => wgpu::BufferBindingType::Uniform,
        Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
        Access::Write => wgpu::BufferBindingType::Storage { read_only: false },
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(accesses)
        .map(|(binding, access)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty: kind(access), has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A compute pipeline over these groups, or over what its shader uses.
pub(super) fn compute(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    entry: &str,
    groups: Option<&[Option<&wgpu::BindGroupLayout>]>,
) -> Result<wgpu::ComputePipeline, GpuError> {
    let layout = groups.map(|bind_group_layouts| {
        gpu.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(entry),
            bind_group_layouts,
            immediate_size: 0,
        })
    });
    let pipeline = gpu.device().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: layout.as_ref(),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    gpu.check()?;
    Ok(pipeline)
}

/// Whole buffers at the bindings 0, 1, …
pub(super) fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let resources: Vec<wgpu::BindingResource<'_>> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
    bind_resources(gpu, layout, &resources)
}

/// As [`bind`], for textures too.
pub(super) fn bind_resources(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}
