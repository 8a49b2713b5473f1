//! Pipelines and bind groups, whose layouts come from the WGSL.

use super::{Gpu, GpuError};

pub(super) fn module(gpu: &Gpu, label: &str, source: String) -> wgpu::ShaderModule {
    gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// How a compute shader uses what is bound.
#[derive(Clone, Copy)]
pub(super) enum Access {
    Uniform,
    Read,
    Write,
    /// A texture of whole numbers.
    Texture,
}

/// Invocations of a workgroup over a list, as in `locate.wgsl` and `resolve.wgsl`.
const WORKGROUP: u32 = 64;
/// No dispatch has more workgroups in one direction on any adapter.
pub(super) const WORKGROUPS_MAX: u32 = 65_535;

/// Dispatches at least so many invocations, in rows, and a workgroup for an empty list too, so that a first picture,
/// however small, has drivers finish compiling.
pub(super) fn dispatch_over(pass: &mut wgpu::ComputePass<'_>, count: u32) {
    let groups = count.div_ceil(WORKGROUP).max(1);
    let columns = groups.min(WORKGROUPS_MAX);
    pass.dispatch_workgroups(columns, groups.div_ceil(columns), 1);
}

/// A group of buffers and textures at the bindings 0, 1, …, for a shader that need not use all of them.
pub(super) fn layout(gpu: &Gpu, accesses: &[Access]) -> wgpu::BindGroupLayout {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let kind = |access: &Access| match access {
        Access::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        Access::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        Access::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        Access::Texture => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(accesses)
        .map(|(binding, access)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: kind(access),
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
