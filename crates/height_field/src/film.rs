//! Filling the holes of a file or an array.

use crate::Fill;
use ndarray::Array2;

/// Residual at which the film over the holes counts as found, relative to that of a flat one.
const RESIDUAL: f64 = 1e-12;
/// Steps of the solution after which it is taken as it is; a hole of a thousand pixels across needs some thousands.
const STEPS_MAX: usize = 50_000;

impl Fill {
    /// Replaces every NaN of `heights_um`, whose pixels are of `dx_um` by `dy_um`; at least one height must be finite.
    pub(crate) fn apply(self, heights_um: &mut Array2<f64>, dx_um: f64, dy_um: f64) {
        let known: Vec<f64> = heights_um.iter().copied().filter(|h| h.is_finite()).collect();
        if self == Self::None || known.is_empty() || known.len() == heights_um.len() {
            return;
        }
        // About the first height, so that an offset costs no digits.
        let base = known[0];
        let mean = known.iter().map(|h| h - base).sum::<f64>() / known.len() as f64;
        match self {
            Self::None => {}
            Self::Mean => heights_um.mapv_inplace(|h| if h.is_nan() { base + mean } else { h }),
            Self::Laplace => {
                let film = Film::over(heights_um, base + mean, dx_um, dy_um).solve();
                for (place, height) in film {
                    heights_um[place] = base + mean + height;
                }
            }
        }
    }
}

/// The equations of a film over holes: for each missing point, the sum over its neighbours of the weighted difference to
/// them is zero. The tile's edges leave the film free, that is flat across them.
struct Film {
    places: Vec<[usize; 2]>,
    /// For each missing point, its missing neighbours and their weights.
    links: Vec<[(usize, f64); 4]>,
    /// Sum of the weights of all neighbours.
    diagonal: Vec<f64>,
    /// Weighted heights of the neighbours that are known, less the base.
    given: Vec<f64>,
}

impl Film {
    fn over(heights_um: &Array2<f64>, base: f64, dx_um: f64, dy_um: f64) -> Self {
        let (ny, nx) = heights_um.dim();
        let places: Vec<[usize; 2]> =
            heights_um.indexed_iter().filter(|(_, h)| h.is_nan()).map(|((iy, ix), _)| [iy, ix]).collect();
        let mut number = Array2::from_elem((ny, nx), usize::MAX);
        for (at, place) in places.iter().enumerate() {
            number[*place] = at;
        }
        // Only their ratio counts; the larger is 1.
        let finer = dx_um.min(dy_um);
        let (wx, wy) = ((finer / dx_um).powi(2), (finer / dy_um).powi(2));
        let mut film =
            Self { links: Vec::with_capacity(places.len()), diagonal: Vec::new(), given: Vec::new(), places };
        for &[iy, ix] in &film.places {
            let neighbours = [
                (ix > 0).then(|| ([iy, ix - 1], wx)),
                (ix + 1 < nx).then(|| ([iy, ix + 1], wx)),
                (iy > 0).then(|| ([iy - 1, ix], wy)),
                (iy + 1 < ny).then(|| ([iy + 1, ix], wy)),
            ];
            let (mut links, mut diagonal, mut given) = ([(0, 0.0); 4], 0.0, 0.0);
            for (link, (place, weight)) in links.iter_mut().zip(neighbours.into_iter().flatten()) {
                diagonal += weight;
                match number[place] {
                    usize::MAX => given += weight * (heights_um[place] - base),
                    other => *link = (other, weight),
                }
            }
            film.links.push(links);
            film.diagonal.push(diagonal);
            film.given.push(given);
        }
        film
    }

    fn times(&self, film: &[f64], out: &mut [f64]) {
        for (at, value) in out.iter_mut().enumerate() {
            let neighbours: f64 = self.links[at].iter().map(|&(other, weight)| weight * film[other]).sum();
            *value = self.diagonal[at] * film[at] - neighbours;
        }
    }

    /// Heights above the base, by conjugate gradients: the equations are symmetric, and positive since every hole has a rim.
    fn solve(self) -> Vec<([usize; 2], f64)> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled = |residual: &[f64]| residual.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut film = vec![0.0; self.places.len()];
        let mut residual = self.given.clone();
        let mut direction = scaled(&residual);
        let mut size = dot(&residual, &direction);
        let enough = size * RESIDUAL * RESIDUAL;
        let mut image = vec![0.0; film.len()];
        for _ in 0..STEPS_MAX {
            if size.is_nan() || size <= enough {
                break;
            }
            self.times(&direction, &mut image);
            let step = size / dot(&direction, &image);
            for (((f, r), d), i) in film.iter_mut().zip(&mut residual).zip(&direction).zip(&image) {
                *f += step * d;
                *r -= step * i;
            }
            let preconditioned = scaled(&residual);
            let next = dot(&residual, &preconditioned);
            let share = next / size;
            for (d, p) in direction.iter_mut().zip(&preconditioned) {
                *d = p + share * *d;
            }
            size = next;
        }
        self.places.into_iter().zip(film).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights of order 1 µm, solved to 1e-12.
    const SOLVED_UM: f64 = 1e-10;

    fn with_holes(height: impl Fn(f64, f64) -> f64) -> (Array2<f64>, Array2<f64>) {
        let whole = Array2::from_shape_fn((40, 50), |(iy, ix)| height(ix as f64 * 0.1, iy as f64 * 0.3));
        let mut holed = whole.clone();
        for ((iy, ix), h) in holed.indexed_iter_mut() {
            let in_disc = (ix as f64 - 30.0).powi(2) + (iy as f64 - 15.0).powi(2) < 64.0;
            if in_disc || (ix == 3 && iy < 20) || [iy, ix] == [39, 49] {
                *h = f64::NAN;
            }
        }
        (whole, holed)
    }

    #[test]
    fn a_film_continues_a_harmonic_relief_over_holes_within() {
        // Linear functions and x² − y² solve the equations on a grid exactly, whatever its proportions.
        let (whole, mut holed) = with_holes(|x, y| 7.0 + 0.2 * x - 0.1 * y + 0.05 * (x * x - y * y) + 0.02 * x * y);
        // Holes at the tile's edge have no rim there: keep to those within.
        for place in [[39, 49]].into_iter().chain((0..20).map(|iy| [iy, 3])) {
            holed[place] = whole[place];
        }
        Fill::Laplace.apply(&mut holed, 0.1, 0.3);
        let error = (&holed - &whole).iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        assert!(error < SOLVED_UM, "{error}");
    }

    #[test]
    fn a_film_stays_within_its_rim_and_leaves_the_rest_alone() {
        let (whole, holed) = with_holes(|x, y| 1000.0 + (3.0 * x).sin() * (2.0 * y).cos());
        let mut filled = holed.clone();
        Fill::Laplace.apply(&mut filled, 0.1, 0.3);
        for (((before, after), whole), place) in holed.iter().zip(&filled).zip(&whole).zip(0..) {
            assert!(after.is_finite() && (before.is_nan() || before == after), "{place}");
            assert!((999.0 - SOLVED_UM..=1001.0 + SOLVED_UM).contains(after), "{place}: {after} for {whole}");
        }
        let mut mean = holed.clone();
        Fill::Mean.apply(&mut mean, 0.1, 0.3);
        let known: Vec<f64> = holed.iter().copied().filter(|h| h.is_finite()).collect();
        let expected = known.iter().sum::<f64>() / known.len() as f64;
        assert!(mean.iter().zip(&holed).all(|(m, h)| !h.is_nan() || (m - expected).abs() < 1e-10));
        let mut untouched = holed.clone();
        Fill::None.apply(&mut untouched, 0.1, 0.3);
        assert!(untouched.iter().zip(&holed).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn one_height_fills_everything_and_names_round_trip() {
        let mut field = Array2::from_elem((9, 7), f64::NAN);
        field[[4, 2]] = 0.25;
        Fill::Laplace.apply(&mut field, 1.0, 1.0);
        assert!(field.iter().all(|h| (h - 0.25).abs() < SOLVED_UM));
        for fill in Fill::ALL {
            assert_eq!(fill.name().parse::<Fill>().unwrap(), fill);
        }
        assert!("film".parse::<Fill>().unwrap_err().to_string().contains("none, laplace, mean"));
    }
}
