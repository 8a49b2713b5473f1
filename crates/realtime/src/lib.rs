//! The realtime renderer: the methods of [`sunbeam::methods`] on the GPU, without a window. [`snake`] is the mesh of
//! the default [`Shape`].
//!
//! [`Gpu`] opens an adapter. A *method* computes the reflectance of a relief for a pair of directions. A [`Shader`] is
//! a method with its data on the GPU. It answers arrays of [`Query`], each a surface point with a pair of directions
//! ([`Shader::evaluate_async`]). [`Renderer::draw_async`] draws a [`Scene`] with a [`Shader`] into a [`Target`], with
//! the camera and the sun of a [`View`], in four stages:
//!
//! 1. *raster* writes the number of the nearest triangle at each pixel.
//! 2. *locate* computes the point of the triangle on the pixel's ray, the shading frame and the directions there, and
//!    the visibility of the sun. A depth map from the sun decides the visibility for nearly every pixel, and a ray
//!    through a tree of boxes for the others. The stage also adds the radiance of the ground to the picture. The
//!    shading frame has the conventions of Mitsuba 3, so pictures agree pixel by pixel.
//! 3. *shade* computes the reflectance by the method, for sunlit samples of the mesh only, in submissions of bounded
//!    time.
//! 4. *resolve* computes the radiance of these samples with the pigment, the diffuse colour below the relief, and adds
//!    it to the mean over the samples of each pixel.
//!
//! Supersampling repeats the stages for each sample of a pixel, so the memory does not depend on the number of samples.
//! Light is direct sunlight only; a film ([`AnswerKind::Film`](sunbeam::methods::AnswerKind::Film)) also shows the
//! sunlit ground behind it. Methods compute in single precision. Of the methods, only
//! [`Table`](sunbeam::methods::MethodKind::Table) can conserve energy.
//!
//! Calls that wait for the GPU are futures, because the event loop of a browser must not block. On other platforms most
//! of them have a blocking form without `_async` in its name.
//!
//! On the mesh `wi` is the direction to the light and `wo` that to the viewer, both in the grating's frame. This is the
//! shading frame rotated about the normal z, so that x is the relief's x axis. Radiance is linear sRGB, not clamped. A
//! white diffuse plane that faces the sun has the radiance 1.
//!
//! ```no_run
//! use sunbeam::Preset;
//! use sunbeam::methods::{MethodKind, MethodOptions, build};
//! use sunbeam_realtime::{AdapterChoice, Gpu, Optics, Renderer, Scene, Shader, Shape, Target, View};
//!
//! let gpu = Gpu::open(AdapterChoice::Any)?;
//! let options = sunbeam::Options { conserve_energy: false, ..sunbeam::Options::default() };
//! let method = build(MethodKind::Table, &Preset::Cd.build(None, None)?, &options, &MethodOptions::default())?;
//! let shader = Shader::new(&gpu, &*method, &Optics::default())?;
//! let (mesh, pigment) = Shape::Sphere.make(1.0, (1, 1))?;
//! let scene = Scene::new(&gpu, &mesh, &pigment)?;
//! let target = Target::new(&gpu, 384, 256)?;
//! Renderer::new(&gpu)?.draw(&gpu, &scene, &shader, &target, &View::default())?;
//! let picture: Vec<[f32; 3]> = target.read_picture(&gpu)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(not(target_arch = "wasm32"))]
mod blocking;
mod clock;
mod device;
mod error;
mod layout;
pub mod levels;
mod locate;
mod mesh;
mod orbit;
mod pipeline;
mod program;
pub mod progressive;
mod renderer;
mod scene;
mod scene_data;
mod shader;
mod shape;
pub mod snake;
mod sunlight;
mod target;
mod tone;
mod tree;
mod view;

pub use device::{ADAPTER_VARIABLE, AdapterChoice, Gpu};
pub use error::GpuError;
pub use layout::{Optics, Query};
pub use mesh::Mesh;
pub use orbit::{DEGREES_PER_POINT, Orbit};
#[doc(hidden)]
pub use program::every_program;
pub use renderer::{FrameReport, Renderer, StageTimes};
pub use scene::Scene;
pub use scene_data::SceneData;
pub use shader::{Answers, Shader};
pub use shape::Shape;
pub use target::Target;
pub use tone::TonePass;
pub use view::{Blend, Camera, KERATIN, Light, PIGMENT_SCALE, SOIL, View};

/// Sets `XDG_RUNTIME_DIR` to the folder for temporary files if it is not set, as in containers. Without the variable,
/// Mesa's Vulkan drivers print a complaint to stderr. They only look for the socket of a window system in the folder.
///
/// # Safety
/// No other thread may access environment variables during the call. Programs make it the first call of `main`.
pub unsafe fn give_drivers_a_runtime_folder() {
    const VARIABLE: &str = "XDG_RUNTIME_DIR";
    if cfg!(target_os = "linux") && std::env::var_os(VARIABLE).is_none() {
        // SAFETY: the caller promises that no other thread accesses environment variables.
        unsafe { std::env::set_var(VARIABLE, std::env::temp_dir()) };
    }
}
