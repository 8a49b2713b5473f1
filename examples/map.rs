//! Writes a colour map of a blazed grating over the outgoing hemisphere: `cargo run --release --example map > map.ppm`.
//!
//! The hemisphere is seen from above, x to the right, y up. Its pixels are directions to the viewer. Light comes in
//! along the normal.

use std::io::Write;
use sunbeam::colour::srgb_bytes;
use sunbeam::methods::{MethodKind, MethodOptions, build};
use sunbeam::scattering::{Pair, map_direction};
use sunbeam::{Options, Preset};

/// Width and height of the map in pixels.
const SIZE: usize = 256;
/// Factor from a BSDF value in 1/sr to a linear screen value, chosen by eye. A larger one shows weaker orders and
/// clips more of the strong ones.
const EXPOSURE: f64 = 0.3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // None: the preset's own period and height.
    let field = Preset::Blazed.build(None, None)?;
    // Shorter than sunlight's, the default of 65 µm, so that orders are several pixels wide.
    let options = Options { coherence_length_um: 10.0, ..Options::default() };
    // The colour table holds the integral over wavelengths: one look-up gives a colour.
    let method = build(MethodKind::Table, &field, &options, &MethodOptions::default())?;
    let wi = [0.0, 0.0, 1.0];
    let mut pixels = Vec::with_capacity(3 * SIZE * SIZE);
    for row in 0..SIZE {
        for column in 0..SIZE {
            // Pixels outside the unit disc show no direction, and are black.
            let colour = map_direction(column, row, SIZE).map_or([0.0; 3], |wo| {
                // Methods compute in single precision, as on a GPU.
                let single = |v: [f64; 3]| v.map(|component| component as f32);
                let relief = method.answer_rgb(single(wi), single(wo));
                // The answer is the relief's factor, divided by the albedo to conserve energy. The factors of obliquity
                // and shadowing multiply it. A perfect conductor has no Fresnel factor.
                // `Pair::new` gives None, here no light, unless both directions are above the surface.
                let factor = Pair::new(wi, wo).map_or(0.0, |pair| options.angular_factor(&pair));
                relief.map(|channel| factor * f64::from(channel))
            });
            pixels.extend(srgb_bytes(colour.map(|value| EXPOSURE * value)));
        }
    }
    let mut out = std::io::stdout().lock();
    writeln!(out, "P6 {SIZE} {SIZE} 255")?;
    out.write_all(&pixels)?;
    Ok(())
}
