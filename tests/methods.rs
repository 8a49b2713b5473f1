//! The sources' methods against the oracle and against what they promise.

mod common;

use common::{Random, preset};
use std::f64::consts::{PI, TAU};
use std::time::Instant;
use sunbeam::colour::{ciede2000, linear_srgb_to_lab};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::methods::{Method, MethodError, MethodKind, MethodOptions, Repeats, build};
use sunbeam::reflectance::{Exact, Options};
use sunbeam::table::{DENSITY_FLOOR_UM2, Model};
use sunbeam::transform::Series;

const COHERENCE_UM: f64 = 65.0;

fn method(kind: MethodKind, field: &HeightField, tolerance: f64, options: &MethodOptions) -> Box<dyn Method> {
    build(kind, field, COHERENCE_UM, tolerance, options).unwrap()
}

fn oracle(field: &HeightField, model: Model) -> Exact {
    let options = Options { model, coherence_length_um: COHERENCE_UM, conserve_energy: false, ..Options::default() };
    Exact::new(field, &options, None)
}

/// Errors of `S` in ascending order over random places at a few κ, relative to the largest of the oracle's value, its
/// mean over window places, and the density floor, as tables are measured. Half the places lie near whole orders.
fn errors(field: &HeightField, method: &dyn Method) -> Vec<f64> {
    let (patch, mean) = (oracle(field, Model::Patch), oracle(field, Model::Ensemble));
    let (lx, ly) = field.extent_um();
    let mut random = Random::new(5);
    let mut errors = Vec::new();
    for (w, nm) in [(2.0, 380.0), (1.9, 450.0), (1.5, 380.0), (1.2, 550.0), (0.6, 633.0), (0.1, 780.0), (1e-4, 500.0)] {
        let um: f64 = nm * 1e-3;
        // Rounded as the method's arguments are, so that both see one place.
        let w = f64::from(w as f32);
        let across = (4.0 - w * w).max(0.04f64).sqrt();
        for i in 0..60 {
            let turn = random.between(0.0, TAU);
            let distance = across * random.unit().sqrt();
            let mut uv = [distance * turn.cos(), distance * turn.sin()];
            if field.size().1 == 1 {
                uv[1] *= 0.02;
            }
            if i % 2 == 0 {
                let near = |u: f64, l: f64, r: &mut Random| ((u * l / um).round() + r.between(-0.1, 0.1)) * um / l;
                uv = [near(uv[0], lx, &mut random), near(uv[1], ly, &mut random)];
            }
            let [u, v] = uv.map(|c| c as f32);
            let f = [f64::from(u) / um, f64::from(v) / um];
            let kappa = TAU * w / um;
            let truth = patch.power_density(f, kappa);
            let scale = truth.max(mean.power_density(f, kappa)).max(DENSITY_FLOOR_UM2);
            let found = f64::from(method.spectral([u, v, w as f32], nm as f32).unwrap()) * um * um;
            errors.push((found - truth).abs() / scale);
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

/// Median, 99th percentile and largest.
fn summary(errors: &[f64]) -> [f64; 3] {
    let at = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
    [at(0.5), at(0.99), at(1.0)]
}

#[test]
fn flss_is_the_direct_sum() {
    for name in [Preset::Flat, Preset::Blazed, Preset::Sinusoidal, Preset::Elaphe, Preset::Xenopeltis] {
        let field = preset(name);
        for tolerance in [1e-3, 1e-5] {
            let start = Instant::now();
            let flss = method(MethodKind::Flss, &field, tolerance, &MethodOptions::default());
            let built = start.elapsed();
            let start = Instant::now();
            for i in 0..20 {
                flss.response([0.1 + 0.01 * i as f32, 0.05, 1.9]);
            }
            let response = start.elapsed() / 20;
            let found = summary(&errors(&field, &*flss));
            let bytes: usize = flss.shader().storage.iter().map(|b| b.len()).sum();
            println!("{name} {tolerance:e}: {found:?}, {bytes} bytes, built {built:?}, response {response:?}");
        }
    }
}
