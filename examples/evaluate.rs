//! Prints the BSDF of a perfectly reflecting sinusoidal grating over the angle of view:
//! `cargo run --release --example evaluate`.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use sunbeam::{Options, Preset, Surface};

/// Angle of incidence with the normal in degrees, in the plane of x. The light is on the side of +x.
const THETA_I_DEG: f64 = 20.0;
/// Wavelengths in nm.
const WAVELENGTHS_NM: [f64; 3] = [450.0, 550.0, 650.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A period of 2 µm along x, and 0.15 µm from valley to peak.
    let field = Preset::Sinusoidal.build(Some(2.0), Some(0.15))?;
    // Shorter than sunlight's, the default of 65 µm: orders are wider, so fewer of them lie between the printed angles.
    let options = Options { coherence_length_um: 20.0, ..Options::default() };
    let surface = Surface::new(&field, &options)?;

    // Unit vectors to light and viewer, z along the normal; positive angles are on the side of +x.
    let direction = |degrees: f64| [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()];
    println!("  angle   f_r in 1/sr at {WAVELENGTHS_NM:?} nm");
    for degrees in (-80..=80).step_by(5).map(f64::from) {
        let values = WAVELENGTHS_NM.map(|nm| surface.eval(direction(THETA_I_DEG), direction(degrees), nm));
        println!("{degrees:6}° {:>12.4} {:>12.4} {:>12.4}", values[0], values[1], values[2]);
    }
    Ok(())
}
