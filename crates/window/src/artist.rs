use super::hemisphere::{self, BrdfMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use sunbeam::methods::Method;
use sunbeam_cli::{encode, output};
use sunbeam_realtime::levels::{self, Level, Pace};
use sunbeam_realtime::snake::PigmentTexture;
use sunbeam_realtime::{FrameReport, Gpu, GpuError, Mesh, Optics, Query, Renderer, Scene, Shader, Target, View};

/// Targets that are kept for the next picture: two sizes while something moves, each shown and drawn in turns.
const TARGETS_KEPT: usize = 4;
/// A first picture after a change should not take longer than this.
const PREVIEW_MS: f64 = 70.0;

/// What is to be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawJob {
    pub view: View,
    pub optics: Optics,
    /// Of the finest picture, in pixels.
    pub size: (u32, u32),
}

/// A picture that is done.
pub struct Picture {
    pub target: Arc<Target>,
    pub report: FrameReport,
    /// Wall clock of all of it.
    pub ms: f64,
    /// Whether no finer one follows.
    pub finest: bool,
}

/// Where a screenshot goes: `png`, and the same with `.exr`.
#[derive(Clone, Debug)]
pub struct Shot {
    pub png: PathBuf,
    pub exposure: f64,
}

/// One piece of work, after which there may be another job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    Picture(Level),
    /// The map with this side.
    Map(usize),
    Save,
}

/// What a step gave.
pub enum Done {
    Picture(Picture),
    /// `None` where the cursor is not on the lit side of the mesh.
    Map(Option<BrdfMap>),
    Saved(PathBuf),
}

/// Draws what is ordered, in steps.
pub struct Artist {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    scene: Option<Scene>,
    shader: Option<Shader>,
    job: Option<DrawJob>,
    /// Where in the picture the map is asked for, each coordinate in [0, 1).
    cursor: Option<[f32; 2]>,
    shot: Option<Shot>,
    targets: Vec<Arc<Target>>,
    /// What is drawn of the job, and of the map.
    latest: Option<(Arc<Target>, Level)>,
    map: Option<usize>,
    pace: Pace,
    map_pace: Pace,
}

impl Artist {
    /// Compiles what does not depend on anything.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn new(gpu: Arc<Gpu>) -> Result<Self, GpuError> {
        let renderer = Renderer::new(&gpu)?;
        Ok(Self {
            gpu,
            renderer,
            scene: None,
            shader: None,
            job: None,
            cursor: None,
            shot: None,
            targets: Vec::new(),
            latest: None,
            map: None,
            pace: Pace::default(),
            map_pace: Pace::default(),
        })
    }

    /// Takes another mesh.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn set_scene(&mut self, mesh: &Mesh, pigment: &PigmentTexture) -> Result<(), GpuError> {
        self.scene = Some(Scene::new(&self.gpu, mesh, pigment)?);
        self.start_over();
        Ok(())
    }

    /// Takes another method, whose answers end early once the flag is set; gives its bytes on the GPU.
    ///
    /// # Errors
    /// As [`Shader::new`]. The method before stays.
    pub fn set_method(&mut self, method: &dyn Method, stop: Arc<AtomicBool>) -> Result<u64, GpuError> {
        let optics = self.job.as_ref().map_or_else(Optics::default, |job| job.optics);
        let mut shader = Shader::new(&self.gpu, method, &optics)?;
        shader.stop_when(stop);
        let bytes = shader.bytes();
        self.shader = Some(shader);
        (self.pace, self.map_pace) = (Pace::default(), Pace::default());
        self.start_over();
        Ok(bytes)
    }

    /// Takes another job.
    pub fn set_job(&mut self, job: DrawJob) {
        if let Some(shader) = &self.shader {
            shader.set_optics(&self.gpu, &job.optics);
        }
        self.job = Some(job);
        self.start_over();
    }

    /// Asks for the map of another place.
    pub fn set_cursor(&mut self, cursor: Option<[f32; 2]>) {
        self.cursor = cursor;
        self.map = None;
    }

    /// Asks for files of the finest picture.
    pub fn set_shot(&mut self, shot: Shot) {
        self.shot = Some(shot);
    }

    fn start_over(&mut self) {
        self.latest = None;
        self.map = None;
    }

    /// What to do next: a first picture, a first map, then better ones.
    pub fn next_step(&self) -> Option<Step> {
        let (Some(job), Some(_), Some(_)) = (&self.job, &self.scene, &self.shader) else { return None };
        let drawn = self.latest.as_ref().map(|(_, level)| *level);
        let picture = levels::next(drawn, job.size, job.view.supersample, &self.pace, PREVIEW_MS).map(Step::Picture);
        let map = self.cursor.and_then(|_| hemisphere::next(self.map, &self.map_pace)).map(Step::Map);
        let save = self.shot.as_ref().map(|_| Step::Save);
        match (drawn, self.map) {
            (None, _) => picture,
            (Some(_), None) if self.shot.is_none() => map.or(picture),
            _ => picture.or(save).or(map),
        }
    }

    /// Whether something is shown already that the step only makes better.
    pub fn refines(&self, step: Step) -> bool {
        match step {
            Step::Picture(_) => self.latest.is_some(),
            Step::Map(_) => self.map.is_some(),
            Step::Save => false,
        }
    }

    /// Whether a screenshot is being waited for.
    pub fn owes_shot(&self) -> bool {
        self.shot.is_some()
    }

    /// Gives up what a step that failed was for, until there is something new.
    pub fn give_up(&mut self) {
        self.job = None;
        self.shot = None;
    }

    /// Does a step of [`Artist::next_step`]; `None` where it has become pointless.
    ///
    /// # Errors
    /// What went wrong, [`GpuError::Stopped`] included; a file that cannot be written is a text.
    pub fn work(&mut self, step: Step) -> Result<Option<Done>, Failure> {
        match step {
            Step::Picture(level) => Ok(self.draw(level)?.map(Done::Picture)),
            Step::Map(index) => Ok(self.draw_map(index)?.map(Done::Map)),
            Step::Save => self.save(),
        }
    }

    fn draw(&mut self, level: Level) -> Result<Option<Picture>, GpuError> {
        let Some(job) = self.job.clone() else { return Ok(None) };
        let target = self.target(level.size(job.size))?;
        let (Some(scene), Some(shader)) = (&self.scene, &self.shader) else { return Ok(None) };
        let start = Instant::now();
        let view = View { supersample: level.supersample, ..job.view };
        let report = self.renderer.draw(&self.gpu, scene, shader, &target, &view)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.pace.learn(level.rays(job.size), ms);
        self.latest = Some((Arc::clone(&target), level));
        // The place under the cursor is known better now.
        self.map = None;
        let finest = level.is_last(job.view.supersample);
        Ok(Some(Picture { target, report, ms, finest }))
    }

    fn draw_map(&mut self, index: usize) -> Result<Option<Option<BrdfMap>>, GpuError> {
        let (Some([x, y]), Some((target, _)), Some(shader)) = (self.cursor, &self.latest, &self.shader) else {
            return Ok(None);
        };
        let (width, height) = target.size();
        let pixel = |at: f32, side: u32| ((at * side as f32) as u32).min(side - 1);
        let seen = target.read_query(&self.gpu, pixel(x, width), pixel(y, height))?;
        self.map = Some(index);
        if seen.kind != Query::SKIN || seen.wi[2] <= 0.0 {
            self.map = Some(hemisphere::LAST);
            return Ok(Some(None));
        }
        Ok(Some(Some(hemisphere::draw(&self.gpu, shader, &seen, index, &mut self.map_pace)?)))
    }

    fn save(&mut self) -> Result<Option<Done>, Failure> {
        let (Some(shot), Some((target, _))) = (self.shot.take(), &self.latest) else { return Ok(None) };
        let picture = target.read_picture(&self.gpu)?;
        let (width, height) = target.size();
        let size = (width as usize, height as usize);
        let write = |path: &Path, encoded: Result<Vec<u8>, Box<dyn std::error::Error>>| {
            let bytes = encoded.map_err(|error| Failure::File(error.to_string()))?;
            output::write(path, &bytes).map_err(Failure::File)
        };
        // The PNG last: whoever waits for it finds both.
        write(&shot.png.with_extension("exr"), encode::exr(size, |i| picture[i]))?;
        write(&shot.png, encode::tone_mapped_png(size, &picture, shot.exposure))?;
        Ok(Some(Done::Saved(shot.png)))
    }

    /// A target that is not being shown.
    fn target(&mut self, size: (u32, u32)) -> Result<Arc<Target>, GpuError> {
        let free = |target: &Arc<Target>| Arc::strong_count(target) == 1;
        if let Some(target) = self.targets.iter().find(|target| target.size() == size && free(target)) {
            return Ok(Arc::clone(target));
        }
        while self.targets.len() >= TARGETS_KEPT {
            let Some(oldest) = self.targets.iter().position(free) else { break };
            self.targets.remove(oldest);
        }
        let (width, height) = size;
        let target = Arc::new(Target::new(&self.gpu, width, height)?);
        self.targets.push(Arc::clone(&target));
        Ok(target)
    }
}

/// Why a step was not done.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A screenshot that cannot be written.
    #[error("{0}")]
    File(String),
}
