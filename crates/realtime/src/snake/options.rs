//! Options of the snake and their checks.

use super::SnakeError;

/// Shape and resolution of the snake. Its skin is a *sheet* of scales over the back and the flanks. The comment of each
/// field gives the accepted range, and the default in parentheses.
///
/// The default mesh has 10 933 vertices and 21 573 faces. The snake of Single 2014 (M. Single's thesis, *An Interactive
/// Shader for Natural Diffraction Gratings*) has 11 696 and 22 950.
#[derive(Debug, Clone, PartialEq)]
pub struct SnakeOptions {
    /// Half the number of cells along each edge of a scale, 1 to 128 (3). The number of cells is even, because corners
    /// of the sheet lie in the middle of scales, where there must be vertices.
    pub half_cells: usize,
    /// Length of the body in half scales, 4 to 400 (27). The unit is half a scale because every second row of scales is
    /// displaced by it.
    pub rows_along: usize,
    /// Width of the sheet around the body in half scales, 4 to 100 (17).
    pub rows_around: usize,
    /// Length of the centreline in cm, 1 to 100 (10.6).
    pub length_cm: f64,
    /// Half width of the body in cm, 0.1 to 10 (1.2). The height of the body is proportional to it.
    pub radius_cm: f64,
    /// Largest angle in radians, seen from above, between the S-shaped centreline and the x axis, 0 to 1.5 (0.5).
    pub bend_rad: f64,
    /// Height in cm by which the middle of the body is raised from the ground, 0 to 5 (0.25).
    pub lift_cm: f64,
    /// Factor on the height of the scales over the smooth skin, 0 to 3 (1).
    pub relief: f64,
    /// Factor on the height of the keels, the ridges along the scales, 0 (smooth scales, like those of the sunbeam
    /// snake *Xenopeltis*) to 3 (1).
    pub keel: f64,
    /// Spread of the scales' random properties, 0 (all scales alike) to 1 (0.35).
    pub variation: f64,
    /// Seed of the random properties (1). Equal options give equal meshes on every machine, up to rounding differences
    /// of the platform's mathematical functions.
    pub seed: u64,
}

impl Default for SnakeOptions {
    fn default() -> Self {
        Self {
            half_cells: 3,
            rows_along: 27,
            rows_around: 17,
            length_cm: 10.6,
            radius_cm: 1.2,
            bend_rad: 0.5,
            lift_cm: 0.25,
            relief: 1.0,
            keel: 1.0,
            variation: 0.35,
            seed: 1,
        }
    }
}

impl SnakeOptions {
    /// The snake with `factor` times the cells in each direction, rounded to an even number and at least 2. Factors
    /// that are not finite and positive change nothing.
    pub fn with_resolution(mut self, factor: f64) -> Self {
        if factor.is_finite() && factor > 0.0 {
            self.half_cells = ((self.half_cells as f64 * factor).round() as usize).max(1);
        }
        self
    }

    /// Refuses options out of range.
    ///
    /// # Errors
    /// [`SnakeError::Count`], [`SnakeError::Number`], [`SnakeError::Bend`].
    pub(super) fn check(&self) -> Result<(), SnakeError> {
        let counts = [
            ("half_cells", self.half_cells, 1, 128),
            ("rows_along", self.rows_along, 4, 400),
            ("rows_around", self.rows_around, 4, 100),
        ];
        for (field, found, least, most) in counts {
            if !(least..=most).contains(&found) {
                return Err(SnakeError::Count { field, found, least, most });
            }
        }
        let numbers = [
            ("length_cm", self.length_cm, 1.0, 100.0),
            ("radius_cm", self.radius_cm, 0.1, 10.0),
            ("bend_rad", self.bend_rad, 0.0, 1.5),
            ("lift_cm", self.lift_cm, 0.0, 5.0),
            ("relief", self.relief, 0.0, 3.0),
            ("keel", self.keel, 0.0, 3.0),
            ("variation", self.variation, 0.0, 1.0),
        ];
        for (field, found, least, most) in numbers {
            if !(least..=most).contains(&found) {
                return Err(SnakeError::Number { field, found, least, most });
            }
        }
        // Seen from above, the angle of the centreline is bend·cos(2πu) at the fraction u of its length (body.rs). Its
        // largest derivative by the length is the largest curvature, 2π·bend/length. The lower bound avoids a division
        // by zero.
        let bend_radius_cm = self.length_cm / (self.bend_rad * std::f64::consts::TAU).max(1e-9);
        // At the half width itself, the inner side of the bend would shrink to a line. The factor 1.3, chosen,
        // leaves room for the scales there.
        let least_cm = 1.3 * self.radius_cm;
        if bend_radius_cm < least_cm {
            return Err(SnakeError::Bend { radius_cm: bend_radius_cm, least_cm });
        }
        Ok(())
    }
}
