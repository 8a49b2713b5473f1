//! Structs that WGSL shaders and Rust share byte by byte. A test compares their offsets with those in WGSL.
//!
//! WGSL aligns a `vec3` to 16 bytes, so each is followed by a number in its gap. Lengths are in cm, the unit of the
//! mesh. Vectors are in the scene's frame, where z points up, unless noted otherwise. The *grating's frame* at a point
//! has the surface's normal as z and the relief's x axis as x. The *pigment* is the diffuse colour below the relief. A
//! *film* is a transparent sheet with the relief on one side.

use bytemuck::{Pod, Zeroable};
use sunbeam::methods::AnswerKind;
use sunbeam::scattering::{ComplexIndex, Cover, Obliquity};

/// The surface point that a pixel shows, with its directions to light and viewer, for which a [`super::Shader`]
/// computes the reflectance; same layout as `Query` in `query.wgsl`. Both directions are in the grating's frame on the
/// mesh, and in the scene's frame on the ground ([`Query::GROUND`]).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Query {
    /// Unit vector towards the light, above the surface or on either side of a film.
    pub wi: [f32; 3],
    /// [`Query::NOTHING`], [`Query::GROUND`] or [`Query::SKIN`].
    pub kind: u32,
    /// Unit vector towards the viewer.
    pub wo: [f32; 3],
    /// 1 where the sun is visible, directly or through films; else 0, and `sun` is 0, too. The method computes the
    /// reflectance of lit points of the mesh only.
    pub lit: u32,
    /// Texture coordinates of the mesh, for the pigment.
    pub uv: [f32; 2],
    /// Fraction of the sunlight that arrives at the point: 0 in shadow, 1 in direct sun, a value between behind films.
    pub sun: f32,
    /// Fills the struct to a multiple of 16 bytes.
    pub(super) padding: u32,
}

impl Query {
    /// [`Query::kind`] of a pixel whose ray leaves the scene.
    pub const NOTHING: u32 = 0;
    /// [`Query::kind`] of a pixel whose ray meets the ground, the plane z = 0.
    pub const GROUND: u32 = 1;
    /// [`Query::kind`] of a pixel whose ray meets the mesh, whose surface is called skin.
    pub const SKIN: u32 = 2;

    /// A sunlit point of the mesh with these directions in the grating's frame, and (0, 0) as texture coordinates.
    pub fn new(wi: [f32; 3], wo: [f32; 3]) -> Self {
        Self { wi, kind: Self::SKIN, wo, lit: 1, sun: 1.0, ..Self::default() }
    }
}

/// Options of the factors of the reflectance that do not depend on the relief (docs/model.md#the-reflectance). The
/// default is a perfect conductor with Stam's obliquity factor and without shadowing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optics {
    /// The refractive index; `None` is a perfect conductor, which reflects all light at every angle.
    pub index: Option<ComplexIndex>,
    /// The cover, a flat clear layer over the relief; `None` for a bare surface. Under a cover the method receives the
    /// directions inside the cover.
    pub cover: Option<Cover>,
    /// The obliquity factor, a function of both directions; [`Obliquity`] has the formulas. The variant `SmallSlope`
    /// also replaces the Fresnel factor.
    pub obliquity: Obliquity,
    /// Whether the reflectance has the V-cavity factor of shadowing and masking.
    pub shadowing: bool,
}

/// [`Optics`] and the kind of a method's answers; same layout as `Optics` in `optics.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct OpticsUniform {
    /// Real part of the refractive index, relative to the index of the cover.
    pub eta: f32,
    /// Imaginary part of the refractive index, relative to the index of the cover; 0 for a dielectric.
    pub k: f32,
    /// 1 for a perfect conductor, which does not use `eta` and `k`; else 0.
    pub reflects_all: u32,
    /// Obliquity factor: a constant `PAIR_OBLIQUITY_*` of pair.wgsl.
    pub obliquity: u32,
    /// 1 with the factor of shadowing and masking, else 0.
    pub shadowing: u32,
    /// Kind of answers: a constant `OPTICS_ANSWER_*` of optics.wgsl.
    pub answer_kind: u32,
    /// Refractive index of the cover; 1 without a cover.
    pub cover_eta: f32,
}

impl OpticsUniform {
    /// The uniform for `optics` and a method with answers of this kind.
    pub(crate) fn new(optics: &Optics, answer_kind: AnswerKind) -> Self {
        let cover_eta = optics.cover.map_or(1.0, Cover::eta);
        // Without an index, `reflects_all` is 1 and the numbers of the index are not used.
        let index = optics.index.unwrap_or(ComplexIndex { eta: 1.0, k: 0.0 }).relative_to(cover_eta);
        Self {
            eta: index.eta as f32,
            k: index.k as f32,
            reflects_all: u32::from(optics.index.is_none()),
            // tests/realtime/twins.rs compares the results for each of these numbers with the processor's.
            obliquity: match optics.obliquity {
                Obliquity::Stam => 0,
                Obliquity::Unit => 1,
                Obliquity::SmallSlope => 2,
            },
            shadowing: u32::from(optics.shadowing),
            // methods.rs, gratings.rs and films.rs in tests/realtime compare the results for each of these numbers with
            // the processor's.
            answer_kind: match answer_kind {
                AnswerKind::Relief => 0,
                AnswerKind::Reflectance => 1,
                // The film's index is in `FrameUniform`, since only the locate stage needs it.
                AnswerKind::Film { .. } => 2,
            },
            cover_eta: cover_eta as f32,
        }
    }
}

/// Work of one dispatch of the stage `shade`: one part of the answers to a range of queries. shader.rs explains ranges
/// and parts. Same layout as `Range` in `shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct RangeUniform {
    /// First entry of the list `chosen`, which has the indices of the queries to answer.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
    /// Index of the computed part of each answer, from 0.
    pub part: u32,
    /// Number of parts of each answer.
    pub parts: u32,
    /// Always 2. It bounds a loop by which the shader detects that the adapter ends loops early. As a constant of the
    /// shader, it would let the compiler remove the loop (shade.wgsl).
    pub two: u32,
}

/// A vertex of the mesh; same layout as `Vertex` in `mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Vertex {
    /// Position in cm.
    pub position: [f32; 3],
    /// First texture coordinate.
    pub u: f32,
    /// Shading normal of any length except 0.
    pub normal: [f32; 3],
    /// Second texture coordinate.
    pub v: f32,
}

/// A node of the tree of bounding boxes; same layout as `Node` in `trace.wgsl`. Nodes are in depth-first order: the
/// first child of an inner node follows it in the array. The box of a leaf is not read.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Node {
    /// Lower corner of the box.
    pub low: [f32; 3],
    /// Index of a leaf's triangle; `TRACE_NONE` of `trace.wgsl` for an inner node.
    pub triangle: u32,
    /// Upper corner of the box.
    pub high: [f32; 3],
    /// Index of the node that follows this node's subtree; the number of nodes if none follows.
    pub next: u32,
}

/// Camera, light and blending of one sample of a picture; same layout as `Frame` in `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct FrameUniform {
    /// Position of the camera.
    pub origin: [f32; 3],
    /// Number of pixels in a row.
    pub width: u32,
    /// Unit vector along the viewing direction.
    pub forward: [f32; 3],
    /// Number of rows.
    pub height: u32,
    /// Vector from the middle of the image plane, at the distance 1 from the camera, to its right edge. Its length is
    /// the tangent of half the horizontal field of view.
    pub right: [f32; 3],
    /// Weight of the diffraction colour in [`super::Blend::FixedMix`], the weighted mean with the pigment, 0 to 1; 0
    /// for other blends.
    pub share: f32,
    /// Vector from the middle of the image plane to its lower edge. Its length is that of `right` times height over
    /// width of the picture: pixels are square.
    pub down: [f32; 3],
    /// Factor on the reflectance of the pigment texture.
    pub pigment_scale: f32,
    /// Unit vector to the sun.
    pub to_sun: [f32; 3],
    /// The [`super::Blend`]: `FRAME_PHYSICAL`, `FRAME_FIXED_MIX` or `FRAME_NONE` of `frame.wgsl`.
    pub blend: u32,
    /// Position of the ray within its pixel, 0 to 1 from the left and the top.
    pub subpixel: [f32; 2],
    /// Cosine and sine of the angle from the tangent along u to the grating's x axis, counter-clockwise about the
    /// normal.
    pub rotation: [f32; 2],
    /// Diffuse reflectance of the ground, linear sRGB, 0 to 1.
    pub soil: [f32; 3],
    /// Weight of the sample: 1 over the number of samples of a pixel.
    pub weight: f32,
    /// 1 for the first sample, which replaces the previous picture; 0 for later samples, which are added.
    pub is_first: u32,
    /// 1 if the scene has a ground in the plane z = 0, else 0.
    pub has_ground: u32,
    /// Refractive index of the mesh if it is a transparent film; 0 for an opaque mesh.
    pub film_eta: f32,
    /// Fills the struct to a multiple of 16 bytes.
    pub padding: u32,
}

/// Box that the sun's depth map covers; same layout as `Sunlight` in `sunlight.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SunlightUniform {
    /// Centre of the box.
    pub centre: [f32; 3],
    /// Number of texels along each side of the map, a whole number. It is an f32, since the shader multiplies
    /// coordinates by it.
    pub side: f32,
    /// Unit vector along the map's rows, towards higher columns.
    pub right: [f32; 3],
    /// Half the box's extent along `right`.
    pub half_width: f32,
    /// Unit vector along the map's columns, towards the top row.
    pub up: [f32; 3],
    /// Half the box's extent along `up`.
    pub half_height: f32,
    /// Unit vector to the sun.
    pub to_sun: [f32; 3],
    /// Half the box's extent along `to_sun`.
    pub half_depth: f32,
}

/// Colours in the contents of a buffer of `vec4<f32>`; the fourth component is dropped.
pub(super) fn colours(contents: &[u8]) -> Vec<[f32; 3]> {
    let colour = |bytes: &[u8]| {
        let [r, g, b, _] = bytemuck::pod_read_unaligned::<[f32; 4]>(bytes);
        [r, g, b]
    };
    contents.chunks_exact(size_of::<[f32; 4]>()).map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{self, tests::validated};
    use std::mem::offset_of;

    /// Name and offset of each member of a WGSL struct, and the struct's size; all in bytes.
    fn wgsl_layout(source: &str, name: &str) -> (Vec<(String, u32)>, u32) {
        let module = validated(source);
        let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
        let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
            panic!("there is no struct {name}")
        };
        (members.iter().map(|member| (member.name.clone().unwrap(), member.offset)).collect(), *span)
    }

    /// Name and offset of each listed field of a Rust struct, and the struct's size; the counterpart of `wgsl_layout`.
    macro_rules! rust_layout {
        ($ty:ty: $($field:ident),+) => {
            (vec![$((stringify!($field).to_owned(), offset_of!($ty, $field) as u32)),+], size_of::<$ty>() as u32)
        };
    }

    #[test]
    fn structs_have_the_layout_of_the_shaders() {
        let (shade, locate) = (program::shade(&program::no_method()), program::locate());
        for (source, name, ours) in [
            (&shade, "Query", rust_layout!(Query: wi, kind, wo, lit, uv, sun)),
            (
                &shade,
                "Optics",
                rust_layout!(OpticsUniform: eta, k, reflects_all, obliquity, shadowing, answer_kind, cover_eta),
            ),
            (&shade, "Range", rust_layout!(RangeUniform: first, count, part, parts, two)),
            (&locate, "Vertex", rust_layout!(Vertex: position, u, normal, v)),
            (
                &locate,
                "Sunlight",
                rust_layout!(SunlightUniform: centre, side, right, half_width, up, half_height, to_sun, half_depth),
            ),
            (&locate, "Node", rust_layout!(Node: low, triangle, high, next)),
            (
                &locate,
                "Frame",
                rust_layout!(
                    FrameUniform: origin, width, forward, height, right, share, down, pigment_scale, to_sun, blend,
                    subpixel, rotation, soil, weight, is_first, has_ground, film_eta
                ),
            ),
        ] {
            assert_eq!(wgsl_layout(source, name), ours, "{name}");
        }
    }
}
