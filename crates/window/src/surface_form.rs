//! The controls of the relief's source: a preset or a file.

use super::widgets::{choice, number, optional, row};
use eframe::egui::{self, Ui};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use sunbeam::config::{ReliefSource, Source, SurfaceConfig};
use sunbeam::height_field::Preset;

// Ranges of controls contain the usual values. Options of the command line accept more.

/// Range of the control for periods in µm.
const PERIOD_UM: RangeInclusive<f64> = 0.2..=50.0;
/// Range of the controls for heights in µm.
const HEIGHT_UM: RangeInclusive<f64> = 0.001..=5.0;
/// Range of the control for pixel sizes in µm.
const PIXEL_UM: RangeInclusive<f64> = 1e-4..=10.0;
/// Change of a period or a height in µm per point of a drag.
const DRAG_UM: f64 = 0.005;
/// Change of a pixel size in µm per point of a drag.
const PIXEL_DRAG_UM: f64 = 0.001;

/// The choice of the relief's source. Name and scale of a file are edited here. The surface receives them together when
/// the user opens the file.
pub(crate) struct SurfaceForm {
    /// The source whose controls are shown.
    chosen: Chosen,
    /// Name of the file as typed.
    path: String,
    /// Size of a pixel of the file in µm; `None` for the size that the file contains.
    pixel_size_um: Option<f64>,
    /// Height of full scale, such as white, in µm; `None` for the height that the file contains.
    max_height_um: Option<f64>,
}

/// Kind of source that the form shows.
#[derive(Clone, Copy, PartialEq)]
enum Chosen {
    Preset(Preset),
    File,
}

impl From<&SurfaceConfig> for SurfaceForm {
    fn from(surface: &SurfaceConfig) -> Self {
        let (chosen, path) = match surface.source() {
            Source::Preset(preset) => (Chosen::Preset(preset), String::new()),
            Source::File(path) => (Chosen::File, path.display().to_string()),
        };
        Self { chosen, path, pixel_size_um: surface.pixel_size, max_height_um: surface.max_height }
    }
}

impl SurfaceForm {
    /// Shows the controls. A preset changes the surface at once; a file, when the user opens it.
    pub(crate) fn show(&mut self, ui: &mut Ui, surface: &mut SurfaceConfig) {
        let presets = Preset::ALL.map(|preset| (Chosen::Preset(preset), preset.name()));
        choice(ui, "Relief", &mut self.chosen, presets.into_iter().chain([(Chosen::File, "file…")]));
        match self.chosen {
            Chosen::Preset(preset) => {
                if surface.source() != Source::Preset(preset) {
                    surface.set_relief_source(ReliefSource { preset: Some(preset), ..ReliefSource::default() });
                }
                // Only presets that take a period and a height have defaults of them.
                if let Some((period, height)) = preset.defaults_um() {
                    dimension(ui, "Period", &mut surface.period, period, PERIOD_UM);
                    dimension(ui, "Height", &mut surface.height, height, HEIGHT_UM);
                }
            }
            Chosen::File => self.file(ui, surface),
        }
    }

    /// The controls for a file.
    fn file(&mut self, ui: &mut Ui, surface: &mut SurfaceConfig) {
        // The enter key in the text field, or the button, opens the file.
        let mut open = false;
        row(ui, "File", |ui| {
            let edit = egui::TextEdit::singleline(&mut self.path).hint_text("skin.gsf").desired_width(f32::INFINITY);
            open = ui.add(edit).lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        });
        // 0.065 and 0.4 µm appear when the numbers are switched on. They are examples, not read from the file.
        optional(ui, "Pixel size", &mut self.pixel_size_um, 0.065, PIXEL_UM, PIXEL_DRAG_UM, " µm");
        optional(ui, "Max height", &mut self.max_height_um, 0.4, HEIGHT_UM, DRAG_UM, " µm");
        row(ui, "", |ui| open |= ui.button("Open").clicked());
        if open && !self.path.trim().is_empty() {
            surface.set_relief_source(self.file_source(surface));
        }
    }

    /// The file that the form shows. If the surface has this file already, parameters without a control are kept, such
    /// as the channel.
    fn file_source(&self, surface: &SurfaceConfig) -> ReliefSource {
        let filename = Some(PathBuf::from(self.path.trim()));
        let others = if surface.filename == filename { surface.relief_source() } else { ReliefSource::default() };
        ReliefSource { filename, pixel_size: self.pixel_size_um, max_height: self.max_height_um, ..others }
    }
}

/// The control of a length of a preset in µm. A `value` of `None` shows the default, and stays `None` until the user
/// changes the number.
fn dimension(ui: &mut Ui, label: &str, value: &mut Option<f64>, default: f64, range: RangeInclusive<f64>) {
    let mut shown = value.unwrap_or(default);
    number(ui, label, &mut shown, range, DRAG_UM, " µm");
    if shown != value.unwrap_or(default) {
        *value = Some(shown);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form_shows_the_source_of_the_surface() {
        let file = SurfaceConfig { filename: Some("a.gsf".into()), pixel_size: Some(0.1), ..Default::default() };
        assert!(SurfaceForm::from(&file).chosen == Chosen::File);
        let preset = SurfaceConfig { preset: Some(Preset::Cd), ..Default::default() };
        assert!(SurfaceForm::from(&preset).chosen == Chosen::Preset(Preset::Cd));
    }

    #[test]
    fn opening_a_file_again_keeps_its_channel() {
        let file = SurfaceConfig { filename: Some("a.gsf".into()), channel: Some("2".into()), ..Default::default() };
        let form = SurfaceForm { pixel_size_um: Some(0.2), ..SurfaceForm::from(&file) };
        assert_eq!(form.file_source(&file), ReliefSource { pixel_size: Some(0.2), ..file.relief_source() });
        let other = SurfaceForm { path: "b.gsf".into(), ..form };
        assert_eq!(other.file_source(&file).channel, None);
    }
}
