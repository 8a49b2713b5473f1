//! The procedural skins against atomic-force scans: radial and angular power spectra of the heights, and statistics of
//! the relief. The scans are 6.5 µm wide, so skins are cut into crops of this size, levelled and tapered equally, and
//! averaged. A worse skin fails, and so does the other species.

use ndarray::{Array2, s};
use sunbeam::height_field::{FileScale, HeightField, Level, Preset};
use sunbeam_fourier::num_complex::Complex;
use sunbeam_fourier::{Direction, Fft2};

/// Largest difference of radial spectra: half the sum of absolute differences of the fractions of power in rings.
/// Measured: 0.09 and 0.08. A scan is one crop; single crops differ from their skin's average by 0.07 (median) and by
/// 0.13 to 0.17 (95 %).
const RADIAL: f64 = 0.13;
/// Largest difference of angular spectra, as for rings with sectors of direction. Measured: 0.06 and 0.07; single crops
/// differ from their average by up to 0.09 (95 %).
const ANGULAR: f64 = 0.10;
/// Largest relative difference of root mean square height and slopes. Measured: at most 0.13; between crops they
/// scatter by 0.03 (height) to 0.12 (slope along the fingers of Elaphe).
const MOMENTS: f64 = 0.20;
/// Largest relative difference of the height range, which scatters by 0.1 between crops.
const RANGE: f64 = 0.25;
/// Smallest deviation of a wrong skin's spectra, as a multiple of the tolerance.
const CLEAR_MISS: f64 = 2.0;

/// Edges of rings in cycles/µm: narrow at orders, wide at low power. Levelling and taper remove most power below 0.2.
const RINGS: [f64; 11] = [0.2, 0.5, 0.8, 1.1, 1.4, 1.7, 2.1, 2.7, 3.5, 4.7, 6.5];
/// Range of frequencies of the angular spectrum, in cycles/µm.
const SECTOR_BAND: (f64, f64) = (0.5, 4.7);
/// Number of sectors of 15° between the fingers' axis and across. Mirrored directions are folded together, since the
/// orientation of the sample under the microscope is slightly off.
const SECTORS: usize = 6;

const CROP_UM: f64 = 6.5;

#[derive(Debug)]
struct Features {
    rings: Vec<f64>,
    sectors: Vec<f64>,
    /// Root mean square height (µm), slope along and across the fingers, range (µm).
    rms_um: f64,
    slopes: (f64, f64),
    range_um: f64,
}

fn fft2(values: &Array2<f64>) -> Array2<Complex<f64>> {
    let (ny, nx) = values.dim();
    let mut bins: Vec<_> = values.iter().map(|&v| Complex::new(v, 0.0)).collect();
    Fft2::new(nx, ny, Direction::Negative).process(&mut bins, &mut Vec::new());
    Array2::from_shape_vec((ny, nx), bins).unwrap()
}

fn signed(index: usize, count: usize) -> f64 {
    if 2 * index < count { index as f64 } else { index as f64 - count as f64 }
}

fn shares(mut values: Vec<f64>) -> Vec<f64> {
    let sum: f64 = values.iter().sum();
    values.iter_mut().for_each(|v| *v /= sum);
    values
}

/// Features of one crop with its fingers along x. Its spectra are powers, not fractions.
fn features(crop: &HeightField) -> Features {
    let field = crop.levelled(Level::Plane);
    let (nx, ny) = field.size();
    let taper = |i: usize, n: usize| (std::f64::consts::PI * (i as f64 + 0.5) / n as f64).sin().powi(2);
    let window = Array2::from_shape_fn((ny, nx), |(iy, ix)| taper(iy, ny) * taper(ix, nx));
    let mean = (field.heights_um() * &window).sum() / window.sum();
    let power = fft2(&((field.heights_um() - mean) * &window)).mapv(|c| c.norm_sqr());
    let (lx, ly) = field.extent_um();
    let (mut rings, mut sectors) = (vec![0.0; RINGS.len() - 1], vec![0.0; SECTORS]);
    for ((iy, ix), p) in power.indexed_iter() {
        let (fx, fy) = (signed(ix, nx) / lx, signed(iy, ny) / ly);
        let radius = fx.hypot(fy);
        if let Some(ring) = RINGS.windows(2).position(|r| (r[0]..r[1]).contains(&radius)) {
            rings[ring] += p;
        }
        if radius > SECTOR_BAND.0 && radius < SECTOR_BAND.1 {
            let angle = fy.abs().atan2(fx.abs()).to_degrees();
            sectors[((angle / 90.0 * SECTORS as f64) as usize).min(SECTORS - 1)] += p;
        }
    }
    let range_um = crop.peak_to_valley_um();
    Features { rings, sectors, rms_um: field.rms_um(), slopes: field.rms_slope(), range_um }
}

fn average(all: &[Features]) -> Features {
    let count = all.len() as f64;
    let mean = |pick: &dyn Fn(&Features) -> f64| all.iter().map(pick).sum::<f64>() / count;
    let add = |pick: fn(&Features) -> &Vec<f64>| {
        shares((0..pick(&all[0]).len()).map(|i| all.iter().map(|f| pick(f)[i]).sum()).collect())
    };
    Features {
        rings: add(|f| &f.rings),
        sectors: add(|f| &f.sectors),
        rms_um: mean(&|f| f.rms_um),
        slopes: (mean(&|f| f.slopes.0), mean(&|f| f.slopes.1)),
        range_um: mean(&|f| f.range_um),
    }
}

/// The skin with its fingers along x, as in the scans. A mirrored skin has an equal folded spectrum.
fn fingers_along_x(preset: Preset) -> HeightField {
    let field = preset.build(None, None).unwrap();
    if preset != Preset::Elaphe {
        return field;
    }
    HeightField::new(field.heights_um().t().as_standard_layout().into_owned(), field.dy_um(), field.dx_um()).unwrap()
}

/// Average over all disjoint crops of the scans' size.
fn procedural(field: &HeightField) -> Features {
    let n = (CROP_UM / field.dx_um()).round() as usize;
    let (nx, ny) = field.size();
    let mut all = Vec::new();
    for iy in (0..=ny - n).step_by(n) {
        for ix in (0..=nx - n).step_by(n) {
            let heights = field.heights_um().slice(s![iy..iy + n, ix..ix + n]).to_owned();
            all.push(features(&HeightField::new(heights, field.dx_um(), field.dy_um()).unwrap()));
        }
    }
    assert!(all.len() >= 100);
    average(&all)
}

fn scan(name: &str) -> Option<Features> {
    let path = sunbeam_testing::data(&format!("afm/{name}.gsf"))?;
    Some(average(&[features(&HeightField::read(path, &FileScale::default()).unwrap())]))
}

/// Deviations divided by their tolerances, with their names; above 1 the skin misses.
fn deviations(skin: &Features, scan: &Features) -> [(&'static str, f64); 6] {
    let variation = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum::<f64>() / 2.0;
    let relative = |a: f64, b: f64| (a - b).abs() / b;
    [
        ("radial spectrum", variation(&skin.rings, &scan.rings) / RADIAL),
        ("angular spectrum", variation(&skin.sectors, &scan.sectors) / ANGULAR),
        ("rms height", relative(skin.rms_um, scan.rms_um) / MOMENTS),
        ("slope along the fingers", relative(skin.slopes.0, scan.slopes.0) / MOMENTS),
        ("slope across the fingers", relative(skin.slopes.1, scan.slopes.1) / MOMENTS),
        ("height range", relative(skin.range_um, scan.range_um) / RANGE),
    ]
}

#[test]
fn skins_match_the_scans() {
    for (name, preset) in [("elaphe", Preset::Elaphe), ("xenopeltis", Preset::Xenopeltis)] {
        let Some(scan) = scan(name) else { return };
        let skin = procedural(&fingers_along_x(preset));
        for (what, deviation) in deviations(&skin, &scan) {
            println!("{name}: {what} off by {deviation:.2} of its tolerance");
            assert!(deviation <= 1.0, "{name}: {what} is {deviation:.2} of its tolerance\n{skin:?}\n{scan:?}");
        }
    }
}

#[test]
fn wrong_skins_do_not_match_the_scans() {
    let (Some(elaphe), Some(xenopeltis)) = (scan("elaphe"), scan("xenopeltis")) else { return };
    for (preset, other) in [(Preset::Elaphe, &xenopeltis), (Preset::Xenopeltis, &elaphe)] {
        for (what, deviation) in deviations(&procedural(&fingers_along_x(preset)), other) {
            let least = if what.ends_with("spectrum") { CLEAR_MISS } else { 1.0 };
            println!("{preset} against the other: {what} off by {deviation:.2} of its tolerance");
            // Ranges and slopes of the species differ by a factor of two, too.
            assert!(deviation > least, "{preset}: {what} is only {deviation:.2} of its tolerance from the other skin");
        }
    }
    // The right skin fails when rotated by 90°, and when a third too high.
    let skin = fingers_along_x(Preset::Elaphe);
    let turned = Preset::Elaphe.build(None, None).unwrap();
    assert!(deviations(&procedural(&turned), &elaphe)[1].1 > CLEAR_MISS);
    let high = HeightField::new(skin.heights_um() * 1.33, skin.dx_um(), skin.dy_um()).unwrap();
    assert!(deviations(&procedural(&high), &elaphe)[2].1 > 1.0);
}

/// Power of the orders of the phase screen at λ = 550 nm, w = 1.95 (normal incidence, viewed near 18°).
fn orders(field: &HeightField) -> Array2<f64> {
    let kappa = std::f64::consts::TAU * 1.95 / 0.55;
    let count = field.heights_um().len() as f64;
    let real = fft2(&field.heights_um().mapv(|h| (kappa * h).cos()));
    let imaginary = fft2(&field.heights_um().mapv(|h| (kappa * h).sin()));
    let amplitudes = real + imaginary.mapv(|c| c * Complex::<f64>::i());
    amplitudes.mapv(|c| c.norm_sqr() / (count * count))
}

#[test]
fn skins_have_their_periods() {
    // The presets' periods are those of Single 2014. The strongest order along x has this period, to the rounding of
    // the tile's extent.
    for (preset, period_um) in [(Preset::Elaphe, 1.144_26), (Preset::Xenopeltis, 1.552_27)] {
        let field = preset.build(None, None).unwrap();
        let power = fft2(field.heights_um()).mapv(|c| c.norm_sqr());
        let strongest = (5..512).max_by(|a, b| power[[0, *a]].total_cmp(&power[[0, *b]])).unwrap();
        assert!((field.extent_um().0 / strongest as f64 - period_um).abs() < 1e-9, "{preset}: order {strongest}");
    }
}

/// Powers within 3 orders of the x axis and of the y axis, without the speckle around the mirror direction.
fn powers_along_axes(power: &Array2<f64>) -> [f64; 2] {
    let distance = |i: usize| signed(i, 1024).abs();
    let sum = |near: &dyn Fn(usize, usize) -> bool| -> f64 {
        power.indexed_iter().filter(|((iy, ix), _)| near(*ix, *iy)).map(|(_, power)| power).sum()
    };
    let near_axis = |along: usize, across: usize| distance(along) > 30.0 && distance(across) <= 3.0;
    [sum(&|ix, iy| near_axis(ix, iy)), sum(&|ix, iy| near_axis(iy, ix))]
}

/// Single 2014: "Nothing diffracts along the fingers".
#[test]
fn elaphe_diffracts_along_one_axis() {
    let [x, y] = powers_along_axes(&orders(&Preset::Elaphe.build(None, None).unwrap()));
    assert!(y < x / 50.0, "{x} {y}");
}

#[test]
fn xenopeltis_diffracts_along_both_axes() {
    let [x, y] = powers_along_axes(&orders(&Preset::Xenopeltis.build(None, None).unwrap()));
    assert!(x < 4.0 * y && y < 4.0 * x, "{x} {y}");
}

#[test]
fn xenopeltis_diffracts_more_than_elaphe() {
    // Power outside of the mirror direction.
    let diffracted = |preset: Preset| 1.0 - orders(&preset.build(None, None).unwrap())[[0, 0]];
    assert!(diffracted(Preset::Xenopeltis) > diffracted(Preset::Elaphe));
}
