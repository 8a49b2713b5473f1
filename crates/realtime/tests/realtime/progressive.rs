//! Pictures that become finer step by step.

use super::support::{White, gpu};
use std::sync::Arc;
use sunbeam_realtime::progressive::{Job, Progressive};
use sunbeam_realtime::{Gpu, Optics, Renderer, Scene, Shader, Shape, View};

/// Scene and method, without a job. No picture is in time, so each is one step finer than the one before.
fn without_job(gpu: &Gpu) -> Progressive {
    let mut progressive = Progressive::new(0.0);
    let (mesh, pigment) = Shape::Flat.make(1.0, (1, 1)).unwrap();
    progressive.set_scene(Scene::new(gpu, &mesh, &pigment).unwrap());
    progressive.set_shader(gpu, Shader::new(gpu, &White, &Optics::default()).unwrap());
    progressive
}

fn job(size: (u32, u32)) -> Job {
    Job { view: View::default(), optics: Optics::default(), size }
}

#[test]
fn pictures_refine_up_to_the_size_of_the_job() {
    let Some(gpu) = gpu() else { return };
    let renderer = Renderer::new(&gpu).unwrap();
    let mut progressive = without_job(&gpu);
    assert!(progressive.next_level().is_none());
    assert!(progressive.set_job(&gpu, job((64, 48))));
    assert!(!progressive.set_job(&gpu, job((64, 48))));
    let mut drawn = Vec::new();
    while let Some(level) = progressive.next_level() {
        let frame = progressive.frame(&gpu, level).unwrap().unwrap();
        frame.draw(&gpu, &renderer).unwrap();
        progressive.finish(&frame, 1.0);
        drawn.push((frame.target.size(), frame.refines, frame.is_finest));
    }
    let sizes = [(4, 3), (8, 6), (16, 12), (32, 24), (64, 48)];
    assert_eq!(drawn, sizes.map(|size| (size, size != (4, 3), size == (64, 48))));
}

#[test]
fn a_frame_of_an_earlier_job_does_not_count() {
    let Some(gpu) = gpu() else { return };
    let mut progressive = without_job(&gpu);
    progressive.set_job(&gpu, job((64, 48)));
    let first = progressive.next_level().unwrap();
    let frame = progressive.frame(&gpu, first).unwrap().unwrap();
    progressive.set_job(&gpu, job((32, 32)));
    assert!(!progressive.is_current(&frame));
    progressive.finish(&frame, 1.0);
    assert!(progressive.latest().is_none());
    assert_eq!(progressive.next_level(), Some(first));
}

#[test]
fn a_target_that_is_shown_is_not_drawn_into() {
    let Some(gpu) = gpu() else { return };
    let mut progressive = without_job(&gpu);
    progressive.set_job(&gpu, job((64, 48)));
    let level = progressive.next_level().unwrap();
    let shown = progressive.frame(&gpu, level).unwrap().unwrap();
    let other = progressive.frame(&gpu, level).unwrap().unwrap();
    assert!(!Arc::ptr_eq(&shown.target, &other.target));
    let free = Arc::as_ptr(&other.target);
    drop(other);
    let again = progressive.frame(&gpu, level).unwrap().unwrap();
    assert_eq!(Arc::as_ptr(&again.target), free);
}
