//! The window's contents: controls on the left, the picture on the right. Work that takes long is done by other threads
//! (task.rs, drawer.rs), whose results each repaint collects.
//!
//! A *method* evaluates the reflectance of the relief on the GPU. A *recipe* is all inputs of building a method
//! (settings.rs). A *job* is all inputs of a picture except scene and method ([`Job`]). A *map* is the BRDF map of
//! the surface under the cursor (hemisphere.rs). A *point* is egui's unit of length, a pixel of a screen that is not
//! scaled.

use super::artist::Shot;
use super::drawer::{Drawer, Event};
use super::facts::{Facts, MethodFacts, PictureFacts};
use super::hemisphere::BrdfMap;
use super::settings::{Built, Recipe, Settings};
use super::surface_form::SurfaceForm;
use super::task::Task;
use super::tone::ToneMapper;
use super::{controls, picture_view, screenshot};
use eframe::egui::{self, Key, TextureHandle, TextureId, ViewportCommand};
use eframe::egui_wgpu::RenderState;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use sunbeam_realtime::progressive::Job;
use sunbeam_realtime::snake::PigmentTexture;
use sunbeam_realtime::{Gpu, Mesh, Target};

/// Width of the panel with the controls, in points.
const PANEL_POINTS: f32 = 264.0;
/// Interval of repaints while a note counts seconds. Shorter ones count more smoothly and take more time.
const NOTE_INTERVAL: Duration = Duration::from_millis(250);

/// Function that makes the mesh and its pigment, which takes seconds.
pub(crate) type SceneMaker = Box<dyn FnOnce() -> Result<(Mesh, PigmentTexture), String> + Send>;

/// The last picture from the drawer.
struct Shown {
    /// The picture with its full range of radiance.
    target: Arc<Target>,
    /// Exposure in stops at which [`App::texture`] shows the picture; `None` before the first time.
    stops: Option<f64>,
}

/// The window: its controls, the drawer behind it, and the results shown.
pub(crate) struct App {
    settings: Settings,
    /// Settings to which [`App::reset`] returns camera and sun.
    settings_at_start: Settings,
    /// The controls of the relief's source, a preset or a file.
    form: SurfaceForm,
    /// GPU device, queue and textures of egui.
    window: RenderState,
    /// Thread that draws pictures and maps.
    drawer: Drawer,
    /// Tone mapping of the picture into [`App::texture`].
    tone: ToneMapper,
    shown: Option<Shown>,
    /// The tone-mapped picture; `None` before the first picture.
    texture: Option<TextureId>,
    /// The BRDF map at the cursor with its texture, if there is one.
    map: Option<(BrdfMap, TextureHandle)>,
    /// The mesh while it is being made.
    scene: Option<Task<(Mesh, PigmentTexture)>>,
    /// The method while it is being built.
    building: Option<(Recipe, Task<Built>)>,
    /// The recipe of the last build, successful or not. A build that has failed is not repeated.
    tried: Option<Recipe>,
    /// The job that was last sent to the drawer.
    job: Option<Job>,
    /// Position in the picture whose map was ordered last, each coordinate in [0, 1) from the upper left. `None` if no
    /// map was ordered.
    cursor: Option<[f32; 2]>,
    /// The facts at the bottom of the panel.
    facts: Facts,
    /// File name of the first screenshot.
    screenshot: PathBuf,
    /// Message about the last screenshot.
    saved: Option<String>,
    /// Message of the last error, of any kind, until the next build begins.
    error: Option<String>,
}

impl App {
    /// The window's contents. Starts the threads that make the mesh and draw. `screenshot` is the file name of the
    /// first screenshot.
    pub(crate) fn new(
        ctx: &egui::Context,
        window: RenderState,
        settings: Settings,
        make_scene: SceneMaker,
        screenshot: PathBuf,
    ) -> Self {
        let gpu = Arc::new(Gpu::adopt(window.device.clone(), window.queue.clone()));
        let facts = Facts {
            adapter: gpu.adapter(),
            is_software: gpu.is_software(),
            has_timestamps: gpu.has_timestamps(),
            ..Default::default()
        };
        Self {
            settings_at_start: settings.clone(),
            form: SurfaceForm::from(&settings.surface),
            settings,
            drawer: Drawer::start(gpu, ctx),
            tone: ToneMapper::new(&window.device),
            window,
            shown: None,
            texture: None,
            map: None,
            scene: Some(Task::start(ctx, make_scene)),
            building: None,
            tried: None,
            job: None,
            cursor: None,
            facts,
            screenshot,
            saved: None,
            error: None,
        }
    }

    /// Takes the results of other threads. Starts to build the method of the settings, if its recipe is not that of the
    /// last build and no build is under way.
    fn collect(&mut self, ctx: &egui::Context) {
        self.collect_scene();
        self.collect_method();
        let recipe = self.settings.recipe();
        if self.building.is_none() && self.tried.as_ref() != Some(&recipe) {
            self.error = None;
            self.tried = Some(recipe.clone());
            let to_build = recipe.clone();
            self.building = Some((recipe, Task::start(ctx, move || to_build.build())));
        }
        if self.building.is_some() || self.scene.is_some() {
            ctx.request_repaint_after(NOTE_INTERVAL);
        }
        while let Some(event) = self.drawer.next_event() {
            self.handle(event, ctx);
        }
    }

    /// Hands the mesh to the drawer once it is made.
    fn collect_scene(&mut self) {
        if let Some(outcome) = self.scene.as_ref().and_then(Task::poll) {
            self.scene = None;
            match outcome {
                Ok((mesh, pigment)) => self.drawer.set_scene(mesh, pigment),
                Err(error) => self.error = Some(error),
            }
        }
    }

    /// Hands the method to the drawer once it is built.
    fn collect_method(&mut self) {
        if let Some((recipe, task)) = &self.building
            && let Some(outcome) = task.poll()
        {
            let name = recipe.name();
            self.building = None;
            match outcome {
                Ok(Built { method, seconds }) => {
                    self.facts.method = Some(MethodFacts { name, build_seconds: seconds, bytes: None });
                    self.drawer.set_method(method);
                }
                Err(error) => self.error = Some(error),
            }
        }
    }

    /// Stores the result of an event of the drawer.
    fn handle(&mut self, event: Event, ctx: &egui::Context) {
        match event {
            Event::Uploaded(bytes) => {
                if let Some(method) = &mut self.facts.method {
                    method.bytes = Some(bytes);
                }
            }
            Event::Picture(picture) => {
                self.facts.picture = Some(PictureFacts::from(&picture));
                self.shown = Some(Shown { target: picture.target, stops: None });
            }
            // A map may arrive after the cursor has left the picture.
            Event::Map(Some(map)) if self.cursor.is_some() => {
                let texture = ctx.load_texture("BRDF map", map.image.clone(), egui::TextureOptions::NEAREST);
                self.map = Some((map, texture));
            }
            Event::Map(_) => self.map = None,
            Event::Saved(path) => {
                self.saved = Some(format!("{} and .exr written", path.display()));
            }
            Event::Failed(error) => self.error = Some(error),
        }
    }

    /// The panel with the controls, the buttons and the facts.
    fn panel(&mut self, ui: &mut egui::Ui) {
        egui::ScrollArea::vertical().show(ui, |ui| {
            controls::show(ui, &mut self.settings, &mut self.form);
            ui.separator();
            ui.horizontal(|ui| {
                if ui.button("Screenshot (S)").clicked() {
                    self.save();
                }
                if ui.button("Reset view (R)").clicked() {
                    self.reset();
                }
            });
            if let Some(saved) = &self.saved {
                ui.weak(saved);
            }
            ui.separator();
            self.facts.show(ui);
        });
    }

    /// A line about the work that the picture waits for, if any.
    fn note(&self) -> Option<String> {
        if let Some((recipe, task)) = &self.building {
            return Some(format!("building {} … {:.1} s", recipe.name(), task.seconds()));
        }
        self.scene.as_ref().map(|task| format!("making the mesh … {:.1} s", task.seconds()))
    }

    /// Shows the picture with the BRDF map, and orders the picture of the settings and the map at the cursor. Drags
    /// and the wheel over the picture change camera and sun in the settings.
    fn picture(&mut self, ui: &mut egui::Ui) {
        let stops = self.settings.exposure;
        // A new picture, or another exposure, is tone-mapped again.
        if let Some(shown) = &mut self.shown
            && shown.stops != Some(stops)
        {
            shown.stops = Some(stops);
            self.texture = Some(self.tone.show(&self.window, &shown.target, stops));
        }
        let note = self.error.clone().or_else(|| self.note());
        let (response, area) = picture_view::show(ui, &mut self.settings, self.texture, note.as_deref());
        if let Some((map, texture)) = &self.map {
            picture_view::show_map(ui, response.rect, map, texture.id());
        }
        self.order(area.size);
        // During a drag, the map stays that of the point where the drag began.
        if !response.dragged() && area.cursor != self.cursor {
            self.cursor = area.cursor;
            if self.cursor.is_none() {
                self.map = None;
            }
            self.drawer.set_cursor(self.cursor);
        }
    }

    /// Orders the picture of the settings if it is not ordered yet. `screen_size` is the width and height of the
    /// picture's area in pixels of the screen. The picture has [`Settings::scale`] times as many along each side.
    fn order(&mut self, screen_size: (u32, u32)) {
        let scaled = |side: u32| ((side as f32 * self.settings.scale).round() as u32).max(1);
        let view = match self.settings.view() {
            Ok(view) => view,
            Err(error) => {
                self.error = Some(error.to_string());
                return;
            }
        };
        let size = (scaled(screen_size.0), scaled(screen_size.1));
        let job = Job { view, optics: self.settings.optics(), size };
        if self.job.as_ref() != Some(&job) {
            self.drawer.set_job(job.clone());
            self.job = Some(job);
        }
    }

    /// Orders a screenshot of the finest picture, after the previews.
    fn save(&mut self) {
        let png = screenshot::free_name(&self.screenshot);
        self.saved = Some(format!("{} follows when the picture is done", png.display()));
        self.drawer.save(Shot { png, exposure: self.settings.exposure });
    }

    /// Returns camera and sun to their positions at the start.
    fn reset(&mut self) {
        self.settings.orbit = self.settings_at_start.orbit;
        self.settings.sun = self.settings_at_start.sun;
    }

    /// Handles keys, unless a text field has the focus.
    fn keys(&mut self, ctx: &egui::Context) {
        if ctx.text_edit_focused() {
            return;
        }
        let pressed = |key| ctx.input(|input| input.key_pressed(key));
        if pressed(Key::S) {
            self.save();
        }
        if pressed(Key::R) {
            self.reset();
        }
        if pressed(Key::Q) && ctx.input(|input| input.modifiers.command) {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.collect(&ctx);
        self.keys(&ctx);
        egui::Panel::left("controls").resizable(false).exact_size(PANEL_POINTS).show(ui, |ui| self.panel(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
    }
}
