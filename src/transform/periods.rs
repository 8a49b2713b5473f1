//! Dominant periods of a relief, from the power spectrum of its heights.
//!
//! - A *wave* is a bin (jx, jy) of the heights' Fourier transform: jx and jy periods over the extents Lx and Ly in µm
//!   of the field. It has the frequencies fx = jx/Lx and fy = jy/Ly in cycles/µm, and the direction φ = atan2(fy, fx).
//! - An *axis bin* j of the x axis sums the power of all waves with |jx| = j within 45° of that axis, for any jy.
//!   Axis bins of the y axis are defined alike. Axis bin 0 is empty, since its only wave is the mean.
//! - A peak is an axis bin j whose power is at least that of its two neighbours. Powers from bin [`REFINED_MIN`] on
//!   are smoothed beforehand.
//! - The dominant period is the extent divided by the position j of the peak with the largest j·power(j). The factor j,
//!   the frequency, favours a grating over the slow undulation of natural surfaces. A parabola through the peak and its
//!   neighbours refines its position to a fraction of a bin.

use super::{Direction, Fft2};
use crate::height_field::HeightField;
use serde::Serialize;
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

/// Fraction of the heights' variance at or below which the power of a peak is attributed to rounding. Chosen: larger
/// values miss weak periods; smaller ones mistake rounding for periods.
const POWER_FRACTION_MIN: f64 = 1e-9;
/// Smallest axis bin that is smoothed with its neighbours, and whose position as a peak they refine. Bins 1 and 2 are
/// used as they are, since their neighbours hold other waves: bin 1 the tilt of the relief, bins 2 and 3 the harmonics
/// of bin 1.
const REFINED_MIN: usize = 3;
/// Half width of the band of frequencies that counts for a period's power and direction, as a fraction of the period's
/// frequency. The band reaches at least one axis bin to either side ([`Period::power_share`]). Chosen: larger values
/// include more of an irregular pattern, but also other patterns; smaller ones do the opposite.
const BAND: f64 = 0.1;

/// Dominant period along one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Period {
    /// Period along the axis, in µm.
    pub period_um: f64,
    /// Mean direction in degrees from +x towards +y, in (−90, 90], of the waves that `power_share` counts, weighted by
    /// their power.
    pub direction_deg: f64,
    /// Fraction of the variance of the heights, after multiplication by the window, in waves near the period. These are
    /// the waves within 45° of the axis whose frequency along the axis differs from that of the period by at most 10 %,
    /// or by one bin if that is more.
    pub power_share: f64,
}

/// Dominant periods along x and y.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Periods {
    /// Along x; `None` if no peak of the x axis exceeds rounding.
    pub x: Option<Period>,
    /// Along y; `None` if no peak of the y axis exceeds rounding.
    pub y: Option<Period>,
}

/// Axis bin: power at one frequency along an axis.
#[derive(Clone, Copy, Default)]
struct AxisBin {
    /// Sum of |DFT|² of the waves, not normalised.
    power: f64,
    /// Sum of the waves' powers times `exp(2iφ)`. With the double angle, the opposite waves f and −f of one real wave
    /// add up rather than cancel.
    direction: Complex64,
}

/// Dominant periods of a relief along x and y.
///
/// A period is that of the highest peak of frequency times power, refined by a parabola. The power is that of waves
/// within 45° of the axis, summed over the other axis. A field that does not repeat (`repeats` is false) is first
/// multiplied by a Hann window, since its edges do not match.
///
/// ```
/// use sunbeam::Preset;
/// use sunbeam::transform::periods;
///
/// let found = periods(&Preset::Cd.build(None, None)?, true);
/// // The tracks are 1.6 µm apart along x.
/// assert!((found.x.unwrap().period_um - 1.6).abs() < 1e-2);
/// # Ok::<(), sunbeam::height_field::HeightFieldError>(())
/// ```
pub fn periods(field: &HeightField, repeats: bool) -> Periods {
    let (nx, ny) = field.size();
    let mean_um = field.mean_um();
    let hann = |i: usize, n: usize| {
        // An axis of one pixel needs no window.
        if repeats || n == 1 { 1.0 } else { 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / n as f64).cos() }
    };
    let mut amplitudes: Vec<Complex64> = field
        .heights_um()
        .indexed_iter()
        .map(|((iy, ix), h)| ((h - mean_um) * hann(ix, nx) * hann(iy, ny)).into())
        .collect();
    Fft2::new(nx, ny, Direction::Positive).process(&mut amplitudes, &mut Vec::new());

    let (lx, ly) = field.extent_um();
    let mut along_x = vec![AxisBin::default(); nx / 2 + 1];
    let mut along_y = vec![AxisBin::default(); ny / 2 + 1];
    let mut total = 0.0;
    // Without (0, 0), the mean.
    for (index, amplitude) in amplitudes.iter().enumerate().skip(1) {
        let power = amplitude.norm_sqr();
        total += power;
        // Bins are [jy][jx] in FFT order.
        let (jx, jy) = (signed(index % nx, nx), signed(index / nx, ny));
        let (fx, fy) = (jx as f64 / lx, jy as f64 / ly);
        let direction = power * Complex64::cis(2.0 * fy.atan2(fx));
        let bin = if fx.abs() >= fy.abs() {
            &mut along_x[jx.unsigned_abs() as usize]
        } else {
            &mut along_y[jy.unsigned_abs() as usize]
        };
        bin.power += power;
        bin.direction += direction;
    }
    Periods { x: peak(&along_x, lx, total, repeats), y: peak(&along_y, ly, total, repeats) }
}

/// Signed number, in (−n/2, n/2], of a bin in FFT order, of `n` bins along an axis.
fn signed(bin: usize, n: usize) -> i64 {
    if 2 * bin > n { bin as i64 - n as i64 } else { bin as i64 }
}

/// Period of the highest peak of frequency times power; `None` where all power is attributed to rounding.
///
/// `bins` are those of one axis, from 0, and `extent_um` is the extent of the field along it. `total` is the power of
/// all waves of the field, also those within 45° of the other axis.
fn peak(bins: &[AxisBin], extent_um: f64, total: f64, repeats: bool) -> Option<Period> {
    let raw = |j: usize| bins.get(j).map_or(0.0, |bin| bin.power);
    // Smoothing with the weights ¼, ½, ¼ reduces random variation between bins, and leaves the peak of a regular
    // pattern in place.
    let smooth = |j: usize| {
        if j < REFINED_MIN { raw(j) } else { 0.25 * raw(j - 1) + 0.5 * raw(j) + 0.25 * raw(j + 1) }
    };
    // Bin 1 of a field that does not repeat contains a part of its tilt.
    let first = if repeats { 1 } else { 2 };
    // Smoothing also gives power to a bin that is empty before. Such a bin is no peak, hence the last condition.
    let best = (first..bins.len())
        .filter(|&j| smooth(j) >= smooth(j - 1) && smooth(j) >= smooth(j + 1) && raw(j) > 0.0)
        .max_by(|&a, &b| (a as f64 * smooth(a)).total_cmp(&(b as f64 * smooth(b))))?;
    let offset = if best < REFINED_MIN { 0.0 } else { vertex(smooth(best - 1), smooth(best), smooth(best + 1)) };
    let position = best as f64 + offset;
    // Sums over the band about the position, at least one bin to either side.
    let reach = (BAND * position).max(1.0);
    let near = |j: &usize| (*j as f64 - position).abs() <= reach;
    let (mut power, mut direction) = (0.0, Complex64::ZERO);
    for j in (1..bins.len()).filter(near) {
        power += bins[j].power;
        direction += bins[j].direction;
    }
    // NaN where the powers overflow.
    let power_share = power / total;
    if power_share.is_nan() || power_share <= POWER_FRACTION_MIN {
        return None;
    }
    // The sum has the double angle.
    let degrees = (0.5 * direction.arg()).to_degrees();
    // Removes rounding of the transform. Adding 0 removes the sign of −0.
    let rounded = (degrees * 1e6).round() / 1e6 + 0.0;
    // −90° is the same direction as 90°.
    let direction_deg = if rounded <= -90.0 { 90.0 } else { rounded };
    Some(Period { period_um: extent_um / position, direction_deg, power_share })
}

/// Position, from −½ to ½, of the vertex of the parabola through values at −1, 0 and 1, of which the middle one is the
/// largest.
fn vertex(before: f64, peak: f64, after: f64) -> f64 {
    let curvature = before - 2.0 * peak + after;
    if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::Preset;
    use ndarray::Array2;

    fn periods_of(preset: Preset) -> Periods {
        periods(&preset.build(None, None).unwrap(), true)
    }

    #[test]
    fn presets_have_their_documented_periods() {
        for preset in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
            let found = periods_of(preset);
            let x = found.x.unwrap();
            assert!((x.period_um - 2.5).abs() < 1e-12 && x.direction_deg.abs() < 1e-9, "{preset}: {x:?}");
            assert_eq!(found.y, None, "{preset}");
        }
        assert_eq!(periods_of(Preset::Flat), Periods { x: None, y: None });
        // Tracks are exactly 1.6 µm apart. Layers and fingers of the skins vary, hence 3 % and 5 %.
        let cd = periods_of(Preset::Cd).x.unwrap();
        assert!((cd.period_um / 1.6 - 1.0).abs() < 1e-3, "{cd:?}");
        let elaphe = periods_of(Preset::Elaphe).x.unwrap();
        assert!((elaphe.period_um / 1.144 - 1.0).abs() < 0.03, "{elaphe:?}");
        let xenopeltis = periods_of(Preset::Xenopeltis);
        let (x, y) = (xenopeltis.x.unwrap(), xenopeltis.y.unwrap());
        assert!((x.period_um / 1.552 - 1.0).abs() < 0.03, "{x:?}");
        assert!((y.period_um / 0.62 - 1.0).abs() < 0.05, "{y:?}");
    }

    #[test]
    fn directions_that_round_to_minus_90_degrees_are_90() {
        let mut bins = [AxisBin::default(); 3];
        // The double angle of a direction 3e-8 degrees above −90°.
        bins[1] = AxisBin { power: 1.0, direction: Complex64::cis(1e-9 - 0.5 * TAU) };
        assert_eq!(peak(&bins, 1.0, 1.0, true).unwrap().direction_deg, 90.0);
    }

    #[test]
    fn oblique_wave_of_a_scan_is_found_between_bins() {
        // A wave with periods of 0.7 µm along x and 0.4 µm along y has the direction 60.26°, within 45° of the y axis.
        let wave = |(iy, ix): (usize, usize)| (TAU * (ix as f64 * 0.05 / 0.7 + iy as f64 * 0.05 / 0.4)).sin();
        let field = HeightField::new(Array2::from_shape_fn((130, 150), wave), 0.05, 0.05).unwrap();
        let y = periods(&field, false).y.unwrap();
        // A parabola through a smoothed Hann peak errs by up to a twentieth of a bin, here of bin 16.
        assert!((y.period_um / 0.4 - 1.0).abs() < 4e-3, "{y:?}");
        assert!((y.direction_deg - (0.7f64 / 0.4).atan().to_degrees()).abs() < 0.5, "{y:?}");
        assert!(y.power_share > 0.95, "{y:?}");
    }
}
