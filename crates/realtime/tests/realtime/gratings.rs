//! The method `table` of gratings by Maxwell's equations: WGSL against the library, on pairs of directions and in a
//! picture.

use super::common::{Random, cache, direction};
use super::support::{gpu, query, worst_of_pairs};
use std::f32::consts::PI;
use std::sync::Arc;
use sunbeam::cache::Origin;
use sunbeam::config::SurfaceConfig;
use sunbeam::grating::GratingColourSurface;
use sunbeam::methods::{AnswerKind, Method};
use sunbeam::scattering::{ComplexIndex, Obliquity, SpectralIndex};
use sunbeam::table::Progress;
use sunbeam_realtime::snake::{SnakeMesh, SnakeOptions, pigment_texture};
use sunbeam_realtime::{Blend, Gpu, Mesh, Optics, Query, Renderer, Scene, Shader, Target, View};

/// Tolerance relative to the brightest channel of a pair, or to the mean if that is larger. Directions and wavelengths
/// of orders are single precision on both sides. At five standard deviations, the flank of an order changes by 25 times
/// the relative error of its position.
const TOLERANCE: f32 = 1e-3;
/// Tolerance within a millionth of the passing-off of an order. Efficiencies change with the square root of the
/// distance from it in orders, `t ± a`. The shader rounds the distance to 1e-6, whose root is 1e-3; the slope near an
/// anomaly is ten.
const PASSING_OFF: f32 = 2e-2;
/// Distances from the passing-off of an order, as sines.
const OFF: [f64; 7] = [0.0, 1e-7, -1e-7, 1e-6, -1e-6, 1e-3, -1e-3];
/// Index of the first distance at which rounding does not matter.
const CLEAR: usize = 5;

/// A grating; its tables are cached, because solving takes seconds.
fn grating(json: &str) -> Arc<(GratingColourSurface, Origin)> {
    let config = SurfaceConfig::from_json(json).unwrap();
    let index = config.index().map(SpectralIndex::Constant);
    config.build_shared_grating_colours(index.as_ref(), &cache(), &Progress::none()).unwrap()
}

/// Aluminium with a few narrow orders: configuration, and period in µm.
const ALUMINIUM: (&str, f64) =
    (r#"{"preset":"blazed","period":0.6,"height":0.08,"theory":"rigorous","eta":1.0,"k":6.9}"#, 0.6);
/// A perfect conductor with wide orders: configuration, and period in µm.
const PERFECT: (&str, f64) =
    (r#"{"preset":"sinusoidal","period":0.7,"height":0.15,"theory":"rigorous","coherence_length":8.0}"#, 0.7);

/// A direction with these cosines along x and y, if there is one.
fn above(x: f64, y: f64) -> Option<[f64; 3]> {
    let squared = 1.0 - x * x - y * y;
    (squared > 0.0).then(|| [x, y, squared.sqrt()])
}

/// Random pairs, and pairs along an order of some wavelength, conical mounts included; all also reversed.
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

/// Grazing, retro-reflected and mirrored pairs, along the axes and elsewhere.
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

/// Pairs along an order, near a wavelength and incidence at which another order passes off.
fn pairs_where_orders_pass_off(period_um: f64) -> Vec<Query> {
    let mut random = Random::new(29);
    let mut pairs = Vec::new();
    while pairs.len() < 3000 {
        let um = random.between(0.4, 0.7);
        let off = OFF[pairs.len() / 2 % OFF.len()];
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

fn mean_of(expected: &[[f32; 3]]) -> f32 {
    expected.as_flattened().iter().map(|value| value.abs()).sum::<f32>() / (3 * expected.len()) as f32
}

fn answers(gpu: &Gpu, shader: &Shader, queries: &[Query]) -> Vec<[f32; 3]> {
    shader.evaluate(gpu, queries).unwrap().reflectances
}

#[test]
fn wgsl_of_gratings_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    for (json, period_um) in [ALUMINIUM, PERFECT] {
        let grating = grating(json);
        let method = &grating.0;
        assert_eq!(method.answers(), AnswerKind::Reflectance);
        // Nothing is multiplied by what is around it.
        let optics = Optics {
            index: Some(ComplexIndex { eta: 1.5, k: 0.1 }),
            cover: None,
            obliquity: Obliquity::Stam,
            shadowing: true,
        };
        let shader = Shader::new(&gpu, method, &optics).unwrap();
        let mut asked = pairs(period_um, 12_000);
        asked.extend(hard_pairs());
        let (found, expected) = (answers(&gpu, &shader, &asked), twin(method, &asked));
        let mean = mean_of(&expected);
        assert!(mean > 0.0 && expected.iter().filter(|rgb| rgb[1] > 1e-3 * mean).count() > asked.len() / 3);
        let error = worst_of_pairs(&found, &expected, mean);
        eprintln!("{json}: {} pairs, largest difference {error:.1e}", asked.len());
        assert!(error < TOLERANCE, "{json}: {error}");

        let passing = pairs_where_orders_pass_off(period_um);
        let (found_there, expected_there) = (answers(&gpu, &shader, &passing), twin(method, &passing));
        let mean_there = mean_of(&expected_there);
        for (clear, tolerance) in [(true, TOLERANCE), (false, PASSING_OFF)] {
            let of = |values: &[[f32; 3]]| -> Vec<[f32; 3]> {
                let chosen = values.iter().enumerate().filter(|(i, _)| (i / 2 % OFF.len() >= CLEAR) == clear);
                chosen.map(|(_, rgb)| *rgb).collect()
            };
            let error = worst_of_pairs(&of(&found_there), &of(&expected_there), mean_there);
            eprintln!("{json}: where orders pass off, clear of that {clear}, largest difference {error:.1e}");
            assert!(error < tolerance, "{json}, {clear}: {error}");
        }

        // Each change of one side alone is seen: directions, period, width of an order, what an order has.
        let moved: Vec<Query> =
            asked.iter().map(|query| Query::new([query.wi[0] + 1e-3, query.wi[1], query.wi[2]], query.wo)).collect();
        assert!(worst_of_pairs(&found, &twin(method, &moved), mean) > TOLERANCE);
        let uniform = method.shader().uniform;
        // Places in the struct: steps for each nm, spacing, standard deviation, period.
        for word in [1, 7, 8, 9] {
            let mut changed = uniform.clone();
            let place = 4 * word..4 * word + 4;
            let value = f32::from_le_bytes(changed[place.clone()].try_into().unwrap());
            changed[place].copy_from_slice(&(1.01 * value).to_le_bytes());
            shader.set_parameters(&gpu, &changed).unwrap();
            let error = worst_of_pairs(&answers(&gpu, &shader, &asked), &expected, mean);
            // A perfect conductor is the same at every wavelength.
            assert!(error > TOLERANCE || (word == 1 && json == PERFECT.0), "word {word} of {json}: {error}");
        }
    }
}

#[test]
fn invalid_pairs_answer_zero() {
    let Some(gpu) = gpu() else { return };
    let grating = grating(PERFECT.0);
    let shader = Shader::new(&gpu, &grating.0, &Optics::default()).unwrap();
    let up = [0.0, 0.0, 1.0];
    let bad = [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 1.0]];
    let queries: Vec<Query> = bad.iter().flat_map(|&w| [query(w, up), query(up, w)]).collect();
    assert_eq!(answers(&gpu, &shader, &queries), vec![[0.0; 3]; queries.len()]);
}

/// A picture of the snake against the library's double-precision answers for the query of each pixel.
#[test]
fn a_picture_agrees_with_the_library_pixel_by_pixel() {
    let Some(gpu) = gpu() else { return };
    let grating = grating(PERFECT.0);
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
    let mean = mean_of(&expected);
    let bright = expected.iter().filter(|rgb| rgb.iter().any(|value| *value > mean)).count();
    let error = worst_of_pairs(&picture, &expected, mean);
    eprintln!("{bright} bright pixels, largest difference {error:.1e}");
    assert!(bright > 300, "{bright}");
    assert!(error < PASSING_OFF, "{error}");
    // Negative control: another grating.
    assert!(worst_of_pairs(&picture, &radiance(&self::grating(ALUMINIUM.0).0), mean) > 0.1);
}
