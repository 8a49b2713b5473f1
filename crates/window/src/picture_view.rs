//! The picture with its mouse controls, the note on it, and the BRDF map in its corner. Sizes are in points, egui's
//! unit of length, and opacities from 0 to 255. Those without a comment are chosen by eye.

use super::hemisphere::BrdfMap;
use super::settings::Settings;
use eframe::egui::{self, Color32, PointerButton, Rect, Response, Sense, Stroke, TextureId, Ui, Vec2, pos2, vec2};

/// Natural logarithm of the zoom factor per point that the wheel scrolls. Larger values zoom faster; smaller ones are
/// more precise.
const ZOOM_PER_POINT: f32 = 0.002;
/// Largest side of the BRDF map in points.
const MAP_POINTS_MAX: f32 = 150.0;
/// Largest side of the BRDF map as a fraction of the picture's shorter side.
const MAP_FRACTION_MAX: f32 = 0.4;
/// Distance of note and map from the picture's edges in points.
const MARGIN_POINTS: f32 = 12.0;
/// Length of each arm of the viewer's cross in the BRDF map, in points.
const CROSS_POINTS: f32 = 4.0;
/// Texture coordinates of a whole texture.
const WHOLE: Rect = Rect { min: pos2(0.0, 0.0), max: pos2(1.0, 1.0) };

/// The area of the window that shows the picture, and the cursor in it.
pub(crate) struct PictureArea {
    /// Width and height of the area in pixels of the screen, at least 1.
    pub size: (u32, u32),
    /// Position of the cursor in the area, each coordinate in [0, 1) from the upper left; `None` outside.
    pub cursor: Option<[f32; 2]>,
}

/// Shows the picture `texture` and the line of text `note` in the available space, and moves camera and sun with the
/// mouse. Returns egui's response, which tells what the mouse does in the area, and the area with the cursor.
pub(crate) fn show(
    ui: &mut Ui,
    settings: &mut Settings,
    texture: Option<TextureId>,
    note: Option<&str>,
) -> (Response, PictureArea) {
    let (response, painter) = ui.allocate_painter(ui.available_size(), Sense::click_and_drag());
    let area = response.rect;
    painter.rect_filled(area, 0.0, Color32::BLACK);
    if let Some(texture) = texture {
        painter.image(texture, area, WHOLE, Color32::WHITE);
    }
    if let Some(note) = note {
        show_note(&painter, area, note);
    }
    steer(ui, &response, settings);
    let pixels = area.size() * ui.pixels_per_point();
    let size = (pixels.x.round().max(1.0) as u32, pixels.y.round().max(1.0) as u32);
    let position = |at: egui::Pos2| {
        let [x, y] = ((at - area.min) / area.size()).into();
        let inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
        inside.then_some([x, y])
    };
    let cursor = response.hover_pos().and_then(position);
    (response, PictureArea { size, cursor })
}

/// Shows a line of white text on a dark ground at the top of the picture's area.
fn show_note(painter: &egui::Painter, area: Rect, note: &str) {
    let at = area.center_top() + vec2(0.0, MARGIN_POINTS);
    let font = egui::FontId::proportional(15.0);
    let galley = painter.layout_no_wrap(note.to_owned(), font, Color32::WHITE);
    let text = egui::Align2::CENTER_TOP.anchor_size(at, galley.size());
    painter.rect_filled(text.expand(6.0), 4.0, Color32::from_black_alpha(180));
    painter.galley(text.min, galley, Color32::WHITE);
}

/// Moves camera and sun. A drag with the left button turns the camera. With the middle button or shift, it shifts the
/// camera. With the right button or ctrl, it turns the sun. Wheel and pinch zoom.
fn steer(ui: &Ui, response: &Response, settings: &mut Settings) {
    let (modifiers, scrolled, pinched) =
        ui.input(|input| (input.modifiers, input.smooth_scroll_delta().y, input.zoom_delta()));
    let Vec2 { x, y } = response.drag_delta();
    let left = response.dragged_by(PointerButton::Primary);
    if response.dragged_by(PointerButton::Secondary) || (left && modifiers.ctrl) {
        settings.sun.turn(x, y);
    } else if response.dragged_by(PointerButton::Middle) || (left && modifiers.shift) {
        settings.orbit.pan(x, y, response.rect.width());
    } else if left {
        settings.orbit.turn(x, y);
    }
    // Factor on the camera's distance; `pinched` is above 1 for fingers that spread. Scrolling up and spreading two
    // fingers move the camera nearer.
    let factor = (-ZOOM_PER_POINT * scrolled).exp() / pinched;
    if response.hovered() && factor != 1.0 {
        settings.orbit.zoom(f64::from(factor));
    }
}

/// Shows the BRDF map in the lower right corner of the picture's area. A circle marks the mirror direction, a cross the
/// direction to the viewer.
pub(crate) fn show_map(ui: &Ui, area: Rect, map: &BrdfMap, texture: TextureId) {
    let painter = ui.painter_at(area);
    let side = MAP_POINTS_MAX.min(MAP_FRACTION_MAX * area.size().min_elem());
    let disc = Rect::from_min_size(area.max - Vec2::splat(side + MARGIN_POINTS), Vec2::splat(side));
    painter.circle_filled(disc.center(), 0.5 * side, Color32::from_black_alpha(220));
    painter.image(texture, disc, WHOLE, Color32::WHITE);
    painter.circle_stroke(disc.center(), 0.5 * side, Stroke::new(1.0, Color32::GRAY));
    // Position in the map of a unit vector with the components x and y in the frame of the relief. The map's y points
    // up, that of the screen down.
    let at = |x: f32, y: f32| disc.center() + 0.5 * side * vec2(x, -y);
    // `wi` points to the sun, `wo` to the viewer. The mirror direction of `wi` has the opposite x and y.
    painter.circle_stroke(at(-map.wi[0], -map.wi[1]), 3.0, Stroke::new(1.0, Color32::WHITE));
    let viewer = at(map.wo[0], map.wo[1]);
    let cross = Stroke::new(1.0, Color32::WHITE);
    for arm in [vec2(CROSS_POINTS, 0.0), vec2(0.0, CROSS_POINTS)] {
        painter.line_segment([viewer - arm, viewer + arm], cross);
    }
    // The exposure maps a BRDF of 1/exposure to white. `theta_deg` is the angle of incidence.
    let theta_deg = map.wi[2].clamp(-1.0, 1.0).acos().to_degrees();
    let text = format!("θi {theta_deg:.0}°, white at {:.2} /sr", 1.0 / map.exposure);
    let font = egui::FontId::proportional(11.0);
    painter.text(disc.center_top() - vec2(0.0, 4.0), egui::Align2::CENTER_BOTTOM, text, font, Color32::WHITE);
}
