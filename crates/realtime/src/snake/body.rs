//! The smooth body: an S-shaped centreline with a rotation-minimising frame, swept by a flattened cross-section.
//!
//! The section consists of two half ellipses, the back and the belly, with a common half width r. At the angle φ, which
//! is 0 on top of the back, its point is r·(sin φ·side + b·cos φ·up), with b = [`BACK`] or [`BELLY`]. The skin is a
//! sheet over the upper part of the section; its two edges under the belly are the *rims*. Texture coordinates are u
//! along the centreline from head to tail and v across the sheet from rim to rim, both proportional to the arc length
//! in cm.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::SnakeOptions;

/// Height of the section above its widest line, relative to the half width; chosen by eye.
const BACK: f64 = 0.92;
/// Height of the section below its widest line, relative to the half width; chosen by eye.
const BELLY: f64 = 0.70;
/// Fraction of the girth that the sheet covers, from rim to rim. Chosen: the rims are hidden under the body.
const COVERAGE: f64 = 0.76;
/// Number of steps of the tables of centreline and section. Chosen: far finer than the cells of any mesh.
const STEPS: usize = 2048;

/// A point of the centreline with its frame.
struct Station {
    centre: DVec3,
    forward: DVec3,
    up: DVec3,
}

/// The undisplaced body, a function of the arc length along the centreline and around the section.
pub(super) struct Body {
    stations: Vec<Station>,
    length_cm: f64,
    radius_cm: f64,
    /// Arc length in cm from the top of the back to the angle `i·2π/STEPS − π`.
    arcs: Vec<f64>,
    /// Signed distances in cm from the top of the back to the rims, along the section.
    rims: (f64, f64),
}

impl Body {
    /// The body of these options. `centre_row` is the position of the top of the back between the rims, as a fraction
    /// of the sheet's width.
    pub(super) fn new(options: &SnakeOptions, centre_row: f64) -> Self {
        let arcs = section_arcs(options.radius_cm);
        let width = COVERAGE * (arcs[STEPS] - arcs[0]);
        Self {
            stations: stations(options),
            length_cm: options.length_cm,
            radius_cm: options.radius_cm,
            arcs,
            rims: (-centre_row * width, (1.0 - centre_row) * width),
        }
    }

    /// Width of the sheet in cm, rim to rim.
    pub(super) fn width_cm(&self) -> f64 {
        self.rims.1 - self.rims.0
    }

    /// Point and outward normal at `u`, `v` in [0, 1] of the skin without scales.
    pub(super) fn point(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (centre, forward, up) = self.frame(u);
        // Side is such that forward × side is up on the back.
        let side = up.cross(forward);
        let angle = self.angle(self.rims.0 + v * (self.rims.1 - self.rims.0));
        let (sin, cos) = angle.sin_cos();
        let rise = if cos >= 0.0 { BACK } else { BELLY };
        let offset = self.radius_cm * (side * sin + up * (rise * cos));
        let normal = (side * (sin * rise) + up * cos).normalize();
        (centre + offset, normal)
    }

    /// Centre, direction towards the tail, and upward axis of the section at `u`.
    fn frame(&self, u: f64) -> (DVec3, DVec3, DVec3) {
        let position = u.clamp(0.0, 1.0) * (STEPS as f64);
        let index = (position as usize).min(STEPS - 1);
        let t = position - index as f64;
        let (a, b) = (&self.stations[index], &self.stations[index + 1]);
        let forward = a.forward.lerp(b.forward, t).normalize();
        let up = a.up.lerp(b.up, t).reject_from_normalized(forward).normalize();
        // Hermite interpolation, so that positions are as smooth as directions.
        let h = self.length_cm / STEPS as f64;
        let (t2, t3) = (t * t, t * t * t);
        let centre = a.centre * (2.0 * t3 - 3.0 * t2 + 1.0)
            + a.forward * (h * (t3 - 2.0 * t2 + t))
            + b.centre * (3.0 * t2 - 2.0 * t3)
            + b.forward * (h * (t3 - t2));
        (centre, forward, up)
    }

    /// Angle of the section, 0 on the back, at a signed arc length from there.
    fn angle(&self, arc: f64) -> f64 {
        let index = self.arcs.partition_point(|&a| a <= arc).clamp(1, STEPS) - 1;
        let (a, b) = (self.arcs[index], self.arcs[index + 1]);
        (index as f64 + (arc - a) / (b - a)) * TAU / STEPS as f64 - PI
    }
}

/// Direction of the centreline at `u`. Seen from above it swings once to each side, which gives an S. The slope raises
/// the middle by about `lift_cm`.
fn heading(options: &SnakeOptions, u: f64) -> DVec3 {
    let turn = options.bend_rad * (TAU * u).cos();
    let slope = options.lift_cm * PI / options.length_cm * (TAU * u).sin();
    DVec3::new(turn.cos(), turn.sin(), slope).normalize()
}

/// The centreline with its frames at [`STEPS`] + 1 equal steps, by Simpson's rule over the direction; centred over the
/// origin.
fn stations(options: &SnakeOptions) -> Vec<Station> {
    let step = options.length_cm / STEPS as f64;
    let ground = options.radius_cm * BELLY;
    let mut forward = heading(options, 0.0);
    let mut up = DVec3::Z.reject_from_normalized(forward).normalize();
    let mut centre = DVec3::new(0.0, 0.0, ground);
    let mut stations = Vec::with_capacity(STEPS + 1);
    for i in 0..=STEPS {
        stations.push(Station { centre, forward, up });
        let next = heading(options, (i + 1) as f64 / STEPS as f64);
        let middle = heading(options, (i as f64 + 0.5) / STEPS as f64);
        let next_centre = centre + (forward + middle * 4.0 + next) * (step / 6.0);
        up = carry(up, forward, next, next_centre - centre);
        (forward, centre) = (next, next_centre);
    }
    let middle = stations.iter().map(|s| s.centre).sum::<DVec3>() / stations.len() as f64;
    for station in &mut stations {
        station.centre -= DVec3::new(middle.x, middle.y, 0.0);
    }
    stations
}

/// One step of the rotation-minimising frame by double reflection
/// (Wang, Jüttler, Zheng and Liu, *Computation of Rotation Minimizing Frames*, ACM TOG 27(1), 2008).
fn carry(up: DVec3, forward: DVec3, next: DVec3, chord: DVec3) -> DVec3 {
    let reflect = |x: DVec3, axis: DVec3| x - axis * (2.0 * axis.dot(x) / axis.length_squared());
    let half = reflect(forward, chord);
    let axis = next - half;
    let carried = reflect(up, chord);
    if axis.length_squared() < 1e-24 { carried } else { reflect(carried, axis) }
}

/// Arc length in cm at every step of the section's angle, measured from the top of the back.
fn section_arcs(radius: f64) -> Vec<f64> {
    let mut arcs = Vec::with_capacity(STEPS + 1);
    let mut total = 0.0;
    for i in 0..=STEPS {
        arcs.push(total);
        // The midpoint never falls on the joints of back and belly.
        let angle = (i as f64 + 0.5) * TAU / STEPS as f64 - PI;
        let (sin, cos) = angle.sin_cos();
        let rise = if cos >= 0.0 { BACK } else { BELLY };
        total += radius * (cos * cos + rise * rise * sin * sin).sqrt() * TAU / STEPS as f64;
    }
    let top = arcs[STEPS / 2];
    arcs.iter().map(|arc| arc - top).collect()
}
