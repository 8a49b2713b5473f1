//! The realtime renderer, and the snake that it draws: the methods of [`sunbeam::methods`] on the GPU, without a window.
//!
//! [`Gpu`] opens an adapter; a [`Shader`] is a method with its data there. It answers arrays of [`Query`] pairs
//! ([`Shader::evaluate_async`]), and pictures: [`Renderer::draw_async`] takes a [`Scene`], a [`Shader`], a [`Target`] and the
//! [`View`], and runs four stages.
//!
//! 1. *raster*: which triangle each pixel sees. Nothing is interpolated.
//! 2. *locate*: where the pixel's ray meets that triangle, the shading frame there, the directions in it, and whether the
//!    sun is seen: a depth map from the sun tells for nearly every pixel, and a ray through a tree of boxes for the rest,
//!    which are listed and done together. The ground is done then.
//!    Its conventions are those of Mitsuba 3, so that pictures agree pixel by pixel.
//! 3. *shade*: the method, for the lit samples only, in submissions of bounded time.
//! 4. *resolve*: pigment and light, for the same samples; the mean over a pixel's samples.
//!
//! Supersampling repeats the four for each place in a pixel, so memory does not grow with it. Light is direct sunlight
//! only. Methods are single precision, and all but the colour table leave out what conserves energy.
//!
//! Calls that wait for the GPU are futures, as a browser needs them. Elsewhere each has a twin that blocks and is called the
//! same without `_async`.
//!
//! `wi` is the direction to the light, `wo` that to the viewer, both in the grating's frame. Radiance is linear sRGB,
//! not clamped; a white diffuse plane that faces the sun has 1.

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
pub use orbit::Orbit;
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

/// Mesa's Vulkan drivers complain on stderr, where a program's own errors belong, unless `XDG_RUNTIME_DIR` is set, which
/// it is not in containers. They only look for a window system there.
///
/// # Safety
/// No other thread may read or write variables of the environment meanwhile: programs call this first.
pub unsafe fn give_drivers_a_runtime_folder() {
    const VARIABLE: &str = "XDG_RUNTIME_DIR";
    if cfg!(target_os = "linux") && std::env::var_os(VARIABLE).is_none() {
        // SAFETY: as the caller promises.
        unsafe { std::env::set_var(VARIABLE, std::env::temp_dir()) };
    }
}
