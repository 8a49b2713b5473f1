//! A procedural piece of a snake, like the 3D scan in Single 2014 (M. Single's thesis, docs/glossary.md).
//!
//! Modules: `body` is the smooth body, `lattice` the outlines of the scales, `scales` their height, `patch` the grid of
//! one scale, `mesh` the triangles, `pigment` the texture, `ply` the file, and `options` the parameters.
//!
//! A bent body lies on the ground plane z = 0 (z is up, **1 unit = 1 cm**), covered with overlapping,
//! keeled scales in diamond packing. The mesh is one open sheet over the back and the flanks; its rim is
//! tucked under the body, so there is no seam. Each scale has a grid of its own, whose sides are the edges of scales.
//!
//! # Conventions
//! - `u` in [0, 1] runs along the body from head to tail, `v` in [0, 1] around it; with the default
//!   length the sheet is twice as long as wide, so a 2:1 texture has square texels on the skin.
//! - `∂P/∂u × ∂P/∂v` points out of the body and triangles are counter-clockwise seen from outside.
//!   With the outward normal `n` and the tangent `t` the bitangent is `b = n × t`, on the side of
//!   growing `v`: (t, b, n) is right-handed with no mirrored patch.
//! - The tangent is `∂P/∂u` made orthogonal to the normal (Gram–Schmidt): what Mitsuba 3 computes for
//!   its shading frame from the UVs. A grating with grooves along x of that frame is a grating along the body.
//! - Scales overlap like tiles: the free edge of each points to the tail, +u.

mod body;
mod error;
mod lattice;
mod mesh;
mod options;
mod patch;
mod pigment;
mod ply;
mod scales;
#[cfg(test)]
mod tests;

pub use error::SnakeError;
pub use mesh::SnakeMesh;
pub use options::SnakeOptions;
pub use pigment::{PIGMENT_SIZE, PigmentTexture, pigment_texture};
