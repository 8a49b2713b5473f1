//! `sunbeam snake`: the mesh of the snake and the pigment of its skin.

use super::arguments::out_of_range;
use super::output::{Output, output};
use super::{Outcome, encode, print_json};
use serde::Serialize;
use std::error::Error;
use sunbeam::colour::srgb_decode;
use sunbeam_realtime::snake::{PIGMENT_SIZE, PigmentTexture, SnakeMesh, SnakeOptions, pigment_texture};

/// Write the snake's mesh as PLY
///
/// One unit is 1 cm, z is up. The mesh has normals, texture coordinates (u along the body) and tangents along the body.
/// Prints the numbers of vertices and faces as JSON.
#[derive(clap::Args)]
pub(crate) struct SnakeArgs {
    /// File for the mesh (.ply)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["ply"]))]
    output: Output,
    /// Factor on the number of cells along each direction; 1 gives about 11 000 vertices
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    resolution: f64,
    /// File for the diffuse pigment over the texture coordinates: sRGB (.png) or linear sRGB (.exr)
    #[arg(long, value_name = "FILE", value_parser = output(&["png", "exr"]))]
    pigment: Option<Output>,
    /// Factor on the linear reflectance of the pigment in an .exr file, 0 to 1; the renderers use 0.35
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    pigment_scale: f64,
}

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Output,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pigment: &'a Option<Output>,
}

/// Runs `sunbeam snake`.
pub(crate) fn run(args: &SnakeArgs) -> Outcome {
    if !(args.resolution.is_finite() && args.resolution > 0.0) {
        return Err(out_of_range("resolution", args.resolution, "finite and positive").into());
    }
    let is_linear = args.pigment.as_ref().is_some_and(|file| file.ends_in("exr"));
    let scale = args.pigment_scale;
    if scale != 1.0 && !is_linear {
        return Err(out_of_range("pigment-scale", scale, "left out without --pigment FILE.exr").into());
    }
    if !(0.0..=1.0).contains(&scale) {
        return Err(out_of_range("pigment-scale", scale, "0 to 1").into());
    }
    let options = SnakeOptions::default().with_resolution(args.resolution);
    let mesh = SnakeMesh::build(&options)?;
    mesh.write_ply(args.output.path())?;
    if let Some(file) = &args.pigment {
        let texture = pigment_texture(&options, PIGMENT_SIZE.0, PIGMENT_SIZE.1)?;
        if is_linear {
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

/// Encodes the texture, whose bytes are sRGB, as OpenEXR in linear sRGB times `scale`.
fn linear_exr(texture: &PigmentTexture, scale: f64) -> Result<Vec<u8>, Box<dyn Error>> {
    encode::exr((texture.width, texture.height), |i| {
        let encoded = texture.pixels[i].map(|byte| f64::from(byte) / 255.0);
        srgb_decode(encoded).map(|value| (scale * value) as f32)
    })
}
