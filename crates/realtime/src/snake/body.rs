//! The smooth body: a flattened cross-section, swept along an S-shaped centreline with a rotation-minimising frame,
//! which does not turn about the centreline.
//!
//! The section consists of two half ellipses, the back and the belly, with a common half width r. Its point at the
//! angle φ is r·(sin φ·side + b·cos φ·up), with b = [`BACK`] or [`BELLY`]. The angle is 0 on top of the back and ±π
//! below the belly. `side` is orthogonal to the centreline and to `up`, and points to growing v.
//!
//! The skin is a sheet over the upper part of the section; its two edges under the belly are the *rims*. Texture
//! coordinates are u along the centreline from head to tail and v across the sheet from rim to rim. Both are
//! proportional to the arc length.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::SnakeOptions;

/// Height b of the back's half ellipse, relative to the half width r; chosen by eye. At 1 the back is a half circle.
const BACK: f64 = 0.92;
/// Height b of the belly's half ellipse, relative to the half width r; chosen by eye. Smaller values flatten the belly.
const BELLY: f64 = 0.70;
/// Fraction of the girth that the sheet covers, from rim to rim. Smaller values would bring the rims into view from the
/// side; larger ones add triangles that no camera above the ground sees.
const COVERAGE: f64 = 0.76;
/// Number of steps of the tables of centreline and section. The steps are smaller than the cells of most meshes. More
/// steps take longer and follow the curves more closely.
const STEPS: usize = 2048;

/// A point of the centreline with its frame.
struct Station {
    /// Point of the centreline in cm.
    centre: DVec3,
    /// Unit vector along the centreline towards the tail.
    forward: DVec3,
    /// Unit vector from the centre to the top of the back.
    up: DVec3,
}

/// The body without scales, a function of the arc length along the centreline and around the section.
pub(super) struct Body {
    /// Stations at u = i/[`STEPS`], i from 0 to [`STEPS`].
    stations: Vec<Station>,
    /// Length of the centreline in cm.
    length_cm: f64,
    /// Half width r of the section in cm.
    radius_cm: f64,
    /// Arc length in cm from the top of the back to the angle φ = `i·2π/STEPS − π`, i from 0 to [`STEPS`]. It has the
    /// sign of φ.
    arcs_cm: Vec<f64>,
    /// Arc lengths in cm from the top of the back to the rims at v = 0 (negative) and v = 1 (positive).
    rims_cm: (f64, f64),
}

impl Body {
    /// The body that the options describe. `back_v` is the texture coordinate v of the top of the back.
    pub(super) fn new(options: &SnakeOptions, back_v: f64) -> Self {
        let arcs_cm = section_arcs_cm(options.radius_cm);
        let width_cm = COVERAGE * (arcs_cm[STEPS] - arcs_cm[0]);
        Self {
            stations: stations(options),
            length_cm: options.length_cm,
            radius_cm: options.radius_cm,
            arcs_cm,
            rims_cm: (-back_v * width_cm, (1.0 - back_v) * width_cm),
        }
    }

    /// Width of the sheet in cm, rim to rim.
    pub(super) fn width_cm(&self) -> f64 {
        self.rims_cm.1 - self.rims_cm.0
    }

    /// Point in cm and outward unit normal at `u`, `v` in [0, 1] of the skin without scales.
    pub(super) fn point(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let Station { centre, forward, up } = self.station(u);
        // u grows along `forward` and v along `side`; on the back, forward × side = up points outwards.
        let side = up.cross(forward);
        let (sin, cos) = self.angle(self.rims_cm.0 + v * self.width_cm()).sin_cos();
        let b = relative_height(cos);
        let offset = self.radius_cm * (side * sin + up * (b * cos));
        // Orthogonal to the tangent of the ellipse, side·cos − up·b·sin, and to `forward`, along which a
        // rotation-minimising frame moves all points of the section.
        let normal = (side * (sin * b) + up * cos).normalize();
        (centre + offset, normal)
    }

    /// The station at `u`, interpolated between the stored ones.
    fn station(&self, u: f64) -> Station {
        let position = u.clamp(0.0, 1.0) * (STEPS as f64);
        let index = (position as usize).min(STEPS - 1);
        let t = position - index as f64;
        let (before, after) = (&self.stations[index], &self.stations[index + 1]);
        let forward = before.forward.lerp(after.forward, t).normalize();
        let up = before.up.lerp(after.up, t).reject_from_normalized(forward).normalize();
        // Cubic Hermite interpolation with step h in cm, so that positions are as smooth as directions.
        let h = self.length_cm / STEPS as f64;
        let (t2, t3) = (t * t, t * t * t);
        let centre = before.centre * (2.0 * t3 - 3.0 * t2 + 1.0)
            + before.forward * (h * (t3 - 2.0 * t2 + t))
            + after.centre * (3.0 * t2 - 2.0 * t3)
            + after.forward * (h * (t3 - t2));
        Station { centre, forward, up }
    }

    /// Angle φ of the section at a signed arc length in cm from the top of the back.
    fn angle(&self, arc_cm: f64) -> f64 {
        // Interval of the table that contains the arc length, by which the angle is interpolated linearly.
        let index = self.arcs_cm.partition_point(|&arc| arc <= arc_cm).clamp(1, STEPS) - 1;
        let (below, above) = (self.arcs_cm[index], self.arcs_cm[index + 1]);
        (index as f64 + (arc_cm - below) / (above - below)) * TAU / STEPS as f64 - PI
    }
}

/// Relative height b of the half ellipse at an angle φ with this cosine.
fn relative_height(cos: f64) -> f64 {
    if cos >= 0.0 { BACK } else { BELLY }
}

/// Unit direction of the centreline at `u`. Seen from above, its angle with +x is bend·cos(2πu), which gives an S. The
/// slope lift·π/length·sin(2πu), integrated over the distance length·u, gives the height lift/2·(1 − cos(2πu)) above
/// the head: lift at the middle and 0 at the tail. This is approximate, because the direction is normalised.
fn heading(options: &SnakeOptions, u: f64) -> DVec3 {
    let turn = options.bend_rad * (TAU * u).cos();
    let slope = options.lift_cm * PI / options.length_cm * (TAU * u).sin();
    DVec3::new(turn.cos(), turn.sin(), slope).normalize()
}

/// The [`STEPS`] + 1 stations at equal steps of u. Simpson's rule integrates the direction. The stations are shifted
/// along x and y, so that the mean of their centres lies over the origin.
fn stations(options: &SnakeOptions) -> Vec<Station> {
    let step_cm = options.length_cm / STEPS as f64;
    // At the head, the belly touches the ground, z = 0.
    let height_cm = options.radius_cm * BELLY;
    let mut forward = heading(options, 0.0);
    let mut up = DVec3::Z.reject_from_normalized(forward).normalize();
    let mut centre = DVec3::new(0.0, 0.0, height_cm);
    let mut stations = Vec::with_capacity(STEPS + 1);
    for i in 0..=STEPS {
        stations.push(Station { centre, forward, up });
        // The step after the last station is computed but not used.
        let next = heading(options, (i + 1) as f64 / STEPS as f64);
        let middle = heading(options, (i as f64 + 0.5) / STEPS as f64);
        let next_centre = centre + (forward + middle * 4.0 + next) * (step_cm / 6.0);
        up = transported_up(up, forward, next, next_centre - centre);
        (forward, centre) = (next, next_centre);
    }
    let mean = stations.iter().map(|s| s.centre).sum::<DVec3>() / stations.len() as f64;
    for station in &mut stations {
        station.centre -= DVec3::new(mean.x, mean.y, 0.0);
    }
    stations
}

/// The upward axis after one step of the rotation-minimising frame, by double reflection (Wang, Jüttler, Zheng and Liu,
/// *Computation of Rotation Minimizing Frames*, ACM TOG 27(1), 2008). `chord` is the vector between the two centres;
/// `forward` and `next` are the directions there.
fn transported_up(up: DVec3, forward: DVec3, next: DVec3, chord: DVec3) -> DVec3 {
    let reflect = |x: DVec3, axis: DVec3| x - axis * (2.0 * axis.dot(x) / axis.length_squared());
    let reflected_forward = reflect(forward, chord);
    let reflected_up = reflect(up, chord);
    // The first reflection nearly reverses `forward`; the second maps the result to `next`.
    reflect(reflected_up, next - reflected_forward)
}

/// [`Body::arcs_cm`] for the half width `radius_cm`, by the midpoint rule.
fn section_arcs_cm(radius_cm: f64) -> Vec<f64> {
    let mut arcs = Vec::with_capacity(STEPS + 1);
    let mut total = 0.0;
    for i in 0..=STEPS {
        arcs.push(total);
        // Midpoints of steps never lie where back and belly meet.
        let angle = (i as f64 + 0.5) * TAU / STEPS as f64 - PI;
        let (sin, cos) = angle.sin_cos();
        let b = relative_height(cos);
        total += radius_cm * (cos * cos + b * b * sin * sin).sqrt() * TAU / STEPS as f64;
    }
    let top = arcs[STEPS / 2];
    arcs.iter().map(|arc| arc - top).collect()
}
