//! Estimates the albedo of the skin of *Xenopeltis* from sampled directions: `cargo run --release --example sample`.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use sunbeam::{Options, Preset, Surface};

/// Number of samples. More lower the noise of the estimate.
const COUNT: usize = 20_000;
/// Wavelengths in nm that each sample carries, as a path of a spectral renderer does.
const WAVELENGTHS_NM: [f64; 4] = [420.0, 500.0, 580.0, 660.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Period and height are `None`: a skin accepts no others than its own.
    let surface = Surface::new(&Preset::Xenopeltis.build(None, None)?, &Options::default())?;
    // Unit vector to the light, 30° from the normal z.
    let wi = [0.5, 0.0, 0.75f64.sqrt()];
    let mut random = Pcg64::seed_from_u64(1);
    // Sums of the samples' weights f·cosθ/pdf, one for each wavelength. Mean weights estimate the albedo.
    let mut sum = [0.0; 4];
    let mut below_horizon = 0;
    for _ in 0..COUNT {
        // Three random numbers in [0, 1) give a sample. `None` is one below the horizon: its weight is zero, and it
        // counts among the COUNT samples.
        let Some(sample) = surface.sample(wi, &WAVELENGTHS_NM, [random.random(), random.random(), random.random()])
        else {
            below_horizon += 1;
            continue;
        };
        for (total, nm) in sum.iter_mut().zip(WAVELENGTHS_NM) {
            *total += surface.eval(wi, sample.wo, nm) * sample.wo[2] / sample.pdf;
        }
    }
    // The surface's own albedo is an integral over its table, without random numbers.
    for (total, nm) in sum.iter().zip(WAVELENGTHS_NM) {
        let albedo = surface.albedo(wi, nm).ok_or("a patch or a transparent body has no albedo")?;
        println!("{nm} nm: the mean weight is {:.3}, the integrated albedo {albedo:.3}", total / COUNT as f64);
    }
    println!("{:.1} % of the samples are below the horizon", 100.0 * f64::from(below_horizon) / COUNT as f64);
    Ok(())
}
