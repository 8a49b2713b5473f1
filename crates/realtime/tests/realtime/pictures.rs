//! Pictures: rays, frames and shadows against Mitsuba's, radiance against its formulas, and general properties.

use super::support::{Lobe, White, gpu, worst};
use glam::DVec3;
use serde_json::Value;
use std::f64::consts::PI;
use sunbeam::colour::srgb_decode;
use sunbeam::methods::Method;
use sunbeam::scattering::{ComplexIndex, Pair, fresnel_unpolarised};
use sunbeam_realtime::snake::{PigmentTexture, SnakeMesh, SnakeOptions, pigment_texture};
use sunbeam_realtime::{
    Blend, Camera, Gpu, Light, Mesh, Optics, PIGMENT_SCALE, Query, Renderer, SOIL, Scene, SceneData, Shader, Target,
    View,
};

const KERATIN: ComplexIndex = ComplexIndex { eta: 1.56, k: 0.0 };

/// Tolerance of directions: Mitsuba's single-precision rays meet curved normals a few roundings of the camera's
/// distance away.
const DIRECTION_TOLERANCE: f64 = 2e-5;
/// Fraction of pixels whose ray may pass an edge (of a triangle, the body or a shadow) on the other side.
const EDGE_FRACTION: f64 = 0.005;
/// Relative tolerance of radiance: single precision over a dozen factors.
const RADIANCE_TOLERANCE: f32 = 1e-4;

struct Studio {
    gpu: Gpu,
    scene: Scene,
    pigment: PigmentTexture,
    renderer: Renderer,
}

impl Studio {
    fn new() -> Option<Self> {
        let gpu = gpu()?;
        let options = SnakeOptions::default();
        let mesh = Mesh::from(&SnakeMesh::build(&options).unwrap());
        let pigment = pigment_texture(&options, 256, 128).unwrap();
        let scene = Scene::new(&gpu, &mesh, &pigment).unwrap();
        let renderer = Renderer::new(&gpu).unwrap();
        Some(Self { gpu, scene, pigment, renderer })
    }

    fn shader(&self, method: &dyn Method) -> Shader {
        Shader::new(&self.gpu, method, &Optics { index: Some(KERATIN), ..Optics::default() }).unwrap()
    }

    fn picture(&self, shader: &Shader, size: (u32, u32), view: &View) -> (Vec<[f32; 3]>, Vec<Query>) {
        let target = Target::new(&self.gpu, size.0, size.1).unwrap();
        let report = self.renderer.draw(&self.gpu, &self.scene, shader, &target, view).unwrap();
        assert!(report.gpu_ms.total() > 0.0);
        let queries = target.read_queries(&self.gpu).unwrap();
        // One of them alone is the same.
        let (column, row) = (size.0 / 2, size.1 / 3);
        assert_eq!(target.read_query(&self.gpu, column, row).unwrap(), queries[(row * size.0 + column) as usize]);
        assert!(target.read_query(&self.gpu, 0, size.1).is_err());
        (target.read_picture(&self.gpu).unwrap(), queries)
    }
}

#[test]
fn rays_frames_and_shadows_agree_with_mitsuba() {
    let Some(studio) = Studio::new() else { return };
    let recorded: Value = serde_json::from_str(include_str!("data/mitsuba_hits.json")).unwrap();
    let side = |name: &str| recorded[name].as_u64().unwrap() as u32;
    let (_, queries) = studio.picture(&studio.shader(&White), (side("width"), side("height")), &View::default());
    let pixels = recorded["pixels"].as_array().unwrap();
    assert_eq!(pixels.len(), queries.len());
    // Number of pixels that agree after a turn of our directions about the normal, in degrees.
    let agreeing = |turn_deg: f64| {
        let (sin, cos) = turn_deg.to_radians().sin_cos();
        let agrees = |(query, pixel): (&Query, &Value)| {
            let kind = match pixel["skin"].as_bool() {
                None => Query::NOTHING,
                Some(false) => Query::GROUND,
                Some(true) => Query::SKIN,
            };
            if query.kind != kind || Some(query.lit == 1) != pixel["lit"].as_bool() {
                return false;
            }
            let turned = |[x, y, z]: [f32; 3]| {
                let (x, y) = (f64::from(x), f64::from(y));
                [cos * x + sin * y, cos * y - sin * x, f64::from(z)]
            };
            let found = turned(query.wi).into_iter().chain(turned(query.wo)).chain(query.uv.map(f64::from));
            // The ground has no texture coordinates here.
            let count = if kind == Query::SKIN { 8 } else { 6 };
            let expected = pixel["wi_wo_uv"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap());
            found.zip(expected).take(count).all(|(a, b)| (a - b).abs() < DIRECTION_TOLERANCE)
        };
        queries.iter().zip(pixels).filter(|pair| agrees(*pair)).count() as f64 / pixels.len() as f64
    };
    assert!(agreeing(0.0) >= 1.0 - EDGE_FRACTION, "only {} of the pixels agree", agreeing(0.0));
    // Negative control: a turn by a hundredth of a degree.
    assert!(agreeing(0.01) < 0.9, "{}", agreeing(0.01));
}

#[test]
fn a_draft_differs_from_its_scene_at_edges_of_shadows_only() {
    let Some(studio) = Studio::new() else { return };
    let mesh = Mesh::from(&SnakeMesh::build(&SnakeOptions::default()).unwrap());
    let data = SceneData::new(&mesh, &studio.pigment).unwrap();
    let draft = Scene::draft(&studio.gpu, &data).unwrap();
    let shader = studio.shader(&White);
    let (size, view) = ((96, 64), View::default());
    let (_, whole) = studio.picture(&shader, size, &view);
    let target = Target::new(&studio.gpu, size.0, size.1).unwrap();
    studio.renderer.draw(&studio.gpu, &draft, &shader, &target, &view).unwrap();
    let drawn = target.read_queries(&studio.gpu).unwrap();
    let dark = whole.iter().filter(|query| query.lit == 0 && query.kind != Query::NOTHING).count();
    assert!(dark > 100, "{dark} pixels are in the shadow");
    let mut others = 0;
    for (a, b) in whole.iter().zip(&drawn) {
        others += usize::from(a.lit != b.lit);
        let mut b = *b;
        (b.lit, b.sun) = (a.lit, a.sun);
        assert_eq!(b, *a);
    }
    assert!(others * 100 < whole.len(), "{others} pixels of {}", whole.len());
}

#[test]
fn rotation_turns_the_grating_against_the_tangent() {
    let Some(studio) = Studio::new() else { return };
    let shader = studio.shader(&White);
    let (_, straight) = studio.picture(&shader, (30, 20), &View::default());
    let (_, turned) = studio.picture(&shader, (30, 20), &View { rotation_deg: 90.0, ..View::default() });
    for (a, b) in straight.iter().zip(&turned).filter(|(a, _)| a.kind == Query::SKIN) {
        // The tangent becomes −y of the grating.
        for (a, b) in [(a.wi, b.wi), (a.wo, b.wo)] {
            assert!((a[0] + b[1]).abs() < 1e-6 && (a[1] - b[0]).abs() < 1e-6 && (a[2] - b[2]).abs() < 1e-6);
        }
    }
}

/// The pigment's reflectance, bilinear in linear light.
fn pigment_at(pigment: &PigmentTexture, [u, v]: [f32; 2]) -> DVec3 {
    let texel = |x: f64, y: f64| {
        let (x, y) = (x.rem_euclid(pigment.width as f64), y.rem_euclid(pigment.height as f64));
        DVec3::from(srgb_decode(pigment.pixels[y as usize * pigment.width + x as usize].map(|c| f64::from(c) / 255.0)))
    };
    let (x, y) = (f64::from(u) * pigment.width as f64 - 0.5, f64::from(v) * pigment.height as f64 - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let row = |y: f64| texel(left, y).lerp(texel(left + 1.0, y), x - left);
    f64::from(PIGMENT_SCALE) * row(top).lerp(row(top + 1.0), y - top)
}

/// Radiance of a query by the formulas.
fn radiance(query: &Query, method: &dyn Method, pigment: &PigmentTexture, blend: Blend) -> [f32; 3] {
    if query.lit == 0 {
        return [0.0; 3];
    }
    let cos_i = f64::from(query.wi[2]);
    if query.kind == Query::GROUND {
        return SOIL.map(|c| c * cos_i as f32);
    }
    let pair = Pair::new(query.wi.map(f64::from), query.wo.map(f64::from)).unwrap();
    let factor = fresnel_unpolarised(pair.cos_half(), KERATIN) * pair.obliquity(Default::default());
    let response = method.answer_rgb(query.wi, query.wo);
    let diffraction = DVec3::from(response.map(f64::from)) * factor;
    let diffuse = pigment_at(pigment, query.uv) / PI;
    let left = |cos: f64| 1.0 - fresnel_unpolarised(cos, KERATIN);
    let reflectance = match blend {
        Blend::Physical => diffraction + diffuse * (left(cos_i) * left(f64::from(query.wo[2]))),
        Blend::FixedMix { share } => diffuse.lerp(diffraction, f64::from(share)),
        Blend::None => diffraction,
    };
    (reflectance * PI * cos_i).as_vec3().to_array()
}

#[test]
fn radiance_agrees_with_the_formulas() {
    let Some(studio) = Studio::new() else { return };
    let lobe = Lobe::default();
    let shader = studio.shader(&lobe);
    for blend in [Blend::Physical, Blend::FixedMix { share: 0.3 }, Blend::None] {
        let (picture, queries) = studio.picture(&shader, (60, 40), &View { blend, ..View::default() });
        let by = |blend| -> Vec<[f32; 3]> {
            queries.iter().map(|query| radiance(query, &lobe, &studio.pigment, blend)).collect()
        };
        let error = worst(&picture, &by(blend), 1e-3);
        assert!(error < RADIANCE_TOLERANCE, "{blend:?}: {error}");
        let other = Blend::FixedMix { share: 0.31 };
        assert!(worst(&picture, &by(other), 1e-3) > RADIANCE_TOLERANCE, "{blend:?} is taken for {other:?}");
    }
}

#[test]
fn pictures_are_finite_not_black_and_follow_the_light() {
    let Some(studio) = Studio::new() else { return };
    let shader = studio.shader(&Lobe::default());
    let view = |azimuth: f64| View { light: Light::from_angles(azimuth, 40.0).unwrap(), ..View::default() };
    let (first, queries) = studio.picture(&shader, (60, 40), &view(-150.0));
    let (second, _) = studio.picture(&shader, (60, 40), &view(-60.0));
    for picture in [&first, &second] {
        assert!(picture.as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
        assert!(picture.as_flattened().iter().sum::<f32>() / 7200.0 > 1e-3);
    }
    let changed = first.iter().zip(&second).filter(|(a, b)| a != b).count();
    assert!(changed > first.len() / 2, "{changed}");
    let share = |kind| queries.iter().filter(|query| query.kind == kind).count() as f64 / queries.len() as f64;
    assert!(share(Query::SKIN) > 0.4 && share(Query::GROUND) > 0.1, "{}, {}", share(Query::SKIN), share(Query::GROUND));
    assert!(queries.iter().any(|query| query.kind == Query::GROUND && query.lit == 0), "the snake throws no shadow");
    // A second picture into the same buffers is equal.
    let target = Target::new(&studio.gpu, 60, 40).unwrap();
    for azimuth in [-60.0, -150.0] {
        studio.renderer.draw(&studio.gpu, &studio.scene, &shader, &target, &view(azimuth)).unwrap();
    }
    assert_eq!(target.read_picture(&studio.gpu).unwrap(), first);
}

#[test]
fn supersampling_is_the_mean_of_a_larger_picture() {
    let Some(studio) = Studio::new() else { return };
    let shader = studio.shader(&Lobe::default());
    let (small, _) = studio.picture(&shader, (20, 12), &View { supersample: 3, ..View::default() });
    let (large, _) = studio.picture(&shader, (60, 36), &View::default());
    let mean = |i: usize| -> [f32; 3] {
        let (x, y) = (i % 20, i / 20);
        let sum = |c: usize| (0..9).map(|k| large[(3 * y + k / 3) * 60 + 3 * x + k % 3][c]).sum::<f32>();
        std::array::from_fn(|c| sum(c) / 9.0)
    };
    let means: Vec<[f32; 3]> = (0..small.len()).map(mean).collect();
    // Rays are rounded differently, which at an edge may give another triangle.
    let pixels = small.iter().zip(&means);
    let differing = pixels.filter(|(a, b)| worst(&[**a], &[**b], 1e-2) > 1e-3).count();
    assert!(differing <= small.len() / 50, "{differing} of {} pixels differ", small.len());
}

#[test]
fn errors_of_views_name_the_parameter() {
    let Some(studio) = Studio::new() else { return };
    let shader = studio.shader(&White);
    let target = Target::new(&studio.gpu, 8, 8).unwrap();
    let camera = Camera::default();
    for (view, named) in [
        (View { camera: Camera { fov_deg: 180.0, ..camera }, ..View::default() }, "fov"),
        (View { camera: Camera { target: camera.origin, ..camera }, ..View::default() }, "camera-target"),
        (View { camera: Camera { target: [-1.2, -7.0, 0.0], ..camera }, ..View::default() }, "camera-target"),
        (View { supersample: 0, ..View::default() }, "supersample"),
        (View { rotation_deg: f64::NAN, ..View::default() }, "rotation"),
        (View { blend: Blend::FixedMix { share: 1.5 }, ..View::default() }, "share"),
    ] {
        let error = studio.renderer.draw(&studio.gpu, &studio.scene, &shader, &target, &view).unwrap_err().to_string();
        assert!(error.contains(&format!("{named:?}")), "{error}");
    }
    for refused in [Light::from_angles(f64::NAN, 40.0), Light::from_angles(0.0, 0.0), Light::from_direction([0.0; 3])] {
        assert!(refused.unwrap_err().to_string().contains("light-"));
    }
}

/// The shadow of a level square is its outline moved along the sun's rays. The rest of the ground is lit, also far
/// outside the square's box.
#[test]
fn the_shadow_of_a_square_has_its_outline() {
    let Some(gpu) = gpu() else { return };
    let corner = |x: f32, y: f32| [x, y, 1.0];
    let mesh = Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let pigment = pigment_texture(&SnakeOptions::default(), 16, 16).unwrap();
    let scene = Scene::new(&gpu, &mesh, &pigment).unwrap();
    let renderer = Renderer::new(&gpu).unwrap();
    let shader = Shader::new(&gpu, &White, &Optics::default()).unwrap();
    let (side, half_view) = (96, 12.0);
    let camera = Camera {
        origin: [0.0, -1e-3, 200.0],
        target: [0.0; 3],
        fov_deg: 2.0 * (half_view / 200.0f64).atan().to_degrees(),
    };
    for (azimuth, elevation) in [(0.0, 80.0), (-90.0, 50.0), (30.0, 30.0), (135.0, 12.0)] {
        let light = Light::from_angles(azimuth, elevation).unwrap();
        let view = View { camera, light, ..View::default() };
        let target = Target::new(&gpu, side, side).unwrap();
        renderer.draw(&gpu, &scene, &shader, &target, &view).unwrap();
        let sun = light.to_sun();
        let (mut shadowed, mut lit) = (0, 0);
        for (i, query) in target.read_queries(&gpu).unwrap().iter().enumerate() {
            let across = |cell: usize| ((cell as f64 + 0.5) / f64::from(side) - 0.5) * 2.0 * half_view;
            let (x, y) = (across(i % side as usize), -across(i / side as usize));
            // The point of the ray to the sun at the square's height.
            let outline = f64::max((x + sun[0] / sun[2]).abs(), (y + sun[1] / sun[2]).abs());
            // The camera is not straight above, and the square hides what is below it.
            if query.kind != Query::GROUND || (outline - 1.0).abs() < 0.05 {
                continue;
            }
            assert_eq!(query.lit == 1, outline > 1.0, "sun at {azimuth}, {elevation}: the ground at {x}, {y}");
            *(if query.lit == 1 { &mut lit } else { &mut shadowed }) += 1;
        }
        assert!(lit > 1000, "sun at {azimuth}, {elevation}: {lit} lit");
        // The square hides what is straight below it, which is most of the shadow of a high sun.
        assert!(shadowed > 10 || elevation > 60.0, "sun at {azimuth}, {elevation}: {shadowed} in the shadow");
    }
}
