use super::output::{Output, output};
use super::{Outcome, encode, print_json};
use serde::Serialize;
use std::error::Error;
use sunbeam::colour::srgb_decode;
use sunbeam_realtime::snake::{PIGMENT_SIZE, PigmentTexture, SnakeMesh, SnakeOptions, pigment_texture};

/// Write the snake's mesh as PLY
///
/// 1 unit is 1 cm, z is up; the mesh has normals, texture coordinates (u along the body) and tangents along the body.
/// Prints the counts as JSON.
#[derive(clap::Args)]
pub struct SnakeArgs {
    /// The mesh (.ply)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["ply"]))]
    output: Output,
    /// Times the cells in each direction; 1 is the mesh of 10 933 vertices and 21 573 faces
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    resolution: f64,
    /// The diffuse pigment for the same texture coordinates: an sRGB picture (.png), or linear sRGB (.exr)
    #[arg(long, value_name = "FILE", value_parser = output(&["png", "exr"]))]
    pigment: Option<Output>,
    /// Factor on the pigment's linear reflectance in an .exr, 0 to 1; the renderers take 0.35
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    pigment_scale: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pigment: &'a Option<Output>,
}

/// Runs `sunbeam snake`.
pub fn run(args: &SnakeArgs) -> Outcome {
    if !(args.resolution.is_finite() && args.resolution > 0.0) {
        return Err(format!("parameter \"resolution\" is {}, but must be finite and positive", args.resolution).into());
    }
    let (linear, scale) = (args.pigment.as_ref().is_some_and(|file| file.ends_in("exr")), args.pigment_scale);
    if !(0.0..=1.0).contains(&scale) || (scale != 1.0 && !linear) {
        let accepted = if linear { "0 to 1" } else { "left out without --pigment FILE.exr" };
        return Err(format!("parameter \"pigment-scale\" is {scale}, but must be {accepted}").into());
    }
    let options = SnakeOptions::default().with_resolution(args.resolution);
    let mesh = SnakeMesh::build(&options)?;
    mesh.write_ply(args.output.path())?;
    if let Some(file) = &args.pigment {
        let texture = pigment_texture(&options, PIGMENT_SIZE.0, PIGMENT_SIZE.1)?;
        if linear {
            file.write(&linear_exr(&texture, scale)?)?;
        } else {
            texture.write_png(file.path())?;
        }
    }
    print_json(&Report {
        output: &args.output,
        vertices: mesh.positions.len(),
        faces: mesh.triangles.len(),
        pigment: &args.pigment,
    })
}

/// The texture decoded, times a factor, as OpenEXR.
fn linear_exr(texture: &PigmentTexture, scale: f64) -> Result<Vec<u8>, Box<dyn Error>> {
    encode::exr((texture.width, texture.height), |i| {
        let encoded = texture.pixels[i].map(|byte| f64::from(byte) / 255.0);
        srgb_decode(encoded).map(|value| (scale * value) as f32)
    })
}
