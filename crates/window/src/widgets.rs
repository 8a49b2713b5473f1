//! Widgets that several panels use.

use eframe::egui::{Align2, ComboBox, DragValue, Sense, TextStyle, Ui, emath::Numeric, vec2};
use std::ops::RangeInclusive;

/// Width of the labels in points. Labels beyond it are cut off; a larger width leaves less of the panel to the widgets.
const LABEL_POINTS: f32 = 112.0;
/// Largest number of decimals of a number.
const DECIMALS_MAX: usize = 4;

/// A menu of values with names. Another value is shown without a name. The label is also the menu's identifier, so it
/// is unique in a panel.
pub(crate) fn choice<T: Copy + PartialEq>(
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

/// A number to type or drag. Numbers that the user enters are clamped to the range. `speed` is the change per point
/// of a drag, and `suffix` the unit shown after the number.
pub(crate) fn number<N: Numeric>(
    ui: &mut Ui,
    label: &str,
    value: &mut N,
    range: RangeInclusive<N>,
    speed: f64,
    suffix: &str,
) {
    row(ui, label, |ui| {
        ui.add(drag(value, range, speed, suffix));
    });
}

/// The widget of [`number`] for an optional number, with a checkbox; `None` is shown as "auto". `first` is the value
/// when the box is checked.
pub(crate) fn optional<N: Numeric>(
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
                ui.add(drag(number, range, speed, suffix));
            }
            None => {
                ui.weak("auto");
            }
        }
    });
}

/// A checkbox.
pub(crate) fn switch(ui: &mut Ui, label: &str, value: &mut bool) {
    row(ui, label, |ui| {
        ui.checkbox(value, "");
    });
}

/// A label with widgets on its right.
pub(crate) fn row(ui: &mut Ui, label: &str, add: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let size = vec2(LABEL_POINTS, ui.spacing().interact_size.y);
        let (area, _) = ui.allocate_exact_size(size, Sense::hover());
        let (font, colour) = (TextStyle::Body.resolve(ui.style()), ui.visuals().text_color());
        ui.painter_at(area).text(area.left_center(), Align2::LEFT_CENTER, label, font, colour);
        add(ui);
    });
}

/// The widget of a number without its label. Numbers that are not integers have up to [`DECIMALS_MAX`] decimals.
fn drag<'a, N: Numeric>(value: &'a mut N, range: RangeInclusive<N>, speed: f64, suffix: &str) -> DragValue<'a> {
    // A value outside the range, such as one of the command line, stays until the user changes it.
    let drag = DragValue::new(value).range(range).clamp_existing_to_range(false).speed(speed).suffix(suffix.to_owned());
    if N::INTEGRAL { drag } else { drag.max_decimals(DECIMALS_MAX) }
}
