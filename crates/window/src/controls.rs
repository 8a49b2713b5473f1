//! The controls of the settings, in the panel on the left.

use super::settings::Settings;
use super::surface_form::SurfaceForm;
use super::widgets::{choice, number, optional, row, switch};
use eframe::egui::{self, Ui};
use std::ops::RangeInclusive;
use sunbeam::config::{BODY_ETA, COVER_ETA, ObliquityChoice, RELATIVE_SIZE, Theory};
use sunbeam::methods::{
    GEMS_SHARPNESS, LAMBDA_STEP_NM, MethodKind, NEIGHBOURHOOD_MAX, REPEATS_MAX, RESOLUTION, Repeats, StamForm,
    TERMS_MAX,
};
use sunbeam::scattering::ComplexIndex;
use sunbeam::table::COHERENCE_LENGTH_UM;
use sunbeam::transform::Series;
use sunbeam_realtime::Blend;

// Ranges of controls contain the usual values. Options of the command line accept more; their values stay until the
// user changes them.

/// Exposure in stops.
const EXPOSURE_STOPS: RangeInclusive<f64> = -6.0..=12.0;
/// Pixels of the picture per pixel of the window, along each side.
const SCALE: RangeInclusive<f32> = 0.1..=2.0;
/// Rays along each side of a pixel.
const SUPERSAMPLE: RangeInclusive<u32> = 1..=8;
/// Real part of the refractive index.
const INDEX_ETA: RangeInclusive<f64> = 0.01..=20.0;
/// Imaginary part of the refractive index.
const INDEX_K: RangeInclusive<f64> = 0.0..=20.0;
/// Period of the grating that Stam's method assumes, in µm.
const PERIOD_UM: RangeInclusive<f64> = 0.05..=100.0;

/// Width of the exposure's slider in points, which leaves room for the number beside it.
const SLIDER_POINTS: f32 = 82.0;

/// All controls, from top to bottom. The last three arguments of `number` and `optional` are the range, the change per
/// point of a drag, and the unit. Before them, `optional` has the value when it is switched on (widgets.rs).
pub(crate) fn show(ui: &mut Ui, settings: &mut Settings, form: &mut SurfaceForm) {
    section(ui, "Surface", |ui| {
        form.show(ui, &mut settings.surface);
        row(ui, "Coherence length", |ui| {
            let length = egui::DragValue::new(&mut settings.surface.coherence_length);
            ui.add(length.range(COHERENCE_LENGTH_UM).speed(0.5).suffix(" µm").max_decimals(2));
        });
        number(ui, "Scale", &mut settings.surface.scale, RELATIVE_SIZE, 0.005, "");
        number(ui, "Depth", &mut settings.surface.depth, RELATIVE_SIZE, 0.005, "");
        let mut is_film = settings.is_film();
        switch(ui, "Film", &mut is_film);
        // Acts only if the switch has changed.
        settings.set_film(is_film);
        // A film has no cover, a flat clear layer over the relief, and only the scalar theory here.
        if !is_film {
            optional(ui, "Cover's index", &mut settings.surface.cover_eta, 1.5, COVER_ETA, 0.01, "");
            choice(ui, "Theory", &mut settings.surface.theory, Theory::ALL.map(|theory| (theory, theory.name())));
        }
        // The rigorous theory contains obliquity and shadowing, and a film has its own factor.
        if settings.surface.theory == Theory::Scalar && !is_film {
            let obliquity = ObliquityChoice::ALL.map(|choice| (choice, choice.name()));
            choice(ui, "Obliquity", &mut settings.surface.obliquity, obliquity);
            switch(ui, "Shadowing", &mut settings.surface.shadowing);
        }
        number(ui, "Rotation", &mut settings.view.rotation_deg, -360.0..=360.0, 0.5, "°");
        match &mut settings.index {
            Some(index) if is_film => number(ui, "eta", &mut index.eta, BODY_ETA, 0.01, ""),
            _ => show_index(ui, &mut settings.index),
        }
    });
    section(ui, "Method", |ui| show_method(ui, settings));
    section(ui, "Sun", |ui| settings.sun.show(ui, settings.orbit.azimuth_deg()));
    section(ui, "Picture", |ui| show_picture(ui, settings));
}

/// A section with a title that can be folded.
fn section(ui: &mut Ui, title: &str, add: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(true).show_unindented(ui, add);
}

/// The refractive index; `None` is a perfect conductor, which reflects all light.
fn show_index(ui: &mut Ui, index: &mut Option<ComplexIndex>) {
    let mut reflects_all = index.is_none();
    switch(ui, "Reflects all", &mut reflects_all);
    match index {
        _ if reflects_all => *index = None,
        None => *index = Some(sunbeam_realtime::KERATIN),
        Some(ComplexIndex { eta, k }) => {
            number(ui, "eta", eta, INDEX_ETA, 0.01, "");
            number(ui, "k", k, INDEX_K, 0.01, "");
        }
    }
}

/// The method and the options that it reads ([`MethodOptions`](sunbeam::methods::MethodOptions) describes them). An
/// optional number that is switched on starts at an example, which is not the automatic value.
fn show_method(ui: &mut Ui, settings: &mut Settings) {
    choice(ui, "Method", &mut settings.kind, MethodKind::ALL.map(|kind| (kind, kind.name())));
    let options = &mut settings.options;
    for &option in settings.kind.options() {
        match option {
            "lambda_step_nm" => number(ui, "λ step", &mut options.lambda_step_nm, LAMBDA_STEP_NM, 0.1, " nm"),
            "terms" => optional(ui, "Terms", &mut options.terms, 7, 1..=TERMS_MAX, 0.1, ""),
            "neighbourhood" => {
                optional(ui, "Neighbourhood", &mut options.neighbourhood, 3, 1..=NEIGHBOURHOOD_MAX, 0.1, "");
            }
            "series" => {
                let series = [(Series::Chebyshev, "chebyshev"), (Series::Taylor, "taylor")];
                choice(ui, "Series", &mut options.series, series);
            }
            "weighted" => switch(ui, "Weighted", &mut options.weighted),
            "repeats" => show_repeats(ui, &mut options.repeats),
            "period_um" => optional(ui, "Period", &mut options.period_um, 1.6, PERIOD_UM, 0.01, " µm"),
            "stam_form" => {
                choice(ui, "Form", &mut options.stam_form, [(StamForm::Spacing, "spacing"), (StamForm::Gems, "gems")]);
            }
            // Only the form of Stam's method from GPU Gems reads these two options.
            "gems_sharpness" | "gems_highlight" if options.stam_form != StamForm::Gems => {}
            "gems_sharpness" => number(ui, "Sharpness", &mut options.gems_sharpness, GEMS_SHARPNESS, 0.5, " /µm"),
            "resolution" => number(ui, "Table samples", &mut options.resolution, RESOLUTION, 0.05, " ×"),
            // Options without a control keep their value from the command line.
            other => row(ui, other, |ui| {
                ui.weak("by command line");
            }),
        }
    }
}

/// The numbers of repeats of the tile along x and y. Both are set, or none.
fn show_repeats(ui: &mut Ui, repeats: &mut Option<Repeats>) {
    let [x, y] = repeats.map_or([None; 2], |repeats| repeats.xy().map(Some));
    let (mut new_x, mut new_y) = (x, y);
    optional(ui, "Repeats along x", &mut new_x, 26, 1..=REPEATS_MAX, 0.2, "");
    optional(ui, "Repeats along y", &mut new_y, 1, 1..=REPEATS_MAX, 0.2, "");
    if (new_x, new_y) != (x, y) {
        // Switching off one number drops both; switching on one sets the other to 1.
        let is_dropped = (x.is_some() && new_x.is_none()) || (y.is_some() && new_y.is_none());
        *repeats = (!is_dropped).then(|| Repeats::Each([new_x.unwrap_or(1), new_y.unwrap_or(1)]));
    }
}

/// Exposure, blending with the pigment, ground and resolution.
fn show_picture(ui: &mut Ui, settings: &mut Settings) {
    row(ui, "Exposure", |ui| {
        ui.spacing_mut().slider_width = SLIDER_POINTS;
        let slider = egui::Slider::new(&mut settings.exposure, EXPOSURE_STOPS).max_decimals(1);
        // An exposure of the command line may be out of range or have more decimals, and stays until the user edits it.
        ui.add(slider.clamping(egui::SliderClamping::Edits));
    });
    let mut kind = BlendKind::from(settings.view.blend);
    choice(ui, "Pigment", &mut kind, BlendKind::ALL);
    if kind != BlendKind::from(settings.view.blend) {
        settings.view.blend = kind.with_default_share();
    }
    if let Blend::FixedMix { share } = &mut settings.view.blend {
        number(ui, "Share", share, 0.0..=1.0, 0.005, "");
    }
    switch(ui, "Ground", &mut settings.view.ground);
    number(ui, "Rays per pixel side", &mut settings.view.supersample, SUPERSAMPLE, 0.05, "");
    number(ui, "Resolution", &mut settings.scale, SCALE, 0.01, " x");
}

/// Kind of a [`Blend`], for a choice by name. A fixed mix also has a share: the weight of the diffraction colour.
#[derive(Clone, Copy, PartialEq)]
enum BlendKind {
    Physical,
    FixedMix,
    None,
}

impl From<Blend> for BlendKind {
    fn from(blend: Blend) -> Self {
        match blend {
            Blend::Physical => Self::Physical,
            Blend::FixedMix { .. } => Self::FixedMix,
            Blend::None => Self::None,
        }
    }
}

impl BlendKind {
    /// All kinds with their names.
    const ALL: [(Self, &'static str); 3] =
        [(Self::Physical, "physical"), (Self::FixedMix, "mix"), (Self::None, "none")];

    /// The blend of this kind; a fixed mix has equal parts of diffraction colour and pigment.
    fn with_default_share(self) -> Blend {
        match self {
            Self::Physical => Blend::Physical,
            Self::FixedMix => Blend::FixedMix { share: 0.5 },
            Self::None => Blend::None,
        }
    }
}
