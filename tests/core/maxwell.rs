//! The model against Maxwell's equations on measured skins: the fraction of the reflected power in wrong directions.

use super::common::built;
use ndarray::Array2;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;
use sunbeam::height_field::{FileScale, HeightField};
use sunbeam::scattering::{ComplexIndex, Obliquity, Options, Pair, SpectralIndex};

/// Pixel of the periodic, smooth crops in µm, and the factor of finer sampling that the phase needs.
const PIXEL_UM: f64 = 0.065;
const FINER: usize = 3;
/// The solver's index of keratin.
const KERATIN: ComplexIndex = ComplexIndex { eta: 1.56, k: 0.0 };
/// Largest angle of incidence in degrees of the first group of lights; the second group is at 75°.
const THETA_MAX_DEG: u32 = 60;

/// Effect of the tables on a misplaced fraction: their tolerance, and the divisor, which is tabulated from above, so
/// that directions beside its ridges are divided by more than their albedo. Measured 0.007, towards the solver.
const TABLES: f64 = 0.008;

/// A light: wavelength in nm, polar angle and azimuth in degrees.
type Light = (u32, u32, u32);

/// The solver's efficiencies of orders in unpolarised light, `[light][(jx, jy)]`.
fn solved(path: &Path) -> BTreeMap<Light, BTreeMap<(i32, i32), f64>> {
    let mut lights: BTreeMap<Light, BTreeMap<(i32, i32), f64>> = BTreeMap::new();
    for line in std::fs::read_to_string(path).unwrap().lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let whole = |i: usize| columns[i].parse::<u32>().unwrap();
        let order = (columns[5].parse().unwrap(), columns[6].parse().unwrap());
        lights.entry((whole(2), whole(3), whole(4))).or_default().insert(order, columns[7].parse().unwrap());
    }
    lights
}

/// Periodic heights resampled along each row by their Fourier series, and transposed.
fn finer_along_rows(heights: &Array2<f64>) -> Array2<f64> {
    let (rows, n) = heights.dim();
    let half = (n as i32 - 1) / 2;
    Array2::from_shape_fn((n * FINER, rows), |(x, row)| {
        let at = x as f64 / FINER as f64;
        // Dirichlet's kernel; for an even number of samples half of the highest frequency counts on either side.
        (0..n)
            .map(|i| {
                let turns = (at - i as f64) / n as f64;
                let whole: f64 = (1..=half).map(|j| 2.0 * (TAU * f64::from(j) * turns).cos()).sum();
                let highest = if n % 2 == 0 { (TAU * 0.5 * n as f64 * turns).cos() } else { 0.0 };
                heights[[row, i]] * (1.0 + whole + highest) / n as f64
            })
            .sum()
    })
}

/// Fractions of the reflected power that the model misplaces, one a light: up to [`THETA_MAX_DEG`], and beyond.
fn misplaced(folder: &Path, species: &str, obliquity: Obliquity) -> [Vec<f64>; 2] {
    let scale = FileScale { pixel_size_um: Some(PIXEL_UM), ..FileScale::default() };
    let crop = HeightField::read(folder.join(format!("{species}_A.npy")), &scale).unwrap();
    let heights = crop.heights_um();
    let period_um = [heights.ncols() as f64 * PIXEL_UM, heights.nrows() as f64 * PIXEL_UM];
    let fine = finer_along_rows(&finer_along_rows(heights));
    let pixel_um = PIXEL_UM / FINER as f64;
    let index = Some(SpectralIndex::Constant(KERATIN)).filter(|_| obliquity == Obliquity::SmallSlope);
    let options = Options { obliquity, index, ..Options::default() };
    let surface = built(&HeightField::new(fine, pixel_um, pixel_um).unwrap(), &options);
    let lattice = surface.table().lattice();
    let [sx, sy] = surface.table().power_sigma();
    let area = TAU * sx * sy / (lattice.x.period_um * lattice.y.period_um);
    let mut shares = [Vec::new(), Vec::new()];
    for ((nm, theta, phi), orders) in solved(&folder.join(format!("maxwell_{species}_A.csv"))) {
        let ((st, ct), (sp, cp)) = (f64::from(theta).to_radians().sin_cos(), f64::from(phi).to_radians().sin_cos());
        let (wi, um) = ([st * cp, st * sp, ct], f64::from(nm) * 1e-3);
        let (mut off, mut total) = (0.0, 0.0);
        for ((jx, jy), efficiency) in orders {
            let [x, y] = [-wi[0] + um * f64::from(jx) / period_um[0], -wi[1] + um * f64::from(jy) / period_um[1]];
            let wo = [x, y, (1.0 - x * x - y * y).sqrt()];
            let interface = Pair::new(wi, wo).unwrap().interface(Some(KERATIN), obliquity);
            // Orders are far apart, so each is a single Gaussian over direction cosines.
            let power = surface.eval(wi, wo, f64::from(nm)) * um * um * area;
            off += 0.5 * (interface * power - efficiency).abs();
            total += efficiency;
        }
        shares[usize::from(theta > THETA_MAX_DEG)].push(off / total);
    }
    shares
}

#[test]
fn power_on_scans_matches_maxwell() {
    let Some(folder) = sunbeam_testing::data("maxwell") else { return };
    // Misplaced fractions of orders summed directly, up to 60° and at 75°. With Stam's factor each order is divided by
    // the larger of both directions' exact albedos where that exceeds one; with the small-slope factor none does.
    for (species, obliquity, direct) in
        [("xenopeltis", Obliquity::Stam, [0.0955, 0.0783]), ("elaphe", Obliquity::SmallSlope, [0.0105, 0.0154])]
    {
        for (shares, direct) in misplaced(&folder, species, obliquity).into_iter().zip(direct) {
            let mean = shares.iter().sum::<f64>() / shares.len() as f64;
            let worst = shares.iter().copied().fold(0.0, f64::max);
            println!(
                "{species} {obliquity:?}: {:.2} % misplaced in the mean of {} lights, at worst {:.1} %",
                100.0 * mean,
                shares.len(),
                100.0 * worst
            );
            assert!(!shares.is_empty() && (mean - direct).abs() < TABLES, "{species} {obliquity:?}: {mean}");
        }
    }
}
