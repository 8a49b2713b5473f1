use eframe::egui::{self, Color32, Pos2, Sense, Stroke, Vec2};
use sunbeam_realtime::{GpuError, Light};

/// Degrees that the sun moves for each point dragged.
const DEGREES_PER_POINT: f64 = 0.35;
/// Lowest sun in degrees: at 0 nothing is lit.
const ELEVATION_MIN_DEG: f64 = 0.5;
/// Side of the widget in points.
const DISC_POINTS: f32 = 92.0;

/// Where the sun is, as users turn it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Counter-clockwise seen from above, from +x.
    azimuth_deg: f64,
    elevation_deg: f64,
}

impl From<&Light> for Sun {
    fn from(light: &Light) -> Self {
        let [x, y, z] = light.to_sun();
        Self::placed(y.atan2(x).to_degrees(), z.clamp(-1.0, 1.0).asin().to_degrees())
    }
}

impl Sun {
    fn placed(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let azimuth_deg = (azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
        Self { azimuth_deg, elevation_deg: elevation_deg.clamp(ELEVATION_MIN_DEG, 90.0) }
    }

    /// The light as the renderer takes it.
    ///
    /// # Errors
    /// As [`Light::from_angles`], whose ranges the angles keep to.
    pub fn light(&self) -> Result<Light, GpuError> {
        Light::from_angles(self.azimuth_deg, self.elevation_deg)
    }

    /// Goes round and up along with a drag in points.
    pub fn turn(&mut self, right: f32, down: f32) {
        let azimuth = self.azimuth_deg + DEGREES_PER_POINT * f64::from(right);
        *self = Self::placed(azimuth, self.elevation_deg - DEGREES_PER_POINT * f64::from(down));
    }

    /// The sky seen from above, the viewer at the lower edge, with the sun to be dragged; its angles beside it.
    pub fn show(&mut self, ui: &mut egui::Ui, camera_azimuth_deg: f64) {
        ui.horizontal(|ui| {
            self.disc(ui, camera_azimuth_deg);
            ui.vertical(|ui| {
                let (mut azimuth, mut elevation) = (self.azimuth_deg, self.elevation_deg);
                let angle = |value| egui::DragValue::new(value).suffix("°").max_decimals(1).speed(0.5);
                ui.label("Azimuth");
                let turned = ui.add(angle(&mut azimuth)).changed();
                ui.label("Elevation");
                let raised = ui.add(angle(&mut elevation).range(ELEVATION_MIN_DEG..=90.0)).changed();
                if turned || raised {
                    *self = Self::placed(azimuth, elevation);
                }
            });
        });
    }

    fn disc(&mut self, ui: &mut egui::Ui, camera_azimuth_deg: f64) {
        let (response, painter) = ui.allocate_painter(Vec2::splat(DISC_POINTS), Sense::click_and_drag());
        let (centre, radius) = (response.rect.center(), 0.5 * DISC_POINTS - 4.0);
        if let Some(at) = response.interact_pointer_pos() {
            *self = Self::at((at - centre) / radius, camera_azimuth_deg);
        }
        let faint = ui.visuals().weak_text_color();
        painter.circle(centre, radius, ui.visuals().extreme_bg_color, Stroke::new(1.0, faint));
        // Elevations of 30° and 60°.
        for elevation in [30.0f32, 60.0] {
            painter.circle_stroke(centre, radius * elevation.to_radians().cos(), Stroke::new(0.5, faint));
        }
        let sun: Pos2 = centre + radius * self.place(camera_azimuth_deg);
        painter.line_segment([centre, sun], Stroke::new(1.0, faint));
        painter.circle(sun, 6.0, Color32::from_rgb(255, 214, 90), Stroke::new(1.0, Color32::BLACK));
        response
            .on_hover_text("The sky from above, you at the lower edge. Drag the sun, here or with the right button.");
    }

    /// Place in the unit disc, x right and y down.
    fn place(&self, camera_azimuth_deg: f64) -> Vec2 {
        let (sin, cos) = (self.azimuth_deg - camera_azimuth_deg).to_radians().sin_cos();
        let radius = self.elevation_deg.to_radians().cos();
        Vec2::new((radius * sin) as f32, (radius * cos) as f32)
    }

    /// The inverse of [`Sun::place`].
    fn at(place: Vec2, camera_azimuth_deg: f64) -> Self {
        let azimuth = f64::from(place.x.atan2(place.y)).to_degrees();
        Self::placed(azimuth + camera_azimuth_deg, f64::from(place.length().min(1.0).acos()).to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_shows_where_the_sun_is_and_takes_it_there() {
        // Behind the camera is the lower edge, on its right is the right edge.
        let behind = Sun::placed(-100.0, 0.5).place(-100.0);
        assert!((behind - Vec2::new(0.0, 1.0)).length() < 1e-3);
        let right = Sun::placed(-10.0, 0.5).place(-100.0);
        assert!((right - Vec2::new(1.0, 0.0)).length() < 1e-3);
        for (azimuth, elevation) in [(-150.0, 40.0), (20.0, 80.0), (179.0, 5.0)] {
            let back = Sun::at(Sun::placed(azimuth, elevation).place(35.0), 35.0);
            assert!((back.azimuth_deg - azimuth).abs() < 1e-3 && (back.elevation_deg - elevation).abs() < 1e-3);
        }
    }

    #[test]
    fn it_never_sets_nor_passes_the_zenith() {
        let mut sun = Sun::from(&Light::default());
        sun.turn(1e3, -1e3);
        assert_eq!(sun.elevation_deg, 90.0);
        sun.turn(1e3, 1e3);
        assert_eq!(sun.elevation_deg, ELEVATION_MIN_DEG);
        assert!(sun.azimuth_deg.abs() <= 180.0);
        sun.light().unwrap();
        Sun::at(Vec2::new(9.0, -9.0), 0.0).light().unwrap();
    }
}
