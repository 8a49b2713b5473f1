//! Sub-regions of a skin: squares with slightly shorter or longer periods.

use super::PIXELS;
use crate::HeightFieldError;
use ndarray::Array2;
use std::ops::RangeInclusive;

/// Accepted edge lengths of a sub-region in µm: about two layer periods of `xenopeltis`, and about half the edge of a
/// skin's tile, 65.2 µm.
pub const REGION_SIZE_UM: RangeInclusive<f64> = 3.0..=33.0;
/// Accepted relative deviations of the spatial frequency in a sub-region. Chosen by eye: beyond a tenth the pattern
/// looks torn at the borders.
pub const REGION_SPREAD: RangeInclusive<f64> = 0.0..=0.1;

/// Sub-regions of a skin, a model of an observation in Single 2014 (M. Single's thesis). In its measurements, the angle
/// of the diffraction peak alternates between two curves as the wavelength changes. The thesis explains the two curves
/// by regions of different period.
///
/// The tile is divided into equal squares. Their number along each axis is the even one nearest to the tile's edge
/// divided by `size_um`. Along x, the period along x is alternately divided by `1 + spread` and by `1 − spread`; the
/// period along y varies likewise along y. Layers and fingers (`mod.rs`) continue across the borders of squares, and
/// the tile stays periodic. The squares are not rotated against each other.
///
/// ```
/// use sunbeam_height_field::{Preset, Regions};
///
/// let field = Preset::Xenopeltis.build_in_regions(Regions::new(20.0, 0.05)?)?;
/// assert_eq!(field.size(), (1024, 1024));
/// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regions {
    /// Intended edge of a square in µm; the tile has a whole number of squares.
    size_um: f64,
    /// Relative deviation of the spatial frequency in a square, upwards and downwards.
    spread: f64,
}

impl Regions {
    /// Squares of about `size_um` ([`REGION_SIZE_UM`]) with the relative spread `spread` ([`REGION_SPREAD`]).
    ///
    /// # Errors
    /// A number outside of its range.
    pub fn new(size_um: f64, spread: f64) -> Result<Self, HeightFieldError> {
        let checks = [("region_size", size_um, REGION_SIZE_UM), ("region_spread", spread, REGION_SPREAD)];
        match checks.into_iter().find(|(_, found, range)| !range.contains(found)) {
            Some((parameter, found, range)) => {
                Err(HeightFieldError::NotWithin { parameter, found, low: *range.start(), high: *range.end() })
            }
            None => Ok(Self { size_um, spread }),
        }
    }

    /// Number of squares along one edge of a skin's tile, `extent_um` long: the even number nearest to extent/size.
    /// [`REGION_SIZE_UM`] keeps it at 2 or more.
    fn count(&self, extent_um: f64) -> f64 {
        2.0 * libm::round(0.5 * extent_um / self.size_um)
    }

    /// Adds the sub-regions to the displacements of a square tile's pixels: arrays `[[iy, ix]]` of [`PIXELS`]² in µm,
    /// which are added to the coordinates.
    ///
    /// The added displacement is a triangle wave that rises over one square and falls over the next. Its slope,
    /// ±`spread`, is the relative change of the spatial frequency. The wave's mean is about 0, so the pattern as a
    /// whole is not shifted.
    pub(super) fn displace(&self, warp_x: &mut Array2<f64>, warp_y: &mut Array2<f64>, extent_um: f64) {
        let count = self.count(extent_um);
        let wave: Vec<f64> = (0..PIXELS)
            .map(|i| {
                // Position in squares.
                let position = i as f64 * count / PIXELS as f64;
                let square = libm::floor(position);
                let offset = position - square;
                let is_rising = square % 2.0 == 0.0;
                // Triangle wave between 0 and 1, which becomes a displacement about 0.
                let triangle = if is_rising { offset } else { 1.0 - offset };
                self.spread * extent_um / count * (triangle - 0.5)
            })
            .collect();
        warp_x.indexed_iter_mut().for_each(|((_, ix), x)| *x += wave[ix]);
        warp_y.indexed_iter_mut().for_each(|((iy, _), y)| *y += wave[iy]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HeightField, Preset};
    use std::f64::consts::TAU;

    /// Power of the heights of the left or right half of the tile at a frequency along x in cycles/µm, with a Hann
    /// window and summed over rows.
    fn power(field: &HeightField, right: bool, frequency: f64) -> f64 {
        let half = PIXELS / 2;
        let first = if right { half } else { 0 };
        let wave: Vec<(f64, f64)> = (0..half)
            .map(|i| {
                let hann = 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / half as f64).cos();
                let (sin, cos) = (TAU * frequency * i as f64 * field.dx_um()).sin_cos();
                (hann * sin, hann * cos)
            })
            .collect();
        let mean = field.mean_um();
        let row_power = |iy: usize| {
            let sums = wave.iter().enumerate().fold((0.0, 0.0), |(a, b), (i, (sin, cos))| {
                let h = field.heights_um()[[iy, first + i]] - mean;
                (a + h * sin, b + h * cos)
            });
            sums.0 * sums.0 + sums.1 * sums.1
        };
        // Every eighth row, 0.5 µm apart, suffices for a mean.
        (0..PIXELS).step_by(8).map(row_power).sum()
    }

    /// The strongest period along x in µm of one half of the tile, between 1.35 and 1.8.
    fn strongest_um(field: &HeightField, right: bool) -> f64 {
        let periods = (0..=90).map(|i| 1.35 + 0.005 * f64::from(i));
        periods.max_by(|a, b| power(field, right, 1.0 / a).total_cmp(&power(field, right, 1.0 / b))).unwrap()
    }

    #[test]
    fn halves_of_the_tile_have_the_two_periods() {
        // Distance between layers of `xenopeltis` in µm.
        const LAYER_UM: f64 = 1.552_27;
        // The skin's random displacement moves the period of a half by 1 %, and the search has steps of 0.3 %. The
        // wrong sign would be 10 % off.
        const TOLERANCE: f64 = 0.015;
        let plain = Preset::Xenopeltis.build(None, None).unwrap();
        let regions = Regions::new(33.0, 0.05).unwrap();
        let field = Preset::Xenopeltis.build_in_regions(regions).unwrap();
        for (right, factor) in [(false, 1.05), (true, 0.95)] {
            let (before, after) = (strongest_um(&plain, right), strongest_um(&field, right));
            assert!((before / LAYER_UM - 1.0).abs() < TOLERANCE, "{before}");
            assert!((after * factor / LAYER_UM - 1.0).abs() < TOLERANCE, "{after} with a frequency of {factor}");
        }
    }

    #[test]
    fn zero_spread_is_the_plain_skin() {
        let none = Regions::new(10.0, 0.0).unwrap();
        assert_eq!(Preset::Elaphe.build_in_regions(none).unwrap(), Preset::Elaphe.build(None, None).unwrap());
    }

    #[test]
    fn number_of_squares_is_even_and_nearest_to_the_size() {
        for (size_um, count) in [(33.0, 2.0), (20.0, 4.0), (3.0, 22.0)] {
            assert_eq!(Regions::new(size_um, 0.05).unwrap().count(65.2), count, "{size_um}");
        }
    }

    #[test]
    fn errors_name_the_parameter() {
        for (size_um, spread, parameter) in
            [(2.0, 0.05, "region_size"), (f64::NAN, 0.05, "region_size"), (20.0, 0.2, "region_spread")]
        {
            let message = Regions::new(size_um, spread).unwrap_err().to_string();
            assert!(message.contains(parameter), "{message}");
        }
        // Huge numbers have an exponent rather than 300 digits.
        assert!(Regions::new(1e300, 0.05).unwrap_err().to_string().contains("is 1e300;"));
        let message = Preset::Cd.build_in_regions(Regions::new(20.0, 0.05).unwrap()).unwrap_err().to_string();
        assert!(message.contains("region_size") && message.contains("xenopeltis"), "{message}");
    }
}
