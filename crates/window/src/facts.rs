use super::artist::Picture;
use super::widgets::row;
use eframe::egui::Ui;

/// Facts about the machine, the method and the last picture.
#[derive(Default)]
pub(crate) struct Facts {
    pub adapter: String,
    pub software: bool,
    pub timestamps: bool,
    pub method: Option<MethodFacts>,
    pub picture: Option<PictureFacts>,
}

/// The method that draws.
pub(crate) struct MethodFacts {
    pub name: &'static str,
    pub build_seconds: f64,
    pub bytes: u64,
}

/// Size, time and work of a picture.
pub(crate) struct PictureFacts {
    size: (u32, u32),
    ms: f64,
    /// Whether no finer picture follows.
    finest: bool,
    answered: u64,
    stages: [(&'static str, f64); 4],
}

impl From<&Picture> for PictureFacts {
    fn from(picture: &Picture) -> Self {
        let times = picture.report.gpu_ms;
        Self {
            size: picture.target.size(),
            ms: picture.ms,
            finest: picture.finest,
            answered: picture.report.answered,
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
    /// Lines of text.
    pub(crate) fn show(&self, ui: &mut Ui) {
        let line = |ui: &mut Ui, label: &str, text: String| {
            row(ui, label, |ui| {
                ui.label(text);
            });
        };
        if let Some(picture) = &self.picture {
            let (width, height) = picture.size;
            line(ui, "Picture", format!("{width} × {height}{}", if picture.finest { "" } else { ", draft" }));
            line(ui, "Lit samples", picture.answered.to_string());
            line(ui, "Frame", format!("{:.1} ms, {:.1} fps", picture.ms, 1e3 / picture.ms.max(1e-3)));
            let stages = picture.stages.map(|(stage, ms)| format!("{stage} {ms:.1}")).join(", ");
            let clock = if self.timestamps { "GPU clock" } else { "wall clock" };
            ui.weak(format!("{stages} ms by the {clock}"));
        }
        if let Some(method) = &self.method {
            line(ui, "Method", format!("{}, {:.2} MB", method.name, method.bytes as f64 * 1e-6));
            line(ui, "  built in", format!("{:.2} s", method.build_seconds));
        }
        ui.weak(format!("{}{}", self.adapter, if self.software { ", software" } else { "" }));
    }
}
