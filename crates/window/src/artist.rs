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

/// A drawn picture.
pub(crate) struct Picture {
    pub target: Arc<Target>,
    pub report: FrameReport,
    /// Wall-clock time in ms.
    pub ms: f64,
    /// Whether no finer picture follows.
    pub finest: bool,
}

/// Files of a screenshot: `png`, and its name with `.exr`.
#[derive(Clone, Debug)]
pub(crate) struct Shot {
    pub png: PathBuf,
    /// Stops by which the PNG is brightened.
    pub exposure: f64,
}

/// One piece of work. Orders are read between steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    Picture(Level),
    /// The map with the side of this index.
    Map(usize),
    Save,
}

/// Result of a step.
pub(crate) enum Done {
    Picture(Picture),
    /// `None` where the cursor is not on the lit side of the mesh.
    Map(Option<BrdfMap>),
    Saved(PathBuf),
}

/// Draws the ordered pictures and maps, step by step.
pub(crate) struct Artist {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    progressive: Progressive,
    /// Point of the picture whose map is wanted, each coordinate in [0, 1).
    cursor: Option<[f32; 2]>,
    shot: Option<Shot>,
    /// Index of the side of the map that is drawn already.
    map: Option<usize>,
    map_pace: Pace,
}

impl Artist {
    /// Compiles the programs that do not depend on a method.
    ///
    /// # Errors
    /// The errors of [`Renderer::new`].
    pub(crate) fn new(gpu: Arc<Gpu>) -> Result<Self, GpuError> {
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
    /// The errors of [`Scene::new`].
    pub(crate) fn set_scene(&mut self, mesh: &Mesh, pigment: &PigmentTexture) -> Result<(), GpuError> {
        self.progressive.set_scene(Scene::new(&self.gpu, mesh, pigment)?);
        self.map = None;
        Ok(())
    }

    /// Takes another method, which stops when the flag is set; returns its bytes on the GPU.
    ///
    /// # Errors
    /// The errors of [`Shader::new`]; then the method before stays.
    pub(crate) fn set_method(&mut self, method: &dyn Method, stop: Arc<AtomicBool>) -> Result<u64, GpuError> {
        let mut shader = Shader::new(&self.gpu, method, &Optics::default())?;
        shader.stop_when(stop);
        let bytes = shader.bytes();
        self.progressive.set_shader(&self.gpu, shader);
        (self.map, self.map_pace) = (None, Pace::default());
        Ok(bytes)
    }

    /// Takes another job.
    pub(crate) fn set_job(&mut self, job: Job) {
        if self.progressive.set_job(&self.gpu, job) {
            self.map = None;
        }
    }

    /// Orders the map of another point.
    pub(crate) fn set_cursor(&mut self, cursor: Option<[f32; 2]>) {
        self.cursor = cursor;
        self.map = None;
    }

    /// Orders files of the finest picture.
    pub(crate) fn set_shot(&mut self, shot: Shot) {
        self.shot = Some(shot);
    }

    /// The next step: a first picture, a first map, then finer ones.
    pub(crate) fn next_step(&self) -> Option<Step> {
        let picture = self.progressive.next_level().map(Step::Picture);
        let map = self.cursor.and_then(|_| hemisphere::next(self.map, &self.map_pace)).map(Step::Map);
        let save = self.shot.as_ref().map(|_| Step::Save);
        match (self.progressive.latest(), self.map) {
            (None, _) => picture,
            (Some(_), None) if self.shot.is_none() => map.or(picture),
            _ => picture.or(save).or(map),
        }
    }

    /// Whether the step only refines a picture or map that is shown already.
    pub(crate) fn refines(&self, step: Step) -> bool {
        match step {
            Step::Picture(_) => self.progressive.latest().is_some(),
            Step::Map(_) => self.map.is_some(),
            Step::Save => false,
        }
    }

    /// Whether a screenshot is ordered.
    pub(crate) fn owes_shot(&self) -> bool {
        self.shot.is_some()
    }

    /// Drops the orders after a failed step, until there is a new one.
    pub(crate) fn give_up(&mut self) {
        self.progressive.give_up();
        self.shot = None;
    }

    /// Does a step of [`Artist::next_step`]; `None` where its order is gone.
    ///
    /// # Errors
    /// [`Failure`]; [`GpuError::Stopped`] where the flag was set.
    pub(crate) fn work(&mut self, step: Step) -> Result<Option<Done>, Failure> {
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
        // The PNG is written last: with it, both files are there.
        write(&shot.png.with_extension("exr"), encode::exr(size, |i| picture[i]))?;
        write(&shot.png, encode::tone_mapped_png(size, &picture, shot.exposure))?;
        Ok(Some(Done::Saved(shot.png)))
    }
}

/// Reason why a step failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A screenshot that cannot be written.
    #[error("{0}")]
    File(String),
}
