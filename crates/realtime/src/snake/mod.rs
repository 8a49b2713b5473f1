//! A procedural piece of a snake. Its default size and resolution are close to those of the 3D scan in Single 2014
//! (M. Single's thesis, docs/glossary.md).
//!
//! A bent body lies on the ground plane z = 0, covered with overlapping, keeled scales in diamond packing. z is up, and
//! **1 unit = 1 cm**. The mesh is one open sheet over the back and the flanks. Its rim lies under the body, so no seam
//! is visible. Each scale has a grid of its own, whose sides are the edges of scales.
//!
//! Modules: `body` is the smooth body, `lattice` the outlines of the scales, `scales` their height, `patch` the grid of
//! one scale, `mesh` the triangles, `pigment` the texture, `ply` the file, and `options` the parameters.
//!
//! # Conventions
//! - `u` in [0, 1] runs along the body from head to tail, roughly along +x. `v` in [0, 1] runs around it, roughly along
//!   +y on the back. With the default options the sheet is twice as long as wide, so a 2:1 texture has square texels on
//!   the skin.
//! - `∂P/∂u × ∂P/∂v` points out of the body, and triangles are counter-clockwise seen from outside.
//! - The tangent `t` is `∂P/∂u` made orthogonal to the outward normal `n` (Gram–Schmidt), like the shading frame that
//!   Mitsuba 3 computes from texture coordinates. The bitangent `b = n × t` points to the side of growing `v`, so
//!   (t, b, n) is right-handed everywhere.
//! - The x axis of a relief is the tangent if its `rotation` is 0, so grooves along x run along the body.
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
pub(crate) use pigment::BACK_REFLECTANCE;
pub use pigment::{PIGMENT_SIZE, PigmentTexture, pigment_texture};
