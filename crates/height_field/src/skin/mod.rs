//! Procedural snake skins after atomic-force scans of shed skin.
//!
//! The scans: 6.5 µm crops published with M. Single, *An Interactive Shader for Natural Diffraction Gratings* (Bern, 2014).
//! `tests/core/snake_spectra.rs` holds the skins against them.
//!
//! Both skins are layers of cells that end in fingers and lie over each other like tiles on a roof. Across layer `l`
//! runs `t`, from 0 where the gaps between its fingers open to 1 where the fingers end on the next layer. Coordinates
//! are warped by smooth fields that are periodic over the tile (regions of other orientation and period), and every
//! finger has its own place, length, width and height. What differs is in the two files; what they share is here.

mod elaphe;
mod regions;
mod xenopeltis;

pub(super) use elaphe::elaphe;
pub use regions::{REGION_SIZE_UM, REGION_SPREAD, Regions};
pub(super) use xenopeltis::xenopeltis;

use super::random::Random;
use ndarray::{Array2, Axis};
use rayon::prelude::*;

/// Pixels along each side of a skin.
const PIXELS: usize = 1024;

/// Numbers of one finger.
#[derive(Clone, Copy, Debug)]
struct Finger {
    /// Shift across the finger, in finger periods.
    shift: f64,
    /// Shift of the tip along the finger, in layer periods.
    tip: f64,
    /// Width factor.
    width: f64,
    /// Height of the tip in µm.
    height_um: f64,
}

/// The lattice of layers and fingers over one tile. The fingers run along +x.
struct Lattice {
    layers: usize,
    fingers: usize,
    extent_x_um: f64,
    extent_y_um: f64,
    table: Vec<Finger>,
    /// Displacements in µm, `[[iy, ix]]`.
    warp_x: Array2<f64>,
    warp_y: Array2<f64>,
    /// Shift of each layer against the lattice, in finger periods.
    layer_shift: Vec<f64>,
}

/// Where a pixel lies in the lattice.
struct LayerPlace {
    layer: i64,
    /// Along the layer, in layer periods, in `[0, 1)`.
    t: f64,
    /// Across the fingers, in finger periods.
    v: f64,
}

impl Lattice {
    fn step_um(&self) -> (f64, f64) {
        (self.extent_x_um / PIXELS as f64, self.extent_y_um / PIXELS as f64)
    }

    fn place(&self, ix: usize, iy: usize) -> LayerPlace {
        let (dx, dy) = self.step_um();
        let x = ix as f64 * dx + self.warp_x[[iy, ix]];
        let y = iy as f64 * dy + self.warp_y[[iy, ix]];
        let along = x / self.extent_x_um * self.layers as f64;
        let layer = libm::floor(along);
        LayerPlace { layer: layer as i64, t: along - layer, v: y / self.extent_y_um * self.fingers as f64 }
    }

    /// Evaluates the height of every pixel, `height(lattice, ix, iy)`.
    fn relief(&self, height: impl Fn(&Self, usize, usize) -> f64 + Sync) -> Array2<f64> {
        let mut heights = Array2::zeros((PIXELS, PIXELS));
        heights.axis_iter_mut(Axis(0)).enumerate().par_bridge().for_each(|(iy, mut row)| {
            row.iter_mut().enumerate().for_each(|(ix, h)| *h = height(self, ix, iy));
        });
        heights
    }

    fn layer_shift(&self, layer: i64) -> f64 {
        self.layer_shift[layer.rem_euclid(self.layers as i64) as usize]
    }

    fn finger(&self, layer: i64, finger: i64) -> &Finger {
        let layer = layer.rem_euclid(self.layers as i64) as usize;
        &self.table[layer * self.fingers + finger.rem_euclid(self.fingers as i64) as usize]
    }

    /// The three fingers of a layer nearest to `v`, each with its signed distance in finger periods.
    fn near(&self, layer: i64, v: f64) -> impl Iterator<Item = (&Finger, f64)> {
        let v = v + self.layer_shift(layer);
        let middle = libm::floor(v) as i64;
        (middle - 1..=middle + 1).map(move |j| {
            let finger = self.finger(layer, j);
            (finger, v - j as f64 - 0.5 - finger.shift)
        })
    }

    /// Position in µm of the point at `t` on the axis of a finger, warp undone to first order.
    fn position_um(&self, layer: i64, finger: i64, t: f64, across: f64) -> (f64, f64) {
        let (dx, dy) = self.step_um();
        let v = finger as f64 + 0.5 + across + self.finger(layer, finger).shift - self.layer_shift(layer);
        let x = (layer as f64 + t) / self.layers as f64 * self.extent_x_um;
        let y = v / self.fingers as f64 * self.extent_y_um;
        let at = |value: f64, step: f64| (libm::floor(value / step) as i64).rem_euclid(PIXELS as i64) as usize;
        let (ix, iy) = (at(x, dx), at(y, dy));
        (x - self.warp_x[[iy, ix]], y - self.warp_y[[iy, ix]])
    }

    /// Adds a Gaussian granule, periodic over the tile.
    fn granule(&self, heights: &mut Array2<f64>, centre: (f64, f64), radius: (f64, f64), height_um: f64) {
        let (dx, dy) = self.step_um();
        let span = |c: f64, r: f64, step: f64| {
            (libm::floor((c - 3.0 * r) / step) as i64)..=(libm::ceil((c + 3.0 * r) / step) as i64)
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

/// One table entry per finger of every layer.
fn fingers(count: usize, random: &mut Random, mut make: impl FnMut(&mut Random) -> Finger) -> Vec<Finger> {
    (0..count).map(|_| make(random)).collect()
}

/// Shifts and scales the heights to exactly `[0, top_um]`, as the pictures of the scans span black to white.
fn stretch(heights: &mut Array2<f64>, top_um: f64) {
    let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &h| (lo.min(h), hi.max(h)));
    heights.mapv_inplace(|h| (h - low) / (high - low) * top_um);
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

#[cfg(test)]
mod tests {
    use crate::{HeightField, Preset, Regions};

    /// Largest step between neighbours, inside and over the seam, along x and along y.
    fn steps(field: &HeightField) -> [(f64, f64); 2] {
        let h = field.heights_um();
        let mut out = [(0.0_f64, 0.0_f64); 2];
        for ((iy, ix), value) in h.indexed_iter() {
            for (axis, (jx, jy), at_seam) in
                [(0, ((ix + 1) % 1024, iy), ix == 1023), (1, (ix, (iy + 1) % 1024), iy == 1023)]
            {
                let step = (h[[jy, jx]] - value).abs();
                let slot = if at_seam { &mut out[axis].1 } else { &mut out[axis].0 };
                *slot = slot.max(step);
            }
        }
        out
    }

    #[test]
    fn skins_tile_without_a_seam_and_have_their_range() {
        let plain = |preset: Preset| preset.build(None, None).unwrap();
        let in_regions = Preset::Xenopeltis.build_in_regions(Regions::new(20.0, 0.05).unwrap()).unwrap();
        for (preset, field, top) in [
            (Preset::Elaphe, plain(Preset::Elaphe), 0.43472),
            (Preset::Xenopeltis, plain(Preset::Xenopeltis), 0.81869),
            (Preset::Xenopeltis, in_regions, 0.81869),
        ] {
            assert_eq!(field.size(), (1024, 1024));
            // The published maxima; the subtraction of the lowest height may round.
            let (low, high) = field.range_um();
            assert!(low == 0.0 && (high - top).abs() < 1e-15, "{preset}: {low} {high}");
            for (inside, seam) in steps(&field) {
                assert!(seam <= inside, "{preset}: a step of {seam} µm over the seam, {inside} µm inside");
            }
        }
    }

    #[test]
    fn skins_are_the_same_on_every_machine() {
        // FNV-1a over the bits of every height: threads, platforms and compilers must not show. Other values mean that
        // the surface changed: on purpose only.
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
