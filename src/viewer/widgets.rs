//! Widgets that several panels use.

use eframe::egui::{self, ComboBox, DragValue, Ui, emath::Numeric};
use std::ops::RangeInclusive;

/// A choice among values with names.
pub fn choice<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    choices: impl IntoIterator<Item = (T, &'static str)>,
) {
    row(ui, label, |ui| {
        let choices: Vec<_> = choices.into_iter().collect();
        let current = choices.iter().find(|(choice, _)| choice == value).map_or("", |(_, name)| name);
        ComboBox::from_id_salt(label).selected_text(current).show_ui(ui, |ui| {
            for (choice, name) in choices {
                ui.selectable_value(value, choice, name);
            }
        });
    });
}

/// A number.
pub fn number<N: Numeric>(ui: &mut Ui, label: &str, value: &mut N, range: RangeInclusive<N>, speed: f64, suffix: &str) {
    row(ui, label, |ui| {
        ui.add(DragValue::new(value).range(range).speed(speed).suffix(suffix.to_owned()).max_decimals(4));
    });
}

/// A number that need not be given; `first` is what it becomes when it is.
pub fn optional<N: Numeric>(
    ui: &mut Ui,
    label: &str,
    value: &mut Option<N>,
    first: N,
    range: RangeInclusive<N>,
    speed: f64,
    suffix: &str,
) {
    row(ui, label, |ui| {
        let mut given = value.is_some();
        if ui.checkbox(&mut given, "").on_hover_text("Set by hand").changed() {
            *value = given.then_some(first);
        }
        match value {
            Some(number) => {
                ui.add(DragValue::new(number).range(range).speed(speed).suffix(suffix.to_owned()).max_decimals(4));
            }
            None => {
                ui.weak("auto");
            }
        }
    });
}

/// Something that is or is not.
pub fn switch(ui: &mut Ui, label: &str, value: &mut bool) {
    row(ui, label, |ui| {
        ui.checkbox(value, "");
    });
}

/// A label with something on its right.
pub fn row(ui: &mut Ui, label: &str, add: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let (at, _) =
            ui.allocate_exact_size(egui::vec2(LABEL_POINTS, ui.spacing().interact_size.y), egui::Sense::hover());
        ui.put(at, egui::Label::new(label).halign(egui::Align::Min).truncate());
        add(ui);
    });
}

/// Width of the labels.
const LABEL_POINTS: f32 = 108.0;
