//! Functions in WGSL against their Rust twins, on pairs of directions.

use super::common::{Random, direction};
use super::support::{Lobe, White, gpu, query, worst};
use sunbeam::methods::{MethodShader, Relief};
use sunbeam::scattering::{ComplexIndex, Cover, Inside, Obliquity, Pair};
use sunbeam_realtime::{Optics, Query, Shader};

/// Tolerance: some twenty roundings of single precision, and the inexact division and roots of graphics interfaces.
const TOLERANCE: f32 = 1e-5;
/// Tolerance of the small-slope factor. Its azimuth is a difference of cosines that nearly cancel; the error grows with
/// |ε|, and for a perfect conductor with 1/cos²θ.
const SMALL_SLOPE: f32 = 2e-3;
/// Cosine below which the small-slope factor is not compared.
const SMALL_SLOPE_COSINE_MIN: f32 = 0.01;

/// Random pairs, and grazing, retro-reflected, mirrored and axial ones.
fn pairs() -> Vec<Query> {
    let mut random = Random::new(7);
    let mut pairs: Vec<Query> = (0..4000).map(|_| query(random.direction(), random.direction())).collect();
    for theta in [0.0, 30.0, 75.0, 89.0, 89.99, 89.999_99] {
        for phi in [0.0, 33.0, 180.0] {
            let wi = direction(theta, phi);
            for (other, turn) in [(theta, 0.0), (theta, 180.0), (75.0, 90.0), (0.0, 0.0), (89.99, 179.0)] {
                pairs.push(query(wi, direction(other, phi + turn)));
            }
        }
    }
    pairs
}

/// `R·O·M`, or `Q·M`, in double precision, between the directions inside the cover and with its factor.
fn expected(queries: &[Query], optics: &Optics) -> Vec<[f32; 3]> {
    let factor = |query: &Query| {
        let inside = Inside::new(optics.cover, query.wi.map(f64::from), query.wo.map(f64::from))?;
        let pair = Pair::new(inside.wi, inside.wo)?;
        let shadowing = if optics.shadowing { pair.shadowing() } else { 1.0 };
        let index = optics.index.map(|index| index.relative_to(optics.cover.map_or(1.0, Cover::eta)));
        let interface = pair.interface(index, optics.obliquity);
        Some(inside.factor * interface * pair.obliquity(optics.obliquity) * shadowing)
    };
    queries.iter().map(|query| [factor(query).unwrap_or(0.0) as f32; 3]).collect()
}

fn all_optics() -> Vec<Optics> {
    let indices = [(1.56, 0.0), (0.2, 3.4), (1.0, 0.0), (0.7, 0.0), (900.0, 0.0), (2.0, 80.0), (1e-3, 1e-3)];
    let mut optics: Vec<Optics> =
        indices.iter().map(|&(eta, k)| Optics { index: Some(ComplexIndex { eta, k }), ..Optics::default() }).collect();
    optics.push(Optics { obliquity: Obliquity::Unit, ..Optics::default() });
    optics.push(Optics { shadowing: true, ..Optics::default() });
    optics.push(Optics { index: optics[0].index, obliquity: Obliquity::Unit, shadowing: true, ..optics[0] });
    let bent = [0, 1, 3, 5].map(|i| Optics { obliquity: Obliquity::SmallSlope, ..optics[i] });
    optics.extend(bent);
    optics.push(Optics { obliquity: Obliquity::SmallSlope, ..Optics::default() });
    // An index below the cover's is left out: R has a square root's slope where total reflection begins.
    let covered = [1, 4, 5, 11].map(|i| Optics { cover: Some(Cover::new(1.58)), ..optics[i] });
    optics.extend(covered);
    optics
}

#[test]
fn optics_of_a_pair_agree_with_the_library() {
    let Some(gpu) = gpu() else { return };
    let all = pairs();
    let low = |query: &Query| query.wi[2].min(query.wo[2]) < SMALL_SLOPE_COSINE_MIN;
    let steep: Vec<Query> = all.iter().filter(|query| !low(query)).copied().collect();
    let shader = Shader::new(&gpu, &White, &Optics::default()).unwrap();
    for optics in all_optics() {
        shader.set_optics(&gpu, &optics);
        let (queries, tolerance) =
            if optics.obliquity == Obliquity::SmallSlope { (&steep, SMALL_SLOPE) } else { (&all, TOLERANCE) };
        let found = shader.evaluate(&gpu, queries).unwrap().reflectances;
        let error = worst(&found, &expected(queries, &optics), 1e-6);
        assert!(error < tolerance, "{optics:?}: {error}");
        // The comparison sees a difference in any one factor.
        let mut other = optics;
        other.index = optics.index.map(|index| ComplexIndex { eta: 1.1 * index.eta, ..index });
        if optics.index.is_some() {
            let error = worst(&found, &expected(queries, &other), 1e-6);
            assert!(error > TOLERANCE, "{optics:?} is taken for {other:?}: {error}");
        }
        // No direction inside the cover is flat enough for shadowing.
        other = match optics.cover {
            None => Optics { shadowing: !optics.shadowing, ..optics },
            Some(_) => Optics { cover: None, ..optics },
        };
        if optics.index.is_none_or(|index| index.eta != 1.0) {
            assert!(worst(&found, &expected(queries, &other), 1e-6) > TOLERANCE, "{optics:?} is taken for {other:?}");
        }
    }
}

#[test]
fn invalid_pairs_answer_zero() {
    let Some(gpu) = gpu() else { return };
    let up = [0.0, 0.0, 1.0];
    let bad =
        [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 1.0], [0.0, 0.0, f64::NAN]];
    let queries: Vec<Query> = bad.iter().flat_map(|&w| [query(w, up), query(up, w)]).collect();
    let shader = Shader::new(&gpu, &White, &Optics::default()).unwrap();
    assert_eq!(shader.evaluate(&gpu, &queries).unwrap().reflectances, vec![[0.0; 3]; queries.len()]);
    assert_eq!(shader.evaluate(&gpu, &[]).unwrap().reflectances, Vec::<[f32; 3]>::new());
}

#[test]
fn data_of_a_method_are_uploaded_and_can_be_changed() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random::new(3);
    let queries: Vec<Query> = (0..3000).map(|_| query(random.direction(), random.direction())).collect();
    let unit = Optics { obliquity: Obliquity::Unit, ..Optics::default() };
    let twin = |method: &Lobe| -> Vec<[f32; 3]> {
        let q = |query: &Query| std::array::from_fn(|c| query.wi[c] + query.wo[c]);
        queries.iter().map(|query| method.relief_rgb(q(query))).collect()
    };
    let (method, other) = (Lobe::default(), Lobe { sharpness: 4.001, ..Lobe::default() });
    let shader = Shader::new(&gpu, &method, &unit).unwrap();
    let answers = shader.evaluate(&gpu, &queries).unwrap();
    assert!(answers.gpu_ms > 0.0 && answers.submissions >= 2, "{} ms", answers.gpu_ms);
    assert!(worst(&answers.reflectances, &twin(&method), 1e-6) < TOLERANCE);
    assert!(worst(&answers.reflectances, &twin(&other), 1e-6) > TOLERANCE);
    shader.set_parameters(&gpu, &other.relief_shader().uniform).unwrap();
    assert!(worst(&shader.evaluate(&gpu, &queries).unwrap().reflectances, &twin(&other), 1e-6) < TOLERANCE);
}

/// A method with nested loops that llvmpipe cuts short.
struct Count;

impl Relief for Count {
    fn relief_rgb(&self, _: [f32; 3]) -> [f32; 3] {
        [100_000.0; 3]
    }

    fn relief_spectral(&self, _: [f32; 3], _: f32) -> Option<f32> {
        None
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        MethodShader {
            name: "count",
            wgsl: vec![
                "
                struct Count { outer: u32, inner: u32 }
                @group(1) @binding(0) var<uniform> limits: Count;
                fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
                    var sum = 0.0;
                    for (var i = answer_part; i < limits.outer; i += answer_parts) {
                        for (var j = 0u; j < limits.inner; j++) {
                            sum += 2.0 * q.z / f32(limits.inner / 500u);
                        }
                    }
                    return vec3<f32>(0.5 * sum);
                }",
            ],
            uniform: [100u32, 1000, 0, 0].iter().flat_map(|count| count.to_le_bytes()).collect(),
            storage: Vec::new(),
        }
    }
}

#[test]
fn long_loops_are_complete_on_adapters_that_cut_them_short() {
    let Some(gpu) = gpu() else { return };
    let shader = Shader::new(&gpu, &Count, &Optics::default()).unwrap();
    let up = [0.0, 0.0, 1.0];
    let answers = shader.evaluate(&gpu, &[query(up, up), query(up, up)]).unwrap();
    assert_eq!(answers.reflectances, [[100_000.0; 3]; 2]);
}
