//! Pictures that begin coarse and become finer while nothing changes, as the window and the page show them.
//!
//! A [`Progressive`] holds scene, method and [`Job`], and decides how fine the next picture is. It never waits for the
//! GPU. The caller takes a [`Frame`] from it, draws the frame, blocking or not, and hands it back:
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
//! A scene, method or job that is set between [`Progressive::frame`] and [`Progressive::finish`] makes the frame stale:
//! it may be shown, and the pictures begin anew.

use crate::levels::{self, Level, Pace};
use crate::{FrameReport, Gpu, GpuError, Optics, Renderer, Scene, Shader, Target, View};
use std::rc::Rc;
use std::sync::Arc;

/// Number of targets kept for the next pictures. Two sizes times two: during a drag, pictures of two sizes alternate,
/// and one target is shown while another is drawn.
const TARGETS_KEPT: usize = 4;

/// The picture to draw, at its full resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Camera, light and rays per pixel.
    pub view: View,
    /// Optics around the relief.
    pub optics: Optics,
    /// Width and height in pixels.
    pub size: (u32, u32),
}

/// One picture to draw.
pub struct Frame {
    /// The memory that the picture is drawn into.
    pub target: Arc<Target>,
    /// The picture's resolution.
    pub level: Level,
    /// Whether a coarser picture of the same job is there already.
    pub refines: bool,
    /// Whether no finer picture follows.
    pub is_finest: bool,
    scene: Rc<Scene>,
    shader: Rc<Shader>,
    /// The job's view with the rays per pixel of the level.
    view: View,
    /// Number of rays of the picture.
    rays: f64,
    /// [`Progressive::generation`] when the frame was made.
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

/// Scene, method and job, and the pictures drawn of them so far.
pub struct Progressive {
    scene: Option<Rc<Scene>>,
    /// The scene of coarse pictures, and of all pictures until there is a full scene.
    draft: Option<Rc<Scene>>,
    shader: Option<Rc<Shader>>,
    job: Option<Job>,
    /// The finest picture of the job so far.
    latest: Option<(Arc<Target>, Level)>,
    targets: Vec<Arc<Target>>,
    pace: Pace,
    /// Time in ms that the first picture after a change may take.
    preview_ms: f64,
    /// Number of changes of scene, method and job.
    generation: u64,
}

impl Progressive {
    /// A state without scene, method and job. The first picture after each change is as fine as `preview_ms` allows.
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

    /// Replaces the scene. An earlier draft stays for coarse pictures.
    pub fn set_scene(&mut self, scene: Scene) {
        self.scene = Some(Rc::new(scene));
        self.start_over();
    }

    /// Replaces the draft and drops the present scene; the full scene of the draft follows later.
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

    /// Removes the job: [`Progressive::next_level`] is `None` until there is another job.
    pub fn give_up(&mut self) {
        self.job = None;
    }

    /// Begins with the coarsest picture again, after a change of scene, method or job.
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

    /// The finest picture drawn of the job so far.
    pub fn latest(&self) -> Option<&(Arc<Target>, Level)> {
        self.latest.as_ref()
    }

    /// The resolution of the next picture; `None` when the finest one is there, or scene, method or job are missing.
    pub fn next_level(&self) -> Option<Level> {
        let (Some(job), Some(_)) = (&self.job, &self.shader) else { return None };
        self.scene.as_ref().or(self.draft.as_ref())?;
        let latest = self.latest.as_ref().map(|(_, level)| *level);
        levels::next(latest, job.size, job.view.supersample, &self.pace, self.preview_ms)
    }

    /// A picture of the job at this level, ready to be drawn; `None` where scene, method or job are missing.
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
            is_finest: level.is_last(job.view.supersample),
            scene,
            shader,
            view: View { supersample: level.supersample, ..job.view },
            rays: level.rays(job.size),
            generation: self.generation,
        }))
    }

    /// Whether scene, method and job are still those of the frame.
    pub fn is_current(&self, frame: &Frame) -> bool {
        self.generation == frame.generation
    }

    /// Records a frame that was drawn and shown in `ms` milliseconds. The time updates the estimated speed if the
    /// method is still the frame's. The picture becomes the latest one if the frame is current.
    pub fn finish(&mut self, frame: &Frame, ms: f64) {
        if self.shader.as_ref().is_some_and(|shader| Rc::ptr_eq(shader, &frame.shader)) {
            self.pace.learn(frame.rays, ms);
        }
        if self.is_current(frame) {
            self.latest = Some((Arc::clone(&frame.target), frame.level));
        }
    }

    /// The scene to draw at a level: the draft for coarse levels and the full scene for fine ones, if both exist.
    fn scene_at(&self, level: Level) -> Option<&Rc<Scene>> {
        let (first, second) = if level.divisor > 1 { (&self.draft, &self.scene) } else { (&self.scene, &self.draft) };
        first.as_ref().or(second.as_ref())
    }

    /// A target of this size that neither a frame nor the caller holds; a new one if there is none.
    fn free_target(&mut self, gpu: &Gpu, size: (u32, u32)) -> Result<Arc<Target>, GpuError> {
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
