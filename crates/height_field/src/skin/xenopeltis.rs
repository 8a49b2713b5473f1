//! Preset `xenopeltis`, the sunbeam snake: short fingers with raised round tips, in layers 1.552 µm apart.
//!
//! *Fingers* are the finger-like ridges in which the skin's overlapping cells end; a *layer* is a row of such cells.
//! `mod.rs` defines the coordinates: t along a layer in layer periods, v and q across the fingers in finger periods.
//! Numbers without another source were chosen by eye and by the spectra of the scans: amplitudes in µm, positions and
//! widths in these periods. [`smooth_step`] is 0 at its first argument and 1 at its second, which may be the smaller.

use super::{Finger, FingerShape, Lattice, PIXELS, Regions, random_fingers, stretch, touching_half_width};
use crate::random::{Random, smooth_step};
use crate::{HeightField, HeightFieldError};
use ndarray::Array2;
use std::f64::consts::TAU;

/// Seed of all random numbers. It is arbitrary; another seed, or another order of the numbers, makes another skin.
const SEED: u64 = 0x5e40_9e17_0001;
/// Layers on the tile; 42 periods make a tile of 65.2 µm.
const LAYERS: usize = 42;
/// Fingers in a layer, 0.621 µm apart; the warp varies the distance by −4 % to +3 % over the tile.
const FINGERS: usize = 105;
/// Distance between layers in µm: the period that Single 2014 derives from peak angles, 1552.27 nm. The preset cannot
/// confirm this number, since it is built from it.
const LAYER_UM: f64 = 1.552_27;
/// Peak to valley in µm: the height of white in the published pictures of the scans.
const TOP_UM: f64 = 0.818_69;

/// Width of the fingers' flanks, in finger periods. A flank is the edge over which a finger's opacity, the weight of
/// its surface against the ground's, falls from 1 to 0. Wider flanks are less steep.
const FLANK: f64 = 0.20;
/// Height of a layer's surface between pits and tips, in µm.
const PLAIN_UM: f64 = 0.435;

/// Position along a layer, in layer periods, at which the round end of a mean finger begins.
const TIP: f64 = 0.80;
/// Length of a finger's round end, in layer periods.
const TIP_LENGTH: f64 = 0.20;
/// Standard deviation of the tips' positions, in layer periods.
const TIP_SIGMA: f64 = 0.06;
/// Position along a layer, in layer periods, beyond which no finger is drawn, to save time. No finger is longer, since
/// [`Random::normal`] is at most 6.
const REACH: f64 = TIP + TIP_LENGTH + 6.0 * TIP_SIGMA;

/// Shape of the fingers, which lean towards −y.
const SHAPE: FingerShape = FingerShape { lean: 0.15, flank: FLANK, reach: REACH, half_width, surface_um };

/// Half the width of a finger at `t`, in finger periods, between the middles of its two flanks. Fingers touch at t = 0,
/// from which a pointed gap opens between them. Tips are round.
fn half_width(t: f64, finger: &Finger) -> f64 {
    // Half width at which neighbours cover the ground between them.
    let touching = touching_half_width(FLANK);
    let gap = 0.5 * FLANK * smooth_step(0.0, 0.08, t) + 0.17 * smooth_step(0.03, 0.45, t);
    // Wide and narrow fingers differ only near the tip, which is a bulb.
    let bulb = 0.36 * (finger.width - 1.0) * smooth_step(0.5, 0.85, t);
    // Fraction of the round end that lies before `t`: 0 before the end, 1 at its extremity.
    let past = ((t - TIP - finger.tip) / TIP_LENGTH).clamp(0.0, 1.0);
    (touching - gap + bulb) * (1.0 - past * past).sqrt()
}

/// Height of a finger's surface at `t` and `q`, in µm.
fn surface_um(t: f64, q: f64, finger: &Finger) -> f64 {
    // Fraction of the tip's height that the finger has reached.
    let rise = 0.35 * smooth_step(0.0, 0.4, t) + 0.65 * smooth_step(0.45, 0.9, t);
    // The fall of the surface from the finger's axis to its sides: 0.03 µm at |q| = 0.4, at most 0.045 µm.
    let fall = 0.03 * smooth_step(0.05, 0.4, t) * (q * q / 0.16).min(1.5);
    PLAIN_UM - 0.02 * (1.0 - rise) + finger.height_um * rise - fall
}

/// Height of pixel (`ix`, `iy`) in µm, before granules and noise.
///
/// The ground is the plain of this layer, with a pit between the fingers.
fn height_um(lattice: &Lattice, ix: usize, iy: usize) -> f64 {
    let position = lattice.position(ix, iy);
    let pit = 0.16 * smooth_step(0.04, 0.16, position.t) * smooth_step(0.95, 0.25, position.t);
    let ground_um = PLAIN_UM - 0.02 * smooth_step(0.2, 0.9, position.t) - pit;
    lattice.covered_um(ground_um, &position, &SHAPE)
}

/// The skin in the orientation of the scan: fingers along +x, layers 1.552 µm apart along x, fingers 0.62 µm apart
/// along y. With `regions` the periods alternate between squares of the tile.
pub(crate) fn xenopeltis(regions: Option<Regions>) -> Result<HeightField, HeightFieldError> {
    let extent_um = LAYERS as f64 * LAYER_UM;
    let mut random = Random::new(SEED);
    // Shifts and tips are in the module's periods, widths are factors.
    let fingers = random_fingers(LAYERS * FINGERS, &mut random, |random| Finger {
        shift: 0.06 * random.normal(),
        tip: TIP_SIGMA * random.normal(),
        // Some fingers are wide enough to merge with a neighbour at the tip.
        width: if random.unit() < 0.12 { random.between(1.5, 2.1) } else { random.between(0.6, 1.3) },
        height_um: random.between(0.03, 0.19),
    });
    let phases = [random.between(0.0, TAU), random.between(0.0, TAU)];
    // Displacement of a layer along y in finger periods: two slow waves over the layers, and a random shift.
    let displacement = |layer: usize, random: &mut Random| {
        let angle = TAU * layer as f64 / LAYERS as f64;
        0.25 * libm::sin(angle + phases[0]) + 0.2 * libm::sin(3.0 * angle + phases[1]) + 0.09 * random.normal()
    };
    let mut lattice = Lattice {
        layer_count: LAYERS,
        finger_count: FINGERS,
        extent_x_um: extent_um,
        extent_y_um: extent_um,
        fingers,
        // Root mean square displacements in µm. The shortest waves are a sixth and a quarter of the tile.
        warp_x: random.smooth_field(PIXELS, PIXELS, 6) * 0.11,
        warp_y: random.smooth_field(PIXELS, PIXELS, 4) * 0.12,
        layer_shift: (0..LAYERS).map(|layer| displacement(layer, &mut random)).collect(),
    };
    if let Some(regions) = regions {
        regions.displace(&mut lattice.warp_x, &mut lattice.warp_y, extent_um);
    }
    let mut heights = lattice.relief(height_um);
    add_granules(&mut heights, &lattice, &mut random);
    // A slow undulation, and noise with a grain along x; root mean squares in µm.
    heights += &(random.smooth_field(PIXELS, PIXELS, 12) * 0.015);
    heights += &(random.blurred_noise(PIXELS, PIXELS, 3, 1) * 0.008);
    stretch(&mut heights, TOP_UM);
    HeightField::new(heights, extent_um / PIXELS as f64, extent_um / PIXELS as f64)
}

/// Adds a granule, a small Gaussian bump, to about 12 % of the tips and a deep dent to about 12 % of the pits. Radii
/// (standard deviations) and heights are in µm.
fn add_granules(heights: &mut Array2<f64>, lattice: &Lattice, random: &mut Random) {
    for layer in 0..LAYERS as i64 {
        for finger in 0..FINGERS as i64 {
            let (chance, along) = (random.unit(), random.unit());
            if chance < 0.12 {
                let centre = lattice.position_um(layer, finger, 0.7 + 0.3 * along, 0.2 * random.normal());
                let radius = random.between(0.06, 0.11);
                let top = random.between(0.03, 0.23);
                lattice.granule(heights, centre, (radius, radius), top);
            } else if chance > 0.88 {
                // The pit lies half a period beside its finger, and is longer along the fingers than across.
                let centre = lattice.position_um(layer, finger, 0.15 + 0.35 * along, 0.5);
                let radius = random.between(0.05, 0.08);
                lattice.granule(heights, centre, (2.0 * radius, radius), -random.between(0.03, 0.18));
            }
        }
    }
}
