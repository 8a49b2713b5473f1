//! What draws.

use super::quick::read;
use super::report::thrown;
use crate::{MethodData, WebError, image};
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use sunbeam::scattering::map_direction;
use sunbeam_realtime::levels::{self, Level, Pace};
use sunbeam_realtime::{
    FrameReport, Gpu, GpuError, Optics, Query, Renderer, Scene, SceneData, Shader, Target, TonePass, View,
};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

/// Targets that are kept for next pictures: while something is dragged, two sizes in turns.
const TARGETS_KEPT: usize = 3;

/// A first picture after a change should not take longer than this: with the messages about it, two frames of a screen.
const PREVIEW_MS: f64 = 25.0;

/// What is to be seen.
#[derive(Clone, Debug, PartialEq)]
struct Job {
    view: View,
    optics: Optics,
    size: (u32, u32),
}

/// Where pictures are shown.
struct Screen {
    surface: wgpu::Surface<'static>,
    config: RefCell<wgpu::SurfaceConfiguration>,
    tone: TonePass,
}

/// What changes from call to call. No borrow of it is held while anything is awaited.
#[derive(Default)]
struct State {
    scene: Option<Rc<Scene>>,
    /// What coarse pictures show, and all of them until there is a scene.
    draft: Option<Rc<Scene>>,
    shader: Option<Rc<Shader>>,
    job: Option<Job>,
    stops: f64,
    /// How fine the picture of the job is.
    latest: Option<Level>,
    /// What is on the canvas, and whether at another exposure than the one asked for.
    shown: Option<Rc<Target>>,
    tone_changed: bool,
    pace: Pace,
    targets: Vec<Rc<Target>>,
}

impl State {
    /// What a picture of this level shows.
    fn scene_at(&self, level: Level) -> Option<&Rc<Scene>> {
        let (first, second) = if level.divisor > 1 { (&self.draft, &self.scene) } else { (&self.scene, &self.draft) };
        first.as_ref().or(second.as_ref())
    }
}

/// Draws with WebGPU on a canvas.
#[wasm_bindgen]
pub struct Artist {
    gpu: Gpu,
    screen: Option<Screen>,
    renderer: Renderer,
    state: RefCell<State>,
    /// Counts jobs, so that who waited sees whether there is another.
    jobs: Cell<u32>,
    /// Whether a picture that only refines is being drawn.
    refining: Cell<bool>,
    stop: Arc<AtomicBool>,
}

thread_local! {
    static LOST: RefCell<Option<js_sys::Function>> = const { RefCell::new(None) };
}

#[wasm_bindgen]
impl Artist {
    /// Opens WebGPU for a canvas, or for none.
    pub async fn open(canvas: Option<web_sys::OffscreenCanvas>) -> Result<Artist, JsValue> {
        Self::opened(canvas).await.map_err(thrown)
    }

    /// What draws, as JSON.
    pub fn adapter(&self) -> String {
        json!({ "name": self.gpu.adapter(), "backend": self.gpu.backend(), "software": self.gpu.is_software() })
            .to_string()
    }

    /// Has a function called with a line of text when the device is lost.
    pub fn on_lost(&self, callback: js_sys::Function) {
        LOST.with_borrow_mut(|listener| *listener = Some(callback));
    }

    /// Uploads what `make_scene` made. A draft comes before the scene that it is of, and instead of the one before.
    pub async fn set_scene(&self, bytes: Vec<u8>, is_draft: bool) -> Result<(), JsValue> {
        let upload = if is_draft { Scene::draft } else { Scene::of };
        let scene = SceneData::from_bytes(bytes).and_then(|data| upload(&self.gpu, &data)).map_err(thrown)?;
        let scene = Some(Rc::new(scene));
        {
            let mut state = self.state.borrow_mut();
            if is_draft {
                (state.draft, state.scene) = (scene, None);
            } else {
                state.scene = scene;
            }
        }
        self.start_over();
        Ok(())
    }

    /// Compiles and uploads a method; its bytes on the GPU.
    pub async fn set_method(&self, bytes: Vec<u8>) -> Result<f64, JsValue> {
        let data = MethodData::from_bytes(bytes).map_err(thrown)?;
        let optics = self.state.borrow().job.as_ref().map_or_else(Optics::default, |job| job.optics);
        let shader = Shader::of_async(&self.gpu, &data.shader(), data.answers(), &optics).await;
        let mut shader = shader.map_err(thrown)?;
        shader.stop_when(Arc::clone(&self.stop));
        if let Some(job) = &self.state.borrow().job {
            shader.set_optics(&self.gpu, &job.optics);
        }
        let taken = shader.bytes() as f64;
        {
            let mut state = self.state.borrow_mut();
            state.shader = Some(Rc::new(shader));
            state.pace = Pace::default();
        }
        self.start_over();
        Ok(taken)
    }

    /// Says what is to be seen from now on.
    pub fn set_view(&self, json: &str, width: u32, height: u32, supersample: u32) -> Result<(), JsValue> {
        let settings = read(json)?;
        let view = settings.view(supersample).map_err(thrown)?;
        let job = Job { view, optics: settings.optics(), size: (width.max(1), height.max(1)) };
        let is_new = {
            let mut state = self.state.borrow_mut();
            state.tone_changed |= state.stops != settings.exposure;
            state.stops = settings.exposure;
            if let Some(shader) = &state.shader {
                shader.set_optics(&self.gpu, &job.optics);
            }
            let is_new = state.job.as_ref() != Some(&job);
            state.job = Some(job);
            is_new
        };
        if is_new {
            self.start_over();
        }
        Ok(())
    }

    /// Draws the next finer picture and shows it; its report, or nothing.
    pub async fn step(&self) -> Result<Option<String>, JsValue> {
        self.stepped().await.map_err(thrown)
    }

    /// Draws the finest picture and shows it; its report.
    pub async fn draw(&self) -> Result<String, JsValue> {
        let missing = || thrown(WebError::Internal("there is no scene, method or view yet".to_owned()));
        let finest =
            self.state.borrow().job.as_ref().map(|job| Level { divisor: 1, supersample: job.view.supersample });
        self.drawn(finest.ok_or_else(missing)?).await.map_err(thrown)?.ok_or_else(missing)
    }

    /// Width and height of the picture shown; zeros before there is one.
    pub fn size(&self) -> Vec<u32> {
        let (width, height) = self.state.borrow().shown.as_ref().map_or((0, 0), |target| target.size());
        vec![width, height]
    }

    /// The picture shown, linear sRGB.
    pub async fn pixels(&self) -> Result<Vec<f32>, JsValue> {
        Ok(self.picture().await.map_err(thrown)?.as_flattened().to_vec())
    }

    /// The picture shown as a PNG.
    pub async fn png(&self) -> Result<Vec<u8>, JsValue> {
        let picture = self.picture().await.map_err(thrown)?;
        let (size, stops) = {
            let state = self.state.borrow();
            (state.shown.as_ref().map_or((0, 0), |target| target.size()), state.stops)
        };
        image::picture_png(&picture, size, stops).map_err(thrown)
    }

    /// What a place of the picture, 0 to 1 from the upper left, sees of the skin.
    pub async fn query(&self, x: f64, y: f64) -> Result<Option<String>, JsValue> {
        self.queried(x, y).await.map_err(thrown)
    }

    /// Linear sRGB over the hemisphere for light from `wi`.
    pub async fn map(&self, wi: &[f32], side: usize) -> Result<Vec<f32>, JsValue> {
        let refused = || thrown(WebError::Internal("a direction is three numbers".to_owned()));
        let wi: [f32; 3] = wi.try_into().map_err(|_| refused())?;
        self.mapped(wi, side).await.map_err(thrown)
    }

    /// Destroys the device.
    pub fn lose(&self) {
        self.gpu.device().destroy();
    }
}

impl Artist {
    async fn opened(canvas: Option<web_sys::OffscreenCanvas>) -> Result<Self, WebError> {
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
            let listener = LOST.with_borrow_mut(Option::take);
            if let Some(listener) = listener {
                // What a listener throws is its own affair.
                let _ = listener.call1(&JsValue::NULL, &format!("the GPU's device is lost: {reason}").into());
            }
        });
        let screen = surface.map(|surface| Screen::new(&gpu, &adapter, surface)).transpose()?;
        let renderer = Renderer::new(&gpu)?;
        Ok(Self {
            gpu,
            screen,
            renderer,
            state: RefCell::default(),
            jobs: Cell::new(0),
            refining: Cell::new(false),
            stop: Arc::default(),
        })
    }

    /// Nothing is drawn of what is wanted now.
    fn start_over(&self) {
        self.state.borrow_mut().latest = None;
        self.jobs.set(self.jobs.get().wrapping_add(1));
        if self.refining.get() {
            self.stop.store(true, Relaxed);
        }
    }

    async fn stepped(&self) -> Result<Option<String>, WebError> {
        let next = {
            let state = self.state.borrow();
            let Some(job) = &state.job else { return Ok(None) };
            if state.tone_changed && state.latest.is_some() {
                None
            } else {
                let next = levels::next(state.latest, job.size, job.view.supersample, &state.pace, PREVIEW_MS);
                let Some(level) = next else { return Ok(None) };
                Some(level)
            }
        };
        match next {
            Some(level) => self.drawn(level).await,
            None => self.toned().await,
        }
    }

    /// Shows the same picture at another exposure.
    async fn toned(&self) -> Result<Option<String>, WebError> {
        let start = Instant::now();
        let (shown, level, supersample) = {
            let state = self.state.borrow();
            let supersample = state.job.as_ref().map_or(1, |job| job.view.supersample);
            (state.shown.clone(), state.latest, supersample)
        };
        let (Some(shown), Some(level)) = (shown, level) else { return Ok(None) };
        self.show(&shown).await?;
        Ok(Some(report(&shown, level, supersample, start, &FrameReport::default())))
    }

    /// Draws at a level and shows it. Nothing where scene, method or job are missing, or where the picture only refined one that
    /// is not wanted any more.
    async fn drawn(&self, level: Level) -> Result<Option<String>, WebError> {
        let start = Instant::now();
        let (scene, shader, job, refining) = {
            let state = self.state.borrow();
            let (Some(scene), Some(shader), Some(job)) = (state.scene_at(level), &state.shader, &state.job) else {
                return Ok(None);
            };
            (Rc::clone(scene), Rc::clone(shader), job.clone(), state.latest.is_some())
        };
        let target = self.target(level.size(job.size))?;
        let view = View { supersample: level.supersample, ..job.view };
        let number = self.jobs.get();
        self.stop.store(false, Relaxed);
        self.refining.set(refining);
        let drawn = self.renderer.draw_async(&self.gpu, &scene, &shader, &target, &view).await;
        self.refining.set(false);
        let is_wanted = self.jobs.get() == number;
        let drawn = match drawn {
            Err(GpuError::Stopped) => return Ok(None),
            drawn => drawn?,
        };
        if refining && !is_wanted {
            return Ok(None);
        }
        self.show(&target).await?;
        let mut state = self.state.borrow_mut();
        state.pace.learn(level.rays(job.size), start.elapsed().as_secs_f64() * 1e3);
        state.shown = Some(Rc::clone(&target));
        if is_wanted && self.jobs.get() == number {
            state.latest = Some(level);
        }
        Ok(Some(report(&target, level, job.view.supersample, start, &drawn)))
    }

    /// A target of this size that is not shown.
    fn target(&self, size: (u32, u32)) -> Result<Rc<Target>, WebError> {
        let mut state = self.state.borrow_mut();
        let is_shown = |target: &Rc<Target>| state.shown.as_ref().is_some_and(|shown| Rc::ptr_eq(shown, target));
        let found = state.targets.iter().position(|target| target.size() == size && !is_shown(target));
        let target = match found {
            Some(index) => state.targets.remove(index),
            None => Rc::new(Target::new(&self.gpu, size.0, size.1)?),
        };
        state.targets.insert(0, Rc::clone(&target));
        state.targets.truncate(TARGETS_KEPT);
        Ok(target)
    }

    /// Puts a picture on the canvas, and waits until that is done.
    async fn show(&self, target: &Target) -> Result<(), WebError> {
        let stops = {
            let mut state = self.state.borrow_mut();
            state.tone_changed = false;
            state.stops
        };
        if let Some(screen) = &self.screen {
            screen.show(&self.gpu, target, stops)?;
        }
        Ok(self.gpu.idle_async().await?)
    }

    async fn picture(&self) -> Result<Vec<[f32; 3]>, WebError> {
        let shown = self.state.borrow().shown.clone();
        match shown {
            Some(target) => Ok(target.read_picture_async(&self.gpu).await?),
            None => Err(WebError::Internal("no picture is drawn yet".to_owned())),
        }
    }

    async fn queried(&self, x: f64, y: f64) -> Result<Option<String>, WebError> {
        let (shown, shader) = {
            let state = self.state.borrow();
            (state.shown.clone(), state.shader.clone())
        };
        let (Some(target), Some(shader)) = (shown, shader) else { return Ok(None) };
        if !((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y)) {
            return Ok(None);
        }
        let (width, height) = target.size();
        let pixel = |place: f64, count: u32| ((place * f64::from(count)) as u32).min(count - 1);
        let query = target.read_query_async(&self.gpu, pixel(x, width), pixel(y, height)).await?;
        if query.kind != Query::SKIN {
            return Ok(None);
        }
        let answers = shader.evaluate_async(&self.gpu, &[Query::new(query.wi, query.wo)]).await?;
        let q: [f32; 3] = std::array::from_fn(|c| query.wi[c] + query.wo[c]);
        let length = q.iter().map(|c| c * c).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
        Ok(Some(
            json!({
                "wi": query.wi,
                "wo": query.wo,
                "half": q.map(|c| c / length),
                "q": q,
                "lit": query.lit != 0,
                "rgb": answers.reflectances.first(),
            })
            .to_string(),
        ))
    }

    async fn mapped(&self, wi: [f32; 3], side: usize) -> Result<Vec<f32>, WebError> {
        let shader = self.state.borrow().shader.clone();
        let Some(shader) = shader else { return Err(WebError::Internal("there is no method yet".to_owned())) };
        let places: Vec<_> = (0..side * side).map(|i| map_direction(i % side, i / side, side)).collect();
        let asked: Vec<Query> = places.iter().flatten().map(|wo| Query::new(wi, wo.map(|c| c as f32))).collect();
        // Stopping is for pictures.
        self.stop.store(false, Relaxed);
        let mut answers = shader.evaluate_async(&self.gpu, &asked).await?.reflectances.into_iter();
        Ok(places.iter().flat_map(|place| place.and_then(|_| answers.next()).unwrap_or_default()).collect())
    }
}

impl Screen {
    fn new(gpu: &Gpu, adapter: &wgpu::Adapter, surface: wgpu::Surface<'static>) -> Result<Self, WebError> {
        let config = surface.get_default_config(adapter, 1, 1);
        let mut config = config.ok_or_else(|| WebError::NoWebGpu("the canvas takes no WebGPU".to_owned()))?;
        // What is shown is encoded already.
        config.format = config.format.remove_srgb_suffix();
        // The canvas is configured when there is a picture.
        config.width = 0;
        let tone = TonePass::new(gpu.device(), config.format);
        Ok(Self { surface, config: RefCell::new(config), tone })
    }

    fn show(&self, gpu: &Gpu, target: &Target, stops: f64) -> Result<(), WebError> {
        let (width, height) = target.size();
        {
            let mut config = self.config.borrow_mut();
            if (config.width, config.height) != (width, height) {
                (config.width, config.height) = (width, height);
                self.surface.configure(gpu.device(), &config);
            }
        }
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => frame,
            _ => {
                gpu.check()?;
                return Err(WebError::Gpu("the canvas gives no texture to draw on".to_owned()));
            }
        };
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        self.tone.draw(gpu.device(), gpu.queue(), target.picture(), width, &view, stops);
        gpu.queue().present(frame);
        Ok(())
    }
}

fn report(target: &Target, level: Level, supersample: u32, start: Instant, drawn: &FrameReport) -> String {
    let (width, height) = target.size();
    json!({
        "width": width,
        "height": height,
        "supersample": level.supersample,
        "finest": level.is_last(supersample),
        "ms": start.elapsed().as_secs_f64() * 1e3,
        "answered": drawn.answered,
        "submissions": drawn.submissions,
    })
    .to_string()
}
