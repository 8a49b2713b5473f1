//! Films, which reflect and transmit: WGSL against its Rust twins, and pictures against the library.

use super::common::{Random, preset};
use super::support::{gpu, query, worst, worst_of_pairs};
use std::f64::consts::PI;
use sunbeam::height_field::Preset;
use sunbeam::lobe::{ColourSurface, LinearSrgb, Lobe};
use sunbeam::methods::{AnswerKind, Method, MethodKind, MethodOptions, build};
use sunbeam::numeric::Plain;
use sunbeam::scattering::{Options, TransparentBody};
use sunbeam_realtime::snake::{PigmentTexture, SnakeOptions, pigment_texture};
use sunbeam_realtime::{Blend, Camera, Gpu, Light, Mesh, Optics, Query, Renderer, SOIL, Scene, Shader, Target, View};

/// Tolerance of the factor F, relative to its value and a thousandth of the mean. In transmission w is a difference of
/// normal components, and F has 1/w². At an index of 1.2 it loses two digits of single precision.
const FACTOR: f32 = 1e-3;
/// Tolerance of answers relative to the brightest channel of a pair and a thousandth of the mean: beside an order, the
/// table changes by some hundred times the rounding of the position among its rings.
const TOLERANCE: f32 = 1e-4;
/// Floor of relative errors, as a fraction of the mean.
const FLOOR: f32 = 1e-3;
/// Tolerance of radiance relative to its brightest channel and a thousandth of the picture's: a few dozen roundings.
const RADIANCE: f32 = 1e-4;
/// Coherence length of the films in µm.
const COHERENCE_UM: f64 = 12.0;

fn film(eta: f64) -> TransparentBody {
    TransparentBody::new(eta, true, COHERENCE_UM)
}

/// Relief and options of a film, magnified as tables take it.
fn magnified(name: Preset, body: TransparentBody, conserve_energy: bool) -> (sunbeam::HeightField, Options) {
    let coherence_length_um = COHERENCE_UM * body.eta;
    let options = Options { coherence_length_um, conserve_energy, body: Some(body), ..Options::default() };
    (preset(name).resized(body.eta, body.eta), options)
}

fn method(name: Preset, eta: f64, conserve_energy: bool) -> Box<dyn Method> {
    let (field, options) = magnified(name, film(eta), conserve_energy);
    build(MethodKind::Table, &field, &options, &MethodOptions::default()).unwrap()
}

/// The direction on either side of the film, at random.
fn on_a_side(random: &mut Random, [x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, y, if random.unit() < 0.5 { z } else { -z }]
}

/// Pairs on all sides, half of them near the mirror direction or the straight one, where most of the light goes.
fn pairs(count: usize) -> Vec<Query> {
    let mut random = Random::new(31);
    let mut pairs = Vec::new();
    while pairs.len() < count {
        let (wi, mut wo) = (random.direction(), random.direction());
        if pairs.len() % 2 == 0 {
            let [x, y] = [0, 1].map(|axis| -wi[axis] + random.between(-0.2, 0.2));
            let z_squared = 1.0 - x * x - y * y;
            if z_squared <= 0.0 {
                continue;
            }
            wo = [x, y, z_squared.sqrt()];
        }
        pairs.push(query(on_a_side(&mut random, wi), on_a_side(&mut random, wo)));
    }
    pairs
}

fn mean_of(expected: &[[f32; 3]]) -> f32 {
    expected.as_flattened().iter().map(|value| value.abs()).sum::<f32>() / (3 * expected.len()) as f32
}

fn twin(method: &dyn Method, queries: &[Query]) -> Vec<[f32; 3]> {
    queries.iter().map(|query| method.answer_rgb(query.wi, query.wo)).collect()
}

/// Queries whose tangent is moved by a thousandth.
fn moved(queries: &[Query]) -> Vec<Query> {
    queries.iter().map(|query| Query::new([query.wi[0] + 1e-3, query.wi[1], query.wi[2]], query.wo)).collect()
}

#[test]
fn wgsl_of_the_factor_of_films_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let queries = pairs(6000);
    for eta in [1.2, 1.5, 2.4, 4.0] {
        let method = method(Preset::Flat, eta, false);
        let mut shader = method.shader();
        // The last source is film.wgsl, which calls the functions of transparent.wgsl.
        *shader.wgsl.last_mut().unwrap() = "fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
            return vec3<f32>(pair_at_body(wave_at_body(wi), wave_at_body(wo)).factor);
        }";
        let shader = Shader::of(&gpu, &shader, method.answers(), &Optics::default()).unwrap();
        let found = shader.evaluate(&gpu, &queries).unwrap().reflectances;
        let expected = |eta: f64| -> Vec<[f32; 3]> {
            let factor = |query: &Query| film(eta).factor(query.wi.map(f64::from), query.wo.map(f64::from));
            queries.iter().map(|query| [factor(query) as f32; 3]).collect()
        };
        let (expected, other) = (expected(eta), expected(1.002 * eta));
        // Each way of light is compared with its own mean.
        for way in 0..4 {
            let of = |values: &[[f32; 3]]| -> Vec<[f32; 3]> {
                let is_way = |query: &Query| usize::from(query.wi[2] < 0.0) + 2 * usize::from(query.wo[2] < 0.0) == way;
                queries.iter().zip(values).filter(|(query, _)| is_way(query)).map(|(_, value)| *value).collect()
            };
            let floor = FLOOR * mean_of(&of(&expected));
            let error = worst(&of(&found), &of(&expected), floor);
            eprintln!("eta {eta}, way {way}: {} pairs, largest difference {error:.1e}", of(&found).len());
            assert!(of(&found).len() > 1000 && error < FACTOR, "{eta} {way}: {error}");
            assert!(worst(&of(&found), &of(&other), floor) > FACTOR, "{eta} {way}: another index is not seen");
        }
    }
}

#[test]
fn wgsl_of_films_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let queries = pairs(4000);
    for (name, eta, conserve_energy) in [
        (Preset::Blazed, 1.5, false),
        (Preset::Sinusoidal, 1.0, false),
        (Preset::Blazed, 1.5, true),
        (Preset::Xenopeltis, 1.56, false),
        (Preset::Sinusoidal, 1.8, true),
    ] {
        let method = method(name, eta, conserve_energy);
        assert_eq!(method.answers(), AnswerKind::Film { eta: eta as f32 });
        let shader = Shader::new(&gpu, &*method, &Optics::default()).unwrap();
        let found = shader.evaluate(&gpu, &queries).unwrap().reflectances;
        let expected = twin(&*method, &queries);
        let floor = FLOOR * mean_of(&expected);
        let error = worst_of_pairs(&found, &expected, floor);
        eprintln!("film of {name}, eta {eta}, energy conserved {conserve_energy}: largest difference {error:.1e}");
        assert!(error < TOLERANCE, "{name} {eta}: {error}");
        // Negative controls: another direction, and a divisor of another wavelength.
        let error = worst_of_pairs(&found, &twin(&*method, &moved(&queries)), floor);
        assert!(error > TOLERANCE, "{name} {eta} does not see a change of direction: {error}");
        if conserve_energy {
            let mut uniform = method.shader().uniform;
            // Place of the first plane's wavelength in the struct.
            uniform[28..32].copy_from_slice(&300f32.to_le_bytes());
            shader.set_parameters(&gpu, &uniform).unwrap();
            let error = worst_of_pairs(&shader.evaluate(&gpu, &queries).unwrap().reflectances, &expected, floor);
            assert!(error > TOLERANCE, "{name} {eta} does not see its albedos: {error}");
        }
    }
}

#[test]
fn the_method_of_films_is_the_lobe_of_colours() {
    for (name, conserve_energy) in [(Preset::Blazed, false), (Preset::Blazed, true)] {
        let (field, options) = magnified(name, film(1.5), conserve_energy);
        let method = build(MethodKind::Table, &field, &options, &MethodOptions::default()).unwrap();
        let surface = ColourSurface::new(&field, &options, None).unwrap();
        let lobe = surface.transmissive_lobe_over::<Plain<'_, f32>>(surface.words(), None).unwrap();
        let queries = pairs(1000);
        let expected: Vec<_> = queries.iter().map(|query| lobe.eval(query.wi, query.wo, LinearSrgb, true)).collect();
        assert_eq!(twin(&*method, &queries), expected);
        assert!(mean_of(&expected) > 0.0);
    }
}

#[test]
fn other_methods_and_interfaces_are_refused_in_one_line() {
    let (field, options) = magnified(Preset::Blazed, film(1.5), false);
    let interface = Options { body: Some(TransparentBody { is_film: false, ..film(1.5) }), ..options.clone() };
    for kind in MethodKind::ALL {
        for (options, name) in [(&options, "film"), (&interface, "interface")] {
            if kind == MethodKind::Table && name == "film" {
                continue;
            }
            let refused = build(kind, &field, options, &MethodOptions::default()).err().unwrap().to_string();
            let start = format!("the method {kind} does not know transmission = {name}, only none");
            assert!(refused.starts_with(&start) && refused.contains("film"), "{refused}");
        }
    }
}

/// A level square at a height of 1 cm, with u along +x.
fn square() -> (Mesh, PigmentTexture) {
    let corner = |x: f32, y: f32| [x, y, 1.0];
    let mesh = Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    (mesh, pigment_texture(&SnakeOptions::default(), 16, 16).unwrap())
}

struct Studio {
    gpu: Gpu,
    scene: Scene,
    renderer: Renderer,
}

const SIDE: u32 = 96;
const CAMERA: Camera = Camera { origin: [1.0, -6.0, 9.0], target: [0.0, 0.2, 0.5], fov_deg: 32.0 };

impl Studio {
    fn new() -> Option<Self> {
        let gpu = gpu()?;
        let (mesh, pigment) = square();
        let scene = Scene::new(&gpu, &mesh, &pigment).unwrap();
        let renderer = Renderer::new(&gpu).unwrap();
        Some(Self { gpu, scene, renderer })
    }

    fn picture(&self, method: &dyn Method, view: &View) -> (Vec<[f32; 3]>, Vec<Query>) {
        let shader = Shader::new(&self.gpu, method, &Optics::default()).unwrap();
        let target = Target::new(&self.gpu, SIDE, SIDE).unwrap();
        self.renderer.draw(&self.gpu, &self.scene, &shader, &target, view).unwrap();
        (target.read_picture(&self.gpu).unwrap(), target.read_queries(&self.gpu).unwrap())
    }
}

/// Fraction of the sunlight that arrives at a point of the ground behind the square; `None` beside the edge of its
/// shadow.
fn arriving(body: TransparentBody, [x, y]: [f64; 2], sun: [f64; 3]) -> Option<f64> {
    let outline = f64::max((x + sun[0] / sun[2]).abs(), (y + sun[1] / sun[2]).abs());
    let passed = body.transmittance(sun[2]);
    ((outline - 1.0).abs() > 0.05).then_some(if outline < 1.0 { passed } else { 1.0 })
}

#[test]
fn a_film_is_lit_from_both_sides_before_the_sunlit_ground() {
    let Some(studio) = Studio::new() else { return };
    let body = film(1.5);
    let method = method(Preset::Blazed, body.eta, true);
    let toward = |azimuth, elevation| Light::from_angles(azimuth, elevation).unwrap();
    // Suns above, which the sheet reflects, and below, which it transmits.
    let from_below = Light::from_direction([-0.35, 0.6, -0.8]).unwrap();
    for (light, ground) in [(toward(70.0, 60.0), true), (toward(100.0, 50.0), false), (from_below, true)] {
        // No blending changes a film.
        let view = View { camera: CAMERA, light, blend: Blend::Physical, ground, ..View::default() };
        let (picture, queries) = studio.picture(&*method, &view);
        let sun = light.to_sun();
        let (mut seen, mut shadowed, mut worst_error) = (0, 0, 0f32);
        let other = film(1.6);
        let mut worst_of_other = 0f32;
        let soil = |passed: f64| SOIL.map(|channel| (passed * sun[2].max(0.0)) as f32 * channel);
        let brightest = picture.as_flattened().iter().fold(0f32, |most, value| most.max(*value));
        for (query, found) in queries.iter().zip(&picture) {
            let origin = CAMERA.origin;
            let wo = query.wo.map(f64::from);
            match query.kind {
                Query::SKIN => {
                    assert!(query.wo[2] > 0.0 && (query.wi[2] > 0.0) == (sun[2] > 0.0) && query.lit == 1);
                    let steps = origin[2] / wo[2];
                    let Some(arrived) = (if ground && sun[2] > 0.0 {
                        arriving(body, [0, 1].map(|axis| origin[axis] - steps * wo[axis]), sun)
                    } else {
                        Some(0.0)
                    }) else {
                        continue;
                    };
                    let cos_i = query.wi[2].abs();
                    let scattered = method.answer_rgb(query.wi, query.wo).map(|f| PI as f32 * cos_i * f);
                    let expected = |body: TransparentBody| -> [f32; 3] {
                        let behind = soil(arrived * body.transmittance(wo[2]));
                        std::array::from_fn(|c| scattered[c] + behind[c])
                    };
                    let floor = 1e-3 * brightest;
                    worst_error = worst_error.max(worst_of_pairs(&[*found], &[expected(body)], floor));
                    worst_of_other = worst_of_other.max(worst_of_pairs(&[*found], &[expected(other)], floor));
                    seen += 1;
                    shadowed += usize::from(arrived < 1.0);
                }
                Query::GROUND => {
                    let steps = origin[2] / wo[2];
                    let place = [0, 1].map(|axis| origin[axis] - steps * wo[axis]);
                    let Some(arrived) = (if sun[2] > 0.0 { arriving(body, place, sun) } else { Some(0.0) }) else {
                        continue;
                    };
                    worst_error = worst_error.max(worst_of_pairs(&[*found], &[soil(arrived)], 1e-4));
                    assert!(sun[2] < 0.0 || (f64::from(query.sun) - arrived).abs() < 1e-5, "{place:?} {}", query.sun);
                }
                _ => assert_eq!(*found, [0.0; 3]),
            }
        }
        eprintln!("sun {sun:.2?}: {seen} pixels of the film, largest difference {worst_error:.1e}, of {brightest:.2e}");
        assert!(seen > 500 && worst_error < RADIANCE, "{seen} {worst_error}");
        if ground && sun[2] > 0.0 {
            assert!(shadowed > 100 && worst_of_other > RADIANCE, "{shadowed} {worst_of_other}");
        }
    }
}
