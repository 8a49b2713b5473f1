//! The BRDF map beside the picture: reflectance over all viewing directions for one direction of the light.

use eframe::egui;
use sunbeam::colour::{automatic_exposure, srgb_bytes};
use sunbeam_realtime::levels::Pace;
use sunbeam_realtime::{Gpu, GpuError, Query, Shader};

/// Sides of the map in pixels, from the coarsest to the finest.
const SIDES: [usize; 4] = [16, 32, 64, 128];
/// Index of the last side.
pub(crate) const LAST: usize = SIDES.len() - 1;
/// Time in ms that the first map after a change may take.
const PREVIEW_MS: f64 = 40.0;

/// A map seen from above, in the layout of `sunbeam brdf-map`: right is the grating's +x, up is +y.
#[derive(Clone)]
pub(crate) struct BrdfMap {
    pub image: egui::ColorImage,
    /// Direction to the light.
    pub wi: [f32; 3],
    /// Direction from the point under the cursor to the viewer.
    pub wo: [f32; 3],
    /// Factor on the reflectance at which 1 % of the pixels exceed 1.
    pub exposure: f64,
}

/// Index of the side to draw after `done`: the finest one in time, else the next.
pub(crate) fn next(done: Option<usize>, pace: &Pace) -> Option<usize> {
    let first = done.map_or(0, |done| done + 1);
    if first >= SIDES.len() {
        return None;
    }
    let fits = |&index: &usize| pace.fits(pixels(index), PREVIEW_MS);
    Some((first..SIDES.len()).rev().find(fits).unwrap_or(first))
}

/// Number of pixels of the map with the side of this index.
fn pixels(index: usize) -> f64 {
    (SIDES[index] * SIDES[index]) as f64
}

/// Draws the map with the side of this index for the light at `seen`, and learns its speed.
///
/// # Errors
/// The errors of [`Shader::brdf_map`].
pub(crate) fn draw(
    gpu: &Gpu,
    shader: &Shader,
    seen: &Query,
    index: usize,
    pace: &mut Pace,
) -> Result<BrdfMap, GpuError> {
    let start = std::time::Instant::now();
    let side = SIDES[index];
    let answers = shader.brdf_map(gpu, seen.wi, side)?;
    pace.learn(pixels(index), start.elapsed().as_secs_f64() * 1e3);

    let linear: Vec<Option<[f64; 3]>> = answers.into_iter().map(|rgb| rgb.map(|rgb| rgb.map(f64::from))).collect();
    let exposure = automatic_exposure(linear.iter().copied().flatten());
    let colour = |rgb: [f64; 3]| {
        let [r, g, b] = srgb_bytes(rgb.map(|value| value * exposure));
        egui::Color32::from_rgb(r, g, b)
    };
    let pixels = linear.iter().map(|rgb| rgb.map_or(egui::Color32::TRANSPARENT, colour)).collect();
    let image = egui::ColorImage::new([side, side], pixels);
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
        assert_eq!(next(None, &pace(1e-5)), Some(LAST));
        assert_eq!(next(Some(LAST), &pace(1e-5)), None);
        let mut done = None;
        for expected in 0..SIDES.len() {
            done = next(done, &pace(1e3));
            assert_eq!(done, Some(expected));
        }
        assert_eq!(next(done, &Pace::default()), None);
    }
}
