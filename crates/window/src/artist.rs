use super::hemisphere::{self, BrdfMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use sunbeam::methods::Method;
use sunbeam_cli::{encode, output};
use sunbeam_realtime::levels::{Level, Pace};
use sunbeam_realtime::progressive::{Job, Progressive};
use sunbeam_realtime::snake::PigmentTexture;
use sunbeam_realtime::{FrameReport, Gpu, GpuError, Mesh, Optics, Query, Renderer, Scene, Shader, Target};

/// Time in ms that the first picture after a change may take: a drag is followed at 14 pictures a second.
const PREVIEW_MS: f64 = 70.0;

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
    progressive: Progressive,
    /// Where in the picture the map is asked for, each coordinate in [0, 1).
    cursor: Option<[f32; 2]>,
    shot: Option<Shot>,
    /// Index of the side of the map that is drawn already.
    map: Option<usize>,
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
            progressive: Progressive::new(PREVIEW_MS),
            cursor: None,
            shot: None,
            map: None,
            map_pace: Pace::default(),
        })
    }

    /// Takes another mesh.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn set_scene(&mut self, mesh: &Mesh, pigment: &PigmentTexture) -> Result<(), GpuError> {
        self.progressive.set_scene(Scene::new(&self.gpu, mesh, pigment)?);
        self.map = None;
        Ok(())
    }

    /// Takes another method, whose answers end early once the flag is set; gives its bytes on the GPU.
    ///
    /// # Errors
    /// As [`Shader::new`]. The method before stays.
    pub fn set_method(&mut self, method: &dyn Method, stop: Arc<AtomicBool>) -> Result<u64, GpuError> {
        let mut shader = Shader::new(&self.gpu, method, &Optics::default())?;
        shader.stop_when(stop);
        let bytes = shader.bytes();
        self.progressive.set_shader(&self.gpu, shader);
        (self.map, self.map_pace) = (None, Pace::default());
        Ok(bytes)
    }

    /// Takes another job.
    pub fn set_job(&mut self, job: Job) {
        if self.progressive.set_job(&self.gpu, job) {
            self.map = None;
        }
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

    /// What to do next: a first picture, a first map, then better ones.
    pub fn next_step(&self) -> Option<Step> {
        let picture = self.progressive.next_level().map(Step::Picture);
        let map = self.cursor.and_then(|_| hemisphere::next(self.map, &self.map_pace)).map(Step::Map);
        let save = self.shot.as_ref().map(|_| Step::Save);
        match (self.progressive.latest(), self.map) {
            (None, _) => picture,
            (Some(_), None) if self.shot.is_none() => map.or(picture),
            _ => picture.or(save).or(map),
        }
    }

    /// Whether something is shown already that the step only makes better.
    pub fn refines(&self, step: Step) -> bool {
        match step {
            Step::Picture(_) => self.progressive.latest().is_some(),
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
        self.progressive.give_up();
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
        let Some(frame) = self.progressive.frame(&self.gpu, level)? else { return Ok(None) };
        let start = Instant::now();
        let report = frame.draw(&self.gpu, &self.renderer)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.progressive.finish(&frame, ms);
        // A finer picture knows the surface under the cursor better.
        self.map = None;
        Ok(Some(Picture { target: Arc::clone(&frame.target), report, ms, finest: frame.is_finest }))
    }

    fn draw_map(&mut self, index: usize) -> Result<Option<Option<BrdfMap>>, GpuError> {
        let (Some([x, y]), Some((target, _)), Some(shader)) =
            (self.cursor, self.progressive.latest(), self.progressive.shader())
        else {
            return Ok(None);
        };
        let Some((column, row)) = target.pixel_at(f64::from(x), f64::from(y)) else {
            self.map = Some(hemisphere::LAST);
            return Ok(Some(None));
        };
        let seen = target.read_query(&self.gpu, column, row)?;
        self.map = Some(index);
        if seen.kind != Query::SKIN || seen.wi[2] <= 0.0 {
            self.map = Some(hemisphere::LAST);
            return Ok(Some(None));
        }
        Ok(Some(Some(hemisphere::draw(&self.gpu, shader, &seen, index, &mut self.map_pace)?)))
    }

    fn save(&mut self) -> Result<Option<Done>, Failure> {
        let (Some(shot), Some((target, _))) = (self.shot.take(), self.progressive.latest()) else { return Ok(None) };
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
