//! The colours over the hemisphere, seen from above, as a portable pixmap: `cargo run --release --example map > map.ppm`.

use std::io::Write;
use sunbeam::colour::srgb_encode;
use sunbeam::methods::{MethodKind, MethodOptions, build};
use sunbeam::scattering::Pair;
use sunbeam::{Options, Preset};

const SIZE: usize = 256;
/// What a reflectance in 1/sr is multiplied by for the screen.
const EXPOSURE: f64 = 0.3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let field = Preset::Blazed.build(None, None)?;
    let options = Options { coherence_length_um: 10.0, ..Options::default() };
    // The colour table: the whole integral over wavelengths, read with one look-up.
    let method = build(MethodKind::Table, &field, &options, &MethodOptions::default())?;
    let wi = [0.0, 0.0, 1.0];
    let mut pixels = Vec::with_capacity(3 * SIZE * SIZE);
    for row in 0..SIZE {
        for column in 0..SIZE {
            let place = |at: usize| 2.0 * (at as f64 + 0.5) / SIZE as f64 - 1.0;
            // x to the right, y up.
            let (x, y) = (place(column), -place(row));
            let cos_squared = 1.0 - x * x - y * y;
            let colour = if cos_squared > 0.0 {
                let wo = [x, y, cos_squared.sqrt()];
                let narrow = |v: [f64; 3]| v.map(|component| component as f32);
                let relief = method.answer_rgb(narrow(wi), narrow(wo));
                // What does not depend on the relief is the caller's: this method answers `AnswerKind::Relief`.
                let factor = Pair::new(wi, wo).map_or(0.0, |pair| options.angular_factor(&pair));
                relief.map(|channel| factor * f64::from(channel))
            } else {
                [0.0; 3]
            };
            let shown = srgb_encode(colour.map(|value: f64| (EXPOSURE * value).clamp(0.0, 1.0)));
            pixels.extend(shown.map(|value| (255.0 * value).round() as u8));
        }
    }
    let mut out = std::io::stdout().lock();
    writeln!(out, "P6 {SIZE} {SIZE} 255")?;
    out.write_all(&pixels)?;
    Ok(())
}
