//! Short forms of wgpu's calls that create pipelines and bind groups.
//!
//! A *bind group* ties buffers and textures to the numbers `@binding(0)`, `@binding(1)`, … of one `@group` in WGSL; its
//! *layout* says how the shader uses each. A *dispatch* starts workgroups of [`WORKGROUP`] invocations. [`Gpu::check`]
//! returns the errors of calls that have no result of their own.

use super::{Gpu, GpuError};

/// Creates a shader module from a WGSL program.
pub(super) fn module(gpu: &Gpu, label: &str, source: String) -> wgpu::ShaderModule {
    gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// Use of a binding by a compute shader.
#[derive(Clone, Copy)]
pub(super) enum Access {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that is only read.
    Read,
    /// A storage buffer that is read and written.
    ReadWrite,
    /// A texture of unsigned integers.
    Texture,
}

/// Number of invocations of a workgroup in `locate.wgsl`, `shade.wgsl` and `resolve.wgsl`, as a test checks. It is a
/// multiple of the 32 or 64 invocations that GPUs execute in lockstep.
pub(super) const WORKGROUP: u32 = 64;
/// Largest number of workgroups of a dispatch along one axis on every adapter; WebGPU's default limit.
pub(super) const WORKGROUPS_MAX: u32 = 65_535;

/// Dispatches at least `count` invocations. The workgroups form a grid of up to [`WORKGROUPS_MAX`] columns, in which
/// the shader numbers invocations by rows. The shader must ignore numbers from `count` on. A `count` of 0 also
/// dispatches one workgroup, because drivers finish compiling at the first dispatch, which would delay a later picture.
pub(super) fn dispatch_over(pass: &mut wgpu::ComputePass<'_>, count: u32) {
    let groups = count.div_ceil(WORKGROUP).max(1);
    let columns = groups.min(WORKGROUPS_MAX);
    let rows = groups.div_ceil(columns);
    pass.dispatch_workgroups(columns, rows, 1);
}

/// The layout of a bind group with these accesses to the bindings 0, 1, …; a shader may leave some of them unused.
pub(super) fn layout(gpu: &Gpu, accesses: &[Access]) -> wgpu::BindGroupLayout {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let kind = |access: &Access| match access {
        Access::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        Access::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        Access::ReadWrite => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
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

/// A compute pipeline with the entry point `entry`. `groups` are the layouts of the groups 0, 1, …; a `None` among them
/// is a group that the shader does not use. Without a list wgpu derives the layouts from the shader.
///
/// # Errors
/// [`GpuError::Refused`] for WGSL or layouts that wgpu refuses, [`GpuError::Lost`].
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

/// A bind group of whole buffers at the bindings 0, 1, …
pub(super) fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let resources: Vec<wgpu::BindingResource<'_>> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
    bind_resources(gpu, layout, &resources)
}

/// A bind group of buffers and textures at the bindings 0, 1, …
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

#[cfg(test)]
mod tests {
    use super::WORKGROUP;
    use crate::program;

    #[test]
    fn workgroups_have_the_size_that_the_shaders_declare() {
        let declared = format!("@workgroup_size({WORKGROUP})");
        for source in [program::locate(), program::shade(&program::no_method()), program::resolve()] {
            assert!(source.contains(&declared));
            assert_eq!(source.matches("@workgroup_size").count(), source.matches(declared.as_str()).count());
        }
    }
}
