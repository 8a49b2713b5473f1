//! WGSL programs for the GPU. WGSL has no includes, so a program is the concatenation of the files that it needs. The
//! macro `wgsl!` embeds a file without its comments. The first comment of each file in the folder wgsl explains the
//! file's purpose, and lib.rs the stages that run the programs.

use std::error::Error;
use sunbeam::grating::{GratingColourSurface, GratingSurface, preset_profile};
use sunbeam::height_field::Preset;
use sunbeam::methods::{COMMON_WGSL, Method, MethodKind, MethodOptions, MethodShader, StamForm, build};
use sunbeam::scattering::{Options, TransparentBody};
use sunbeam::table::{Model, Progress};
use sunbeam::wgsl;

// Sources of the files that several programs contain, without comments.
const PAIR: &str = wgsl!("wgsl/pair.wgsl");
const FRESNEL: &str = wgsl!("wgsl/fresnel.wgsl");
const SMALL_SLOPE: &str = wgsl!("wgsl/small_slope.wgsl");
const OPTICS: &str = wgsl!("wgsl/optics.wgsl");
const QUERY: &str = wgsl!("wgsl/query.wgsl");
const FRAME: &str = wgsl!("wgsl/frame.wgsl");
const MESH: &str = wgsl!("wgsl/mesh.wgsl");
const SUNLIGHT: &str = wgsl!("wgsl/sunlight.wgsl");

/// The program of [`super::TonePass`], which maps radiance to encoded values for a screen.
pub(super) const TONE: &str = wgsl!("wgsl/tone.wgsl");

/// The program of [`super::Shader`] for a method.
pub(super) fn shade(method: &MethodShader<'_>) -> String {
    let shade = wgsl!("wgsl/shade.wgsl");
    let after_method = [PAIR, FRESNEL, SMALL_SLOPE, OPTICS, QUERY, shade];
    [&[COMMON_WGSL], method.wgsl.as_slice(), &after_method].concat().join("\n")
}

/// The program that finds the nearest triangle of each pixel.
pub(super) fn raster() -> String {
    [FRAME, MESH, wgsl!("wgsl/raster.wgsl")].join("\n")
}

/// The program that draws the sun's depth map.
pub(super) fn shadow() -> String {
    [SUNLIGHT, MESH, wgsl!("wgsl/shadow.wgsl")].join("\n")
}

/// The program that turns the triangles of pixels into queries (query.wgsl).
pub(super) fn locate() -> String {
    let (trace, sheet, point) = (wgsl!("wgsl/trace.wgsl"), wgsl!("wgsl/sheet.wgsl"), wgsl!("wgsl/point.wgsl"));
    [FRAME, MESH, trace, sheet, SUNLIGHT, QUERY, point, wgsl!("wgsl/locate.wgsl")].join("\n")
}

/// The program that turns answered queries into a picture.
pub(super) fn resolve() -> String {
    [PAIR, FRESNEL, SMALL_SLOPE, OPTICS, QUERY, FRAME, wgsl!("wgsl/resolve.wgsl")].join("\n")
}

/// Name and source of every program of this crate, among them the shading program with each method, and with the
/// options that change its WGSL. Tests pass the programs to naga and to other compilers of WGSL.
///
/// # Errors
/// Errors of building the methods.
pub fn every_program() -> Result<Vec<(String, String)>, Box<dyn Error>> {
    let field = Preset::Sinusoidal.build(None, None)?;
    // Some methods accept only this model and no energy conservation.
    let patch = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    let Options { coherence_length_um, build_limit, .. } = Options::default();
    let is_film = true;
    let film = Options { body: Some(TransparentBody::new(1.5, is_film, coherence_length_um)), ..patch.clone() };
    let default = MethodOptions::default();
    let gems = MethodOptions { stam_form: StamForm::Gems, ..default };
    // A perfect conductor. At a period of 0.3 µm few orders propagate, so that the solution is quick.
    let profile = preset_profile(Preset::Sinusoidal, Some(0.3), Some(0.05))?.ok_or("this preset is no grating")?;
    let grating = GratingSurface::new(&profile, None, coherence_length_um, build_limit, &Progress::none())?;
    let fixed = [
        ("shade, no method", shade(&no_method())),
        ("shade, grating", shade(&GratingColourSurface::new(grating).shader())),
        ("shade, stam of GPU Gems", shade(&build(MethodKind::Stam, &field, &patch, &gems)?.shader())),
        ("shade, energy conserved", shade(&build(MethodKind::Table, &field, &Options::default(), &default)?.shader())),
        ("shade, film", shade(&build(MethodKind::Table, &field, &film, &default)?.shader())),
        ("raster", raster()),
        ("shadow", shadow()),
        ("locate", locate()),
        ("resolve", resolve()),
        ("tone", TONE.to_owned()),
    ];
    let mut programs = fixed.map(|(name, source)| (name.to_owned(), source)).to_vec();
    for kind in MethodKind::ALL {
        programs.push((format!("shade, {kind}"), shade(&build(kind, &field, &patch, &default)?.shader())));
    }
    Ok(programs)
}

/// Stand-in for a method, without data, for tests of the shading program itself. Its answer has no meaning.
pub(super) fn no_method() -> MethodShader<'static> {
    let wgsl = vec!["fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> { return wi + wo; }"];
    MethodShader { name: "none", wgsl, uniform: Vec::new(), storage: Vec::new() }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::path::{Path, PathBuf};
    use std::sync::LazyLock;

    /// The module of a program, parsed and validated as wgpu does; panics with naga's message if the program is
    /// invalid.
    pub(crate) fn validated(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
        module
    }

    /// The programs of [`every_program`], built once for all tests.
    static PROGRAMS: LazyLock<Vec<(String, String)>> = LazyLock::new(|| every_program().unwrap());

    #[test]
    fn naga_accepts_every_program() {
        for (_, source) in PROGRAMS.iter() {
            validated(source);
        }
    }

    #[test]
    fn every_wgsl_file_is_part_of_a_program() {
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
            // Programs have no comments: `wgsl!` removes the text from `//` to the end of the line.
            let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            let code = lines.collect::<Vec<_>>().join("\n");
            assert!(PROGRAMS.iter().any(|(_, source)| source.contains(&code)), "{}", path.display());
        }
    }
}
