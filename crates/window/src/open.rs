//! Opens the window, and explains why it cannot be opened.

use crate::app::{App, SceneMaker};
use crate::settings::Settings;
use eframe::egui;
use eframe::egui_wgpu::{WgpuError, WgpuSetup, WgpuSetupCreateNew};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;
use sunbeam_realtime::{AdapterChoice, Gpu, GpuError};

/// Initial state of the window.
pub(crate) struct Start {
    pub settings: Settings,
    /// Makes the mesh and its pigment, on another thread.
    pub make_scene: SceneMaker,
    /// Width and height of the window in points, egui's unit: a pixel of a screen that is not scaled.
    pub size: [f32; 2],
    /// File name of the first screenshot; later ones are numbered (screenshot.rs).
    pub screenshot: PathBuf,
    /// Accepted adapters.
    pub adapter: AdapterChoice,
}

/// Opens the window and returns when it has been closed.
///
/// # Errors
/// No display, no adapter that can draw on it, or no device.
pub(crate) fn open(start: Start) -> Result<(), Box<dyn Error>> {
    // winit, which is built for X11 alone, panics if this library is missing.
    #[cfg(target_os = "linux")]
    if xkbcommon_dl::x11::xkbcommon_x11_option().is_none() {
        return Err("libxkbcommon-x11 is missing: apt-get install libxkbcommon-x11-0 on Debian".into());
    }
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    let choice = start.adapter;
    setup.instance_descriptor.backends = wgpu::Backends::all().with_env();
    setup.native_adapter_selector = Some(Arc::new(move |adapters, surface| choose(choice, adapters, surface)));
    // The renderer draws on egui's device, which therefore gets the limits and features that the renderer needs.
    setup.device_descriptor = Arc::new(Gpu::device_descriptor);
    let mut options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_title("sunbeam").with_inner_size(start.size),
        ..Default::default()
    };
    options.wgpu_options.wgpu_setup = WgpuSetup::CreateNew(setup);
    let Start { settings, make_scene, screenshot, .. } = start;
    let make_app = move |creation: &eframe::CreationContext<'_>| {
        let window = creation.wgpu_render_state.clone().ok_or("the window has no GPU device")?;
        let app = App::new(&creation.egui_ctx, window, settings, make_scene, screenshot);
        Ok(Box::new(app) as Box<dyn eframe::App>)
    };
    eframe::run_native("sunbeam", options, Box::new(make_app)).map_err(explained)
}

/// The best accepted adapter that can draw on the window, whose surface is `surface`.
fn choose(
    choice: AdapterChoice,
    adapters: &[wgpu::Adapter],
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter, String> {
    let can_draw = |adapter: &&wgpu::Adapter| surface.is_none_or(|surface| adapter.is_surface_supported(surface));
    let fitting: Vec<wgpu::Adapter> = adapters.iter().filter(can_draw).cloned().collect();
    Gpu::choose(choice, &fitting).cloned().map_err(|error| error.to_string())
}

/// An error of eframe as the error to show, with advice where there is some.
fn explained(error: eframe::Error) -> Box<dyn Error> {
    let no_display = |error: String| {
        // winit's message begins with a position in its source: `…/file.rs:line: `.
        let reason = error.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map(|(_, reason)| reason);
        let reason = reason.unwrap_or(&error).trim_end_matches('.');
        format!("there is no display to open a window on ({reason}); set DISPLAY, or use xvfb-run").into()
    };
    match error {
        eframe::Error::WinitEventLoop(error) => no_display(error.to_string()),
        // The window cannot be created, although there is a display.
        eframe::Error::Winit(error) => error.into(),
        eframe::Error::Wgpu(WgpuError::CustomNativeAdapterSelectionError(reason)) => reason.into(),
        // Without a graphics interface there is no adapter either.
        eframe::Error::Wgpu(WgpuError::CreateSurfaceError(_)) => {
            GpuError::NoAdapter { wanted: "usable".to_owned(), found: "none".to_owned() }.into()
        }
        eframe::Error::Wgpu(error) => error.into(),
        eframe::Error::AppCreation(error) => error,
    }
}
