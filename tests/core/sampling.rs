//! `sample`, `eval` and `pdf` agree (docs/model.md#sampling).

use super::chi_square::{self, Bins, SIGNIFICANCE};
use super::common::{Random, built as build, direction, preset, relief, sinusoid, waves};
use ndarray::Array2;
use std::f64::consts::TAU;
use std::sync::Arc;
use sunbeam::height_field::{HeightField, Level, Preset};
use sunbeam::lobe::{Lobe, SpectralLobe, Surface, UNIFORM_FRACTION};
use sunbeam::numeric::{Lanes, Numbers, Plain};
use sunbeam::sampling::{SamplerLayout, SamplerView};
use sunbeam::scattering::{Options, Reading, Vec3};
use sunbeam::table::{Model, Tiling};
use sunbeam::transform::OrderTransform;

/// Rounding of quotients of equal numbers.
const ROUNDING: f64 = 1e-12;
/// Number of bins along either direction cosine.
const BINS: usize = 40;
/// Points in a bin at which the density, a sum of Gaussians along the axis, is read: largest number, and number to a
/// standard deviation. The midpoint rule must resolve Gaussians that bins' edges cut.
const PLACES_MAX: usize = 80;
const PLACES_PER_SIGMA: f64 = 3.0;
/// Width of a bin in direction cosines.
const WIDTH: f64 = 2.0 / BINS as f64;

/// Bins over the hemisphere. Where the density is bilinear between nodes, for a single wavelength, bins begin and end
/// at nodes, so that one point in each mesh of the lattice is exact.
fn bins(surface: &Surface, axis: usize, wi: Vec3, wavelengths: &[f64]) -> Bins {
    let lattice = surface.table().lattice();
    let period = [lattice.x.period_um, lattice.y.period_um][axis];
    let sigma: [f64; 2] = surface.table().power_sigma();
    let mesh = wavelengths[0] * 1e-3 / period;
    match surface.sampler().layout() {
        SamplerLayout::Square(layout) if layout.axes[axis].sigma.is_none() && wavelengths.len() == 1 => {
            let places = (WIDTH / mesh).ceil();
            let low = ((wi[axis] - 1.0) / mesh).floor() * mesh - wi[axis];
            Bins { count: BINS, low, width: places * mesh, places: places as usize }
        }
        _ => bins_over(-1.0, WIDTH, mesh * sigma[axis]),
    }
}

/// Bins for Gaussians with the standard deviation `sigma`.
fn bins_over(low: f64, width: f64, sigma: f64) -> Bins {
    let places = ((PLACES_PER_SIGMA * width / sigma).ceil() as usize).clamp(8, PLACES_MAX);
    Bins { count: BINS, low, width, places }
}

/// Probability of samples for `wavelengths` under the density for the wavelengths `claimed`.
fn agreement(surface: &Surface, wi: Vec3, wavelengths: &[f64], claimed: &[f64]) -> f64 {
    agreement_within(surface, wi, wavelengths, claimed, [0, 1].map(|axis| bins(surface, axis, wi, claimed)))
}

/// [`agreement`] with given numbers of bins along x and y.
fn agreement_within(surface: &Surface, wi: Vec3, wavelengths: &[f64], claimed: &[f64], bins: [Bins; 2]) -> f64 {
    let density = |wo: Vec3| surface.pdf(wi, wo, claimed);
    chi_square::agreement(bins, density, |random| surface.sample_direction(wi, wavelengths, random.three())).0
}

/// Options without energy conservation, which does not affect the density and takes longest to build.
fn options(coherence_length_um: f64, model: Model) -> Options {
    Options { coherence_length_um, model, conserve_energy: false, ..Options::default() }
}

/// The relief `sin x + sin y + 0.3 sin(2x + y)`, one period of `n` by `n` pixels.
fn crossed(n: usize, period_um: f64, height_um: f64) -> HeightField {
    let sine = |i: usize| (TAU * i as f64 / n as f64).sin();
    let heights = Array2::from_shape_fn((n, n), |(y, x)| height_um * (sine(x) + sine(y) + 0.3 * sine(2 * x + y)));
    HeightField::new(heights, period_um / n as f64, period_um / n as f64).unwrap()
}

fn surfaces() -> Vec<(&'static str, Arc<Surface>)> {
    vec![
        ("blazed", build(&preset(Preset::Blazed), &options(15.0, Model::Ensemble))),
        ("sinusoidal", build(&sinusoid(128, 2.5, 0.125), &options(15.0, Model::Ensemble))),
        ("waves", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(15.0, Model::Ensemble))),
        ("waves patch", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(15.0, Model::Patch))),
        ("waves, small window", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(3.0, Model::Ensemble))),
    ]
}

/// Surfaces sampled on the square, with every kind of lattice.
fn squares() -> Vec<(String, Arc<Surface>)> {
    let (large, wide) = (waves(256, 200, 0.13, 0.15, 0.5), relief(160, 120, 0.07, 0.07, 0.3));
    let alone = |model, coherence| Options { tiling: Tiling::Aperiodic, ..options(coherence, model) };
    let mut squares = vec![
        ("waves".to_owned(), build(&large, &options(65.0, Model::Ensemble))),
        ("waves, 45 µm".to_owned(), build(&large, &options(45.0, Model::Ensemble))),
        ("waves, patch".to_owned(), build(&large, &options(40.0, Model::Patch))),
        ("waves, 5 µm".to_owned(), build(&large, &options(5.0, Model::Ensemble))),
        ("rough and alone".to_owned(), build(&wide, &alone(Model::Ensemble, 65.0))),
        ("rough and alone, patch".to_owned(), build(&wide, &alone(Model::Patch, 65.0))),
        ("rough and alone, 5 µm".to_owned(), build(&wide, &alone(Model::Ensemble, 5.0))),
        ("long row".to_owned(), build(&long_row(), &options(20.0, Model::Ensemble))),
        (
            "flat".to_owned(),
            build(&HeightField::new(Array2::zeros((64, 64)), 1.0, 1.0).unwrap(), &options(65.0, Model::Ensemble)),
        ),
    ];
    squares.push(("elaphe".to_owned(), build(&preset(Preset::Elaphe), &options(65.0, Model::Ensemble))));
    if let Some(path) = sunbeam_testing::data("afm/xenopeltis.gsf") {
        let scan = HeightField::read(path, &Default::default()).unwrap().levelled(Level::Plane);
        squares.push(("scan".to_owned(), build(&scan, &alone(Model::Ensemble, 65.0))));
    }
    squares
}

/// Incidences from normal to grazing: polar angle and azimuth in degrees, and wavelength in nm.
const INCIDENCES: [(f64, f64, f64); 8] = [
    (0.0, 0.0, 550.0),
    (20.0, 130.0, 830.0),
    (40.0, 20.0, 480.0),
    (55.0, 70.0, 420.0),
    (65.0, -90.0, 600.0),
    (75.0, 0.0, 360.0),
    (80.0, -160.0, 650.0),
    (85.0, 25.0, 530.0),
];

/// Every fourth of [`INCIDENCES`], from the one with the number of the surface modulo 4. All surfaces of a list run the
/// same code, so the incidences are divided among them.
fn incidences(surface: usize) -> impl Iterator<Item = (f64, f64, f64)> {
    INCIDENCES.into_iter().skip(surface % 4).step_by(4)
}

#[test]
fn squares_follow_their_density() {
    for (i, (name, surface)) in squares().into_iter().enumerate() {
        assert!(matches!(surface.sampler().layout(), SamplerLayout::Square(_)), "{name}");
        for (theta, phi, nm) in incidences(i) {
            let p = agreement(&surface, direction(theta, phi), &[nm], &[nm]);
            println!("{name} at {theta}°: p = {p:.4}");
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: {p:e}");
        }
    }
}

#[test]
fn single_orders_follow_their_density() {
    let deep = sinusoid(64, 1.2, 0.125);
    let surfaces = [
        ("deep", build(&deep, &options(15.0, Model::Ensemble))),
        ("deep, patch", build(&deep, &options(15.0, Model::Patch))),
        ("crossed", build(&crossed(24, 1.2, 0.1), &options(15.0, Model::Ensemble))),
        ("row of pixels", build(&sinusoid(128, 20.0, 0.2), &options(30.0, Model::Ensemble))),
        ("one column", build(&column(), &options(15.0, Model::Ensemble))),
    ];
    for (i, (name, surface)) in surfaces.into_iter().enumerate() {
        assert!(matches!(surface.sampler().layout(), SamplerLayout::Orders(_)), "{name}");
        for (theta, phi, nm) in incidences(i) {
            let p = agreement(&surface, direction(theta, phi), &[nm], &[nm]);
            println!("{name} at {theta}°: p = {p:.4}");
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: {p:e}");
        }
    }
}

/// A relief that varies along x alone, with too many orders for sampling one by one.
fn long_row() -> HeightField {
    let heights = sinusoid(4096, 150.0, 0.1).heights_um().clone();
    HeightField::new(heights, 150.0 / 4096.0, 2.0).unwrap()
}

/// A relief that varies along y alone.
fn column() -> HeightField {
    HeightField::new(relief(40, 1, 0.2, 0.2, 0.3).heights_um().t().to_owned(), 2.0, 0.2).unwrap()
}

/// Orders of long windows are narrower than bins over the hemisphere, so bins cover the surroundings of a bright one.
#[test]
fn narrow_orders_follow_their_density() {
    for (coherence, kind) in [(500.0, "square"), (70.0, "square"), (1e4, "square"), (500.0, "orders")] {
        let period = if kind == "square" { 20.0 } else { 1.2 };
        let surface = build(&crossed(80, period, 0.1), &options(coherence, Model::Ensemble));
        assert_eq!(matches!(surface.sampler().layout(), SamplerLayout::Square(_)), kind == "square");
        let (wi, nm) = (direction(40.0, 20.0), 550.0);
        // Bins cover ten standard deviations about the order (1, 0).
        let sigma = nm * 1e-3 / (TAU * 2f64.sqrt() * coherence / 4.0);
        let bins = [nm * 1e-3 / period - wi[0], -wi[1]]
            .map(|middle| bins_over(middle - 5.0 * sigma, 10.0 * sigma / BINS as f64, sigma));
        let p = agreement_within(&surface, wi, &[nm], &[nm], bins);
        println!("{coherence} µm: p = {p:.4}");
        assert!(p > SIGNIFICANCE, "{coherence} µm, {kind}: {p:e}");
        let wrong = agreement_within(&surface, wi, &[nm], &[nm + 1e3 * sigma * period], bins);
        assert!(wrong < 1e-9, "{coherence} µm, {kind}: {wrong}");
    }
}

/// The density at each order is proportional to `|c_j|²·O`, the summand of docs/model.md#the-reflectance.
#[test]
fn orders_have_their_fraction_of_the_power() {
    /// Relative error: powers are means over intervals of κ, and orders have a width.
    const RELATIVE: f64 = 0.03;
    let field = preset(Preset::Sinusoidal);
    let surface = build(&field, &Options { conserve_energy: false, ..Options::default() });
    let transform = OrderTransform::new(&field);
    let (pixels, period) = (field.size().0 as i64, field.extent_um().0);
    for (theta, nm) in [(0.0, 550.0), (30.0, 450.0), (50.0, 620.0)] {
        let (wi, um) = (direction(theta, 0.0), nm * 1e-3);
        let mut shares = Vec::new();
        for j in -20..=20i64 {
            let x = um * j as f64 / period - wi[0];
            if x.abs() < 0.97 {
                let wo = [x, 0.0, (1.0 - x * x).sqrt()];
                let (u, w) = (wi[0] + wo[0], wi[2] + wo[2]);
                let power = transform.amplitudes(TAU * w / um)[j.rem_euclid(pixels) as usize].norm_sqr();
                let drawn = surface.pdf(wi, wo, &[nm]) - UNIFORM_FRACTION * sunbeam::numeric::math::SQUARE_PDF;
                shares.push((power * (u * u + w * w).powi(2) / (w * w * wo[2]), drawn / wo[2]));
            }
        }
        assert!(shares.len() > 4);
        let (exact, drawn) = shares.iter().fold((0.0, 0.0), |sum, share| (sum.0 + share.0, sum.1 + share.1));
        for share in &shares {
            let (exact, drawn) = (share.0 / exact, share.1 / drawn);
            assert!((exact - drawn).abs() < RELATIVE * exact.max(0.02), "{theta}°: {exact} {drawn}");
        }
    }
}

/// Kernels' single precision agrees with double precision.
#[test]
fn single_precision_matches_double() {
    /// Relative error: directions in single precision are good to 6e-8, and positions are up to 400 nodes from the
    /// origin.
    const RELATIVE: f64 = 2e-3;
    /// Smallest fraction of agreement: at the edge of a block or of an interval in κ either answer is right.
    const AGREE: f64 = 0.99;
    for (name, surface) in surfaces().into_iter().map(|(name, s)| (name.to_owned(), s)).chain(squares().drain(..4)) {
        let (single, double) = (surface.sampler().view::<f32>(), surface.sampler().view::<f64>());
        let mut random = Random::new(5);
        let (mut same, mut compared) = (0, 0);
        for _ in 0..4000 {
            let wi = random.direction().map(|c| c as f32);
            let (nm, u) = (random.wavelength_nm() as f32, [random.unit() as f32, random.unit() as f32]);
            if wi[2] < 0.1 {
                continue;
            }
            let wide = |v: [f32; 3]| v.map(f64::from);
            let drawn = single.sample(wi, &Reading::at(nm), u, true);
            assert!(drawn.iter().all(|c| c.is_finite()) && drawn[2] >= 0.0, "{name}: {drawn:?}");
            let reading = Reading::at(f64::from(nm));
            let exact = double.sample(wide(wi), &reading, u.map(f64::from), true);
            compared += 2;
            same += i32::from((0..2).all(|i| (f64::from(drawn[i]) - exact[i]).abs() < RELATIVE));
            let wo = if drawn[2] > 0.1 { drawn } else { random.direction().map(|c| c as f32) };
            let (a, b) = (pdf(&single, wi, wo, nm), double.pdf(wide(wi), wide(wo), &reading, true));
            same += i32::from((a - b).abs() <= RELATIVE * b);
        }
        assert!(f64::from(same) >= AGREE * f64::from(compared), "{name}: {same} of {compared}");
        let none = single.pdf([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], &Reading::at(550.0), false);
        assert_eq!((none, single.sample([0.0, 0.0, 1.0], &Reading::at(550.0), [0.5; 2], false)), (0.0, [0.0; 3]));
    }
}

/// Four wavelengths in four lanes have the answers of each alone.
#[test]
fn lanes_match_scalar() {
    /// Relative error: exponents of Gaussians' powers of two are rounded, and products have another order.
    const RELATIVE: f64 = 1e-4;
    /// Absolute error: lanes flush powers of two below the normal numbers to zero.
    const NORMAL: f64 = 1e-30;
    /// Smallest fraction of agreement, since rounding may decide a comparison.
    const AGREE: f64 = 0.999;
    let alone = Options { tiling: Tiling::Aperiodic, ..options(65.0, Model::Ensemble) };
    let more = [
        ("waves, 65 µm", build(&waves(256, 200, 0.13, 0.15, 0.5), &options(65.0, Model::Ensemble))),
        ("rough and alone", build(&relief(160, 120, 0.07, 0.07, 0.3), &alone)),
    ];
    for (name, surface) in surfaces().into_iter().chain(more) {
        let (layout, words) = (surface.layout(), surface.words());
        let (lanes, one) = (SpectralLobe::<Lanes> { layout, words, size: None }, surface.lobe::<f32>());
        let mut random = Random::new(11);
        let (mut same, mut compared, mut some) = (0, 0, 0);
        for _ in 0..1000 {
            let nm: [f32; 4] = std::array::from_fn(|_| random.wavelength_nm() as f32);
            let wi = random.direction().map(|c| c as f32);
            let drawn = one.sample(wi, nm, random.three().map(|u| u as f32), true);
            let wo = if drawn[2] > 0.0 { drawn } else { random.direction().map(|c| c as f32) };
            let (expected, density) = one.eval_pdf(wi, wo, nm, true);
            let (wi, wo) = (wi.map(Lanes::all), wo.map(Lanes::all));
            let ([found], densities) = lanes.eval_pdf(wi, wo, [Lanes::each(nm)], Lanes::mask(true));
            let found = found.to_array().into_iter().chain([0.25 * densities.reduce_add()]);
            for (found, expected) in found.zip(expected.into_iter().chain([density])) {
                let (found, expected) = (f64::from(found), f64::from(expected));
                assert!(found.is_finite() && found >= 0.0, "{name}: {found}");
                compared += 1;
                some += i32::from(expected > 0.0);
                same += i32::from((found - expected).abs() <= RELATIVE * expected + NORMAL);
            }
        }
        assert!(f64::from(same) >= AGREE * f64::from(compared), "{name}: {same} of {compared}");
        assert!(2 * some > compared, "{name}: {some} of {compared}");
    }
}

fn pdf(view: &SamplerView<Plain<'_, f32>>, wi: [f32; 3], wo: [f32; 3], nm: f32) -> f64 {
    f64::from(view.pdf(wi, wo, &Reading::at(nm), true))
}

#[test]
fn directions_follow_their_density() {
    for (i, (name, surface)) in surfaces().into_iter().enumerate() {
        for (theta, phi, nm) in incidences(i) {
            let p = agreement(&surface, direction(theta, phi), &[nm], &[nm]);
            println!("{name} at {theta}°: p = {p:.4}");
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: {p:e}");
        }
    }
}

#[test]
fn several_wavelengths_share_one_density() {
    let carried = [420.0, 500.0, 580.0, 660.0];
    for (name, surface) in &surfaces()[1..3] {
        let wi = direction(40.0, 20.0);
        let p = agreement(surface, wi, &carried, &carried);
        println!("{name}: p = {p:.4}");
        assert!(p > SIGNIFICANCE, "{name}: {p:e}");
        let mut random = Random::new(4);
        for _ in 0..1000 {
            let wo = random.direction();
            let mean = carried.iter().map(|&nm| surface.eval_pdf(wi, wo, nm).pdf).sum::<f64>() / 4.0;
            assert!((surface.pdf(wi, wo, &carried) - mean).abs() <= ROUNDING * mean);
        }
    }
}

#[test]
fn a_wrong_density_is_rejected() {
    let surface = &surfaces()[1].1;
    let p = agreement(surface, direction(40.0, 20.0), &[550.0], &[560.0]);
    assert!(p < 1e-9, "{p}");
}

#[test]
fn weight_times_density_is_the_reflectance() {
    for (name, surface) in surfaces() {
        let mut random = Random::new(9);
        for _ in 0..2000 {
            let (wi, nm) = (random.direction(), random.wavelength_nm());
            let carried = [nm, random.wavelength_nm(), random.wavelength_nm()];
            let Some(sample) = surface.sample(wi, &carried, random.three()) else { continue };
            let f = surface.eval_pdf(wi, sample.wo, nm).f * sample.wo[2];
            assert!((sample.weight * sample.pdf - f).abs() <= ROUNDING * f, "{name}");
            assert!((sample.pdf - surface.pdf(wi, sample.wo, &carried)).abs() <= ROUNDING * sample.pdf, "{name}");
            let length: f64 = sample.wo.iter().map(|c| c * c).sum();
            assert!((length - 1.0).abs() < ROUNDING && sample.wo[2] > 0.0);
        }
    }
}

/// The density is positive over the whole hemisphere, so weights are bounded also where samples rarely fall.
#[test]
fn the_density_is_positive_where_light_is_reflected() {
    for (name, surface) in surfaces() {
        let mut random = Random::new(12);
        for _ in 0..5000 {
            let (wi, wo, nm) = (random.direction(), random.direction(), random.wavelength_nm());
            let answer = surface.eval_pdf(wi, wo, nm);
            assert!(answer.pdf.is_finite() && answer.pdf > 0.0, "{name}: {answer:?}");
        }
    }
}
