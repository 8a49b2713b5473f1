//! The BRDF map beside the picture: reflectance over all viewing directions for one direction of the light.
//!
//! The map is an orthographic projection of the hemisphere from above: the viewing direction (x, y, z) lies at the
//! point (x, y) of the unit disc. Slow methods draw coarse maps first.

use eframe::egui;
use sunbeam::colour::{automatic_exposure, srgb_bytes};
use sunbeam_realtime::levels::Pace;
use sunbeam_realtime::{Gpu, GpuError, Query, Shader};

/// Sides of the map in pixels, from the coarsest to the finest.
const SIDES: [usize; 4] = [16, 32, 64, 128];
/// Side of the finest map in pixels.
pub(crate) const FINEST_SIDE: usize = SIDES[SIDES.len() - 1];
/// Intended time in ms of the first map after a change. Larger values show finer first maps; smaller ones show them
/// sooner.
const PREVIEW_MS: f64 = 40.0;

/// A map of the hemisphere seen from above, in the layout of `sunbeam brdf-map`: right is the relief's +x, up is +y.
#[derive(Clone)]
pub(crate) struct BrdfMap {
    /// sRGB colours, transparent outside the disc of the hemisphere.
    pub image: egui::ColorImage,
    /// Unit vector to the light in the relief's frame.
    pub wi: [f32; 3],
    /// Unit vector from the point under the cursor to the viewer in the relief's frame.
    pub wo: [f32; 3],
    /// Factor on the reflectance (1/sr) in the image, with which at most 1 % of the lit pixels exceed 1.
    pub exposure: f64,
}

/// Side in pixels of the map to draw after a map with the side `done`; `None` after the finest map. `done` is `None`
/// before the first map. `pace` is the estimated speed of the method.
///
/// The map is the finest one that takes at most [`PREVIEW_MS`]. If none does, it is the coarsest one finer than `done`.
pub(crate) fn next_side(done: Option<usize>, pace: &Pace) -> Option<usize> {
    let mut finer = SIDES.into_iter().filter(|&side| done.is_none_or(|done| side > done));
    let fits = |&side: &usize| pace.fits(pixel_count(side), PREVIEW_MS);
    finer.clone().rev().find(fits).or_else(|| finer.next())
}

/// Number of pixels of a map with this side.
fn pixel_count(side: usize) -> f64 {
    (side * side) as f64
}

/// Draws a map with `side` pixels along each side for the light at `seen`, the surface point under the cursor with its
/// directions. Updates the estimate `pace`, for which the pixels of the map count as rays.
///
/// # Errors
/// The errors of [`Shader::brdf_map`].
pub(crate) fn draw(
    gpu: &Gpu,
    shader: &Shader,
    seen: &Query,
    side: usize,
    pace: &mut Pace,
) -> Result<BrdfMap, GpuError> {
    let start = std::time::Instant::now();
    // `f_r` in 1/sr as linear sRGB, rows from the top; `None` outside the disc.
    let answers = shader.brdf_map(gpu, seen.wi, side)?;
    pace.learn(pixel_count(side), start.elapsed().as_secs_f64() * 1e3);

    let linear: Vec<Option<[f64; 3]>> = answers.into_iter().map(|rgb| rgb.map(|rgb| rgb.map(f64::from))).collect();
    let exposure = automatic_exposure(linear.iter().copied().flatten());
    let colour = |rgb: [f64; 3]| {
        let [r, g, b] = srgb_bytes(rgb.map(|value| value * exposure));
        egui::Color32::from_rgb(r, g, b)
    };
    let colours = linear.iter().map(|rgb| rgb.map_or(egui::Color32::TRANSPARENT, colour)).collect();
    let image = egui::ColorImage::new([side, side], colours);
    Ok(BrdfMap { image, wi: seen.wi, wo: seen.wo, exposure })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_method_gives_the_finest_map_at_once_and_a_slow_one_in_steps() {
        let pace = |ms_per_pixel: f64| {
            let mut pace = Pace::default();
            pace.learn(1.0, ms_per_pixel);
            pace
        };
        // The finest map takes 128² · 1e-5 ms = 0.16 ms, which is below PREVIEW_MS.
        assert_eq!(next_side(None, &pace(1e-5)), Some(FINEST_SIDE));
        assert_eq!(next_side(Some(FINEST_SIDE), &pace(1e-5)), None);
        // Even a single pixel takes longer than PREVIEW_MS.
        let mut done = None;
        for expected in SIDES {
            done = next_side(done, &pace(1e3));
            assert_eq!(done, Some(expected));
        }
        assert_eq!(next_side(done, &Pace::default()), None);
    }
}
