//! Directions drawn from the skin of *Xenopeltis*, whose weights average to the albedo:
//! `cargo run --release --example sample`.

#![allow(clippy::print_stdout)] // That is what it is for.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use sunbeam::{Options, Preset, Surface};

const COUNT: usize = 20_000;
/// A sample carries several wavelengths, as paths of a spectral renderer do.
const WAVELENGTHS_NM: [f64; 4] = [420.0, 500.0, 580.0, 660.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface = Surface::new(&Preset::Xenopeltis.build(None, None)?, &Options::default())?;
    let wi = [0.5, 0.0, 0.75f64.sqrt()];
    let mut random = Pcg64::seed_from_u64(1);
    let mut sum = [0.0; 4];
    let mut lost = 0;
    for _ in 0..COUNT {
        // None: the order that was drawn lies below the horizon, and the sample counts as zero.
        let Some(sample) = surface.sample(wi, &WAVELENGTHS_NM, [random.random(), random.random(), random.random()])
        else {
            lost += 1;
            continue;
        };
        for (total, nm) in sum.iter_mut().zip(WAVELENGTHS_NM) {
            *total += surface.eval(wi, sample.wo, nm) * sample.wo[2] / sample.pdf;
        }
    }
    for (total, nm) in sum.iter().zip(WAVELENGTHS_NM) {
        let albedo = surface.albedo(wi, nm).ok_or("the surface keeps no table of albedos")?;
        println!("{nm} nm: the mean weight is {:.3}, the tabulated albedo {albedo:.3}", total / COUNT as f64);
    }
    println!("{:.1} % of the samples are lost below the horizon", 100.0 * f64::from(lost) / COUNT as f64);
    Ok(())
}
