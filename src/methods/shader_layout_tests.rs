//! Tests of every method's WGSL by naga, without a GPU. Shaders must be valid and bind the data that Rust supplies.
//! Layouts of structs and values of constants must be equal in Rust and WGSL.

use super::flss::FlssUniform;
#[cfg(feature = "rigorous")]
use super::grating::GratingUniform;
use super::nmm::NmmUniform;
use super::order_grid::OrderGrid;
use super::pq::PqUniform;
use super::stam::StamUniform;
use super::stam_gems::StamGemsUniform;
use super::table::{TableRing, TableUniform};
use super::{AnswerKind, COMMON_WGSL, Method, MethodKind, MethodOptions, StamForm, build};
#[cfg(feature = "rigorous")]
use crate::grating::{GratingColourSurface, GratingSurface, preset_profile};
use crate::height_field::Preset;
use crate::scattering::{Options, SINES_MIN, TransparentBody};
use crate::table::Model;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Expression, Literal, Module, TypeInner};
use std::mem::{offset_of, size_of};
#[cfg(feature = "rigorous")]
use std::sync::LazyLock;

/// WGSL of a caller, which the sources of a method need to form a whole module. Binding 0 of group 0 holds the answer.
const ENTRY: &str = "
@group(0) @binding(0) var<storage, read_write> answer: vec3<f32>;
@compute @workgroup_size(1) fn main() { answer = answer_rgb(vec3<f32>(0.1, 0.2, 0.7), vec3<f32>(0.0, 0.0, 1.0)); }
";

/// A perfectly conducting grating whose period of 0.3 µm leaves few orders, so that it is solved quickly, and once for
/// all tests. `None` without the feature `rigorous`.
#[cfg(feature = "rigorous")]
fn grating() -> Option<&'static dyn Method> {
    static GRATING: LazyLock<GratingColourSurface> = LazyLock::new(|| {
        let (period_um, height_um, coherence_length_um, build_limit) = (0.3, 0.05, 65.0, 1.0);
        let profile = preset_profile(Preset::Sinusoidal, Some(period_um), Some(height_um)).unwrap().unwrap();
        let progress = crate::table::Progress::none();
        GratingColourSurface::new(
            GratingSurface::new(&profile, None, coherence_length_um, build_limit, &progress).unwrap(),
        )
    });
    Some(&*GRATING)
}

#[cfg(not(feature = "rigorous"))]
fn grating() -> Option<&'static dyn Method> {
    None
}

/// Every method with its kind. `stam` comes in both forms, of which `gems` answers reflectances. `table` is a relief's
/// table, a film's and, with the feature `rigorous`, a grating's, whose answers are reflectances. Energy is not
/// conserved, so no table of albedos is built.
fn methods() -> Vec<(MethodKind, &'static dyn Method)> {
    let field = Preset::Sinusoidal.build(None, None).unwrap();
    // The published methods accept only these options.
    let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
    // A film of index 1.5, with the default coherence length in µm.
    let film_surface = Options { body: Some(TransparentBody::new(1.5, true, 65.0)), ..surface.clone() };
    let kinds =
        MethodKind::ALL.map(|kind| (kind, MethodOptions::default())).into_iter().chain([(MethodKind::Stam, gems)]);
    // All methods need the lifetime 'static of the grating, which lies in a static. So the others are leaked.
    let leaked = |method: Box<dyn Method>| &*Box::leak(method);
    let built = kinds.map(|(kind, options)| (kind, leaked(build(kind, &field, &surface, &options).unwrap())));
    let film = leaked(build(MethodKind::Table, &field, &film_surface, &MethodOptions::default()).unwrap());
    built.chain([(MethodKind::Table, film)]).chain(grating().map(|grating| (MethodKind::Table, grating))).collect()
}

/// The method's WGSL, parsed and validated together with the common source and [`ENTRY`]. Panics with naga's message.
fn module(method: &dyn Method) -> Module {
    let shader = method.shader();
    let parts: Vec<&str> = [&[COMMON_WGSL], shader.wgsl.as_slice(), &[ENTRY]].concat();
    let source = parts.concat();
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}: {}", shader.name, error.emit_to_string(&source)));
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}: {}", shader.name, error.emit_to_string(&source)));
    module
}

/// Size of a struct in bytes, and each member's name and offset in bytes.
type Layout = (usize, Vec<(String, usize)>);

/// Layout of the struct `name` in WGSL.
fn reflected(module: &Module, name: &str) -> Layout {
    let (_, found) = module.types.iter().find(|(_, kind)| kind.name.as_deref() == Some(name)).unwrap();
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let member = |m: &naga::StructMember| (m.name.clone().unwrap(), m.offset as usize);
    (*span as usize, members.iter().map(member).collect())
}

/// Layout of a struct in Rust, whose members must be listed in the order of the WGSL.
macro_rules! layout {
    ($name:ident, $($member:ident),+) => {
        (size_of::<$name>(), vec![$((stringify!($member).to_owned(), offset_of!($name, $member))),+])
    };
}

#[test]
fn every_shader_is_valid_and_binds_its_data() {
    // In group 1, binding 0 is the uniform struct, and the storage buffers follow.
    for (kind, method) in methods() {
        let (module, shader) = (module(method), method.shader());
        assert_eq!(shader.name, kind.name());
        let mut bound: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| Some((variable.binding?, variable.space)))
            .filter(|(binding, _)| binding.group == 1)
            .map(|(binding, space)| (binding.binding as usize, space == AddressSpace::Uniform))
            .collect();
        bound.sort_unstable();
        let expected: Vec<_> = (0..=shader.storage.len()).map(|binding| (binding, binding == 0)).collect();
        assert_eq!(bound, expected, "{kind}");
        // Storage buffers hold words of 32 bits, and WebGPU refuses empty ones.
        assert!(shader.storage.iter().all(|bytes| bytes.len() % 4 == 0 && !bytes.is_empty()), "{kind}");
    }
}

#[test]
fn uniforms_have_the_layout_of_the_shaders() {
    for (kind, method) in methods() {
        let module = module(method);
        let (name, expected): (_, Layout) = match kind {
            MethodKind::Flss => ("Flss", layout!(FlssUniform, grid, wavelengths, _pad0, _pad1, _pad2)),
            MethodKind::Nmm => ("Nmm", layout!(NmmUniform, grid, mean_over_peak, _pad)),
            MethodKind::Pq => ("Pq", layout!(PqUniform, grid, repeats, wavelengths, _pad)),
            MethodKind::Stam if method.answers() == AnswerKind::Reflectance => {
                ("StamGems", layout!(StamGemsUniform, highlight, sharpness, period_um, _pad0, _pad1, _pad2))
            }
            MethodKind::Stam => ("Stam", layout!(StamUniform, period_um, _pad0, _pad1, _pad2)),
            #[cfg(feature = "rigorous")]
            MethodKind::Table if method.answers() == AnswerKind::Reflectance => (
                "Grating",
                layout!(
                    GratingUniform,
                    first_nm,
                    steps_per_nm,
                    wavelengths,
                    cells,
                    nodes,
                    order_max,
                    order_zero_start,
                    period_um,
                    spacing_per_um,
                    sigma_per_um,
                    _pad0,
                    _pad1
                ),
            ),
            MethodKind::Table => (
                "Table",
                layout!(
                    TableUniform,
                    inner_spacing,
                    growth,
                    w_log,
                    exponent_offset,
                    last_ring,
                    albedo_cells,
                    albedo_planes,
                    albedo_min_nm,
                    albedo_planes_per_nm,
                    body_eta,
                    body_normal_min,
                    _pad1,
                    rings
                ),
            ),
        };
        assert_eq!(reflected(&module, name), expected);
        assert_eq!(method.shader().uniform.len(), expected.0, "{kind}");
        // Structs inside the uniform structs.
        if name == "Table" {
            let expected: Layout = layout!(
                TableRing,
                offset,
                directions,
                w_count,
                knots_per_w,
                knots_per_efold,
                knee_squared,
                zero_squared,
                _pad
            );
            assert_eq!(reflected(&module, "Ring"), expected);
        }
        if !matches!(kind, MethodKind::Stam | MethodKind::Table) {
            let expected: Layout = layout!(
                OrderGrid,
                extent_um,
                sharpness,
                reach,
                terms,
                series,
                half_range_um,
                peak_um2,
                neighbourhood,
                full_terms_kappa_h
            );
            assert_eq!(reflected(&module, "OrderGrid"), expected);
        }
    }
}

#[test]
fn constants_of_rust_and_wgsl_agree() {
    // Values of the constants in Rust, under their names in WGSL.
    let mut expected: Vec<(&str, f64)> = vec![
        ("TAU", std::f32::consts::TAU.into()),
        ("WAVELENGTH_MIN_UM", super::WAVELENGTH_MIN_UM.into()),
        ("WAVELENGTH_MAX_UM", super::WAVELENGTH_MAX_UM.into()),
        ("SUM_SQUARED_MAX", super::SUM_SQUARED_MAX.into()),
        ("TERMS_MAX", super::TERMS_MAX as f64),
        ("EXPONENT_MAX", super::orders::EXPONENT_MAX.into()),
        ("WHITE_UM", super::nmm::WHITE_UM.into()),
        ("SERIES_ARGUMENT_MAX", super::pq::SERIES_ARGUMENT_MAX.into()),
        ("ORDERS", super::stam::ORDERS.into()),
        ("V_RANGE", super::stam::V_RANGE.into()),
        ("GEMS_ORDERS", super::stam_gems::GEMS_ORDERS.into()),
        ("RED_UM", super::stam_gems::RED_UM.into()),
        ("GREEN_UM", super::stam_gems::GREEN_UM.into()),
        ("BLUE_UM", super::stam_gems::BLUE_UM.into()),
        ("HALF_WIDTH_UM", super::stam_gems::HALF_WIDTH_UM.into()),
        ("DIVISOR_MIN", super::DIVISOR_MIN.into()),
        ("SINES_MIN", (SINES_MIN as f32).into()),
    ];
    #[cfg(feature = "rigorous")]
    {
        use crate::grating::{
            self, GAUSSIAN_REACH, NU_HALF, NU_MIDDLE, ORDER_ZERO_NODES, TAU_SCALE, UNIT, WEIGHT_NODES,
        };
        // Rounds to the precision of WGSL.
        let single = |value: f64| f64::from(value as f32);
        expected.extend([
            ("NU_MIDDLE", single(NU_MIDDLE)),
            ("NU_HALF", single(NU_HALF)),
            ("TAU_SCALE", TAU_SCALE),
            ("GAUSSIAN_REACH", GAUSSIAN_REACH),
            ("UNIT", single(UNIT)),
            ("LOG2_E", std::f32::consts::LOG2_E.into()),
            ("WEIGHT_NODES_TAU", WEIGHT_NODES[0].into()),
            ("WEIGHT_NODES_NU", WEIGHT_NODES[1].into()),
            ("ORDER_ZERO_NODES", ORDER_ZERO_NODES.into()),
            ("GRATING_DIVISOR_MIN", single(grating::DIVISOR_MIN)),
        ]);
    }
    // Every constant of every module must be in the list, and every entry of the list in some module.
    let mut seen = std::collections::BTreeSet::new();
    for (kind, method) in methods() {
        let module = module(method);
        for (_, constant) in module.constants.iter() {
            let name = constant.name.as_deref().unwrap();
            let value = match module.global_expressions[constant.init] {
                Expression::Literal(Literal::F32(value)) => f64::from(value),
                Expression::Literal(Literal::U32(value)) => f64::from(value),
                ref other => panic!("{kind}: {name} is {other:?}"),
            };
            let (_, expected) = expected.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(value, *expected, "{kind}: {name}");
            seen.insert(name.to_owned());
        }
    }
    assert_eq!(seen.len(), expected.len(), "{seen:?}");
}
