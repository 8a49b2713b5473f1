//! Every method's WGSL against its Rust twin, on pairs of directions.

use super::common::{Random, cache, preset};
use super::support::{gpu, query, worst};
use sunbeam::height_field::Preset;
use sunbeam::methods::{AnswerKind, Method, MethodKind, MethodOptions, Repeats, StamForm, build};
use sunbeam::scattering::{ComplexIndex, Obliquity, Options, Pair};
use sunbeam::table::{Model, Progress};
use sunbeam::transform::Series;
use sunbeam_realtime::{Gpu, Optics, Query, Shader};

/// Tolerance relative to the response plus the floor. Both sides are single precision: the position among up to 200
/// orders is known to some 1e-5, and contributions of many orders partly cancel in dark directions.
const TOLERANCE: f32 = 1e-3;
/// Floor of the relative error, as a fraction of the mean response.
const FLOOR: f32 = 1e-3;

/// Pairs over the hemisphere, half of them near the mirror direction, where most of the light goes.
fn pairs(count: usize) -> Vec<Query> {
    let mut random = Random::new(11);
    let mut pairs = Vec::new();
    while pairs.len() < count {
        let wi = random.direction();
        let mut wo = random.direction();
        if pairs.len() % 2 == 0 {
            let shift = |c: f64, r: &mut Random| -c + r.between(-0.2, 0.2);
            let (x, y) = (shift(wi[0], &mut random), shift(wi[1], &mut random));
            let z_squared = 1.0 - x * x - y * y;
            if z_squared <= 0.0 {
                continue;
            }
            wo = [x, y, z_squared.sqrt()];
        }
        pairs.push(query(wi, wo));
    }
    pairs
}

fn twin(method: &dyn Method, queries: &[Query]) -> Vec<[f32; 3]> {
    let response = |query: &Query| {
        let pair = Pair::new(query.wi.map(f64::from), query.wo.map(f64::from)).unwrap();
        let factor = match method.answers() {
            AnswerKind::Relief => pair.obliquity(Obliquity::Stam) as f32,
            AnswerKind::Reflectance | AnswerKind::Film { .. } => 1.0,
        };
        method.answer_rgb(query.wi, query.wo).map(|channel| factor * channel)
    };
    queries.iter().map(response).collect()
}

fn compare(gpu: &Gpu, kind: MethodKind, name: Preset, options: &MethodOptions, count: usize) {
    let field = preset(name);
    let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    let method = build(kind, &field, &surface, options).unwrap();
    compare_twins(gpu, &format!("{kind} of {name} with {options:?}"), &*method, count);
}

fn compare_twins(gpu: &Gpu, name: &str, method: &dyn Method, count: usize) {
    let queries = pairs(count);
    let shader = Shader::new(gpu, method, &Optics::default()).unwrap();
    let answers = shader.evaluate(gpu, &queries).unwrap();
    let expected = twin(method, &queries);
    let mean = expected.as_flattened().iter().map(|value| value.abs()).sum::<f32>() / (3 * count) as f32;
    assert!(mean > 0.0, "{name} answers nothing");
    let floor = FLOOR * mean;
    let error = worst(&answers.reflectances, &expected, floor);
    eprintln!(
        "{name} {count} pairs: {:8.1} ms in {} submissions, largest difference {error:.1e}",
        answers.gpu_ms, answers.submissions
    );
    assert!(error < TOLERANCE, "{name}: {error}");
    // Negative control: directions shifted by a thousandth along the tangent.
    let moved = |query: &Query| Query::new([query.wi[0] + 1e-3, query.wi[1], query.wi[2]], query.wo);
    let moved: Vec<Query> = queries.iter().map(moved).collect();
    let error = worst(&answers.reflectances, &twin(method, &moved), floor);
    assert!(error > TOLERANCE, "{name} does not see a change of direction: {error}");
}

#[test]
fn wgsl_of_flss_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let default = MethodOptions::default();
    compare(&gpu, MethodKind::Flss, Preset::Blazed, &default, 3000);
    let coarse = MethodOptions { lambda_step_nm: 20.0, ..default.clone() };
    compare(&gpu, MethodKind::Flss, Preset::Elaphe, &coarse, 2000);
    compare(&gpu, MethodKind::Flss, Preset::Xenopeltis, &coarse, 2000);
    let sources = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..coarse };
    compare(&gpu, MethodKind::Flss, Preset::Blazed, &sources, 2000);
}

#[test]
fn wgsl_of_nmm_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    for weighted in [false, true] {
        let options = MethodOptions { weighted, ..MethodOptions::default() };
        for name in [Preset::Blazed, Preset::Elaphe, Preset::Xenopeltis] {
            compare(&gpu, MethodKind::Nmm, name, &options, 2000);
        }
    }
}

#[test]
fn wgsl_of_pq_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let options = MethodOptions { lambda_step_nm: 10.0, ..MethodOptions::default() };
    compare(&gpu, MethodKind::Pq, Preset::Blazed, &options, 2000);
    let coarse = MethodOptions { lambda_step_nm: 20.0, repeats: Some(Repeats::Both(1)), ..options };
    compare(&gpu, MethodKind::Pq, Preset::Elaphe, &coarse, 1000);
}

#[test]
fn wgsl_of_stam_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    for name in [Preset::Blazed, Preset::Elaphe] {
        compare(&gpu, MethodKind::Stam, name, &MethodOptions::default(), 4000);
    }
}

#[test]
fn wgsl_of_gpu_gems_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let default = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
    let own = MethodOptions { period_um: Some(10.0), gems_highlight: [0.2, 3.0, 0.5], ..default.clone() };
    let wide = MethodOptions { gems_sharpness: 2.0, ..default.clone() };
    for options in [&default, &own, &wide] {
        compare(&gpu, MethodKind::Stam, Preset::Blazed, options, 4000);
    }
}

#[test]
fn optics_do_not_change_the_colours_of_gpu_gems() {
    let Some(gpu) = gpu() else { return };
    let (field, queries) = (preset(Preset::Blazed), pairs(500));
    let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
    let optics = Optics {
        index: Some(ComplexIndex { eta: 1.5, k: 0.0 }),
        cover: None,
        obliquity: Obliquity::Unit,
        shadowing: true,
    };
    for (stam_form, changed) in [(StamForm::Gems, false), (StamForm::Spacing, true)] {
        let options = MethodOptions { stam_form, ..MethodOptions::default() };
        let method = build(MethodKind::Stam, &field, &surface, &options).unwrap();
        let shader = Shader::new(&gpu, &*method, &Optics::default()).unwrap();
        let before = shader.evaluate(&gpu, &queries).unwrap().reflectances;
        shader.set_optics(&gpu, &optics);
        assert_eq!(shader.evaluate(&gpu, &queries).unwrap().reflectances != before, changed, "{stam_form:?}");
    }
}

#[test]
fn wgsl_of_the_colour_table_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    let options = MethodOptions { resolution: 0.7, ..MethodOptions::default() };
    for name in [Preset::Flat, Preset::Blazed, Preset::Elaphe] {
        compare(&gpu, MethodKind::Table, name, &options, 4000);
    }
}

#[test]
fn wgsl_of_the_conserving_table_agrees_with_rust() {
    let Some(gpu) = gpu() else { return };
    for name in [Preset::Blazed, Preset::Elaphe] {
        let (field, options) = (preset(name), MethodOptions::default());
        let method = build(MethodKind::Table, &field, &Options::default(), &options).unwrap();
        compare_twins(&gpu, &format!("table of {name}, energy conserved,"), &*method, 2000);
        // The path tracer's albedo is built from the same lobes.
        let kept = cache().shared_colours(&field, &Options::default(), None, &Progress::none()).unwrap();
        let view = kept.0.albedo_table().unwrap().view::<f32>();
        let plain =
            build(MethodKind::Table, &field, &Options { conserve_energy: false, ..Options::default() }, &options);
        let plain = plain.unwrap();
        let mut divided = 0;
        for Query { wi, wo, .. } in pairs(500) {
            let (found, relief) = (method.answer_rgb(wi, wo), plain.answer_rgb(wi, wo));
            let factor = view.band_factor(wi, wo, None, true);
            assert_eq!(found, std::array::from_fn(|c| relief[c] * factor[c]));
            divided += usize::from(factor[1] < 0.9);
        }
        assert!(divided > 50, "{divided}");
    }
}

#[test]
fn methods_without_albedo_refuse_to_conserve_energy() {
    let (field, options) = (preset(Preset::Blazed), MethodOptions::default());
    let patch = Options { model: Model::Patch, conserve_energy: true, ..Options::default() };
    for kind in MethodKind::ALL {
        let refused = build(kind, &field, &patch, &options).err().unwrap().to_string();
        assert!(refused.contains("conserve_energy"), "{kind}: {refused}");
    }
}
