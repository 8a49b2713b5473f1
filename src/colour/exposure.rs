//! Automatic exposure of a picture.

/// Fraction of the lit pixels that may clip. Chosen.
const CLIPPED: f64 = 0.01;

/// The exposure factor at which 1 % of the lit pixels exceed 1 in some channel of linear sRGB; 1 for a black picture.
///
/// ```
/// // One bright pixel in two hundred may clip.
/// let pixels = (0..200).map(|i| if i == 0 { [100.0; 3] } else { [0.5; 3] });
/// assert_eq!(sunbeam::colour::automatic_exposure(pixels), 2.0);
/// ```
pub fn automatic_exposure(pixels: impl Iterator<Item = [f64; 3]>) -> f64 {
    let mut largest: Vec<f64> = pixels.map(|rgb| rgb[0].max(rgb[1]).max(rgb[2])).filter(|v| *v > 0.0).collect();
    largest.sort_by(f64::total_cmp);
    let at = ((1.0 - CLIPPED) * largest.len() as f64) as usize;
    largest.get(at).map_or(1.0, |value| 1.0 / value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pixel_in_a_hundred_is_clipped() {
        let factor = automatic_exposure((1..=1000).map(|i| [0.0, f64::from(i), -1.0]));
        assert_eq!(factor, 1.0 / 991.0);
        assert_eq!(automatic_exposure(std::iter::once([0.0; 3])), 1.0);
    }
}
