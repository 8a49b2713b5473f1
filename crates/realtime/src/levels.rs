//! Resolutions (*levels*) of a picture that becomes finer step by step, so that a slow method shows something soon.
//!
//! The first levels have 1/16, 1/8, 1/4, 1/2 and all of the pixels along each side, with one ray for each pixel. If
//! more rays per pixel are requested, one more level has all pixels with all rays. [`next`] skips levels for fast
//! methods.

/// Divisor of the sides of the coarsest picture. A larger divisor shows the first picture of a slow method sooner, with
/// less detail. It is a power of 2, because each level halves it.
const COARSEST_DIVISOR: u32 = 16;

/// Resolution of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Divisor of the full picture's sides.
    pub divisor: u32,
    /// Number of rays along each side of a pixel, at least 1.
    pub supersample: u32,
}

impl Level {
    /// The coarsest level.
    const COARSEST: Self = Self { divisor: COARSEST_DIVISOR, supersample: 1 };

    /// The finest level: all pixels, with `supersample` rays along each side of a pixel.
    pub fn finest(supersample: u32) -> Self {
        Self { divisor: 1, supersample }
    }

    /// Width and height in pixels of the picture at this level, at least 1. `full` is the size at the finest level.
    pub fn size(self, full: (u32, u32)) -> (u32, u32) {
        (full.0.div_ceil(self.divisor).max(1), full.1.div_ceil(self.divisor).max(1))
    }

    /// Number of rays of the picture at this level. `full` is the size in pixels at the finest level.
    pub fn rays(self, full: (u32, u32)) -> f64 {
        let (width, height) = self.size(full);
        f64::from(width) * f64::from(height) * f64::from(self.supersample).powi(2)
    }

    /// Whether this is the finest level for `supersample` rays along each side of a pixel.
    pub fn is_finest(self, supersample: u32) -> bool {
        self == Self::finest(supersample)
    }

    /// The next finer level on the way to `supersample` rays along each side of a pixel; `None` after the finest one.
    /// The rays multiply only after the last halving of the divisor.
    fn finer(self, supersample: u32) -> Option<Self> {
        if self.divisor > 1 {
            return Some(Self { divisor: self.divisor / 2, ..self });
        }
        (!self.is_finest(supersample)).then_some(Self::finest(supersample))
    }
}

/// Speed of a method, estimated from the pictures drawn so far.
///
/// The time of a picture is a constant plus a time per ray, so time divided by rays overestimates the time per ray. The
/// larger the picture, the smaller the error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// `None` before the first picture.
    estimate: Option<Estimate>,
}

/// Time per ray of one picture.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    /// Number of rays of the picture.
    rays: f64,
    /// Time of the picture divided by its number of rays.
    ms_per_ray: f64,
}

impl Pace {
    /// Updates the estimate with a picture of `rays` rays that was drawn in `ms` milliseconds.
    pub fn learn(&mut self, rays: f64, ms: f64) {
        let ms_per_ray = ms / rays;
        // A smaller picture overestimates the time per ray more, so it usually does not count. A lower estimate from a
        // smaller picture shows that the method has become faster.
        if self.estimate.is_none_or(|before| rays >= before.rays || ms_per_ray < before.ms_per_ray) {
            self.estimate = Some(Estimate { rays, ms_per_ray });
        }
    }

    /// Whether a picture of `rays` rays is estimated to take at most `ms` milliseconds; false before the first picture.
    pub fn fits(&self, rays: f64, ms: f64) -> bool {
        self.estimate.is_some_and(|estimate| estimate.ms_per_ray * rays <= ms)
    }
}

/// The level to draw after the level `done`: the finest that takes at most `preview_ms` milliseconds by the estimate of
/// `pace`, and at least one step finer than `done`.
///
/// `done` is `None` before the first picture. `size` is the width and height in pixels of the finest level, and
/// `supersample` its number of rays along each side of a pixel. The result is `None` after the finest level.
pub fn next(done: Option<Level>, size: (u32, u32), supersample: u32, pace: &Pace, preview_ms: f64) -> Option<Level> {
    let mut level = match done {
        Some(done) => done.finer(supersample)?,
        None => Level::COARSEST,
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

    /// Divisor and supersampling of the levels drawn in succession; `ms_per_ray` is `None` before the first picture.
    fn drawn_levels(supersample: u32, ms_per_ray: Option<f64>) -> Vec<(u32, u32)> {
        let pace = Pace { estimate: ms_per_ray.map(|ms_per_ray| Estimate { rays: 1.0, ms_per_ray }) };
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
        assert_eq!(drawn_levels(1, Some(1e-6)), [(1, 1)]);
        assert_eq!(drawn_levels(2, Some(1e-6)), [(1, 2)]);
    }

    #[test]
    fn a_slow_or_unknown_method_begins_coarse_and_reaches_the_finest_level() {
        let slow = [(16, 1), (8, 1), (4, 1), (2, 1), (1, 1), (1, 3)];
        assert_eq!(drawn_levels(3, Some(10.0)), slow);
        assert_eq!(drawn_levels(3, None), slow);
        // In 70 ms at 1 µs per ray, 250 × 175 pixels fit, but not 500 × 350.
        assert_eq!(drawn_levels(1, Some(1e-3)), [(4, 1), (2, 1), (1, 1)]);
    }

    #[test]
    fn the_constant_time_of_a_picture_is_not_counted_per_ray() {
        // 50 ms for each picture and 1 µs for each ray.
        let mut pace = Pace::default();
        for rays in [1e3, 1e6, 1e3] {
            pace.learn(rays, 50.0 + 1e-3 * rays);
        }
        // The largest picture gives 1.05 µs for each ray: 63 ms and 105 ms, where 70 ms are accepted.
        assert!(pace.fits(6e4, PREVIEW_MS) && !pace.fits(1e5, PREVIEW_MS));
        // A picture of the largest size so far counts even if it took longer.
        pace.learn(1e6, 1e5);
        assert!(!pace.fits(6e4, PREVIEW_MS));
    }

    #[test]
    fn every_picture_has_a_pixel() {
        assert_eq!(Level { divisor: 16, supersample: 1 }.size((3, 0)), (1, 1));
    }
}
