//! The artist, which draws with WebGPU on an `OffscreenCanvas` in a Web Worker. `README.md` of this crate documents its
//! calls.
//!
//! A picture is drawn progressively ([`Progressive`]): first a coarse preview, then finer levels (resolution and rays
//! per pixel), each by one [`Artist::step`]. A call that changes scene, method or view stops a drawing that only
//! refines the picture shown. Pictures are radiance in linear sRGB. `screen.rs` applies the exposure when it copies a
//! picture to the canvas.
//!
//! Exported functions convert errors for JavaScript. Those with several steps call a private function, such as
//! `try_step`, which returns [`WebError`].

use super::quick::read;
use super::report::thrown;
use super::screen::Screen;
use crate::{MethodData, WebError, image};
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use sunbeam_realtime::levels::Level;
use sunbeam_realtime::progressive::{Job, Progressive};
use sunbeam_realtime::{FrameReport, Gpu, GpuError, Optics, Query, Renderer, Scene, SceneData, Shader, Target};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

/// Time in ms that the preview after a change may take. With the messages between page and worker, the picture follows
/// a drag within two frames of 1/60 s. A longer time makes previews finer but late.
const PREVIEW_MS: f64 = 25.0;

/// State that calls change. No borrow of it is held across an `await`, since other calls run in the meantime.
struct State {
    /// Scene, method and job (view, optics and size). It chooses the resolution of the next picture.
    progressive: Progressive,
    /// Photographic stops by which pictures are brightened for the canvas.
    exposure_stops: f64,
    /// The picture on the canvas.
    shown: Option<Arc<Target>>,
    /// Whether `exposure_stops` has changed since the picture was put on the canvas.
    tone_changed: bool,
}

/// Draws with WebGPU on a canvas. Calls that draw or read the GPU must not overlap: the worker awaits each before the
/// next (`inTurn` in artist.js). Calls that set scene, method or view may come while one draws.
#[wasm_bindgen]
pub struct Artist {
    gpu: Gpu,
    /// `None` if the artist draws without a canvas.
    screen: Option<Screen>,
    renderer: Renderer,
    state: RefCell<State>,
    /// Whether the current drawing only refines the picture on the canvas. Such a drawing may be stopped.
    refining: Cell<bool>,
    /// Flag that stops the current drawing, set only while `refining`. The shader reads it before each of its
    /// submissions to the GPU.
    stop: Arc<AtomicBool>,
}

thread_local! {
    /// The function registered by [`Artist::on_lost`]. It is here because a JavaScript function cannot move into the
    /// device's callback, which must be `Send`.
    static LOST: RefCell<Option<js_sys::Function>> = const { RefCell::new(None) };
}

#[wasm_bindgen]
impl Artist {
    /// Opens a WebGPU device for a canvas, or for drawing without one.
    pub async fn open(canvas: Option<web_sys::OffscreenCanvas>) -> Result<Artist, JsValue> {
        Self::try_open(canvas).await.map_err(thrown)
    }

    /// The graphics adapter, as JSON.
    pub fn adapter(&self) -> String {
        json!({ "name": self.gpu.adapter(), "backend": self.gpu.backend(), "software": self.gpu.is_software() })
            .to_string()
    }

    /// Registers a function that is called once, with a line of text, when the device is lost.
    pub fn on_lost(&self, callback: js_sys::Function) {
        LOST.with_borrow_mut(|listener| *listener = Some(callback));
    }

    /// Uploads the scene from the bytes of `make_scene` (`maker.rs`). A draft has a coarser depth map of the
    /// sun. It is drawn until its full scene is uploaded, and later for coarse pictures.
    pub async fn set_scene(&self, bytes: Vec<u8>, is_draft: bool) -> Result<(), JsValue> {
        let upload = if is_draft { Scene::draft } else { Scene::of };
        let scene = SceneData::from_bytes(bytes).and_then(|data| upload(&self.gpu, &data)).map_err(thrown)?;
        let progressive = &mut self.state.borrow_mut().progressive;
        if is_draft {
            progressive.set_draft(scene);
        } else {
            progressive.set_scene(scene);
        }
        self.give_up_refining();
        Ok(())
    }

    /// Compiles and uploads the method from the bytes of `Relief.method` (`maker.rs`). Returns its size on the GPU in
    /// bytes.
    pub async fn set_method(&self, bytes: Vec<u8>) -> Result<f64, JsValue> {
        let data = MethodData::from_bytes(bytes).map_err(thrown)?;
        // `set_shader` and `set_job` of the state replace these optics by those of the job.
        let shader = Shader::of_async(&self.gpu, &data.shader(), data.answers(), &Optics::default()).await;
        let mut shader = shader.map_err(thrown)?;
        shader.stop_when(Arc::clone(&self.stop));
        let bytes_on_gpu = shader.bytes() as f64;
        self.state.borrow_mut().progressive.set_shader(&self.gpu, shader);
        self.give_up_refining();
        Ok(bytes_on_gpu)
    }

    /// Sets the view that the following steps draw, and stops the refinement of another view. The finest picture has
    /// `width` × `height` pixels with `supersample` rays along each side. A change of the exposure alone stops nothing,
    /// since the picture shown is only copied again.
    pub fn set_view(&self, json: &str, width: u32, height: u32, supersample: u32) -> Result<(), JsValue> {
        let settings = read(json)?;
        let view = settings.view(supersample).map_err(thrown)?;
        let job = Job { view, optics: settings.optics(), size: (width.max(1), height.max(1)) };
        let mut state = self.state.borrow_mut();
        state.tone_changed |= state.exposure_stops != settings.exposure;
        state.exposure_stops = settings.exposure;
        if state.progressive.set_job(&self.gpu, job) {
            self.give_up_refining();
        }
        Ok(())
    }

    /// Draws the next finer picture and shows it. Returns its report as JSON, or nothing if there is no finer picture
    /// or if the drawing was stopped.
    pub async fn step(&self) -> Result<Option<String>, JsValue> {
        self.try_step().await.map_err(thrown)
    }

    /// Draws the finest picture at once and shows it. Returns its report as JSON. Fails if scene, method or view is
    /// missing, or if one of them changes while this drawing refines the picture shown.
    pub async fn draw(&self) -> Result<String, JsValue> {
        let missing = || {
            thrown(WebError::Internal("the scene, method or view is missing, or changed during the drawing".to_owned()))
        };
        let finest = self.state.borrow().progressive.job().map(|job| Level::finest(job.view.supersample));
        self.draw_level(finest.ok_or_else(missing)?).await.map_err(thrown)?.ok_or_else(missing)
    }

    /// Width and height in pixels of the picture shown; zeros before there is one.
    pub fn size(&self) -> Vec<u32> {
        let (width, height) = self.state.borrow().shown.as_ref().map_or((0, 0), |target| target.size());
        vec![width, height]
    }

    /// The picture shown: radiance in linear sRGB, three numbers a pixel, rows from the top.
    pub async fn pixels(&self) -> Result<Vec<f32>, JsValue> {
        Ok(self.picture().await.map_err(thrown)?.as_flattened().to_vec())
    }

    /// The picture shown as a PNG file ([`image::picture_png`]).
    pub async fn png(&self) -> Result<Vec<u8>, JsValue> {
        // Taken before the `await`, during which another picture may be shown.
        let (size, stops) = {
            let state = self.state.borrow();
            (state.shown.as_ref().map_or((0, 0), |target| target.size()), state.exposure_stops)
        };
        let picture = self.picture().await.map_err(thrown)?;
        image::picture_png(&picture, size, stops).map_err(thrown)
    }

    /// Directions and reflectance at the point of the mesh that the picture shows at (`x`, `y`), as JSON. Both
    /// coordinates are in [0, 1), from the upper left corner. Returns nothing where the picture shows no mesh, and
    /// before the first picture.
    ///
    /// - `wi`, `wo`: unit vectors to the light and to the viewer in the relief's frame, in which z is the normal.
    /// - `q`, `half`: the sum wi + wo, and the unit vector along it.
    /// - `lit`: whether sunlight arrives at the point.
    /// - `rgb`: `f_r` in 1/sr as linear sRGB, the same in light and in shadow.
    pub async fn query(&self, x: f64, y: f64) -> Result<Option<String>, JsValue> {
        self.try_query(x, y).await.map_err(thrown)
    }

    /// The BRDF map for the unit vector `wi` to the light, in the relief's frame: `f_r` in 1/sr as linear sRGB, three
    /// numbers for each of `side`² pixels, rows from the top. Pixels outside the disc of directions are 0.
    pub async fn map(&self, wi: &[f32], side: usize) -> Result<Vec<f32>, JsValue> {
        let refused = || thrown(WebError::Internal("a direction is three numbers".to_owned()));
        let wi: [f32; 3] = wi.try_into().map_err(|_| refused())?;
        self.try_map(wi, side).await.map_err(thrown)
    }

    /// Destroys the GPU's device, for tests of its loss.
    pub fn lose(&self) {
        self.gpu.device().destroy();
    }
}

impl Artist {
    /// [`Artist::open`] with Rust's error type.
    async fn try_open(canvas: Option<web_sys::OffscreenCanvas>) -> Result<Self, WebError> {
        let absent = |reason: &str| WebError::NoWebGpu(format!("this browser gives the page no WebGPU: {reason}"));
        if !wgpu::util::is_browser_webgpu_supported().await {
            return Err(absent("it has none, or no adapter for it"));
        }
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::BROWSER_WEBGPU;
        let instance = wgpu::Instance::new(descriptor);
        let surface = canvas.map(|canvas| instance.create_surface(wgpu::SurfaceTarget::OffscreenCanvas(canvas)));
        let surface = surface.transpose().map_err(|error| absent(&error.to_string()))?;
        let options = wgpu::RequestAdapterOptions { compatible_surface: surface.as_ref(), ..Default::default() };
        let adapter = instance.request_adapter(&options).await.map_err(|error| absent(&error.to_string()))?;
        let gpu = Gpu::open_adapter_async(&adapter).await?;
        gpu.when_lost(|reason| {
            // Taken out first, since the listener may register another one.
            let listener = LOST.with_borrow_mut(Option::take);
            if let Some(listener) = listener {
                // Errors of the listener are ignored.
                let _ = listener.call1(&JsValue::NULL, &format!("the GPU's device is lost: {reason}").into());
            }
        });
        let screen = surface.map(|surface| Screen::new(&gpu, &adapter, surface)).transpose()?;
        let renderer = Renderer::new(&gpu)?;
        Ok(Self {
            gpu,
            screen,
            renderer,
            state: RefCell::new(State {
                progressive: Progressive::new(PREVIEW_MS),
                exposure_stops: 0.0,
                shown: None,
                tone_changed: false,
            }),
            refining: Cell::new(false),
            stop: Arc::default(),
        })
    }

    /// Stops the current drawing if it only refines a picture, which is now out of date. The first picture after a
    /// change is drawn to its end, so that a drag shows pictures.
    fn give_up_refining(&self) {
        if self.refining.get() {
            self.stop.store(true, Relaxed);
        }
    }

    /// [`Artist::step`] with Rust's error type. After a change of the exposure alone, the picture shown is copied to
    /// the canvas again before a finer one is drawn.
    async fn try_step(&self) -> Result<Option<String>, WebError> {
        let next = {
            let state = self.state.borrow();
            match state.progressive.latest() {
                Some((_, level)) if state.tone_changed => Step::Tone(*level),
                _ => match state.progressive.next_level() {
                    Some(level) => Step::Draw(level),
                    None => return Ok(None),
                },
            }
        };
        match next {
            Step::Draw(level) => self.draw_level(level).await,
            Step::Tone(level) => self.show_again(level).await,
        }
    }

    /// Shows the latest picture, of this level, at the current exposure.
    async fn show_again(&self, level: Level) -> Result<Option<String>, WebError> {
        let start = Instant::now();
        let (shown, is_finest) = {
            let state = self.state.borrow();
            let supersample = state.progressive.job().map_or(1, |job| job.view.supersample);
            (state.shown.clone(), level.is_finest(supersample))
        };
        let Some(shown) = shown else { return Ok(None) };
        self.show(&shown).await?;
        // Nothing was evaluated.
        Ok(Some(report(&shown, level, is_finest, start, &FrameReport::default())))
    }

    /// Draws at a level, shows the picture, and returns its report. `None` if scene, method or job is missing, or if
    /// the drawing was a refinement and is out of date.
    async fn draw_level(&self, level: Level) -> Result<Option<String>, WebError> {
        let start = Instant::now();
        let frame = self.state.borrow_mut().progressive.frame(&self.gpu, level)?;
        let Some(frame) = frame else { return Ok(None) };
        self.refining.set(frame.refines);
        let drawn = frame.draw_async(&self.gpu, &self.renderer).await;
        self.refining.set(false);
        // Cleared whether or not it stopped the drawing: left set, it would stop the next drawing, map or query.
        self.stop.store(false, Relaxed);
        let drawn = match drawn {
            Err(GpuError::Stopped) => return Ok(None),
            drawn => drawn?,
        };
        // The scene, method or view may have changed during the `await`. A picture that refines none is shown
        // nevertheless.
        if frame.refines && !self.state.borrow().progressive.is_current(&frame) {
            return Ok(None);
        }
        self.show(&frame.target).await?;
        let mut state = self.state.borrow_mut();
        state.progressive.finish(&frame, start.elapsed().as_secs_f64() * 1e3);
        state.shown = Some(Arc::clone(&frame.target));
        Ok(Some(report(&frame.target, level, frame.is_finest, start, &drawn)))
    }

    /// Puts a picture on the canvas and waits until the GPU is done.
    async fn show(&self, target: &Target) -> Result<(), WebError> {
        let stops = {
            let mut state = self.state.borrow_mut();
            state.tone_changed = false;
            state.exposure_stops
        };
        if let Some(screen) = &self.screen {
            screen.show(&self.gpu, target, stops)?;
        }
        Ok(self.gpu.idle_async().await?)
    }

    /// Pixels of the picture shown, linear sRGB, rows from the top.
    async fn picture(&self) -> Result<Vec<[f32; 3]>, WebError> {
        let shown = self.state.borrow().shown.clone();
        match shown {
            Some(target) => Ok(target.read_picture_async(&self.gpu).await?),
            None => Err(WebError::Internal("no picture is drawn yet".to_owned())),
        }
    }

    /// [`Artist::query`] with Rust's error type.
    async fn try_query(&self, x: f64, y: f64) -> Result<Option<String>, WebError> {
        let (shown, shader) = {
            let state = self.state.borrow();
            (state.shown.clone(), state.progressive.shader().cloned())
        };
        let (Some(target), Some(shader)) = (shown, shader) else { return Ok(None) };
        let Some((column, row)) = target.pixel_at(x, y) else { return Ok(None) };
        let query = target.read_query_async(&self.gpu, column, row).await?;
        // `SKIN` is the mesh. Pixels of the ground and of the background show no relief.
        if query.kind != Query::SKIN {
            return Ok(None);
        }
        let answers = shader.evaluate_async(&self.gpu, &[Query::new(query.wi, query.wo)]).await?;
        // Opposite directions have q = 0; the smallest positive length then makes the half vector 0, too.
        let q: [f32; 3] = std::array::from_fn(|axis| query.wi[axis] + query.wo[axis]);
        let length = q.iter().map(|component| component * component).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
        Ok(Some(
            json!({
                "wi": query.wi,
                "wo": query.wo,
                "half": q.map(|component| component / length),
                "q": q,
                "lit": query.lit != 0,
                "rgb": answers.reflectances.first(),
            })
            .to_string(),
        ))
    }

    /// [`Artist::map`] with Rust's error type.
    async fn try_map(&self, wi: [f32; 3], side: usize) -> Result<Vec<f32>, WebError> {
        let shader = self.state.borrow().progressive.shader().cloned();
        let Some(shader) = shader else { return Err(WebError::Internal("there is no method yet".to_owned())) };
        // Pixels outside the disc are `None`.
        let pixels = shader.brdf_map_async(&self.gpu, wi, side).await?;
        Ok(pixels.into_iter().flat_map(Option::unwrap_or_default).collect())
    }
}

/// The work of one call of [`Artist::step`].
enum Step {
    /// Draws and shows a picture of this level.
    Draw(Level),
    /// Shows the latest picture, of this level, at another exposure.
    Tone(Level),
}

/// Report of a picture as JSON: size in pixels, rays along each side of a pixel, milliseconds since `start`. `drawn`
/// adds the numbers of evaluations of the method and of submissions to the GPU.
fn report(target: &Target, level: Level, is_finest: bool, start: Instant, drawn: &FrameReport) -> String {
    let (width, height) = target.size();
    json!({
        "width": width,
        "height": height,
        "supersample": level.supersample,
        "finest": is_finest,
        "ms": start.elapsed().as_secs_f64() * 1e3,
        "answered": drawn.answered,
        "submissions": drawn.submissions,
    })
    .to_string()
}
