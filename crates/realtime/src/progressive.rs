//! Pictures that begin coarse and become finer while nothing changes. The window (crates/window) and the page in a
//! browser (crates/web) show them.
//!
//! A [`Progressive`] holds a scene, a method (a [`Shader`], which computes the colours of the relief) and a [`Job`],
//! and decides how fine the next picture is: its [`Level`] has a part of the pixels or all of them, and one or more
//! rays per pixel. It never waits for the GPU. The caller takes a [`Frame`] from it, draws the frame, blocking or not,
//! and hands the frame back:
//!
//! ```no_run
//! # use sunbeam_realtime::{Gpu, GpuError, Renderer, progressive::Progressive};
//! # fn draw(progressive: &mut Progressive, gpu: &Gpu, renderer: &Renderer) -> Result<(), GpuError> {
//! while let Some(level) = progressive.next_level() {
//!     let Some(frame) = progressive.frame(gpu, level)? else { break };
//!     let start = std::time::Instant::now();
//!     frame.draw(gpu, renderer)?;
//!     progressive.finish(&frame, start.elapsed().as_secs_f64() * 1e3);
//!     // `frame.target` is shown here.
//! }
//! # Ok(()) }
//! ```
//!
//! A scene, method or job that is set between [`Progressive::frame`] and [`Progressive::finish`] makes the frame stale.
//! A stale frame may be shown, but the next picture does not refine it.

use crate::levels::{self, Level, Pace};
use crate::{FrameReport, Gpu, GpuError, Optics, Renderer, Scene, Shader, Target, View};
use std::rc::Rc;
use std::sync::Arc;

/// Number of targets, the GPU's memory of a picture, kept for the next pictures: two for each of two sizes. During a
/// drag, coarse pictures after changes alternate with finer ones in pauses, and one target is shown while another is
/// drawn into. More targets take more memory; with fewer, targets are created anew during a drag.
const TARGETS_KEPT: usize = 4;

/// The picture to draw, at its full resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Camera, light and rays per pixel.
    pub view: View,
    /// Factors of the reflectance that do not depend on the relief.
    pub optics: Optics,
    /// Width and height in pixels.
    pub size: (u32, u32),
}

/// One picture to draw.
pub struct Frame {
    /// Memory that the picture is drawn into. Another thread, such as that of a window, may show it.
    pub target: Arc<Target>,
    /// The picture's resolution.
    pub level: Level,
    /// Whether a coarser picture of the same job was drawn before.
    pub refines: bool,
    /// Whether no finer picture follows.
    pub is_finest: bool,
    /// Scene to draw.
    scene: Rc<Scene>,
    /// Method to draw with.
    shader: Rc<Shader>,
    /// The job's view with the rays per pixel of the level.
    view: View,
    /// Number of rays of the picture.
    rays: f64,
    /// The field `generation` of the [`Progressive`] when the frame was made.
    generation: u64,
}

impl Frame {
    /// Draws the picture.
    ///
    /// # Errors
    /// The errors of [`Renderer::draw_async`].
    pub async fn draw_async(&self, gpu: &Gpu, renderer: &Renderer) -> Result<FrameReport, GpuError> {
        renderer.draw_async(gpu, &self.scene, &self.shader, &self.target, &self.view).await
    }

    /// Blocking [`Frame::draw_async`].
    ///
    /// # Errors
    /// The errors of [`Renderer::draw_async`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn draw(&self, gpu: &Gpu, renderer: &Renderer) -> Result<FrameReport, GpuError> {
        renderer.draw(gpu, &self.scene, &self.shader, &self.target, &self.view)
    }
}

/// A scene, a method and a job, and the finest picture drawn of them so far.
pub struct Progressive {
    /// The full scene.
    scene: Option<Rc<Scene>>,
    /// A scene that is drawn faster, for coarse pictures, and for all pictures until there is a full scene.
    draft: Option<Rc<Scene>>,
    /// The method.
    shader: Option<Rc<Shader>>,
    /// The job.
    job: Option<Job>,
    /// The finest picture of the job so far; after [`Progressive::give_up`] that of the removed job.
    latest: Option<(Arc<Target>, Level)>,
    /// Targets of earlier frames, in the order of their creation. Those that nobody else holds are drawn into again.
    targets: Vec<Arc<Target>>,
    /// Speed of the method, by which times of pictures are estimated.
    pace: Pace,
    /// Intended time in ms of the first picture after a change. Larger values show a finer first picture, but later.
    preview_ms: f64,
    /// Number of changes of scene, method and job. A frame with a smaller number is stale.
    generation: u64,
}

impl Progressive {
    /// A state without scene, method and job. The first picture after each change is the finest one that is estimated
    /// to take at most `preview_ms` milliseconds, and the coarsest one if there is none.
    pub fn new(preview_ms: f64) -> Self {
        Self {
            scene: None,
            draft: None,
            shader: None,
            job: None,
            latest: None,
            targets: Vec::new(),
            pace: Pace::default(),
            preview_ms,
            generation: 0,
        }
    }

    /// Replaces the full scene. The draft, if there is one, stays for coarse pictures and must show the same scene.
    pub fn set_scene(&mut self, scene: Scene) {
        self.scene = Some(Rc::new(scene));
        self.start_over();
    }

    /// Replaces the draft. The full scene belongs to the previous draft and is dropped. Until
    /// [`Progressive::set_scene`] is called again, all pictures show the draft.
    pub fn set_draft(&mut self, draft: Scene) {
        (self.draft, self.scene) = (Some(Rc::new(draft)), None);
        self.start_over();
    }

    /// Replaces the method and gives it the optics of the job.
    pub fn set_shader(&mut self, gpu: &Gpu, shader: Shader) {
        if let Some(job) = &self.job {
            shader.set_optics(gpu, &job.optics);
        }
        self.shader = Some(Rc::new(shader));
        self.pace = Pace::default();
        self.start_over();
    }

    /// Replaces the job; returns whether it differs from the previous job.
    pub fn set_job(&mut self, gpu: &Gpu, job: Job) -> bool {
        if self.job.as_ref() == Some(&job) {
            return false;
        }
        if let Some(shader) = &self.shader {
            shader.set_optics(gpu, &job.optics);
        }
        self.job = Some(job);
        self.start_over();
        true
    }

    /// Removes the job, for instance after an error. [`Progressive::next_level`] is `None` until there is another job.
    /// [`Progressive::latest`] stays, and a frame under way, which is not stale, may still replace it.
    pub fn give_up(&mut self) {
        self.job = None;
    }

    /// Forgets the pictures drawn so far, after a change of scene, method or job.
    fn start_over(&mut self) {
        self.latest = None;
        self.generation += 1;
    }

    /// The job, if there is one.
    pub fn job(&self) -> Option<&Job> {
        self.job.as_ref()
    }

    /// The method on the GPU, if there is one.
    pub fn shader(&self) -> Option<&Rc<Shader>> {
        self.shader.as_ref()
    }

    /// The finest picture drawn of the job so far, with its resolution.
    pub fn latest(&self) -> Option<&(Arc<Target>, Level)> {
        self.latest.as_ref()
    }

    /// The resolution of the next picture; `None` after the finest one, or if scene, method or job are missing.
    pub fn next_level(&self) -> Option<Level> {
        let (Some(job), Some(_)) = (&self.job, &self.shader) else { return None };
        if self.scene.is_none() && self.draft.is_none() {
            return None;
        }
        let done = self.latest.as_ref().map(|(_, level)| *level);
        levels::next(done, job.size, job.view.supersample, &self.pace, self.preview_ms)
    }

    /// A picture of the job at this level, that of [`Progressive::next_level`]; `None` if scene, method or job are
    /// missing.
    ///
    /// # Errors
    /// The errors of [`Target::new`].
    pub fn frame(&mut self, gpu: &Gpu, level: Level) -> Result<Option<Frame>, GpuError> {
        let (Some(scene), Some(shader), Some(job)) = (self.scene_at(level), &self.shader, &self.job) else {
            return Ok(None);
        };
        let (scene, shader, job) = (Rc::clone(scene), Rc::clone(shader), job.clone());
        Ok(Some(Frame {
            target: self.free_target(gpu, level.size(job.size))?,
            level,
            refines: self.latest.is_some(),
            is_finest: level.is_finest(job.view.supersample),
            scene,
            shader,
            view: View { supersample: level.supersample, ..job.view },
            rays: level.rays(job.size),
            generation: self.generation,
        }))
    }

    /// Whether the frame is not stale: no scene, draft, method or job was set since it was made.
    pub fn is_current(&self, frame: &Frame) -> bool {
        self.generation == frame.generation
    }

    /// Records a frame that was drawn in `ms` milliseconds. The time updates the estimated speed if the frame was drawn
    /// with the present method. The picture becomes [`Progressive::latest`] if the frame is current.
    pub fn finish(&mut self, frame: &Frame, ms: f64) {
        if self.shader.as_ref().is_some_and(|shader| Rc::ptr_eq(shader, &frame.shader)) {
            self.pace.learn(frame.rays, ms);
        }
        if self.is_current(frame) {
            self.latest = Some((Arc::clone(&frame.target), frame.level));
        }
    }

    /// The scene to draw at a level: the draft for levels with a part of the pixels and the full scene for the others.
    /// If one of them is missing, the other is drawn at all levels.
    fn scene_at(&self, level: Level) -> Option<&Rc<Scene>> {
        let (preferred, other) =
            if level.divisor > 1 { (&self.draft, &self.scene) } else { (&self.scene, &self.draft) };
        preferred.as_ref().or(other.as_ref())
    }

    /// A kept target of this size that nobody else holds, or a new one. New targets replace the oldest free ones; if
    /// all are held, the list grows.
    fn free_target(&mut self, gpu: &Gpu, size: (u32, u32)) -> Result<Arc<Target>, GpuError> {
        // The only reference to a free target is the one in `targets`.
        let is_free = |target: &Arc<Target>| Arc::strong_count(target) == 1;
        if let Some(target) = self.targets.iter().find(|target| target.size() == size && is_free(target)) {
            return Ok(Arc::clone(target));
        }
        while self.targets.len() >= TARGETS_KEPT {
            let Some(oldest) = self.targets.iter().position(is_free) else { break };
            self.targets.remove(oldest);
        }
        let target = Arc::new(Target::new(gpu, size.0, size.1)?);
        self.targets.push(Arc::clone(&target));
        Ok(target)
    }
}
