//! Faults of the GPU: errors with advice, never a panic.

use super::support::{White, gpu, query};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use sunbeam::methods::{MethodShader, Relief};
use sunbeam_realtime::{AdapterChoice, Gpu, GpuError, Mesh, Optics, Scene, Shader, Target};

/// A method whose WGSL breaks the contract of [`MethodShader`].
struct Wrong(&'static str);

impl Relief for Wrong {
    fn relief_rgb(&self, _: [f32; 3]) -> [f32; 3] {
        [0.0; 3]
    }

    fn relief_spectral(&self, _: [f32; 3], _: f32) -> Option<f32> {
        None
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        MethodShader { name: "wrong", wgsl: vec![self.0], uniform: vec![0; 16], storage: Vec::new() }
    }
}

#[test]
fn a_machine_without_an_adapter_is_told_what_to_install() {
    let Err(error) = Gpu::open_on(AdapterChoice::Any, wgpu::Backends::empty()) else {
        panic!("there is no such backend")
    };
    assert!(matches!(error, GpuError::NoAdapter { .. }));
    let message = error.to_string();
    assert!(message.contains("libvulkan1 mesa-vulkan-drivers") && message.lines().count() == 1, "{message}");
}

#[test]
fn adapter_choices_are_any_and_software() {
    assert_eq!("software".parse::<AdapterChoice>().unwrap(), AdapterChoice::Software);
    let message = "gpu".parse::<AdapterChoice>().unwrap_err().to_string();
    assert!(message.contains("\"gpu\"") && message.contains("\"software\""), "{message}");
    if let Ok(gpu) = Gpu::open(AdapterChoice::Software) {
        assert!(gpu.is_software() && !gpu.adapter().is_empty() && !gpu.backend().is_empty());
    }
}

#[test]
fn the_stop_flag_ends_work_until_it_is_cleared() {
    let Some(gpu) = gpu() else { return };
    let mut shader = Shader::new(&gpu, &White, &Optics::default()).unwrap();
    let stop = Arc::new(AtomicBool::new(true));
    shader.stop_when(Arc::clone(&stop));
    let queries = [query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8])];
    assert!(matches!(shader.evaluate(&gpu, &queries), Err(GpuError::Stopped)));
    stop.store(false, Ordering::Relaxed);
    assert_eq!(shader.evaluate(&gpu, &queries).unwrap().reflectances.len(), 1);
}

#[test]
fn refused_work_is_an_error_and_the_device_stays_usable() {
    let Some(gpu) = gpu() else { return };
    let optics = Optics::default();
    for (wgsl, said) in [
        ("fn relief_rgb(q: vec3<f32>) -> vec3<f32> { return q.xy; }", "return"),
        ("fn other() {}", "relief_rgb"),
        (
            "@group(1) @binding(5) var<storage, read> a: array<f32>;
             fn relief_rgb(q: vec3<f32>) -> vec3<f32> { return q * a[0]; }",
            "",
        ),
    ] {
        let Err(error) = Shader::new(&gpu, &Wrong(wgsl), &optics) else { panic!("{wgsl} was accepted") };
        assert!(matches!(error, GpuError::Refused { .. }) && error.to_string().contains(said), "{error}");
    }
    let shader = Shader::new(&gpu, &White, &optics).unwrap();
    for wrong in [[0; 32].as_slice(), &[0; 4]] {
        assert!(matches!(shader.set_parameters(&gpu, wrong), Err(GpuError::Parameter { .. })));
    }
    let up = [0.0, 0.0, 1.0];
    assert_eq!(shader.evaluate(&gpu, &[query(up, up)]).unwrap().reflectances, [[1.0; 3]]);
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(gpu) = gpu() else { return };
    let shader = Shader::new(&gpu, &White, &Optics::default()).unwrap();
    gpu.device().destroy();
    let up = [0.0, 0.0, 1.0];
    let error = shader.evaluate(&gpu, &[query(up, up)]).unwrap_err();
    assert!(matches!(error, GpuError::Lost { .. } | GpuError::Refused { .. }), "{error}");
}

#[test]
fn errors_of_size_name_the_data() {
    let Some(gpu) = gpu() else { return };
    for (width, height) in [(0, 10), (10, 20_000)] {
        assert!(matches!(Target::new(&gpu, width, height), Err(GpuError::Parameter { .. })));
    }
    let pigment = sunbeam_realtime::snake::PigmentTexture { width: 1, height: 1, pixels: vec![[0; 3]] };
    assert!(matches!(Scene::new(&gpu, &Mesh::default(), &pigment), Err(GpuError::Mesh { .. })));
}

#[test]
fn gpu_objects_are_send_and_sync() {
    fn keeps<T: Send + Sync>() {}
    keeps::<(Gpu, Scene, Shader, Target, sunbeam_realtime::Renderer)>();
}
