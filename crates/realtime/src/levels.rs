//! Resolutions of a picture that becomes finer step by step.
//!
//! The levels have 1/16, 1/8, 1/4, 1/2 and all of the pixels along each side with one ray for each pixel, and at last
//! all pixels with the full number of rays. [`next`] skips levels for fast methods.

/// Divisor of the coarsest picture's sides. Chosen: the picture has 1/256 of the rays, for slow methods.
const COARSEST: u32 = 16;

/// Resolution of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Divisor of the full picture's sides.
    pub divisor: u32,
    /// Rays along each side of a pixel.
    pub supersample: u32,
}

impl Level {
    /// The finest level: all pixels, with `supersample` rays along each side of a pixel.
    pub fn finest(supersample: u32) -> Self {
        Self { divisor: 1, supersample }
    }

    /// Width and height in pixels of a picture whose full size is `size`.
    pub fn size(self, (width, height): (u32, u32)) -> (u32, u32) {
        (width.div_ceil(self.divisor).max(1), height.div_ceil(self.divisor).max(1))
    }

    /// Number of rays of a picture whose full size is `size`.
    pub fn rays(self, size: (u32, u32)) -> f64 {
        let (width, height) = self.size(size);
        f64::from(width) * f64::from(height) * f64::from(self.supersample).powi(2)
    }

    /// Whether this is the finest level for `supersample` rays along each side of a pixel.
    pub fn is_last(self, supersample: u32) -> bool {
        self.divisor == 1 && self.supersample == supersample
    }

    /// The next finer level.
    fn finer(self, supersample: u32) -> Option<Self> {
        match self.divisor {
            1 if self.supersample == supersample => None,
            1 => Some(Self { divisor: 1, supersample }),
            divisor => Some(Self { divisor: divisor / 2, ..self }),
        }
    }
}

/// Speed of a method, estimated from the pictures drawn so far.
///
/// The time of a small picture is mostly a constant, so the largest picture tells the time per ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// Rays of the picture that the estimate comes from, and ms per ray.
    learnt: Option<(f64, f64)>,
}

impl Pace {
    /// Updates the estimate with a picture of `rays` rays that was drawn in `ms` milliseconds.
    pub fn learn(&mut self, rays: f64, ms: f64) {
        let per_ray = ms / rays;
        if self.learnt.is_none_or(|(most, before)| rays >= most || per_ray < before) {
            self.learnt = Some((rays, per_ray));
        }
    }

    /// Whether a picture of `rays` rays is estimated to take at most `ms` milliseconds; false before the first picture.
    pub fn fits(&self, rays: f64, ms: f64) -> bool {
        self.learnt.is_some_and(|(_, per_ray)| per_ray * rays <= ms)
    }
}

/// The level to draw after `done`: the finest that takes at most `preview_ms`, and at least one step finer than `done`.
/// `None` after the finest level.
pub fn next(done: Option<Level>, size: (u32, u32), supersample: u32, pace: &Pace, preview_ms: f64) -> Option<Level> {
    let mut level = match done {
        Some(done) => done.finer(supersample)?,
        None => Level { divisor: COARSEST, supersample: 1 },
    };
    let fits = |level: &Level| pace.fits(level.rays(size), preview_ms);
    while let Some(finer) = level.finer(supersample).filter(fits) {
        level = finer;
    }
    Some(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (u32, u32) = (1000, 700);
    const PREVIEW_MS: f64 = 70.0;

    fn all(supersample: u32, ms_per_ray: Option<f64>) -> Vec<(u32, u32)> {
        let pace = Pace { learnt: ms_per_ray.map(|ms| (1.0, ms)) };
        let mut levels = Vec::new();
        let mut done = None;
        while let Some(level) = next(done, SIZE, supersample, &pace, PREVIEW_MS) {
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
    fn a_slow_or_unknown_method_begins_coarse_and_reaches_the_finest_level() {
        let slow = [(16, 1), (8, 1), (4, 1), (2, 1), (1, 1), (1, 3)];
        assert_eq!(all(3, Some(10.0)), slow);
        assert_eq!(all(3, None), slow);
        // 11 025 pixels of a quarter of the side fit, twice the side does not.
        assert_eq!(all(1, Some(1e-3)), [(4, 1), (2, 1), (1, 1)]);
    }

    #[test]
    fn the_constant_time_of_a_picture_is_not_counted_per_ray() {
        // 50 ms per picture, and 1 µs per ray.
        let mut pace = Pace::default();
        for rays in [1e3, 1e6, 1e3] {
            pace.learn(rays, 50.0 + 1e-3 * rays);
        }
        assert!(pace.fits(6e4, PREVIEW_MS) && !pace.fits(1e5, PREVIEW_MS));
        // A frame of equal resolution that takes longer.
        pace.learn(1e6, 1e5);
        assert!(!pace.fits(6e4, PREVIEW_MS));
    }

    #[test]
    fn every_picture_has_a_pixel() {
        assert_eq!(Level { divisor: 16, supersample: 1 }.size((3, 0)), (1, 1));
    }
}
