//! The direction of the sun, and the widgets that change it. A *point* is egui's unit of length, a logical pixel.

use eframe::egui::{self, Color32, Pos2, Sense, Stroke, Vec2};
use sunbeam_realtime::{DEGREES_PER_POINT, GpuError, Light};

/// Side in points of the square widget with the disc of the sky ([`Sun::disc`]).
const WIDGET_POINTS: f32 = 92.0;
/// Radius of the sun in points.
const SUN_RADIUS_POINTS: f32 = 6.0;
/// Radius of the disc in points. A sun at the disc's edge, with its outline of one point, still lies within the widget.
const DISC_RADIUS_POINTS: f32 = 0.5 * WIDGET_POINTS - SUN_RADIUS_POINTS - 1.0;

/// Direction of the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sun {
    /// Azimuth in degrees, counter-clockwise from +x seen from above, from −180 to below 180.
    azimuth_deg: f64,
    /// Elevation in degrees, [`Light::ELEVATION_MIN_DEG`] to 90.
    elevation_deg: f64,
}

impl From<&Light> for Sun {
    fn from(light: &Light) -> Self {
        let [x, y, z] = light.to_sun();
        Self::new(y.atan2(x).to_degrees(), z.clamp(-1.0, 1.0).asin().to_degrees())
    }
}

impl Sun {
    /// A sun with these angles. The azimuth is wrapped and the elevation clamped to its range.
    fn new(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let azimuth_deg = (azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
        Self { azimuth_deg, elevation_deg: elevation_deg.clamp(Light::ELEVATION_MIN_DEG, 90.0) }
    }

    /// The light for the renderer.
    ///
    /// # Errors
    /// None for finite angles, because they are within the ranges of [`Light::from_angles`].
    pub(crate) fn light(&self) -> Result<Light, GpuError> {
        Light::from_angles(self.azimuth_deg, self.elevation_deg)
    }

    /// Turns the sun by a drag of `right` and `down` points of the screen, negative to the left and upwards. The
    /// azimuth grows to the right, the elevation upwards.
    pub(crate) fn turn(&mut self, right: f32, down: f32) {
        let azimuth = self.azimuth_deg + DEGREES_PER_POINT * f64::from(right);
        *self = Self::new(azimuth, self.elevation_deg - DEGREES_PER_POINT * f64::from(down));
    }

    /// Shows the widgets: the sky seen from above with a sun to drag and the viewer at the lower edge, and the angles.
    /// `camera_azimuth_deg` is the camera's azimuth seen from its target, measured like the sun's.
    pub(crate) fn show(&mut self, ui: &mut egui::Ui, camera_azimuth_deg: f64) {
        ui.horizontal(|ui| {
            self.disc(ui, camera_azimuth_deg);
            ui.vertical(|ui| {
                let (mut azimuth, mut elevation) = (self.azimuth_deg, self.elevation_deg);
                let angle = |value| egui::DragValue::new(value).suffix("°").max_decimals(1).speed(0.5);
                ui.label("Azimuth");
                let turned = ui.add(angle(&mut azimuth)).changed();
                ui.label("Elevation");
                let raised = ui.add(angle(&mut elevation).range(Light::ELEVATION_MIN_DEG..=90.0)).changed();
                if turned || raised {
                    *self = Self::new(azimuth, elevation);
                }
            });
        });
    }

    /// Shows the disc of the sky. Its centre is the zenith, its edge the horizon, and circles mark the elevations 30°
    /// and 60°. A click or drag moves the sun to the cursor.
    fn disc(&mut self, ui: &mut egui::Ui, camera_azimuth_deg: f64) {
        let (response, painter) = ui.allocate_painter(Vec2::splat(WIDGET_POINTS), Sense::click_and_drag());
        let (centre, radius) = (response.rect.center(), DISC_RADIUS_POINTS);
        if let Some(at) = response.interact_pointer_pos() {
            *self = Self::from_disc((at - centre) / radius, camera_azimuth_deg);
        }
        let faint = ui.visuals().weak_text_color();
        painter.circle(centre, radius, ui.visuals().extreme_bg_color, Stroke::new(1.0, faint));
        for elevation in [30.0f32, 60.0] {
            painter.circle_stroke(centre, radius * elevation.to_radians().cos(), Stroke::new(0.5, faint));
        }
        let sun: Pos2 = centre + radius * self.position(camera_azimuth_deg);
        painter.line_segment([centre, sun], Stroke::new(1.0, faint));
        painter.circle(sun, SUN_RADIUS_POINTS, Color32::from_rgb(255, 214, 90), Stroke::new(1.0, Color32::BLACK));
        response
            .on_hover_text("The sky from above, you at the lower edge. Drag the sun, here or with the right button.");
    }

    /// Position in the unit disc, the orthographic projection of the sky from above: x right and y down, with the
    /// camera's azimuth at the lower edge.
    fn position(&self, camera_azimuth_deg: f64) -> Vec2 {
        let (sin, cos) = (self.azimuth_deg - camera_azimuth_deg).to_radians().sin_cos();
        let radius = self.elevation_deg.to_radians().cos();
        Vec2::new((radius * sin) as f32, (radius * cos) as f32)
    }

    /// The sun at a position in the unit disc; inverse of [`Sun::position`], except for the azimuth of a sun in the
    /// zenith. Positions beyond the edge count as on it.
    fn from_disc(position: Vec2, camera_azimuth_deg: f64) -> Self {
        let azimuth = f64::from(position.x.atan2(position.y)).to_degrees();
        Self::new(azimuth + camera_azimuth_deg, f64::from(position.length().min(1.0).acos()).to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_in_the_disc_give_back_the_sun() {
        // The lower edge of the disc is behind the camera, the right edge on the camera's right.
        // At an elevation of 0.5° the position differs from the edge by 1 − cos 0.5° = 4e-5.
        let behind = Sun::new(-100.0, 0.5).position(-100.0);
        assert!((behind - Vec2::new(0.0, 1.0)).length() < 1e-3);
        let right = Sun::new(-10.0, 0.5).position(-100.0);
        assert!((right - Vec2::new(1.0, 0.0)).length() < 1e-3);
        for (azimuth, elevation) in [(-150.0, 40.0), (20.0, 80.0), (179.0, 5.0)] {
            let back = Sun::from_disc(Sun::new(azimuth, elevation).position(35.0), 35.0);
            assert!((back.azimuth_deg - azimuth).abs() < 1e-3 && (back.elevation_deg - elevation).abs() < 1e-3);
        }
    }

    #[test]
    fn elevations_stay_between_the_horizon_and_the_zenith() {
        let mut sun = Sun::from(&Light::default());
        sun.turn(1e3, -1e3);
        assert_eq!(sun.elevation_deg, 90.0);
        sun.turn(1e3, 1e3);
        assert_eq!(sun.elevation_deg, Light::ELEVATION_MIN_DEG);
        assert!(sun.azimuth_deg.abs() <= 180.0);
        sun.light().unwrap();
        Sun::from_disc(Vec2::new(9.0, -9.0), 0.0).light().unwrap();
    }
}
