//! Automatic exposure of a picture.

/// Fraction of the lit pixels that may clip. Larger values brighten pictures; smaller ones keep more highlights.
const CLIPPED_FRACTION: f64 = 0.01;

/// Factor on a picture in linear sRGB after which at most the fraction `CLIPPED_FRACTION`, 1 %, of the lit pixels have
/// a channel above 1. The largest channel of all other pixels becomes 1. A pixel is lit if a channel is positive. The
/// factor of a black picture is 1.
///
/// ```
/// // One bright pixel in two hundred may clip.
/// let pixels = (0..200).map(|i| if i == 0 { [100.0; 3] } else { [0.5; 3] });
/// assert_eq!(sunbeam::colour::automatic_exposure(pixels), 2.0);
/// ```
pub fn automatic_exposure(pixels: impl Iterator<Item = [f64; 3]>) -> f64 {
    // Largest channels of the lit pixels.
    let mut peaks: Vec<f64> = pixels.map(|[r, g, b]| r.max(g).max(b)).filter(|peak| *peak > 0.0).collect();
    peaks.sort_by(f64::total_cmp);
    // Only pixels with a peak after this index clip.
    let last_unclipped = ((1.0 - CLIPPED_FRACTION) * peaks.len() as f64) as usize;
    // Without lit pixels there is no peak.
    peaks.get(last_unclipped).map_or(1.0, |peak| 1.0 / peak)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_one_pixel_in_a_hundred_is_clipped() {
        // The negative channel, as of a colour outside sRGB, does not matter.
        let factor = automatic_exposure((1..=1000).map(|i| [0.0, f64::from(i), -1.0]));
        assert_eq!(factor, 1.0 / 991.0);
        assert_eq!(automatic_exposure(std::iter::once([0.0; 3])), 1.0);
    }
}
