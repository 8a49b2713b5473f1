//! How fine a picture is drawn first, and how it becomes finer while nobody touches anything.

/// A first picture after a change should not take longer than this.
const PREVIEW_MS: f64 = 70.0;
/// Pixels of the window along each side of a pixel of the coarsest picture.
const COARSEST: u32 = 16;

/// How finely a picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Sides are divided by this.
    pub divisor: u32,
    /// Rays along each side of a pixel.
    pub supersample: u32,
}

impl Level {
    /// Pixels of a picture that is `size` in full.
    pub fn size(self, (width, height): (u32, u32)) -> (u32, u32) {
        (width.div_ceil(self.divisor).max(1), height.div_ceil(self.divisor).max(1))
    }

    fn rays(self, size: (u32, u32)) -> f64 {
        let (width, height) = self.size(size);
        f64::from(width) * f64::from(height) * f64::from(self.supersample).powi(2)
    }

    /// Whether nothing finer follows.
    pub fn is_last(self, supersample: u32) -> bool {
        self.divisor == 1 && self.supersample == supersample
    }

    fn finer(self, supersample: u32) -> Option<Self> {
        match self.divisor {
            1 if self.supersample == supersample => None,
            1 => Some(Self { divisor: 1, supersample }),
            divisor => Some(Self { divisor: divisor / 2, ..self }),
        }
    }
}

/// The level to draw after `done`: the finest that fits [`PREVIEW_MS`], at least one step finer than what is there.
/// `None` when that is the finest. `ms_per_ray` is what rays took last, `None` before the first.
pub fn next(done: Option<Level>, size: (u32, u32), supersample: u32, ms_per_ray: Option<f64>) -> Option<Level> {
    let mut level = match done {
        Some(done) => done.finer(supersample)?,
        None => Level { divisor: COARSEST, supersample: 1 },
    };
    let fits = |level: &Level| ms_per_ray.is_some_and(|ms| ms * level.rays(size) <= PREVIEW_MS);
    while let Some(finer) = level.finer(supersample).filter(fits) {
        level = finer;
    }
    Some(level)
}

/// What rays of a picture took.
pub fn ms_per_ray(level: Level, size: (u32, u32), ms: f64) -> f64 {
    ms / level.rays(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (u32, u32) = (1000, 700);

    fn all(supersample: u32, ms_per_ray: Option<f64>) -> Vec<(u32, u32)> {
        let mut levels = Vec::new();
        let mut done = None;
        while let Some(level) = next(done, SIZE, supersample, ms_per_ray) {
            levels.push((level.divisor, level.supersample));
            done = Some(level);
        }
        levels
    }

    #[test]
    fn a_fast_method_is_drawn_in_full_at_once() {
        assert_eq!(all(1, Some(1e-6)), [(1, 1)]);
        assert_eq!(all(2, Some(1e-6)), [(1, 2)]);
    }

    #[test]
    fn a_slow_or_unknown_one_begins_coarsely_and_reaches_the_finest() {
        let slow = [(16, 1), (8, 1), (4, 1), (2, 1), (1, 1), (1, 3)];
        assert_eq!(all(3, Some(10.0)), slow);
        assert_eq!(all(3, None), slow);
        // 11 025 pixels of a quarter of the side fit, twice the side does not.
        assert_eq!(all(1, Some(1e-3)), [(4, 1), (2, 1), (1, 1)]);
    }

    #[test]
    fn no_picture_is_smaller_than_a_pixel() {
        assert_eq!(Level { divisor: 16, supersample: 1 }.size((3, 0)), (1, 1));
    }
}
