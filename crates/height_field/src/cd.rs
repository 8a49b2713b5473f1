//! Preset `cd`: a compact disc, whose tracks are rows of pits of random length.
//!
//! The *land* is the flat surface between two pits of a track, at height 0. Pits and lands are *runs* of 3 T to 11 T,
//! as in the eight-to-fourteen modulation of IEC 60908, the standard of the disc. T is the length of one *channel
//! bit*, the shortest unit on a track. Tracks run along y. Lengths without another unit are in µm. `floor` and `ceil`
//! are those of the crate `libm`, not the platform's, so that the tile is identical on every machine (`random.rs`).

use super::preset::PIXELS;
use super::random::{Random, smooth_step};
use super::{HeightField, HeightFieldError};
use ndarray::Array2;

/// Tracks on the tile. Forty make the tile 64 µm wide, about as large as those of the presets of snake skin.
const TRACKS: usize = 40;
/// Distance between tracks along x in µm (IEC 60908).
const PITCH_UM: f64 = 1.6;
/// Side of the tile in µm.
const EXTENT_UM: f64 = TRACKS as f64 * PITCH_UM;
/// Edge of a pixel in µm.
const STEP_UM: f64 = EXTENT_UM / PIXELS as f64;
/// Channel bits along one track of the tile, rounded down to a whole number. A disc is read at 1.2 m/s and
/// 4.3218 Mbit/s (IEC 60908).
const CHANNEL_BITS: u32 = (EXTENT_UM * 4.3218 / 1.2) as u32;
/// T in µm, 0.278.
const BIT_UM: f64 = EXTENT_UM / CHANNEL_BITS as f64;
/// Width of a pit at half depth, in µm, typical of pressed discs.
const WIDTH_UM: f64 = 0.5;
/// Depth of a pit in µm: near a quarter of the wavelength of the player's laser in polycarbonate, 0.78 µm / (4 · 1.55)
/// = 0.126 µm.
const DEPTH_UM: f64 = 0.12;
/// Horizontal width of a pit's wall in µm, about as wide as the pit is deep.
const WALL_UM: f64 = 0.14;
/// Seed of the run lengths and of the tracks' starts, an arbitrary number.
const SEED: u64 = 0x00c0_ffee_cd01;
/// Relative frequencies of runs of 3 T to 11 T. In eight-to-fourteen modulation each length is about a third rarer than
/// the previous one. 11 T, which also marks the beginning of each frame, is an exception.
const RUN_WEIGHTS: [u32; 9] = [330, 230, 160, 110, 70, 45, 25, 15, 15];

/// A random run length in channel bits, 3 to 11.
fn run_length(random: &mut Random) -> u32 {
    let mut draw = random.unit() * f64::from(RUN_WEIGHTS.iter().sum::<u32>());
    for (length, &weight) in (3..).zip(&RUN_WEIGHTS) {
        if draw < f64::from(weight) {
            return length;
        }
        draw -= f64::from(weight);
    }
    // Reached only by rounding of `draw`.
    11
}

/// A pit, in channel bits.
struct Pit {
    /// Distance of its first bit from the start of the track.
    start: u32,
    length: u32,
}

/// Pits of one track. Pits and lands are 3 to 11 bits each and fill the tile exactly.
fn pits_of_track(random: &mut Random) -> Vec<Pit> {
    let mut pits = Vec::new();
    let mut start = 0;
    while start < CHANNEL_BITS {
        let (pit, land) = (run_length(random), run_length(random));
        let end = start + pit + land;
        // The remainder must be 0, or long enough for one more pit and land of at least 3 bits each. Otherwise both are
        // drawn again.
        if end == CHANNEL_BITS || end + 6 <= CHANNEL_BITS {
            pits.push(Pit { start, length: pit });
            start = end;
        }
    }
    pits
}

/// A periodic tile of 64 × 64 µm with forty tracks along y. Land is at height 0, pits are 0.12 µm deep.
pub(super) fn cd() -> Result<HeightField, HeightFieldError> {
    let mut random = Random::new(SEED);
    let mut heights = Array2::<f64>::zeros((PIXELS, PIXELS));
    for track in 0..TRACKS {
        let centre = (track as f64 + 0.5) * PITCH_UM;
        let track_start = random.between(0.0, EXTENT_UM);
        for pit in pits_of_track(&mut random) {
            let start = track_start + f64::from(pit.start) * BIT_UM;
            let end = track_start + f64::from(pit.start + pit.length) * BIT_UM;
            press(&mut heights, centre, start, end);
        }
    }
    HeightField::new(heights, STEP_UM, STEP_UM)
}

/// Lowers the heights by a pit between `start` and `end` along y, centred at `centre` along x. Parts beyond the tile
/// continue at its other side. A pit is longer than wide, since 3 T are 0.83 µm.
fn press(heights: &mut Array2<f64>, centre: f64, start: f64, end: f64) {
    // Index of a pixel of the periodic tile.
    let wrap = |i: i64| i.rem_euclid(PIXELS as i64) as usize;
    // Distance along x from the centre of a pit to the upper edge of its wall.
    let reach = 0.5 * (WIDTH_UM + WALL_UM);
    // At half depth a pit is a rectangle with half-round ends, WIDTH_UM wide and `end − start` long. Its centre line
    // joins the centres of both ends.
    let (line_start, line_end) = (start + 0.5 * WIDTH_UM, end - 0.5 * WIDTH_UM);
    let first_y = libm::floor((start - WALL_UM) / STEP_UM) as i64;
    let last_y = libm::ceil((end + WALL_UM) / STEP_UM) as i64;
    let first_x = libm::floor((centre - reach) / STEP_UM) as i64;
    let last_x = libm::ceil((centre + reach) / STEP_UM) as i64;
    for iy in first_y..=last_y {
        let y = iy as f64 * STEP_UM;
        // Distance along y from the centre line; 0 between its ends.
        let beyond_line = (line_start - y).max(y - line_end).max(0.0);
        for ix in first_x..=last_x {
            let offset_x = ix as f64 * STEP_UM - centre;
            // Signed distance from the outline at half depth, positive outside the pit.
            let outside = (beyond_line * beyond_line + offset_x * offset_x).sqrt() - 0.5 * WIDTH_UM;
            // From 0 at the wall's upper edge to the full depth at its lower one.
            let depth = DEPTH_UM * smooth_step(0.5 * WALL_UM, -0.5 * WALL_UM, outside);
            // No other pit reaches this pixel: lands are at least 3 T long.
            heights[[wrap(iy), wrap(ix)]] -= depth;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_fill_a_track_exactly() {
        let mut random = Random::new(7);
        for _ in 0..200 {
            let pits = pits_of_track(&mut random);
            let land_ends = pits.iter().map(|pit| pit.start).skip(1).chain([CHANNEL_BITS]);
            for (pit, land_end) in pits.iter().zip(land_ends) {
                let land = land_end - pit.start - pit.length;
                assert!((3..=11).contains(&pit.length) && (3..=11).contains(&land));
            }
        }
    }

    #[test]
    fn pits_have_their_depth_and_area() {
        let field = cd().unwrap();
        assert_eq!(field.range_um(), (-DEPTH_UM, 0.0));
        assert_eq!(field.extent_um(), (64.0, 64.0));
        // Half of a track is pit, 0.5 µm of 1.6 µm wide: 15.6 % of the area, less about a tenth at the round ends.
        let fraction = field.heights_um().iter().filter(|h| **h < -0.5 * DEPTH_UM).count() as f64 / (1024.0 * 1024.0);
        assert!((0.12..0.16).contains(&fraction), "{fraction}");
    }
}
