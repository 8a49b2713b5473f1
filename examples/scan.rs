//! Describes a measured surface and prints its albedo.
//!
//! `cargo run --release --example scan -- scan.gsf [pixel size in µm]`

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::path::Path;
use sunbeam::height_field::{FileScale, Level};
use sunbeam::transform::periods;
use sunbeam::{HeightField, Options, Surface, Tiling};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("give a file of heights, such as scan.gsf")?;
    // A format with a physical scale, such as .gsf, needs no pixel size. `max_height_um` is the height of white in a
    // format that stores grey values, such as .png; without it, such a file must state its scale.
    let pixel_size_um = arguments.next().map(|text| text.parse()).transpose()?;
    let scale = FileScale { pixel_size_um, max_height_um: None };
    // Levelling subtracts the plane of best fit, the tilt of the sample.
    let field = HeightField::read(Path::new(&path), &scale)?.levelled(Level::Plane);

    // Numbers of pixels and lengths along x and y, and the lowest and the highest height.
    let ((nx, ny), (lx, ly), (low, high)) = (field.size(), field.extent_um(), field.range_um());
    println!("{nx} × {ny} pixels, {lx:.2} × {ly:.2} µm, heights over {:.3} µm", high - low);
    // `false`: the height field is a piece of a surface, whose edges do not join.
    let found = periods(&field, false);
    for (axis, period) in [("x", found.x), ("y", found.y)] {
        if let Some(period) = period {
            println!("strongest period along {axis}: {:.3} µm", period.period_um);
        }
    }

    // The relief beyond the edges of a scan is unknown. With `Aperiodic` the scan is one sample with tapered edges, and
    // is not repeated as a tile, which would make a lattice of sharp orders. The coherence length depends on the light:
    // 65 µm, the default, for filtered sunlight, 5 µm for a microscope's lamp with an open aperture. A larger one than
    // the 20 µm here gives narrower orders and larger tables.
    let options = Options { tiling: Tiling::Aperiodic, coherence_length_um: 20.0, ..Options::default() };
    let surface = Surface::new(&field, &options)?;
    let report = surface.report();
    println!("tables of {:.1} MB in {:.1} s", report.bytes as f64 / 1e6, report.build_seconds);
    for nm in [450.0, 550.0, 650.0] {
        // The direction is the unit vector to the light. The albedo excludes the Fresnel reflectance.
        let albedo = surface.albedo([0.0, 0.0, 1.0], nm).ok_or("a patch or a transparent body has no albedo")?;
        println!("{nm} nm: the albedo for light along the normal is {albedo:.3}");
    }
    Ok(())
}
