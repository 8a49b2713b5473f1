//! Procedural snake skins, modelled on atomic-force scans of shed skin.
//!
//! The scans are the 6.5 µm crops published with M. Single, *An Interactive Shader for Natural Diffraction Gratings*
//! (Bern, 2014). `tests/core/snake_spectra.rs` compares the spectra of skins and scans. Numbers without another source
//! in the files of both skins were chosen by eye and by these spectra.
//!
//! The cells of a skin lie in rows, the *layers*, which overlap like tiles on a roof. Each cell ends in several
//! finger-like ridges, its *fingers*. The shapes of the cells are not modelled. Coordinates, with the fingers along +x:
//!
//! - `t`: position along a layer, in layer periods: 0 at the root of the layer's fingers, where the gaps between them
//!   begin; 1 where the next layer begins; above 1 at tips that lie on the next layer;
//! - `v`: position across the fingers (along y), in finger periods;
//! - `q`: signed distance from the axis of one finger, in finger periods.
//!
//! One skin is built in this order:
//!
//! 1. The lattice of layers and fingers.
//! 2. The height of every pixel: the ground, mixed with the fingers near it by their *opacity*, 1 inside a finger and 0
//!    outside.
//! 3. Gaussian granules: bumps, and dents of negative height.
//! 4. A slow undulation and noise.
//! 5. A stretch to the published range of heights.
//!
//! Coordinates are *warped*: smooth periodic displacements are added to them, so that orientation and period vary over
//! the tile. Every finger has its own position, length, width and height. `elaphe.rs` and `xenopeltis.rs` hold the
//! shapes, `regions.rs` squares with shorter or longer periods. This file has the code that both skins share.

mod elaphe;
mod regions;
mod xenopeltis;

pub(super) use elaphe::elaphe;
pub use regions::{REGION_SIZE_UM, REGION_SPREAD, Regions};
pub(super) use xenopeltis::xenopeltis;

use super::preset::PIXELS;
use super::random::{Random, smooth_step};
use ndarray::{Array2, Axis};
use rayon::prelude::*;

/// Standard deviations to which a granule extends. Its height there is a hundredth of that at its centre. Larger values
/// take more time; smaller ones leave a step around granules.
const GRANULE_REACH: f64 = 3.0;

/// Random deviations of one finger from the regular pattern.
#[derive(Clone, Copy, Debug)]
struct Finger {
    /// Shift across the finger, in finger periods.
    shift: f64,
    /// Shift of the tip along the finger, in layer periods.
    tip: f64,
    /// Width relative to that of a regular finger.
    width: f64,
    /// Height of the tip above the layer's surface, in µm.
    height_um: f64,
}

/// Shape of the fingers of one skin.
struct FingerShape {
    /// Lean of the fingers towards −y over one layer period, in finger periods; negative towards +y.
    lean: f64,
    /// Width of a finger's flanks, in finger periods. A flank is the edge at which the opacity falls from 1 to 0.
    flank: f64,
    /// Position along a layer beyond which no finger is drawn, in layer periods; at most 2, the end of the next layer.
    reach: f64,
    /// Half the width of a finger at `t`, in finger periods, between the middles of its two flanks.
    half_width: fn(t: f64, finger: &Finger) -> f64,
    /// Height of a finger's surface at `t` and `q`, in µm.
    surface_um: fn(t: f64, q: f64, finger: &Finger) -> f64,
}

/// Half the width of fingers that touch, in finger periods: half a period plus 0.6 flanks. The flank then begins at
/// |q| = ½ + 0.1 flanks, beyond the line |q| = ½ where fingers touch, so the opacity is 1 everywhere.
fn touching_half_width(flank: f64) -> f64 {
    0.5 + 0.6 * flank
}

/// Layers and fingers over one tile, with the fingers along +x.
struct Lattice {
    /// Number of layers along x.
    layer_count: usize,
    /// Number of fingers along y in every layer.
    finger_count: usize,
    /// Length of the tile along x in µm.
    extent_x_um: f64,
    /// Length of the tile along y in µm.
    extent_y_um: f64,
    /// Every finger, `[layer · finger_count + finger]`.
    fingers: Vec<Finger>,
    /// Displacement along x in µm, added to the coordinate of pixel `[[iy, ix]]`.
    warp_x: Array2<f64>,
    /// Displacement along y in µm, added to the coordinate of pixel `[[iy, ix]]`.
    warp_y: Array2<f64>,
    /// Shift of each layer against the lattice towards −y, in finger periods.
    layer_shift: Vec<f64>,
}

/// Coordinates of a pixel in the lattice.
struct Position {
    /// Number of the layer along x. It may lie outside 0 to `layer_count` − 1; the layers repeat.
    layer: i64,
    /// Position along the layer, in layer periods, in `[0, 1)`.
    t: f64,
    /// Position across the fingers, in finger periods, before the layer's shift.
    v: f64,
}

impl Lattice {
    /// Pixel size along x and y in µm.
    fn step_um(&self) -> (f64, f64) {
        (self.extent_x_um / PIXELS as f64, self.extent_y_um / PIXELS as f64)
    }

    /// Coordinates of pixel (`ix`, `iy`), warped.
    fn position(&self, ix: usize, iy: usize) -> Position {
        let (dx, dy) = self.step_um();
        let x = ix as f64 * dx + self.warp_x[[iy, ix]];
        let y = iy as f64 * dy + self.warp_y[[iy, ix]];
        let x_in_layers = x / self.extent_x_um * self.layer_count as f64;
        let layer = libm::floor(x_in_layers);
        Position { layer: layer as i64, t: x_in_layers - layer, v: y / self.extent_y_um * self.finger_count as f64 }
    }

    /// Heights `[[iy, ix]]` of all pixels from `height(lattice, ix, iy)`.
    fn relief(&self, height: impl Fn(&Self, usize, usize) -> f64 + Sync) -> Array2<f64> {
        let mut heights = Array2::zeros((PIXELS, PIXELS));
        heights.axis_iter_mut(Axis(0)).enumerate().par_bridge().for_each(|(iy, mut row)| {
            row.iter_mut().enumerate().for_each(|(ix, h)| *h = height(self, ix, iy));
        });
        heights
    }

    /// Shift of a layer in finger periods; layers repeat over the tile.
    fn shift_of(&self, layer: i64) -> f64 {
        self.layer_shift[layer.rem_euclid(self.layer_count as i64) as usize]
    }

    /// A finger by layer and number, both of which repeat over the tile.
    fn finger(&self, layer: i64, finger: i64) -> &Finger {
        let layer = layer.rem_euclid(self.layer_count as i64) as usize;
        &self.fingers[layer * self.finger_count + finger.rem_euclid(self.finger_count as i64) as usize]
    }

    /// The three fingers of a layer nearest to `v`, each with `q`: the signed distance of `v` from its axis in finger
    /// periods. The regular axes of other fingers are at least 1.5 periods away, farther than a finger reaches.
    fn near(&self, layer: i64, v: f64) -> impl Iterator<Item = (&Finger, f64)> {
        let v = v + self.shift_of(layer);
        let middle = libm::floor(v) as i64;
        (middle - 1..=middle + 1).map(move |j| {
            let finger = self.finger(layer, j);
            // The regular axis of finger j is at j + ½.
            (finger, v - j as f64 - 0.5 - finger.shift)
        })
    }

    /// Height in µm at a position. The ground is covered by the fingers of the position's layer, and both are covered
    /// by the tips of the previous layer.
    fn covered_um(&self, ground_um: f64, position: &Position, shape: &FingerShape) -> f64 {
        let mut height_um = ground_um;
        for (layer, t) in [(position.layer, position.t), (position.layer - 1, position.t + 1.0)] {
            if t > shape.reach {
                continue;
            }
            // Opacity of the most opaque finger at the position, and the height of its surface.
            let (mut opacity_max, mut surface_um) = (0.0_f64, 0.0);
            for (finger, q) in self.near(layer, position.v + shape.lean * t) {
                let half = (shape.half_width)(t, finger);
                // A flank is no wider than the finger.
                let flank = shape.flank.min(half * 2.0);
                // Falls from 1 at |q| = half − flank/2 to 0 at |q| = half + flank/2; 0 where the finger has no width.
                let opacity =
                    if half > 0.0 { smooth_step(half + 0.5 * flank, half - 0.5 * flank, q.abs()) } else { 0.0 };
                if opacity > opacity_max {
                    (opacity_max, surface_um) = (opacity, (shape.surface_um)(t, q, finger));
                }
            }
            height_um = mix(height_um, surface_um, opacity_max);
        }
        height_um
    }

    /// Position `(x, y)` in µm at `t` along a finger, `across` finger periods from its axis at the root.
    ///
    /// The lean of the fingers is neglected: the axis at `t` lies [`FingerShape::lean`] · `t` finger periods further
    /// towards −y. The warp is undone approximately: the displacement is read at the position in the regular lattice,
    /// not at the result. Corrections would change the heights of the presets.
    fn position_um(&self, layer: i64, finger: i64, t: f64, across: f64) -> (f64, f64) {
        let (dx, dy) = self.step_um();
        let v = finger as f64 + 0.5 + across + self.finger(layer, finger).shift - self.shift_of(layer);
        let x = (layer as f64 + t) / self.layer_count as f64 * self.extent_x_um;
        let y = v / self.finger_count as f64 * self.extent_y_um;
        let pixel = |value: f64, step: f64| (libm::floor(value / step) as i64).rem_euclid(PIXELS as i64) as usize;
        let (ix, iy) = (pixel(x, dx), pixel(y, dy));
        (x - self.warp_x[[iy, ix]], y - self.warp_y[[iy, ix]])
    }

    /// Adds a Gaussian granule to the periodic `heights`. `centre` and `radius` (standard deviation) are `(x, y)` in
    /// µm. A negative `height_um` makes a dent.
    fn granule(&self, heights: &mut Array2<f64>, centre: (f64, f64), radius: (f64, f64), height_um: f64) {
        let (dx, dy) = self.step_um();
        let span = |c: f64, r: f64, step: f64| {
            let reach = GRANULE_REACH * r;
            (libm::floor((c - reach) / step) as i64)..=(libm::ceil((c + reach) / step) as i64)
        };
        let wrap = |i: i64| i.rem_euclid(PIXELS as i64) as usize;
        for iy in span(centre.1, radius.1, dy) {
            let y = (iy as f64 * dy - centre.1) / radius.1;
            for ix in span(centre.0, radius.0, dx) {
                let x = (ix as f64 * dx - centre.0) / radius.0;
                heights[[wrap(iy), wrap(ix)]] += height_um * libm::exp(-0.5 * (x * x + y * y));
            }
        }
    }
}

/// Draws `count` fingers from `random`, each by `make`.
fn random_fingers(count: usize, random: &mut Random, mut make: impl FnMut(&mut Random) -> Finger) -> Vec<Finger> {
    (0..count).map(|_| make(random)).collect()
}

/// Shifts and scales the heights, which must not all be equal, to exactly `[0, top_um]`. This is the range from black
/// to white in the published pictures.
fn stretch(heights: &mut Array2<f64>, top_um: f64) {
    let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &h| (lo.min(h), hi.max(h)));
    heights.mapv_inplace(|h| (h - low) / (high - low) * top_um);
}

/// Linear interpolation from `a` to `b`.
fn mix(a: f64, b: f64, fraction: f64) -> f64 {
    a + (b - a) * fraction
}

#[cfg(test)]
mod tests {
    use super::PIXELS;
    use crate::{HeightField, Preset, Regions};

    /// Largest step in µm between neighbouring pixels along x and along y: `(inside the tile, across its seam)`.
    fn steps(field: &HeightField) -> [(f64, f64); 2] {
        let h = field.heights_um();
        let mut largest = [(0.0_f64, 0.0_f64); 2];
        for ((iy, ix), value) in h.indexed_iter() {
            for (axis, (jx, jy), at_seam) in
                [(0, ((ix + 1) % PIXELS, iy), ix == PIXELS - 1), (1, (ix, (iy + 1) % PIXELS), iy == PIXELS - 1)]
            {
                let step = (h[[jy, jx]] - value).abs();
                let slot = if at_seam { &mut largest[axis].1 } else { &mut largest[axis].0 };
                *slot = slot.max(step);
            }
        }
        largest
    }

    #[test]
    fn skins_have_their_range_and_no_seam() {
        let plain = |preset: Preset| preset.build(None, None).unwrap();
        let in_regions = Preset::Xenopeltis.build_in_regions(Regions::new(20.0, 0.05).unwrap()).unwrap();
        for (preset, field, top) in [
            (Preset::Elaphe, plain(Preset::Elaphe), 0.43472),
            (Preset::Xenopeltis, plain(Preset::Xenopeltis), 0.81869),
            (Preset::Xenopeltis, in_regions, 0.81869),
        ] {
            assert_eq!(field.size(), (1024, 1024));
            // The published maxima, to rounding.
            let (low, high) = field.range_um();
            assert!(low == 0.0 && (high - top).abs() < 1e-15, "{preset}: {low} {high}");
            for (inside, seam) in steps(&field) {
                assert!(seam <= inside, "{preset}: a step of {seam} µm across the seam, {inside} µm inside");
            }
        }
    }

    #[test]
    fn heights_are_identical_on_every_machine() {
        // FNV-1a over the bits of every height: threads, platforms and compilers must not matter. Another hash means
        // another surface.
        for (preset, regions, pinned) in [
            (Preset::Elaphe, None, 0x251c_72f3_c1d2_f5db_u64),
            (Preset::Xenopeltis, None, 0x4629_5934_bdb2_1ed1),
            (Preset::Xenopeltis, Regions::new(20.0, 0.05).ok(), 0xedc7_834d_79c3_d939),
            (Preset::Cd, None, 0x1658_47ce_12d1_23de),
        ] {
            let field = match regions {
                Some(regions) => preset.build_in_regions(regions).unwrap(),
                None => preset.build(None, None).unwrap(),
            };
            let hash = field
                .heights_um()
                .iter()
                .fold(0xcbf2_9ce4_8422_2325_u64, |hash, h| (hash ^ h.to_bits()).wrapping_mul(0x0100_0000_01b3));
            assert_eq!(hash, pinned, "{preset}: {hash:#018x}");
        }
    }
}
