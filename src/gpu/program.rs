//! Which WGSL files make which program.

use crate::methods::{COMMON_WGSL, MethodShader};

const PAIR: &str = include_str!("wgsl/pair.wgsl");
const FRESNEL: &str = include_str!("wgsl/fresnel.wgsl");
const OPTICS: &str = include_str!("wgsl/optics.wgsl");
const QUERY: &str = include_str!("wgsl/query.wgsl");
const FRAME: &str = include_str!("wgsl/frame.wgsl");
const MESH: &str = include_str!("wgsl/mesh.wgsl");
const SUNLIGHT: &str = include_str!("wgsl/sunlight.wgsl");
const TRACE: &str = include_str!("wgsl/trace.wgsl");

/// The program of [`super::Shader`].
pub(super) fn shade(method: &MethodShader<'_>) -> String {
    [COMMON_WGSL, method.wgsl, PAIR, FRESNEL, OPTICS, QUERY, include_str!("wgsl/shade.wgsl")].join("\n")
}

/// Finds the triangle that each pixel sees.
pub(super) fn raster() -> String {
    [FRAME, MESH, include_str!("wgsl/raster.wgsl")].join("\n")
}

/// Draws the mesh as the sun sees it.
pub(super) fn shadow() -> String {
    [SUNLIGHT, MESH, include_str!("wgsl/shadow.wgsl")].join("\n")
}

/// Turns triangles into queries.
pub(super) fn locate() -> String {
    [FRAME, MESH, TRACE, SUNLIGHT, QUERY, include_str!("wgsl/locate.wgsl")].join("\n")
}

/// Turns answered queries into a picture.
pub(super) fn resolve() -> String {
    [PAIR, FRESNEL, OPTICS, QUERY, FRAME, include_str!("wgsl/resolve.wgsl")].join("\n")
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Parses and validates as wgpu does; panics with naga's message.
    pub fn validated(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        module
    }

    pub const NO_RELIEF: MethodShader<'_> = MethodShader {
        name: "none",
        wgsl: "fn response(q: vec3<f32>) -> vec3<f32> { return q; }",
        uniform: Vec::new(),
        storage: Vec::new(),
    };

    #[test]
    fn every_program_is_valid_without_an_adapter() {
        for source in [shade(&NO_RELIEF), raster(), shadow(), locate(), resolve()] {
            validated(&source);
        }
    }
}
