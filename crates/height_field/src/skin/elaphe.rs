//! Preset `elaphe`: long tapering fingers, 1.144 µm apart, whose tips lie on the next layer.
//!
//! *Fingers* are the finger-like ridges in which the skin's overlapping cells end; a *layer* is a row of such cells.
//! A finger's *root* is at t = 0, its tip near t = 1. *Granules* are small Gaussian bumps.
//! `mod.rs` defines the coordinates: t along a layer in layer periods, v and q across the fingers in finger periods.
//! Numbers without another source were chosen by eye and by the spectra of the scans: amplitudes in µm, positions and
//! widths in these periods. [`smooth_step`] fades from 0 at its first argument to 1 at its second, which may be
//! the smaller one.

use super::{Finger, FingerShape, Lattice, PIXELS, Regions, mix, random_fingers, stretch, touching_half_width};
use crate::random::{Random, smooth_step};
use crate::{HeightField, HeightFieldError};
use ndarray::Array2;

/// Seed of all random numbers. It is arbitrary; another seed, or another order of the numbers, makes another skin.
const SEED: u64 = 0x000e_1a9e_0001;
/// Layers on the tile, 3.26 µm each.
const LAYERS: usize = 20;
/// Fingers in a layer; 57 periods make a tile of 65.2 µm.
const FINGERS: usize = 57;
/// Distance between fingers in µm: the period that Single 2014 derives from peak angles, 1144.26 nm. The preset cannot
/// confirm this number, since it is built from it.
const PERIOD_UM: f64 = 1.144_26;
/// Peak to valley in µm: the height of white in the published pictures of the scans.
const TOP_UM: f64 = 0.434_72;

/// Width of the fingers' flanks, in finger periods. A flank is the edge over which a finger's opacity, the weight of
/// its surface against the ground's, falls from 1 to 0. Wider flanks are less steep.
const FLANK: f64 = 0.16;

/// Position along a layer, in layer periods, at which the round end of a mean finger begins.
const TIP: f64 = 0.92;
/// Length of a finger's round end, in layer periods.
const TIP_LENGTH: f64 = 0.16;
/// Position along a layer, in layer periods, beyond which no finger is drawn, to save time. Few random tips reach it.
const REACH: f64 = 1.3;

/// Shape of the fingers. They lean by 0.06 finger periods per layer period towards +y.
const SHAPE: FingerShape = FingerShape { lean: -0.06, flank: FLANK, reach: REACH, half_width, surface_um };

/// Height of a layer's surface at `t`, in µm; at t < 0 it lies under the previous layer.
///
/// The surface rises by 0.084 µm around the root and falls by 0.012 µm towards the tips.
fn sheet_um(t: f64) -> f64 {
    0.175 + 0.084 * smooth_step(-0.18, 0.22, t) - 0.012 * smooth_step(0.4, 1.0, t)
}

/// Half the width of a finger at `t`, in finger periods, between the middles of its two flanks. At t = 0 neighbouring
/// fingers touch, without ground between them; from there the gap opens as a wedge. Tips are round.
fn half_width(t: f64, finger: &Finger) -> f64 {
    let t = t.max(0.0);
    // Half the width of fingers that touch.
    let touching = touching_half_width(FLANK);
    // The wedge opens as t^(3/4), by square roots, which are the same on every machine.
    let wedge = touching - (0.5 * FLANK + 0.06) * smooth_step(0.0, 0.05, t) - 0.28 * (t * t.sqrt()).sqrt();
    // Fraction of the round end that lies before `t`: 0 before the end, 1 at its extremity.
    let past = ((t - TIP - finger.tip) / TIP_LENGTH).clamp(0.0, 1.0);
    mix(touching, wedge * finger.width, smooth_step(0.0, 0.1, t)) * (1.0 - past * past).sqrt()
}

/// Height of a finger's surface at `t` and `q`, in µm.
fn surface_um(t: f64, q: f64, finger: &Finger) -> f64 {
    // The fall of the surface from the finger's axis to its sides, which is complete at |q| = 0.4.
    let fall = 0.025 * smooth_step(0.0, 0.3, t) * (q * q / 0.16).min(1.0);
    sheet_um(t) - fall + finger.height_um * smooth_step(0.0, 0.4, t)
}

/// Height of pixel (`ix`, `iy`) in µm, before granules and noise.
///
/// The ground between the fingers is the surface of the next layer, which begins under this one, with a pit beside each
/// root.
fn height_um(lattice: &Lattice, ix: usize, iy: usize) -> f64 {
    let position = lattice.position(ix, iy);
    let pit = 0.085 * smooth_step(0.0, 0.08, position.t) * smooth_step(0.42, 0.06, position.t);
    lattice.covered_um(sheet_um(position.t - 1.0) - pit, &position, &SHAPE)
}

/// Heights in µm with the fingers along +x, as in the scan, and the pixel size in µm.
fn along_x(regions: Option<Regions>) -> (Array2<f64>, f64) {
    let extent = FINGERS as f64 * PERIOD_UM;
    let mut random = Random::new(SEED);
    // Numbers are standard deviations, in the units of [`Finger`].
    let fingers = random_fingers(LAYERS * FINGERS, &mut random, |random| Finger {
        shift: 0.03 * random.normal(),
        tip: 0.09 * random.normal(),
        width: 1.0 + 0.07 * random.normal(),
        height_um: 0.008 * random.normal(),
    });
    let mut lattice = Lattice {
        layer_count: LAYERS,
        finger_count: FINGERS,
        extent_x_um: extent,
        extent_y_um: extent,
        fingers,
        // Root mean square displacements in µm. The shortest waves are an eighth and a sixth of the tile.
        warp_x: random.smooth_field(PIXELS, PIXELS, 8) * 0.85,
        warp_y: random.smooth_field(PIXELS, PIXELS, 6) * 0.12,
        // Root mean square in finger periods.
        layer_shift: (0..LAYERS).map(|_| 0.05 * random.normal()).collect(),
    };
    if let Some(regions) = regions {
        regions.displace(&mut lattice.warp_x, &mut lattice.warp_y, extent);
    }
    let mut heights = lattice.relief(height_um);
    add_granules(&mut heights, &lattice, &mut random);
    // A slow undulation, and noise with a grain along x; root mean squares in µm.
    heights += &(random.smooth_field(PIXELS, PIXELS, 10) * 0.008);
    heights += &(random.blurred_noise(PIXELS, PIXELS, 16, 1) * 0.004);
    stretch(&mut heights, TOP_UM);
    (heights, extent / PIXELS as f64)
}

/// Adds three large and six small granules on each finger. Radii (standard deviations) and heights are in µm. Granules
/// are 1.2 times as long along the finger as across it.
fn add_granules(heights: &mut Array2<f64>, lattice: &Lattice, random: &mut Random) {
    for layer in 0..LAYERS as i64 {
        for finger in 0..FINGERS as i64 {
            for granule in 0..9 {
                let large = granule < 3;
                // At random t and q.
                let centre = lattice.position_um(layer, finger, random.between(0.1, 0.95), 0.10 * random.normal());
                let (radius, top) = if large {
                    (random.between(0.08, 0.125), random.between(0.02, 0.09))
                } else {
                    (random.between(0.05, 0.07), random.between(0.005, 0.03))
                };
                // A few of the large granules are much higher than the rest.
                let top = if large && random.unit() < 0.06 { 1.9 * top } else { top };
                lattice.granule(heights, centre, (1.2 * radius, radius), top);
            }
        }
    }
}

/// The skin rotated by +90°: fingers point along +y and are 1.144 µm apart along x, the axis along which Single 2014
/// measures the period. In the published picture the fingers lie along x.
pub(crate) fn elaphe(regions: Option<Regions>) -> Result<HeightField, HeightFieldError> {
    let (heights, step) = along_x(regions);
    // The rotation by +90° maps (x, y) to (−y, x), so pixel (ix, iy) comes from column iy, and from row ix counted from
    // the last.
    let turned = Array2::from_shape_fn((PIXELS, PIXELS), |(iy, ix)| heights[[PIXELS - 1 - ix, iy]]);
    HeightField::new(turned, step, step)
}
