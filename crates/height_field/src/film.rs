//! Filling of missing points: by the mean, or by a film, as of soap, that spans each hole and solves Laplace's
//! equation.
//!
//! In finite differences, the height h of each missing point satisfies `Σ w·(h − h_neighbour) = 0`. The sum is over its
//! up to four neighbours, which are missing points or known heights. The weight w is 1/dx² along x and 1/dy² along y.
//! The system is symmetric and, with one known height at least, positive definite. It is solved by conjugate gradients.
//!
//! The unknowns are heights above the *base*, the mean of the known heights, in µm. In code, `film` is the vector of
//! all unknowns, one for each missing point in row-major order. The flat film has the height of the base everywhere.

use crate::Fill;
use ndarray::Array2;

/// Preconditioned norm of the residual at which the solution is accepted, relative to that of the flat film. Errors are
/// then far below a millionth of the relief's height. A smaller value takes more iterations.
const RESIDUAL: f64 = 1e-12;
/// Largest number of iterations, after which the film is used as it is. A hole of a thousand pixels across needs some
/// thousands.
const ITERATIONS_MAX: usize = 50_000;

impl Fill {
    /// Replaces every NaN of `heights_um` (pixels of `dx_um` by `dy_um`); all other heights are finite. Nothing is
    /// replaced if all heights are NaN, or for [`Fill::None`].
    pub(crate) fn apply(self, heights_um: &mut Array2<f64>, dx_um: f64, dy_um: f64) {
        let known: Vec<f64> = heights_um.iter().copied().filter(|h| h.is_finite()).collect();
        if self == Self::None || known.is_empty() || known.len() == heights_um.len() {
            return;
        }
        // Sums over differences to the first height: a common offset then costs no digits.
        let first = known[0];
        let mean = first + known.iter().map(|h| h - first).sum::<f64>() / known.len() as f64;
        match self {
            Self::None => {}
            Self::Mean => heights_um.mapv_inplace(|h| if h.is_nan() { mean } else { h }),
            Self::Laplace => {
                let film = FilmSystem::new(heights_um, mean, dx_um, dy_um).solve();
                for (point, above_base) in film {
                    heights_um[point] = mean + above_base;
                }
            }
        }
    }
}

/// The linear system of a film over all holes (connected missing points). At the tile's edges the film has zero slope
/// across the edge.
struct FilmSystem {
    /// `[iy, ix]` of each missing point.
    points: Vec<[usize; 2]>,
    /// For each missing point: its missing neighbours, as indices into `points`, and their weights; unused ones have
    /// weight 0.
    links: Vec<[(usize, f64); 4]>,
    /// For each missing point: sum of the weights of all neighbours.
    diagonal: Vec<f64>,
    /// For each missing point: weighted sum of its known neighbours' heights above the base, the right-hand side.
    right_side: Vec<f64>,
}

impl FilmSystem {
    /// The system for all NaN of `heights_um`; `base` is subtracted from known heights.
    fn new(heights_um: &Array2<f64>, base: f64, dx_um: f64, dy_um: f64) -> Self {
        let (ny, nx) = heights_um.dim();
        let points: Vec<[usize; 2]> =
            heights_um.indexed_iter().filter(|(_, h)| h.is_nan()).map(|((iy, ix), _)| [iy, ix]).collect();
        // Index of each pixel in `points`; `usize::MAX` for pixels with a known height.
        let mut index_of = Array2::from_elem((ny, nx), usize::MAX);
        for (index, point) in points.iter().enumerate() {
            index_of[*point] = index;
        }
        // The system depends on the ratio of the weights only; the larger is 1.
        let finer = dx_um.min(dy_um);
        let (wx, wy) = ((finer / dx_um).powi(2), (finer / dy_um).powi(2));
        let mut system = Self { links: Vec::new(), diagonal: Vec::new(), right_side: Vec::new(), points };
        for &[iy, ix] in &system.points {
            let neighbours = [
                (ix > 0).then(|| ([iy, ix - 1], wx)),
                (ix + 1 < nx).then(|| ([iy, ix + 1], wx)),
                (iy > 0).then(|| ([iy - 1, ix], wy)),
                (iy + 1 < ny).then(|| ([iy + 1, ix], wy)),
            ];
            let (mut links, mut diagonal, mut right_side) = ([(0, 0.0); 4], 0.0, 0.0);
            for (link, (point, weight)) in links.iter_mut().zip(neighbours.into_iter().flatten()) {
                diagonal += weight;
                match index_of[point] {
                    usize::MAX => right_side += weight * (heights_um[point] - base),
                    other => *link = (other, weight),
                }
            }
            system.links.push(links);
            system.diagonal.push(diagonal);
            system.right_side.push(right_side);
        }
        system
    }

    /// Writes the product of the system's matrix with `film` into `out`.
    fn times(&self, film: &[f64], out: &mut [f64]) {
        for (i, value) in out.iter_mut().enumerate() {
            let neighbours: f64 = self.links[i].iter().map(|&(other, weight)| weight * film[other]).sum();
            *value = self.diagonal[i] * film[i] - neighbours;
        }
    }

    /// Each missing point, `[iy, ix]`, with its height above the base, by conjugate gradients with a diagonal
    /// preconditioner.
    fn solve(self) -> Vec<([usize; 2], f64)> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let preconditioned =
            |residual: &[f64]| residual.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut film = vec![0.0; self.points.len()];
        let mut residual = self.right_side.clone();
        let mut direction = preconditioned(&residual);
        // Square of the residual's preconditioned norm. Its first value belongs to the flat film, which is 0
        // everywhere.
        let mut norm2 = dot(&residual, &direction);
        let accepted_norm2 = norm2 * RESIDUAL * RESIDUAL;
        let mut product = vec![0.0; film.len()];
        for _ in 0..ITERATIONS_MAX {
            // Products of huge heights may overflow to infinity or NaN, which end the iteration, too.
            if norm2.is_nan() || norm2 <= accepted_norm2 {
                break;
            }
            self.times(&direction, &mut product);
            let step = norm2 / dot(&direction, &product);
            for (((f, r), d), p) in film.iter_mut().zip(&mut residual).zip(&direction).zip(&product) {
                *f += step * d;
                *r -= step * p;
            }
            let next_direction = preconditioned(&residual);
            let next_norm2 = dot(&residual, &next_direction);
            let ratio = next_norm2 / norm2;
            for (d, next) in direction.iter_mut().zip(&next_direction) {
                *d = next + ratio * *d;
            }
            norm2 = next_norm2;
        }
        self.points.into_iter().zip(film).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Accepted error in µm of a film whose heights above the base are of order 1 µm, solved to [`RESIDUAL`].
    const SOLVED_UM: f64 = 1e-10;

    /// Heights `height(x, y)` on 40 rows of 50 pixels of 0.1 × 0.3 µm, and a copy with three holes: a disc, half a
    /// column, and the last pixel.
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
    fn film_continues_harmonic_reliefs_exactly() {
        // Linear functions and x² − y² solve the equations on a grid exactly, whatever its proportions.
        let (whole, mut holed) = with_holes(|x, y| 7.0 + 0.2 * x - 0.1 * y + 0.05 * (x * x - y * y) + 0.02 * x * y);
        // Holes at the tile's edge lack boundary values there: only holes inside are compared.
        for point in [[39, 49]].into_iter().chain((0..20).map(|iy| [iy, 3])) {
            holed[point] = whole[point];
        }
        Fill::Laplace.apply(&mut holed, 0.1, 0.3);
        let error = (&holed - &whole).iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        assert!(error < SOLVED_UM, "{error}");
    }

    #[test]
    fn film_stays_within_its_boundary_values_and_known_heights_stay() {
        let (whole, holed) = with_holes(|x, y| 1000.0 + (3.0 * x).sin() * (2.0 * y).cos());
        let mut filled = holed.clone();
        Fill::Laplace.apply(&mut filled, 0.1, 0.3);
        for (((before, after), whole), point) in holed.iter().zip(&filled).zip(&whole).zip(0..) {
            assert!(after.is_finite() && (before.is_nan() || before == after), "{point}");
            assert!((999.0 - SOLVED_UM..=1001.0 + SOLVED_UM).contains(after), "{point}: {after} for {whole}");
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
    fn one_known_height_fills_the_whole_field() {
        let mut field = Array2::from_elem((9, 7), f64::NAN);
        field[[4, 2]] = 0.25;
        Fill::Laplace.apply(&mut field, 1.0, 1.0);
        assert!(field.iter().all(|h| (h - 0.25).abs() < SOLVED_UM));
    }

    #[test]
    fn names_round_trip() {
        for fill in Fill::ALL {
            assert_eq!(fill.name().parse::<Fill>().unwrap(), fill);
        }
        assert!("film".parse::<Fill>().unwrap_err().to_string().contains("none, laplace, mean"));
    }
}
