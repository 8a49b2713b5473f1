use super::{Outcome, print_json};
use serde::Serialize;
use std::path::PathBuf;
use sunbeam_realtime::snake::{SnakeMesh, SnakeOptions, pigment_texture};

/// Pixels of the pigment texture along and around the body: twice as long as wide, as the skin is.
const PIGMENT_SIZE: (usize, usize) = (2048, 1024);

/// Write the snake's mesh as PLY
///
/// 1 unit is 1 cm, z is up; the mesh has normals, texture coordinates (u along the body) and tangents along the body.
/// Prints the counts as JSON.
#[derive(clap::Args)]
pub struct SnakeArgs {
    /// The mesh (.ply)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Times the cells in each direction; 1 is the mesh of 10 933 vertices and 21 573 faces
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    resolution: f64,
    /// The diffuse pigment as an sRGB image for the same texture coordinates (.png)
    #[arg(long, value_name = "FILE")]
    pigment: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report<'a> {
    output: &'a PathBuf,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pigment: &'a Option<PathBuf>,
}

/// Runs `sunbeam snake`.
pub fn run(args: &SnakeArgs) -> Outcome {
    if !(args.resolution.is_finite() && args.resolution > 0.0) {
        return Err(format!("parameter \"resolution\" is {}, but must be finite and positive", args.resolution).into());
    }
    let options = SnakeOptions::default().with_resolution(args.resolution);
    let mesh = SnakeMesh::build(&options)?;
    mesh.write_ply(&args.output)?;
    if let Some(path) = &args.pigment {
        pigment_texture(&options, PIGMENT_SIZE.0, PIGMENT_SIZE.1)?.write_png(path)?;
    }
    print_json(&Report {
        output: &args.output,
        vertices: mesh.positions.len(),
        faces: mesh.triangles.len(),
        pigment: &args.pigment,
    })
}
