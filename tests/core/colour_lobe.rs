//! The colour lobe against the integral of the spectral lobe over wavelength, and its sampler against its density.

use super::chi_square::{self, Bins, SIGNIFICANCE};
use super::common::{Random, built, cache, colour_differences, direction, preset};
use rayon::prelude::*;
use std::sync::{Arc, LazyLock};
use sunbeam::cache::Origin;
use sunbeam::colour::SpectralToRgb;
use sunbeam::colour::WavelengthWeights;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{ColourSurface, Gamut, LinearSrgb, Lobe, Surface, luminance};
use sunbeam::scattering::{ComplexIndex, Options, Pair, SpectralIndex, Vec3, fresnel_unpolarised};
use sunbeam::table::{Model, Progress, WAVELENGTH_MIN_NM};

/// Largest invisible colour difference, and the fraction of directions that must stay below.
const DELTA_E: f64 = 1.0;
const PERCENTILE: f64 = 0.99;
/// Largest deviation of a Monte Carlo mean in standard errors (exceeded by 6e-5 of seeds).
const STANDARD_ERRORS: f64 = 4.0;

/// Refractive index of gold, (nm, eta, k): Johnson and Christy, Phys. Rev. B 6, 4370 (1972).
const GOLD: [(f64, f64, f64); 14] = [
    (381.5, 1.46, 1.933),
    (397.4, 1.47, 1.952),
    (413.3, 1.46, 1.958),
    (430.5, 1.45, 1.948),
    (450.9, 1.38, 1.914),
    (471.4, 1.31, 1.849),
    (495.9, 1.04, 1.833),
    (520.9, 0.62, 2.081),
    (548.6, 0.43, 2.455),
    (582.1, 0.29, 2.863),
    (616.8, 0.21, 3.272),
    (659.5, 0.14, 3.697),
    (704.5, 0.13, 4.103),
    (821.1, 0.16, 5.083),
];

fn gold() -> SpectralIndex {
    SpectralIndex::sampled(GOLD.map(|(nm, eta, k)| (nm, ComplexIndex { eta, k })).into()).unwrap()
}

fn keratin() -> SpectralIndex {
    SpectralIndex::Constant(ComplexIndex { eta: 1.56, k: 0.0 })
}

fn options() -> Options {
    Options { conserve_energy: false, ..Options::default() }
}

/// A surface from the cache, and the origin of its tables.
type Kept = Arc<(ColourSurface, Origin)>;

fn build(field: &HeightField, options: &Options, index: Option<&SpectralIndex>) -> Kept {
    cache().shared_colours(field, options, index, &Progress::none()).unwrap()
}

/// The BSDF at every nm, Fresnel factor included.
struct Truth {
    surface: Arc<Surface>,
    weights: SpectralToRgb,
}

impl Truth {
    fn new(field: &HeightField) -> Self {
        Self { surface: built(field, &options()), weights: SpectralToRgb::visible(1.0).unwrap() }
    }

    /// Values at every wavelength of the weights, without the Fresnel factor.
    fn relief(&self, wi: Vec3, wo: Vec3) -> Vec<f64> {
        self.weights.wavelengths_nm().map(|nm| self.surface.eval(wi, wo, nm)).collect()
    }

    /// Colour of the relief's values for a pair of directions, with the Fresnel factor of the index.
    fn coloured(&self, relief: &[f64], wi: Vec3, wo: Vec3, index: Option<&SpectralIndex>) -> [f64; 3] {
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let cos = pair.cos_half();
        let mut relief = relief.iter();
        self.weights
            .rgb_of(|nm| relief.next().unwrap() * index.map_or(1.0, |index| fresnel_unpolarised(cos, index.at(nm))))
    }

    fn rgb(&self, wi: Vec3, wo: Vec3, index: Option<&SpectralIndex>) -> [f64; 3] {
        self.coloured(&self.relief(wi, wo), wi, wo, index)
    }
}

/// Directions over the hemisphere, uniform in direction cosines.
fn hemisphere() -> Vec<Vec3> {
    const SIZE: usize = 64;
    let direction = |i: usize| {
        let [x, y] = [i % SIZE, i / SIZE].map(|i| (2 * i + 1) as f64 / SIZE as f64 - 1.0);
        let z_squared = 1.0 - x * x - y * y;
        (z_squared > 0.0).then(|| [x, y, z_squared.sqrt()])
    };
    (0..SIZE * SIZE).filter_map(direction).collect()
}

/// ΔE₀₀ between two answers over the hemisphere, ascending, at an exposure that clips a tenth of the lit directions.
fn differences(truth: impl Fn(Vec3) -> [f64; 3] + Sync, found: impl Fn(Vec3) -> [f64; 3] + Sync) -> Vec<f64> {
    let pixels: Vec<_> = hemisphere().into_par_iter().map(|wo| (truth(wo), found(wo))).collect();
    colour_differences(&pixels)
}

fn percentile(errors: &[f64]) -> f64 {
    errors[(PERCENTILE * (errors.len() - 1) as f64) as usize]
}

struct Case {
    name: &'static str,
    truth: Truth,
    /// Surfaces without an index, of keratin and of gold.
    surfaces: [(Option<SpectralIndex>, Kept); 3],
}

static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    [("sinusoidal", Preset::Sinusoidal), ("elaphe", Preset::Elaphe)]
        .into_iter()
        .map(|(name, field)| {
            let field = preset(field);
            let surfaces = [None, Some(keratin()), Some(gold())]
                .map(|index| (index.clone(), build(&field, &options(), index.as_ref())));
            Case { name, truth: Truth::new(&field), surfaces }
        })
        .collect()
});

#[test]
fn colours_match_the_spectrum() {
    for case in CASES.iter() {
        for (theta, phi) in [(0.0, 0.0), (30.0, 20.0), (60.0, 100.0), (80.0, 0.0)] {
            let wi = direction(theta, phi);
            // The spectral values take longest to compute and serve all indices.
            let reliefs: Vec<_> = hemisphere().into_par_iter().map(|wo| (wo, case.truth.relief(wi, wo))).collect();
            for (index, surface) in &case.surfaces {
                let pixel = |(wo, relief): &(Vec3, Vec<f64>)| {
                    (case.truth.coloured(relief, wi, *wo, index.as_ref()), surface.0.eval(wi, *wo))
                };
                let error = percentile(&colour_differences(&reliefs.iter().map(pixel).collect::<Vec<_>>()));
                println!("{} with {:?} at {theta}°: ΔE {error:.2}", case.name, index.as_ref().map(|i| i.at(550.0)));
                assert!(error < DELTA_E, "{} at {theta}°, {phi}°: ΔE {error:.2}", case.name);
            }
        }
    }
}

/// The colour of gold under a narrow spectrum is not the product of gold's and the spectrum's colours.
#[test]
fn gold_times_a_rainbow_is_not_the_product_of_two_colours() {
    let (index, weights) = (gold(), SpectralToRgb::visible(1.0).unwrap());
    let case = &CASES[1];
    let [(_, plain), _, (_, golden)] = &case.surfaces;
    let (plain, golden) = (&plain.0, &golden.0);
    let wi = direction(30.0, 20.0);
    let product = |wo: Vec3| {
        let cos = (0.5 * (0..3).map(|c| (wi[c] + wo[c]).powi(2)).sum::<f64>().sqrt()).min(1.0);
        let metal = weights.rgb_of(|nm| fresnel_unpolarised(cos, index.at(nm)));
        let colour = plain.eval(wi, wo);
        std::array::from_fn(|c| metal[c] * colour[c])
    };
    let truth = |wo: Vec3| case.truth.rgb(wi, wo, Some(&index));
    let inside = differences(truth, |wo| golden.eval(wi, wo));
    let outside = differences(truth, product);
    println!("ΔE inside {:.2}, as a product {:.2}", percentile(&inside), percentile(&outside));
    assert!(percentile(&inside) < DELTA_E && percentile(&outside) > 2.0 * DELTA_E);
}

/// Largest absolute value of a colour's channels.
fn brightest(colour: [f64; 3]) -> f64 {
    colour.iter().fold(0.0, |most, channel| most.max(channel.abs()))
}

#[test]
fn colours_outside_srgb_are_kept_or_desaturated() {
    // Error relative to the brightest colour: mantissas of nine bits, and splines.
    const OFF: f64 = 0.02;
    // The weights of luminance have seven digits and sum to one.
    const WEIGHTS: f64 = 1e-6;
    let case = &CASES[0];
    let surface = &case.surfaces[0].1.0;
    let mut lobe = surface.lobe::<f64>();
    let wi = direction(30.0, 0.0);
    let (mut least, mut peak, mut worst) = (0.0f64, 0.0f64, 0.0f64);
    for i in 1..400 {
        let x = f64::from(i) / 200.0 - 1.0;
        let wo = [x, 0.0, (1.0 - x * x).sqrt()];
        let truth = case.truth.rgb(wi, wo, None);
        let kept = lobe.eval(wi, wo, LinearSrgb, true);
        lobe.factors.gamut = Gamut::Desaturate;
        let inside = lobe.eval(wi, wo, LinearSrgb, true);
        lobe.factors.gamut = Gamut::Keep;
        // Desaturation keeps the luminance, leaves no negative channel, and changes nothing where no channel was
        // negative.
        let [grey, wanted] = [inside, kept].map(luminance);
        assert!((grey - wanted.max(0.0)).abs() <= WEIGHTS * brightest(kept), "{kept:?} became {inside:?}");
        assert!(inside.iter().all(|&c| c >= 0.0), "{kept:?} became {inside:?}");
        assert!(kept.iter().any(|&c| c < 0.0) || inside == kept);
        for c in 0..3 {
            least = least.min(truth[c]);
            peak = peak.max(truth[c]);
            worst = worst.max((kept[c] - truth[c]).abs());
        }
    }
    assert!(least < -5.0 * OFF * peak && worst < OFF * peak, "{least} {worst} {peak}");
}

#[test]
fn values_are_reciprocal() {
    let mut random = Random::new(3);
    for (_, surface) in CASES.iter().flat_map(|case| &case.surfaces) {
        let lobe = surface.0.lobe::<f64>();
        for _ in 0..1000 {
            let (wi, wo) = (random.direction(), random.direction());
            assert_eq!(lobe.eval(wi, wo, LinearSrgb, true), lobe.eval(wo, wi, LinearSrgb, true));
        }
    }
}

#[test]
fn single_precision_matches_double() {
    // Error in single precision, relative to the brightest channel or a hundredth of the mean: positions among the
    // rings.
    const SINGLE: f64 = 2e-3;
    let mut random = Random::new(3);
    for case in CASES.iter() {
        for (_, surface) in &case.surfaces {
            let (double, single) = (surface.0.lobe::<f64>(), surface.0.lobe::<f32>());
            let pairs: Vec<_> = (0..3000).map(|_| (random.direction(), random.direction())).collect();
            let answers: Vec<_> = pairs.iter().map(|&(wi, wo)| double.eval(wi, wo, LinearSrgb, true)).collect();
            let mean = answers.as_flattened().iter().sum::<f64>() / (3.0 * answers.len() as f64);
            for (&(wi, wo), answer) in pairs.iter().zip(&answers) {
                let narrow = |w: Vec3| w.map(|c| c as f32);
                let found = single.eval(narrow(wi), narrow(wo), LinearSrgb, true);
                let pdf = double.pdf(wi, wo, LinearSrgb, true);
                let scale = brightest(*answer).max(0.01 * mean);
                for (found, answer) in found.into_iter().zip(answer) {
                    assert!((f64::from(found) - answer).abs() < SINGLE * scale, "{found} {answer} {mean}");
                }
                assert!((f64::from(single.pdf(narrow(wi), narrow(wo), LinearSrgb, true)) / pdf - 1.0).abs() < SINGLE);
            }
        }
    }
}

#[test]
fn luminance_matches_the_spectrum() {
    // Relative error: channels' weights are scaled to white separately (0.2 %), and mantissas have nine bits (0.4 %).
    const RELATIVE: f64 = 0.02;
    let case = &CASES[0];
    let lobe = case.surfaces[0].1.0.lobe::<f64>();
    let (mut random, mut sum, mut off) = (Random::new(8), 0.0, 0.0);
    for _ in 0..300 {
        let (wi, wo) = (direction(random.between(0.0, 70.0), 0.0), direction(random.between(0.0, 70.0), 180.0));
        let weights = WavelengthWeights::per_nm().iter().enumerate();
        let truth: f64 =
            weights.map(|(i, w)| f64::from(w[3]) * case.truth.surface.eval(wi, wo, WAVELENGTH_MIN_NM + i as f64)).sum();
        sum += truth;
        off += (luminance(lobe.eval(wi, wo, LinearSrgb, true)) - truth).abs();
    }
    assert!(off < RELATIVE * sum, "{off} of {sum}");
}

#[test]
fn a_flat_mirror_is_white_on_average() {
    let surface = build(&preset(Preset::Flat), &options(), None);
    let lobe = surface.0.lobe::<f64>();
    for theta in [0.0, 30.0, 60.0] {
        let wi = direction(theta, 20.0);
        // The peak and its surroundings on a grid in direction cosines with a spacing of a third of an order's width.
        const STEPS: i32 = 60;
        const STEP: f64 = 1e-3;
        let mut sum = [0.0; 3];
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let (x, y) = (f64::from(i) * STEP - wi[0], f64::from(j) * STEP - wi[1]);
                let wo = [x, y, (1.0 - x * x - y * y).sqrt()];
                let f = lobe.eval(wi, wo, LinearSrgb, true);
                (0..3).for_each(|c| sum[c] += f[c] * STEP * STEP);
            }
        }
        // Four rings interpolate the narrowest peak, the blue one; at 60° the obliquity factor varies across it.
        for channel in sum {
            assert!((channel - 1.0).abs() < 0.01, "{theta}°: {sum:?}");
        }
    }
}

/// Bins along either direction cosine, each with six nodes of the sampler. Eight points to a node make the midpoint
/// rule exact for linear interpolation, wherever it lies.
const BINS: Bins = Bins { count: 37, low: -1.0, width: 2.0 / 37.0, places: 48 };

/// Probability of the samples under the density for the incidence `claimed`, and the fraction of lost samples.
fn agreement(surface: &ColourSurface, wi: Vec3, claimed: Vec3) -> (f64, f64) {
    let (single, exact) = (surface.lobe::<f32>(), surface.lobe::<f64>());
    let density = |wo: Vec3| exact.pdf(claimed, wo, LinearSrgb, true);
    chi_square::agreement([BINS; 2], density, |random| {
        let wo = single.sample(wi.map(|c| c as f32), LinearSrgb, random.three().map(|u| u as f32), true);
        (wo[2] > 0.0).then(|| wo.map(f64::from))
    })
}

#[test]
fn directions_follow_their_density() {
    for case in CASES.iter() {
        let surface = &case.surfaces[2].1.0;
        for (theta, phi) in [(0.0, 0.0), (55.0, 70.0), (80.0, -160.0), (85.0, 25.0)] {
            let wi = direction(theta, phi);
            let (p, lost) = agreement(surface, wi, wi);
            println!("{} at {theta}°: p = {p:.4}, {:.1} % lost", case.name, 100.0 * lost);
            assert!(p > SIGNIFICANCE, "{} at {theta}°: {p:e}", case.name);
            assert!(lost < 0.5, "{} at {theta}°: {lost}", case.name);
        }
    }
}

#[test]
fn a_wrong_density_is_rejected() {
    let surface = &CASES[0].surfaces[0].1.0;
    let (p, _) = agreement(surface, direction(40.0, 20.0), direction(41.0, 20.0));
    assert!(p < 1e-9, "{p}");
}

struct Weights {
    mean: [f64; 3],
    error: [f64; 3],
    /// Standard deviations of the channels and of luminance, relative to the mean.
    channel_std: f64,
    luminance_std: f64,
    largest: f64,
}

fn weights(surface: &ColourSurface, wi: Vec3, count: usize, gamut: Gamut) -> Weights {
    let mut lobe = surface.lobe::<f64>();
    lobe.factors.gamut = gamut;
    let mut random = Random::new(5);
    let (mut sum, mut squares, mut largest) = ([0.0; 4], [0.0; 4], 0.0f64);
    for _ in 0..count {
        let wo = lobe.sample(wi, LinearSrgb, random.three(), true);
        if wo[2] <= 0.0 {
            continue;
        }
        let (f, pdf) = lobe.eval_pdf(wi, wo, LinearSrgb, true);
        assert!(pdf > 0.0 && pdf.is_finite());
        let [r, g, b] = f.map(|f| f * wo[2] / pdf);
        for (i, weight) in [r, g, b, luminance([r, g, b])].into_iter().enumerate() {
            sum[i] += weight;
            squares[i] += weight * weight;
            largest = largest.max(weight);
        }
    }
    let n = count as f64;
    let mean = sum.map(|sum| sum / n);
    let std: [f64; 4] = std::array::from_fn(|i| (squares[i] / n - mean[i] * mean[i]).sqrt());
    Weights {
        mean: std::array::from_fn(|c| mean[c]),
        error: std::array::from_fn(|c| std[c] / n.sqrt()),
        channel_std: (0..3).map(|c| std[c] / mean[c]).sum::<f64>() / 3.0,
        luminance_std: std[3] / mean[3],
        largest: largest / mean[3],
    }
}

/// Largest standard deviation of the channels' weights relative to their mean up to 75°, at 85°, and largest weight
/// relative to the mean luminance. One density serves three channels, and most directions of a grating have light in
/// one, which alone gives 1.2. At 85° much light leaves along the surface, where the square about the hemisphere is
/// half empty and the cosine varies within a node.
const CHANNEL_STD: f64 = 1.5;
const CHANNEL_STD_85: f64 = 1.9;
const LARGEST: f64 = 60.0;

#[test]
fn weights_have_a_small_variance() {
    for name in [Preset::Blazed, Preset::Cd, Preset::Xenopeltis] {
        // The albedo table dominates the build. A disc's weights have a small variance without it; a skin's do not.
        let options = if name == Preset::Cd { options() } else { Options::default() };
        let kept = build(&preset(name), &options, None);
        let surface = &kept.0;
        println!("{name}: {:?}", surface.report());
        for theta in [0.0, 30.0, 60.0, 75.0, 85.0] {
            let found = weights(surface, direction(theta, 25.0), 20_000, Gamut::Desaturate);
            println!(
                "{name} at {theta}°: channels {:.2}, luminance {:.2}, largest {:.1}, mean {:.3?}",
                found.channel_std, found.luminance_std, found.largest, found.mean
            );
            let most = if theta > 80.0 { CHANNEL_STD_85 } else { CHANNEL_STD };
            assert!(found.channel_std < most && found.largest < LARGEST, "{name} at {theta}°");
        }
    }
}

#[test]
fn weights_average_to_the_albedo() {
    // Relative error of the tables: the spectral table's tolerance and the colour table's mantissas.
    const TABLES: f64 = 0.005;
    let case = &CASES[0];
    let white = SpectralToRgb::visible(5.0).unwrap();
    for theta in [0.0, 40.0, 60.0] {
        let wi = direction(theta, 25.0);
        let albedo = white.rgb_of(|nm| case.truth.surface.albedo(wi, nm).unwrap());
        let kept = weights(&case.surfaces[0].1.0, wi, 200_000, Gamut::Keep);
        let grey = weights(&case.surfaces[0].1.0, wi, 200_000, Gamut::Desaturate);
        println!("at {theta}°: {albedo:.3?}, kept {:.3?}, desaturated {:.3?}", kept.mean, grey.mean);
        for c in 0..3 {
            let off = STANDARD_ERRORS * kept.error[c] + TABLES * albedo[c];
            assert!((kept.mean[c] - albedo[c]).abs() < off, "{:?} {albedo:?}", kept.mean);
        }
        // Desaturation keeps the luminance of each direction, except where ripples of the splines make it negative.
        let [found, wanted] = [grey.mean, kept.mean].map(luminance);
        assert!((found - wanted).abs() < 1e-4 * wanted, "{found} {wanted}");
    }
}

#[test]
fn cached_tables_answer_equally() {
    let surface = &CASES[0].surfaces[2].1.0;
    let bytes = postcard::to_stdvec(surface).unwrap();
    let back: ColourSurface = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(back.table(), surface.table());
    let mut random = Random::new(2);
    for _ in 0..100 {
        let (wi, wo, u) = (random.direction(), random.direction(), random.three());
        let (a, b) = (surface.lobe::<f64>(), back.lobe::<f64>());
        assert_eq!(a.eval_pdf(wi, wo, LinearSrgb, true), b.eval_pdf(wi, wo, LinearSrgb, true));
        assert_eq!(a.sample(wi, LinearSrgb, u, true), b.sample(wi, LinearSrgb, u, true));
    }
}

#[test]
fn invalid_pairs_answer_zero() {
    let lobe = CASES[0].surfaces[2].1.0.lobe::<f32>();
    let up = [0.0, 0.0, 1.0];
    let bad =
        [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [f32::NAN, 0.0, 1.0], [0.0, f32::INFINITY, 1.0], [0.0, 0.0, f32::NAN]];
    for w in bad {
        assert_eq!(lobe.eval(w, up, LinearSrgb, true), [0.0; 3]);
        assert_eq!(lobe.eval(up, w, LinearSrgb, true), [0.0; 3]);
    }
    assert_eq!(lobe.sample([0.0, 0.0, -1.0], LinearSrgb, [0.5; 3], true), [0.0; 3]);
    assert_eq!(lobe.eval(up, up, LinearSrgb, false), [0.0; 3]);
    assert_eq!(lobe.pdf(up, [0.0, 0.0, -1.0], LinearSrgb, true), 0.0);
}

#[test]
fn a_patch_and_long_windows_are_built() {
    let field = preset(Preset::Sinusoidal);
    for (model, coherence_length_um) in [(Model::Patch, 65.0), (Model::Ensemble, 200.0)] {
        let options = Options { model, coherence_length_um, ..options() };
        let kept = build(&field, &options, None);
        let surface = &kept.0;
        println!("{:?}", surface.report());
        assert!(surface.report().sampler_bytes <= 8_000_000, "{:?}", surface.report());
        let found = weights(surface, direction(30.0, 25.0), 20_000, Gamut::Desaturate);
        println!("{model:?} {coherence_length_um} µm: channels {:.2}, largest {:.1}", found.channel_std, found.largest);
        assert!(found.channel_std < 3.0, "{}", found.channel_std);
    }
}
