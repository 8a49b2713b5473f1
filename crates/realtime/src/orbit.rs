//! A camera that orbits its target, moved by drags on the screen.
//!
//! A drag is a pair of numbers, positive to the right and downwards, in *points*: logical pixels of the screen, which a
//! browser calls CSS pixels. They are f32, as window toolkits report them.
//!
//! The camera lies at `target + distance·d`, where d = (cos a·cos e, sin a·cos e, sin e) for the azimuth a and the
//! elevation e. z points up.

use super::Camera;
use glam::DVec3;
use std::ops::RangeInclusive;

/// Rotation of the camera or the sun in degrees per point of a drag: a drag over 500 points turns by about half a
/// circle. Larger values turn faster; smaller ones are more precise.
pub const DEGREES_PER_POINT: f64 = 0.35;

/// A camera that orbits its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Point in the middle of the picture, in cm.
    target_cm: DVec3,
    /// Distance of the camera from the target.
    distance_cm: f64,
    /// Azimuth of the camera seen from the target, counter-clockwise from +x seen from above. It is not wrapped.
    azimuth_deg: f64,
    /// Elevation of the camera seen from the target.
    elevation_deg: f64,
    /// Horizontal field of view.
    fov_deg: f64,
}

impl Orbit {
    /// Accepted elevations of the camera in degrees. At ±90° the upward direction of the picture is undefined
    /// ([`Camera`]).
    pub const ELEVATION_DEG: RangeInclusive<f64> = -89.0..=89.0;
    /// Accepted distances of the camera from its target in cm. They must exceed the distance of the near plane, 0.01 cm
    /// (frame.wgsl). With a field of view of 30°, the picture is 0.1 cm wide at the nearest and 107 cm at the farthest.
    pub const DISTANCE_CM: RangeInclusive<f64> = 0.2..=200.0;

    /// A camera that looks at `target` (cm) from an azimuth and an elevation in degrees and a distance in cm. The
    /// azimuth is counter-clockwise from +x seen from above. Elevation and distance are clamped to their ranges.
    /// `fov_deg` is the horizontal field of view in degrees.
    pub fn new(target: [f64; 3], azimuth_deg: f64, elevation_deg: f64, distance_cm: f64, fov_deg: f64) -> Self {
        Self {
            target_cm: target.into(),
            distance_cm: clamp(distance_cm, &Self::DISTANCE_CM),
            azimuth_deg,
            elevation_deg: clamp(elevation_deg, &Self::ELEVATION_DEG),
            fov_deg,
        }
    }

    /// The camera for the renderer.
    pub fn camera(&self) -> Camera {
        Camera {
            origin: (self.target_cm + self.distance_cm * self.outward()).to_array(),
            target: self.target_cm.to_array(),
            fov_deg: self.fov_deg,
        }
    }

    /// Azimuth of the camera seen from the target in degrees, counter-clockwise from +x seen from above.
    pub fn azimuth_deg(&self) -> f64 {
        self.azimuth_deg
    }

    /// Elevation of the camera seen from the target, in degrees.
    pub fn elevation_deg(&self) -> f64 {
        self.elevation_deg
    }

    /// Distance of the camera from the target, in cm.
    pub fn distance_cm(&self) -> f64 {
        self.distance_cm
    }

    /// Turns the camera so that the scene follows a drag: to the right, the camera moves left around the target;
    /// downwards, it rises.
    pub fn turn(&mut self, right: f32, down: f32) {
        self.azimuth_deg -= DEGREES_PER_POINT * f64::from(right);
        let elevation = self.elevation_deg + DEGREES_PER_POINT * f64::from(down);
        self.elevation_deg = clamp(elevation, &Self::ELEVATION_DEG);
    }

    /// Shifts target and camera so that points at the target's distance follow a drag. The picture is `width` points
    /// wide; widths below 1 count as 1.
    pub fn pan(&mut self, right: f32, down: f32, width: f32) {
        let forward = -self.outward();
        // The cross product is not 0, because no camera looks along z: [`Orbit`] limits the elevation, and [`Camera`]
        // excludes this direction.
        let right_axis = forward.cross(DVec3::Z).normalize();
        let up_axis = right_axis.cross(forward);
        let picture_width_cm = 2.0 * self.distance_cm * (0.5 * self.fov_deg).to_radians().tan();
        let cm_per_point = picture_width_cm / f64::from(width.max(1.0));
        // Against the drag: to the left for a drag to the right, upwards for one downwards.
        self.target_cm += cm_per_point * (f64::from(down) * up_axis - f64::from(right) * right_axis);
    }

    /// Multiplies the distance by a positive `factor`, within its range; factors below 1 move the camera nearer.
    pub fn zoom(&mut self, factor: f64) {
        self.distance_cm = clamp(self.distance_cm * factor, &Self::DISTANCE_CM);
    }

    /// Unit vector d from the target to the camera.
    fn outward(&self) -> DVec3 {
        let (sin_a, cos_a) = self.azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = self.elevation_deg.to_radians().sin_cos();
        DVec3::new(cos_a * cos_e, sin_a * cos_e, sin_e)
    }
}

/// The orbit of a camera that does not lie at its target. Elevation and distance are not clamped, so that
/// [`Orbit::camera`] gives back the camera.
impl From<&Camera> for Orbit {
    fn from(camera: &Camera) -> Self {
        let target = DVec3::from(camera.target);
        let offset = DVec3::from(camera.origin) - target;
        let distance_cm = offset.length();
        Self {
            target_cm: target,
            distance_cm,
            azimuth_deg: offset.y.atan2(offset.x).to_degrees(),
            elevation_deg: (offset.z / distance_cm).asin().to_degrees(),
            fov_deg: camera.fov_deg,
        }
    }
}

/// The value or the nearest end of the range.
fn clamp(value: f64, range: &RangeInclusive<f64>) -> f64 {
    value.clamp(*range.start(), *range.end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orbit_gives_back_its_camera() {
        let camera = Camera::default();
        let back = Orbit::from(&camera).camera();
        assert!(DVec3::from(back.origin).distance(DVec3::from(camera.origin)) < 1e-12);
        assert_eq!((back.target, back.fov_deg), (camera.target, camera.fov_deg));
    }

    #[test]
    fn turning_keeps_the_distance_and_never_passes_the_top() {
        let mut orbit = Orbit::from(&Camera::default());
        let distance = |orbit: &Orbit| {
            let camera = orbit.camera();
            DVec3::from(camera.origin).distance(DVec3::from(camera.target))
        };
        let before = distance(&orbit);
        orbit.turn(123.0, 1e4);
        assert!((distance(&orbit) - before).abs() < 1e-9);
        let camera = orbit.camera();
        assert!(camera.origin[2] > camera.target[2] && camera.origin[..2] != camera.target[..2]);
        orbit.zoom(1e-9);
        assert!((distance(&orbit) - Orbit::DISTANCE_CM.start()).abs() < 1e-12);
    }

    #[test]
    fn panning_moves_the_target_against_the_drag() {
        let mut orbit = Orbit::from(&Camera { origin: [0.0, -10.0, 0.0], target: [0.0; 3], fov_deg: 90.0 });
        orbit.pan(50.0, 25.0, 100.0);
        // The picture is 20 wide at the target; the camera looks along +y, so +x is right and +z up.
        assert!(DVec3::from(orbit.camera().target).distance(DVec3::new(-10.0, 0.0, 5.0)) < 1e-12);
    }
}
