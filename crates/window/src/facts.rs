//! Facts about the adapter, the method and the picture, at the bottom of the panel.

use super::artist::Picture;
use super::widgets::row;
use eframe::egui::Ui;

/// Facts about the machine, the method and the last picture.
#[derive(Default)]
pub(crate) struct Facts {
    /// Name of the adapter.
    pub adapter: String,
    /// Whether the adapter renders on the processor.
    pub is_software: bool,
    /// Whether the times of stages come from timestamps of the GPU, instead of a wall clock.
    pub has_timestamps: bool,
    /// `None` before the first method.
    pub method: Option<MethodFacts>,
    /// `None` before the first picture.
    pub picture: Option<PictureFacts>,
}

/// The method that was built last. Until it is uploaded, pictures are drawn with the previous method.
pub(crate) struct MethodFacts {
    /// Name of the method.
    pub name: &'static str,
    /// Time of building it in seconds.
    pub build_seconds: f64,
    /// Size of its data on the GPU in bytes; `None` until it is uploaded.
    pub bytes: Option<u64>,
}

/// Size, time and work of a picture.
pub(crate) struct PictureFacts {
    /// Width and height in pixels.
    size: (u32, u32),
    /// Wall-clock time of drawing in ms.
    frame_ms: f64,
    /// Whether no finer picture follows.
    is_finest: bool,
    /// Number of rays that met sunlit points of the mesh. The method is evaluated once for each such ray.
    lit_samples: u64,
    /// Name and time in ms of each stage of drawing ([`StageTimes`](sunbeam_realtime::StageTimes)).
    stages: [(&'static str, f64); 4],
}

impl From<&Picture> for PictureFacts {
    fn from(picture: &Picture) -> Self {
        let times = picture.report.gpu_ms;
        Self {
            size: picture.target.size(),
            frame_ms: picture.ms,
            is_finest: picture.is_finest,
            lit_samples: picture.report.answered,
            stages: [
                ("raster", times.raster),
                ("locate", times.locate),
                ("shade", times.shade),
                ("resolve", times.resolve),
            ],
        }
    }
}

impl Facts {
    /// Shows the facts as lines of text.
    pub(crate) fn show(&self, ui: &mut Ui) {
        let line = |ui: &mut Ui, label: &str, text: String| {
            row(ui, label, |ui| {
                ui.label(text);
            });
        };
        if let Some(picture) = &self.picture {
            let (width, height) = picture.size;
            line(ui, "Picture", format!("{width} × {height}{}", if picture.is_finest { "" } else { ", draft" }));
            line(ui, "Lit samples", picture.lit_samples.to_string());
            // The time counts as at least a microsecond, so that the rate is finite.
            line(ui, "Frame", format!("{:.1} ms, {:.1} fps", picture.frame_ms, 1e3 / picture.frame_ms.max(1e-3)));
            let stages = picture.stages.map(|(stage, ms)| format!("{stage} {ms:.1}")).join(", ");
            let clock = if self.has_timestamps { "GPU clock" } else { "wall clock" };
            ui.weak(format!("{stages} ms by the {clock}"));
        }
        if let Some(method) = &self.method {
            let size = method.bytes.map_or(String::new(), |bytes| format!(", {:.2} MB", bytes as f64 * 1e-6));
            line(ui, "Method", format!("{}{size}", method.name));
            line(ui, "  built in", format!("{:.2} s", method.build_seconds));
        }
        ui.weak(format!("{}{}", self.adapter, if self.is_software { ", software" } else { "" }));
    }
}
