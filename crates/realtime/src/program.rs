//! Which WGSL files make which program.

use sunbeam::methods::{COMMON_WGSL, MethodShader};

const PAIR: &str = include_str!("wgsl/pair.wgsl");
const FRESNEL: &str = include_str!("wgsl/fresnel.wgsl");
const SMALL_SLOPE: &str = include_str!("wgsl/small_slope.wgsl");
const OPTICS: &str = include_str!("wgsl/optics.wgsl");
const QUERY: &str = include_str!("wgsl/query.wgsl");
const FRAME: &str = include_str!("wgsl/frame.wgsl");
const MESH: &str = include_str!("wgsl/mesh.wgsl");
const SUNLIGHT: &str = include_str!("wgsl/sunlight.wgsl");
/// From radiance to what a screen shows.
pub(super) const TONE: &str = include_str!("wgsl/tone.wgsl");
const TRACE: &str = include_str!("wgsl/trace.wgsl");

/// The program of [`super::Shader`].
pub(super) fn shade(method: &MethodShader<'_>) -> String {
    let shade = include_str!("wgsl/shade.wgsl");
    let around = [PAIR, FRESNEL, SMALL_SLOPE, OPTICS, QUERY, shade];
    [&[COMMON_WGSL], method.wgsl.as_slice(), &around].concat().join("\n")
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
    [PAIR, FRESNEL, SMALL_SLOPE, OPTICS, QUERY, FRAME, include_str!("wgsl/resolve.wgsl")].join("\n")
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::wgsl_operators::tests::tint;
    use super::super::wgsl_operators::{Mixture, mixtures};
    use super::*;
    use std::path::{Path, PathBuf};
    use std::sync::LazyLock;
    use sunbeam::grating::{GratingColourSurface, GratingSurface, preset_profile};
    use sunbeam::height_field::Preset;
    use sunbeam::methods::{Method, MethodKind, MethodOptions, StamForm, build};
    use sunbeam::scattering::Options;
    use sunbeam::table::{Model, Progress};

    /// Parses and validates as wgpu does; panics with naga's message.
    pub fn validated(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        module
    }

    /// What answers without reading anything.
    pub fn no_method() -> MethodShader<'static> {
        let wgsl = vec!["fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> { return wi + wo; }"];
        MethodShader { name: "none", wgsl, uniform: Vec::new(), storage: Vec::new() }
    }

    /// A grating of a single order: solved once for all tests.
    static GRATING: LazyLock<GratingColourSurface> = LazyLock::new(|| {
        let profile = preset_profile(Preset::Sinusoidal, Some(0.3), Some(0.05)).unwrap().unwrap();
        GratingColourSurface::new(GratingSurface::new(&profile, None, 65.0, 1.0, &Progress::none()).unwrap())
    });

    /// Every program that is ever compiled, under a name; the methods' are of another crate. Their tables are built once.
    static PROGRAMS: LazyLock<Vec<(String, String)>> = LazyLock::new(programs);

    fn programs() -> Vec<(String, String)> {
        let field = Preset::Sinusoidal.build(None, None).unwrap();
        let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
        let of_method = |kind: MethodKind| {
            let method = build(kind, &field, &surface, &MethodOptions::default()).unwrap();
            (format!("shade, {kind}"), shade(&method.shader()))
        };
        let conserving = build(MethodKind::Table, &field, &Options::default(), &MethodOptions::default()).unwrap();
        let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
        let gems = build(MethodKind::Stam, &field, &surface, &gems).unwrap();
        let others = [
            ("shade", shade(&no_method())),
            ("shade, grating", shade(&GRATING.shader())),
            ("shade, stam of GPU Gems", shade(&gems.shader())),
            ("shade, energy conserved", shade(&conserving.shader())),
            ("raster", raster()),
            ("shadow", shadow()),
            ("locate", locate()),
            ("resolve", resolve()),
            ("tone", TONE.to_owned()),
        ];
        let named = |(name, source): (&str, String)| (name.to_owned(), source);
        MethodKind::ALL.map(of_method).into_iter().chain(others.map(named)).collect()
    }

    #[test]
    fn every_program_is_valid_without_an_adapter() {
        for (_, source) in PROGRAMS.iter() {
            validated(source);
        }
    }

    #[test]
    fn no_program_mixes_operators_that_the_grammar_keeps_apart() {
        for (name, source) in PROGRAMS.iter() {
            assert_eq!(mixtures(source), [], "{name}");
        }
    }

    #[test]
    fn tint_takes_every_program() {
        for (name, source) in PROGRAMS.iter() {
            match tint(source) {
                Some(verdict) => assert_eq!(verdict, Ok(()), "{name}"),
                None => return sunbeam_testing::skip("tint", "tint is not installed"),
            }
        }
    }

    #[test]
    fn every_file_is_part_of_a_program() {
        fn files(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    files(&path, found);
                } else if path.extension().is_some_and(|extension| extension == "wgsl") {
                    found.push(path);
                }
            }
        }
        let mut found = Vec::new();
        for sources in ["src", "../../src"] {
            let before = found.len();
            files(&Path::new(env!("CARGO_MANIFEST_DIR")).join(sources), &mut found);
            assert!(found.len() > before, "{sources}");
        }
        for path in found {
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(PROGRAMS.iter().any(|(_, source)| source.contains(&text)), "{}", path.display());
        }
    }

    /// Lines that naga takes and a browser refuses.
    #[test]
    fn a_mixture_in_a_program_is_found() {
        let packed = ("(pixel.y << 16u) | pixel.x", "pixel.y << 16u | pixel.x", ["<<", "|"]);
        let sorted = ("((skin >> i) & 1u) != 0u", "(skin >> i & 1u) != 0u", [">>", "&"]);
        for (right, wrong, operators) in [packed, sorted] {
            let source = locate();
            assert!(source.contains(right));
            let line = 1 + source.lines().position(|line| line.contains(right)).unwrap();
            let source = source.replace(right, wrong);
            validated(&source);
            let expected = Mixture { line, operators: operators.map(str::to_owned).to_vec() };
            assert_eq!(mixtures(&source), [expected]);
            assert!(!matches!(tint(&source), Some(Ok(()))));
        }
    }
}
