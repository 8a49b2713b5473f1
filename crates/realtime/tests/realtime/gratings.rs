//! `table` of gratings by Maxwell's equations: its WGSL against the library, on the same pairs of directions and in a picture.

use super::common::{Random, direction};
use super::support::{gpu, query, worst};
use std::f32::consts::PI;
use std::sync::Arc;
use sunbeam::cache::{Cache, Origin};
use sunbeam::config::SurfaceConfig;
use sunbeam::grating::GratingColourSurface;
use sunbeam::methods::{AnswerKind, Method};
use sunbeam::reflectance::{ComplexIndex, Obliquity, SpectralIndex};
use sunbeam::table::Progress;
use sunbeam_realtime::snake::{SnakeMesh, SnakeOptions, pigment_texture};
use sunbeam_realtime::{Blend, Gpu, Mesh, Optics, Query, Renderer, Scene, Shader, Target, View};

/// Of the response, or of the floor where that is more: both sides have directions, and the wavelengths that orders meet, in single
/// precision, and the flank of an order at five deviations changes by 25 times the relative error of its place.
const TOLERANCE: f32 = 1e-3;
/// Responses below this share of the mean are dark, and only their difference matters.
const FLOOR: f32 = 1e-3;
/// The same next to where an order passes off, of the brightest channel. There efficiencies go with the square root of how far off
/// that is in orders, `t ± a` of some units, which one side rounds to 1e-7 and the other does not: √(4·1e-7) = 6e-4, times the
/// slope of an efficiency in that root, of a few units.
const PASSING_OFF: f32 = 4e-3;

/// Of tables that are kept.
const CACHE_BYTES: u64 = 1 << 28;

/// A grating whose table is kept, since solving it takes a while.
fn grating(json: &str) -> Arc<(GratingColourSurface, Origin)> {
    let config = SurfaceConfig::from_json(json).unwrap();
    let index = config.index().map(SpectralIndex::Constant);
    let cache = Cache::new(concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"), CACHE_BYTES);
    config.build_shared_grating_colours(index.as_ref(), &cache, &Progress::none()).unwrap()
}

/// Aluminium with a few orders and narrow ones; and a perfect conductor's, with wide ones.
const ALUMINIUM: (&str, f64) =
    (r#"{"preset":"blazed","period":1.0,"height":0.12,"theory":"rigorous","eta":1.0,"k":6.9}"#, 1.0);
const PERFECT: (&str, f64) =
    (r#"{"preset":"sinusoidal","period":0.7,"height":0.15,"theory":"rigorous","coherence_length":8.0}"#, 0.7);

/// A direction with these cosines along x and y, if there is one.
fn above(x: f64, y: f64) -> Option<[f64; 3]> {
    let squared = 1.0 - x * x - y * y;
    (squared > 0.0).then(|| [x, y, squared.sqrt()])
}

/// Pairs anywhere, and where one looks along an order of some wavelength, conical mounts included; both also reversed.
fn pairs(period_um: f64, count: usize) -> Vec<Query> {
    let mut random = Random::new(23);
    let mut pairs = Vec::new();
    while pairs.len() < count {
        let wi = random.direction();
        let mut wo = random.direction();
        if random.unit() < 0.8 {
            let (um, order) = (random.between(0.37, 0.8), random.between(-3.0, 3.0).round());
            let [dx, dy] = [0, 1].map(|_| random.between(-0.01, 0.01));
            match above(order * um / period_um - wi[0] + dx, dy - wi[1]) {
                Some(direction) => wo = direction,
                None => continue,
            }
        }
        pairs.extend([query(wi, wo), query(wo, wi)]);
    }
    pairs
}

/// Pairs on the horizon, returned, mirrored, along either axis and along none.
fn hard_pairs() -> Vec<Query> {
    let mut pairs = Vec::new();
    for theta in [0.0, 30.0, 75.0, 89.0, 89.99, 89.9999] {
        for phi in [0.0, 33.0, 90.0, 180.0] {
            for (other, turn) in [(theta, 0.0), (theta, 180.0), (75.0, 90.0), (0.0, 0.0), (89.99, 179.0)] {
                let (wi, wo) = (direction(theta, phi), direction(other, phi + turn));
                pairs.extend([query(wi, wo), query(wo, wi)]);
            }
        }
    }
    pairs
}

/// Pairs along an order at a wavelength and incidence at which another one passes off, or nearly.
fn pairs_where_orders_pass_off(period_um: f64) -> Vec<Query> {
    let mut random = Random::new(29);
    let mut pairs = Vec::new();
    while pairs.len() < 3000 {
        let um = random.between(0.4, 0.7);
        let off = [0.0, 1e-7, -1e-7, 1e-5, -1e-5, 1e-3, -1e-3][pairs.len() / 2 % 7];
        let y = random.between(-0.9, 0.9);
        let horizon = f64::sqrt(1.0 - y * y) * (1.0 + off) * if random.unit() < 0.5 { 1.0 } else { -1.0 };
        let step = um / period_um;
        let [passing, order] = [0, 1].map(|_| random.between(-3.0, 3.0).round());
        let x = passing * step - horizon;
        if let (Some(wi), Some(wo)) = (above(x, y), above(order * step - x + random.between(-1e-3, 1e-3), -y)) {
            pairs.extend([query(wi, wo), query(wo, wi)]);
        }
    }
    pairs
}

fn twin(method: &dyn Method, queries: &[Query]) -> Vec<[f32; 3]> {
    queries.iter().map(|query| method.answer_rgb(query.wi, query.wo)).collect()
}

fn floor_of(expected: &[[f32; 3]]) -> f32 {
    FLOOR * expected.as_flattened().iter().map(|value| value.abs()).sum::<f32>() / (3 * expected.len()) as f32
}

/// The largest difference of a channel, of the brightest channel of its pair.
fn worst_of_brightest(found: &[[f32; 3]], expected: &[[f32; 3]], floor: f32) -> f32 {
    let brightest = |rgb: &[f32; 3]| rgb.iter().fold(floor, |most, value| most.max(value.abs()));
    let error = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max) / brightest(b);
    found
        .iter()
        .zip(expected)
        .map(error)
        .fold(0.0, |most, error| if error.is_nan() { f32::INFINITY } else { most.max(error) })
}

fn answers(gpu: &Gpu, shader: &Shader, queries: &[Query]) -> Vec<[f32; 3]> {
    shader.evaluate(gpu, queries).unwrap().reflectances
}

#[test]
fn a_grating_is_its_twin() {
    let Some(gpu) = gpu() else { return };
    for (json, period_um) in [ALUMINIUM, PERFECT] {
        let grating = grating(json);
        let method = &grating.0;
        assert_eq!(method.answers(), AnswerKind::Reflectance);
        // Nothing is multiplied by what is around it.
        let optics =
            Optics { index: Some(ComplexIndex { eta: 1.5, k: 0.1 }), obliquity: Obliquity::Stam, shadowing: true };
        let shader = Shader::new(&gpu, method, &optics).unwrap();
        let mut asked = pairs(period_um, 12_000);
        asked.extend(hard_pairs());
        let (found, expected) = (answers(&gpu, &shader, &asked), twin(method, &asked));
        let floor = floor_of(&expected);
        assert!(floor > 0.0 && expected.iter().filter(|rgb| rgb[1] > floor).count() > asked.len() / 3);
        let error = worst(&found, &expected, floor);
        eprintln!("{json}: {} pairs, largest difference {error:.1e}", asked.len());
        assert!(error < TOLERANCE, "{json}: {error}");

        let passing = pairs_where_orders_pass_off(period_um);
        let (found_there, expected_there) = (answers(&gpu, &shader, &passing), twin(method, &passing));
        let error = worst_of_brightest(&found_there, &expected_there, floor_of(&expected_there) / FLOOR);
        eprintln!("{json}: {} pairs where orders pass off, largest difference {error:.1e}", passing.len());
        assert!(error < PASSING_OFF, "{json}: {error}");

        // Each change of one side alone is seen: directions, period, width of an order, what an order has.
        let moved: Vec<Query> =
            asked.iter().map(|query| Query::new([query.wi[0] + 1e-3, query.wi[1], query.wi[2]], query.wo)).collect();
        assert!(worst(&found, &twin(method, &moved), floor) > TOLERANCE);
        let uniform = method.shader().uniform;
        // Places in the struct: steps for each nm, spacing, standard deviation, period.
        for word in [1, 7, 8, 9] {
            let mut changed = uniform.clone();
            let place = 4 * word..4 * word + 4;
            let value = f32::from_le_bytes(changed[place.clone()].try_into().unwrap());
            changed[place].copy_from_slice(&(1.01 * value).to_le_bytes());
            shader.set_parameters(&gpu, &changed).unwrap();
            let error = worst(&answers(&gpu, &shader, &asked), &expected, floor);
            // A perfect conductor is the same at every wavelength.
            assert!(error > TOLERANCE || (word == 1 && json == PERFECT.0), "word {word} of {json}: {error}");
        }
    }
}

#[test]
fn pairs_that_are_none_answer_zero() {
    let Some(gpu) = gpu() else { return };
    let grating = grating(PERFECT.0);
    let shader = Shader::new(&gpu, &grating.0, &Optics::default()).unwrap();
    let up = [0.0, 0.0, 1.0];
    let bad = [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 1.0]];
    let queries: Vec<Query> = bad.iter().flat_map(|&w| [query(w, up), query(up, w)]).collect();
    assert_eq!(answers(&gpu, &shader, &queries), vec![[0.0; 3]; queries.len()]);
}

/// A picture of the snake in aluminium, pixel by pixel: what its ray met, answered by the library in double precision.
#[test]
fn a_picture_is_what_the_library_answers_for_its_pixels() {
    let Some(gpu) = gpu() else { return };
    let grating = grating(ALUMINIUM.0);
    let options = SnakeOptions::default();
    let mesh = Mesh::from(&SnakeMesh::build(&options).unwrap());
    let scene = Scene::new(&gpu, &mesh, &pigment_texture(&options, 64, 32).unwrap()).unwrap();
    let shader = Shader::new(&gpu, &grating.0, &Optics::default()).unwrap();
    let (width, height) = (240, 160);
    let target = Target::new(&gpu, width, height).unwrap();
    let view = View { blend: Blend::None, ground: false, ..View::default() };
    Renderer::new(&gpu).unwrap().draw(&gpu, &scene, &shader, &target, &view).unwrap();
    let (picture, queries) = (target.read_picture(&gpu).unwrap(), target.read_queries(&gpu).unwrap());
    let radiance = |grating: &GratingColourSurface| -> Vec<[f32; 3]> {
        let of = |query: &Query| {
            if query.kind != Query::SKIN || query.lit == 0 {
                return [0.0; 3];
            }
            let f = grating.eval(query.wi.map(f64::from), query.wo.map(f64::from));
            f.map(|channel| PI * query.wi[2] * channel as f32)
        };
        queries.iter().map(of).collect()
    };
    let expected = radiance(&grating.0);
    let floor = floor_of(&expected);
    let bright = expected.iter().filter(|rgb| rgb.iter().any(|value| *value > 1e3 * floor)).count();
    let error = worst_of_brightest(&picture, &expected, 10.0 * floor);
    eprintln!("{bright} bright pixels, largest difference {error:.1e}");
    assert!(bright > 300, "{bright}");
    // Double precision against single: a pixel in a few hundred lies where an order passes off.
    assert!(error < 2.0 * PASSING_OFF, "{error}");
    // Another grating is seen.
    let other = radiance(&self::grating(PERFECT.0).0);
    assert!(worst_of_brightest(&picture, &other, 10.0 * floor) > 0.1);
}
