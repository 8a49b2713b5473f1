//! Draws pictures, BRDF maps and screenshots, step by step. The thread of drawer.rs passes on the window's orders and
//! runs the steps.
//!
//! A *job* is all inputs of a picture except scene and method. A [`Level`] is the resolution of a picture; pictures
//! of slow methods begin coarse and become finer ([`Progressive`]). A [`Pace`] is the estimated speed of a method. A
//! [`Target`] is a picture on the GPU. It also keeps a [`Query`] for each pixel: the surface point that the pixel
//! shows, with its directions to light and viewer. A *map* is the reflectance over all viewing directions at the
//! point under the cursor (hemisphere.rs).

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

/// Intended time in ms of the first picture after a change. With 70 ms, a drag shows 14 pictures a second. Larger
/// values show finer pictures; smaller ones show more pictures.
const PREVIEW_MS: f64 = 70.0;

/// A drawn picture.
pub(crate) struct Picture {
    /// Memory that contains the picture.
    pub target: Arc<Target>,
    /// Time and work of the GPU.
    pub report: FrameReport,
    /// Wall-clock time of drawing in ms.
    pub ms: f64,
    /// Whether no finer picture follows.
    pub is_finest: bool,
}

/// Order of a screenshot: a tone-mapped PNG, and a linear EXR beside it with the extension `.exr`.
#[derive(Clone, Debug)]
pub(crate) struct Shot {
    /// Path of the PNG.
    pub png: PathBuf,
    /// Stops by which the PNG is brightened: the factor on the radiance is `2^exposure`.
    pub exposure: f64,
}

/// One piece of work. Orders are read between steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// Draws the picture at this level.
    Picture(Level),
    /// Draws the map with this side in pixels.
    Map(usize),
    /// Writes the screenshot.
    Save,
}

/// Result of a step.
pub(crate) enum Done {
    /// The picture.
    Picture(Picture),
    /// The map; `None` where the cursor is beside the mesh, or on the unlit side of an opaque one.
    Map(Option<BrdfMap>),
    /// Path of the PNG.
    Saved(PathBuf),
}

/// Draws the ordered pictures and maps, step by step.
pub(crate) struct Artist {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    progressive: Progressive,
    /// Point of the picture whose map is ordered, each coordinate in [0, 1) from the upper left; `None` for no map.
    cursor: Option<[f32; 2]>,
    /// The ordered screenshot.
    shot: Option<Shot>,
    /// Side in pixels of the finest map drawn for the cursor and the latest picture; `None` before the first map. Where
    /// no map can be drawn, it is [`hemisphere::FINEST_SIDE`], so that no map is left to do.
    map_side: Option<usize>,
    /// Speed of the method for maps, whose pixels count as rays. It is learned anew for each method.
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
            map_side: None,
            map_pace: Pace::default(),
        })
    }

    /// Replaces the mesh and its pigment.
    ///
    /// # Errors
    /// The errors of [`Scene::new`].
    pub(crate) fn set_scene(&mut self, mesh: &Mesh, pigment: &PigmentTexture) -> Result<(), GpuError> {
        self.progressive.set_scene(Scene::new(&self.gpu, mesh, pigment)?);
        self.map_side = None;
        Ok(())
    }

    /// Replaces the method. A step with the method fails with [`GpuError::Stopped`] when the flag `stop` is set.
    /// Returns the size of the method's data on the GPU in bytes.
    ///
    /// # Errors
    /// The errors of [`Shader::new`]; the previous method stays in use.
    pub(crate) fn set_method(&mut self, method: &dyn Method, stop: Arc<AtomicBool>) -> Result<u64, GpuError> {
        let mut shader = Shader::new(&self.gpu, method, &Optics::default())?;
        shader.stop_when(stop);
        let bytes = shader.bytes();
        self.progressive.set_shader(&self.gpu, shader);
        (self.map_side, self.map_pace) = (None, Pace::default());
        Ok(bytes)
    }

    /// Replaces the job: camera, light, optics and size of the picture.
    pub(crate) fn set_job(&mut self, job: Job) {
        if self.progressive.set_job(&self.gpu, job) {
            self.map_side = None;
        }
    }

    /// Orders the map of another point, each coordinate in [0, 1) from the upper left; `None` for no map.
    pub(crate) fn set_cursor(&mut self, cursor: Option<[f32; 2]>) {
        self.cursor = cursor;
        self.map_side = None;
    }

    /// Orders a screenshot of the finest picture. It replaces an earlier order that is not done yet.
    pub(crate) fn set_shot(&mut self, shot: Shot) {
        self.shot = Some(shot);
    }

    /// The next step; `None` if nothing is left to do. Each picture is followed by a first map, and finer maps follow
    /// the finest picture. A screenshot needs the finest picture, so no maps are drawn while one is ordered.
    pub(crate) fn next_step(&self) -> Option<Step> {
        let picture = self.progressive.next_level().map(Step::Picture);
        if self.progressive.latest().is_none() {
            return picture;
        }
        if self.shot.is_some() {
            return picture.or(Some(Step::Save));
        }
        let map = self.cursor.and_then(|_| hemisphere::next_side(self.map_side, &self.map_pace)).map(Step::Map);
        if self.map_side.is_none() { map.or(picture) } else { picture.or(map) }
    }

    /// Whether the step refines a picture or map that has been drawn.
    pub(crate) fn refines(&self, step: Step) -> bool {
        match step {
            Step::Picture(_) => self.progressive.latest().is_some(),
            Step::Map(_) => self.map_side.is_some(),
            Step::Save => false,
        }
    }

    /// Whether a screenshot is ordered and not done yet.
    pub(crate) fn has_shot(&self) -> bool {
        self.shot.is_some()
    }

    /// Drops the job and the screenshot after a failed step, so that the step is not repeated.
    pub(crate) fn give_up(&mut self) {
        self.progressive.give_up();
        self.shot = None;
    }

    /// Does a step of [`Artist::next_step`]; `None` if the order for the step has been dropped.
    ///
    /// # Errors
    /// [`Failure`], with [`GpuError::Stopped`] if the flag of [`Artist::set_method`] was set.
    pub(crate) fn work(&mut self, step: Step) -> Result<Option<Done>, Failure> {
        match step {
            Step::Picture(level) => Ok(self.draw(level)?.map(Done::Picture)),
            Step::Map(side) => Ok(self.draw_map(side)?),
            Step::Save => self.save(),
        }
    }

    /// Draws the picture at a level; `None` if scene, method or job are missing.
    fn draw(&mut self, level: Level) -> Result<Option<Picture>, GpuError> {
        let Some(frame) = self.progressive.frame(&self.gpu, level)? else { return Ok(None) };
        let start = Instant::now();
        let report = frame.draw(&self.gpu, &self.renderer)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.progressive.finish(&frame, ms);
        // A finer picture determines the surface under the cursor more exactly, so the map is drawn again.
        self.map_side = None;
        Ok(Some(Picture { target: Arc::clone(&frame.target), report, ms, is_finest: frame.is_finest }))
    }

    /// Draws the map of the surface under the cursor, with `side` pixels along each side; `None` if cursor, picture or
    /// method are missing.
    fn draw_map(&mut self, side: usize) -> Result<Option<Done>, GpuError> {
        let (Some([x, y]), Some((target, _)), Some(shader)) =
            (self.cursor, self.progressive.latest(), self.progressive.shader())
        else {
            return Ok(None);
        };
        let seen = match target.pixel_at(f64::from(x), f64::from(y)) {
            Some((column, row)) => target.read_query(&self.gpu, column, row)?,
            // Beside the picture: a query of the kind [`Query::NOTHING`].
            None => Query::default(),
        };
        // Only points of the mesh, of the kind `SKIN`, have a map. z is the surface's normal, so wi.z ≤ 0 is light from
        // below, which an opaque surface does not reflect.
        if seen.kind != Query::SKIN || (seen.wi[2] <= 0.0 && !shader.is_film()) {
            self.map_side = Some(hemisphere::FINEST_SIDE);
            return Ok(Some(Done::Map(None)));
        }
        let map = hemisphere::draw(&self.gpu, shader, &seen, side, &mut self.map_pace);
        self.map_side = match map {
            Ok(_) => Some(side),
            // A stopped map is drawn later.
            Err(GpuError::Stopped) => self.map_side,
            // Finer maps would fail as well.
            Err(_) => Some(hemisphere::FINEST_SIDE),
        };
        Ok(Some(Done::Map(Some(map?))))
    }

    /// Writes the ordered screenshot of the latest picture; `None` if order or picture are missing.
    fn save(&mut self) -> Result<Option<Done>, Failure> {
        let (Some(shot), Some((target, _))) = (self.shot.take(), self.progressive.latest()) else { return Ok(None) };
        let picture = target.read_picture(&self.gpu)?;
        let (width, height) = target.size();
        let size = (width as usize, height as usize);
        let write = |path: &Path, encoded: Result<Vec<u8>, Box<dyn std::error::Error>>| {
            let bytes = encoded.map_err(|error| Failure::File(error.to_string()))?;
            output::write(path, &bytes).map_err(Failure::File)
        };
        // The PNG is written last: once it exists, both files do.
        write(&shot.png.with_extension("exr"), encode::exr(size, |i| picture[i]))?;
        write(&shot.png, encode::tone_mapped_png(size, &picture, shot.exposure))?;
        Ok(Some(Done::Saved(shot.png)))
    }
}

/// Reason why a step failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// An error of the GPU.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A screenshot that cannot be written.
    #[error("{0}")]
    File(String),
}
