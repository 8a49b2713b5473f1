//! A compact disc: tracks of pits of random length.

use super::random::{Random, smooth_step};
use super::{HeightField, HeightFieldError};
use ndarray::Array2;

const PIXELS: usize = 1024;
const TRACKS: usize = 40;
/// Distance of the tracks along x (IEC 60908: 1.6 µm).
const PITCH_UM: f64 = 1.6;
const EXTENT_UM: f64 = TRACKS as f64 * PITCH_UM;
/// Channel bits along one track of the tile; makes T = 64/230 = 0.2783 µm.
const CHANNEL_BITS: u32 = 230;
const BIT_UM: f64 = EXTENT_UM / CHANNEL_BITS as f64;
const WIDTH_UM: f64 = 0.5;
const DEPTH_UM: f64 = 0.12;
/// Width of the sloped wall, from the land to the bottom.
const WALL_UM: f64 = 0.14;
const SEED: u64 = 0x00c0_ffee_cd01;
/// Chances of runs of 3 T to 11 T, in thousandths: the run lengths of eight-to-fourteen modulation fall by about a
/// third from each to the next.
const RUNS: [u32; 9] = [330, 230, 160, 110, 70, 45, 25, 15, 15];

fn run(random: &mut Random) -> u32 {
    let mut draw = random.unit() * f64::from(RUNS.iter().sum::<u32>());
    for (length, &chance) in (3..).zip(&RUNS) {
        if draw < f64::from(chance) {
            return length;
        }
        draw -= f64::from(chance);
    }
    11
}

/// `(start, length)` of the pits of one track in channel bits; pits and lands fill the tile exactly, each 3 to 11 bits.
fn pits(random: &mut Random) -> Vec<(u32, u32)> {
    let mut pits = Vec::new();
    let mut at = 0;
    while at < CHANNEL_BITS {
        let (pit, land) = (run(random), run(random));
        let after = at + pit + land;
        // What is left must be nothing, or room for one more pit and land of at least 3 bits each.
        if after == CHANNEL_BITS || after + 6 <= CHANNEL_BITS {
            pits.push((at, pit));
            at = after;
        }
    }
    pits
}

/// Forty tracks that run along y, 64 × 64 µm, periodic. Land is at 0, pits are 0.12 µm deep.
pub(super) fn cd() -> Result<HeightField, HeightFieldError> {
    let mut random = Random::new(SEED);
    let mut heights = Array2::zeros((PIXELS, PIXELS));
    let step = EXTENT_UM / PIXELS as f64;
    let wrap = |i: i64| i.rem_euclid(PIXELS as i64) as usize;
    for track in 0..TRACKS {
        let centre = (track as f64 + 0.5) * PITCH_UM;
        let offset = random.between(0.0, EXTENT_UM);
        let reach = 0.5 * (WIDTH_UM + WALL_UM);
        for (start, length) in pits(&mut random) {
            let (from, to) = (offset + f64::from(start) * BIT_UM, offset + f64::from(start + length) * BIT_UM);
            // The spine of a stadium whose outline at half depth is WIDTH_UM wide and `to − from` long.
            let (low, high) = (from + 0.5 * WIDTH_UM, to - 0.5 * WIDTH_UM);
            let first_y = libm::floor((from - WALL_UM) / step) as i64;
            let last_y = libm::ceil((to + WALL_UM) / step) as i64;
            let first_x = libm::floor((centre - reach) / step) as i64;
            let last_x = libm::ceil((centre + reach) / step) as i64;
            for iy in first_y..=last_y {
                let y = iy as f64 * step;
                let along = (low - y).max(y - high).max(0.0);
                for ix in first_x..=last_x {
                    let across = ix as f64 * step - centre;
                    let outside = (along * along + across * across).sqrt() - 0.5 * WIDTH_UM;
                    let depth = DEPTH_UM * smooth_step(0.5 * WALL_UM, -0.5 * WALL_UM, outside);
                    let height: &mut f64 = &mut heights[[wrap(iy), wrap(ix)]];
                    *height = height.min(-depth);
                }
            }
        }
    }
    HeightField::new(heights, step, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_fill_a_track_exactly() {
        let mut random = Random::new(7);
        for _ in 0..200 {
            let pits = pits(&mut random);
            let ends = pits.iter().map(|p| p.0).skip(1).chain([CHANNEL_BITS]);
            for (&(start, pit), end) in pits.iter().zip(ends) {
                assert!((3..=11).contains(&pit) && (3..=11).contains(&(end - start - pit)));
            }
        }
    }

    #[test]
    fn pits_have_their_depth_and_share() {
        let field = cd().unwrap();
        assert_eq!(field.range_um(), (-DEPTH_UM, 0.0));
        assert_eq!(field.extent_um(), (64.0, 64.0));
        // Half of a track is pit and a pit takes 0.5 of 1.6 µm: 15.6 %, less what the round ends lose (about a tenth).
        let share = field.heights_um().iter().filter(|h| **h < -0.5 * DEPTH_UM).count() as f64 / (1024.0 * 1024.0);
        assert!((0.12..0.16).contains(&share), "{share}");
    }
}
