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

/// Width of the panel in points.
const PANEL_POINTS: f32 = 264.0;
/// Interval at which a note that counts seconds is repainted.
const TICK: Duration = Duration::from_millis(250);

/// Makes the mesh and its pigment, which takes seconds.
pub(crate) type SceneMaker = Box<dyn FnOnce() -> Result<(Mesh, PigmentTexture), String> + Send>;

/// The window: its controls, the drawer behind it, and the results shown.
pub(crate) struct App {
    settings: Settings,
    at_start: Settings,
    form: SurfaceForm,
    window: RenderState,
    drawer: Drawer,
    tone: ToneMapper,
    /// The picture shown, and the stops it was shown at.
    shown: Option<(Arc<Target>, f64)>,
    texture: Option<TextureId>,
    map: Option<(BrdfMap, TextureHandle)>,
    scene: Option<Task<(Mesh, PigmentTexture)>>,
    building: Option<(Recipe, Task<Built>)>,
    /// The recipe of the last build.
    tried: Option<Recipe>,
    /// The last job of the drawer.
    job: Option<Job>,
    cursor: Option<[f32; 2]>,
    facts: Facts,
    screenshot: PathBuf,
    saved: Option<String>,
    error: Option<String>,
}

impl App {
    /// The window's contents; mesh and method are started on other threads.
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
            software: gpu.is_software(),
            timestamps: gpu.has_timestamps(),
            ..Default::default()
        };
        Self {
            at_start: settings.clone(),
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

    /// Takes the results of other threads, and starts the builds that the settings need.
    fn collect(&mut self, ctx: &egui::Context) {
        if let Some(outcome) = self.scene.as_ref().and_then(Task::poll) {
            self.scene = None;
            match outcome {
                Ok((mesh, pigment)) => self.drawer.set_scene(mesh, pigment),
                Err(error) => self.error = Some(error),
            }
        }
        if let Some((recipe, task)) = &self.building
            && let Some(outcome) = task.poll()
        {
            let name = recipe.name();
            self.building = None;
            match outcome {
                Ok(Built { method, seconds }) => {
                    self.facts.method = Some(MethodFacts { name, build_seconds: seconds, bytes: 0 });
                    self.drawer.set_method(method);
                }
                Err(error) => self.error = Some(error),
            }
        }
        let recipe = self.settings.recipe();
        if self.building.is_none() && self.tried.as_ref() != Some(&recipe) {
            self.error = None;
            self.tried = Some(recipe.clone());
            let work = recipe.clone();
            self.building = Some((recipe, Task::start(ctx, move || work.build())));
        }
        if self.building.is_some() || self.scene.is_some() {
            ctx.request_repaint_after(TICK);
        }
        while let Some(event) = self.drawer.next_event() {
            self.handle(event, ctx);
        }
    }

    /// Shows an event of the drawer.
    fn handle(&mut self, event: Event, ctx: &egui::Context) {
        match event {
            Event::Uploaded(bytes) => {
                if let Some(method) = &mut self.facts.method {
                    method.bytes = bytes;
                }
            }
            Event::Picture(picture) => {
                self.facts.picture = Some(PictureFacts::from(&picture));
                // `picture` shows it at the stops of the settings.
                self.shown = Some((picture.target, f64::NAN));
            }
            Event::Map(Some(map)) => {
                let texture = ctx.load_texture("BRDF map", map.image.clone(), egui::TextureOptions::NEAREST);
                self.map = Some((map, texture));
            }
            Event::Map(None) => self.map = None,
            Event::Saved(path) => {
                self.saved = Some(format!("{} and .exr written", path.display()));
            }
            Event::Failed(error) => self.error = Some(error),
        }
    }

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

    /// The work that the picture waits for.
    fn note(&self) -> Option<String> {
        if let Some((recipe, task)) = &self.building {
            return Some(format!("building {} … {:.1} s", recipe.name(), task.seconds()));
        }
        self.scene.as_ref().map(|task| format!("making the mesh … {:.1} s", task.seconds()))
    }

    fn picture(&mut self, ui: &mut egui::Ui) {
        if let Some((target, at)) = &mut self.shown
            && *at != self.settings.exposure
        {
            *at = self.settings.exposure;
            self.texture = Some(self.tone.show(&self.window, target, *at));
        }
        let note = self.error.clone().or_else(|| self.note());
        let (response, seen) = picture_view::show(ui, &mut self.settings, self.texture, note.as_deref());
        if let Some((map, texture)) = &self.map {
            picture_view::show_map(ui, response.rect, map, texture.id());
        }
        self.order(seen.size);
        // During a drag the map stays at its point.
        if !response.dragged() && seen.cursor != self.cursor {
            self.cursor = seen.cursor;
            if self.cursor.is_none() {
                self.map = None;
            }
            self.drawer.set_cursor(self.cursor);
        }
    }

    /// Orders the picture of the settings where it is not ordered yet.
    fn order(&mut self, pixels: (u32, u32)) {
        let scaled = |side: u32| ((side as f32 * self.settings.scale).round() as u32).max(1);
        let view = match self.settings.view() {
            Ok(view) => view,
            Err(error) => {
                self.error = Some(error.to_string());
                return;
            }
        };
        let job = Job { view, optics: self.settings.optics(), size: (scaled(pixels.0), scaled(pixels.1)) };
        if self.job.as_ref() != Some(&job) {
            self.drawer.set_job(job.clone());
            self.job = Some(job);
        }
    }

    fn save(&mut self) {
        let png = screenshot::free_name(&self.screenshot);
        self.saved = Some(format!("{} follows when the picture is done", png.display()));
        self.drawer.save(Shot { png, exposure: self.settings.exposure });
    }

    fn reset(&mut self) {
        self.settings.orbit = self.at_start.orbit;
        self.settings.sun = self.at_start.sun;
    }

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
