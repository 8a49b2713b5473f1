//! Single and double layer potential, S and K, of one medium on the curve, the relief's cross-section.
//!
//! By Nyström's method they are matrices: element (i, j) is the kernel of the integral from node j to node i, times a
//! quadrature weight.
//!
//! For nodes r, r' on one period of the curve, with G = (i/4)H₀⁽¹⁾(k|r − r'|) and ν' the upward unit normal at r':
//!
//! - `(S q)(r) = Σ_p e^{2πibp} ∫ G q ds'`,
//! - `(K u)(r) = Σ_p e^{2πibp} ∫ ∂ν'G u ds'` (principal value).
//!
//! *Image* p of the source r' is its copy moved by p periods; term p of the sums has r' at image p.
//!
//! The kernels have a logarithmic singularity at r = r'. The nearest image is integrated with Kress' weights for
//! `ln(4 sin²((τ − τ')/2))`, where τ is the parameter of the curve (`nodes.rs`). A smooth window ends these weights
//! before the next image is near. The kernels of other images are smooth: either they decay within a few periods and
//! are summed one by one, or all are summed by `lattice_sum.rs`.
//!
//! In this file, k is the wave number of the medium across the grooves in rad/µm, and `decay` is Im k in 1/µm. The
//! Bloch phase b (`bloch`) is in turns: a field changes by the factor e^{2πib} from one period to the next. The period
//! d is in µm. Nodes have equal steps of τ (`step`), and `speed` is |dr/dτ|. A separation is the vector from the
//! nearest image of a source node to a target node.

use crate::Error;
use crate::lattice_sum::{DISTANCE_MIN, HALF_HEIGHT_MIN, LatticeSum};
use crate::linear::{Matrix, zeros};
use crate::nodes::{Nodes, Separation};
use crate::special::{EULER_GAMMA, Radial};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Exponent of decay, Im k times distance, beyond which a field is neglected: e^−30 = 1e-13.
const DECAYED: f64 = 30.0;
/// Largest number of images on either side that are summed one by one. More take longer than the lattice sum. A float,
/// since the number that it bounds is infinite without decay.
const IMAGES_MAX: f64 = 4.0;
/// Distances in periods between which the window of the logarithm's weights falls from 1 to 0. The second is below ½,
/// where the next image is equally near. A narrower transition needs more nodes to be integrated.
const WINDOW: [f64; 2] = [0.3, 0.48];
/// Upper bounds on the two distances r of [`WINDOW`], as Im k·r. The weights multiply Bessel functions, which grow as
/// e^{Im k·r} and would magnify rounding at larger distances.
const WINDOW_DECAYED: [f64; 2] = [2.5, 7.0];

/// The layer potentials as matrices: target node × source node.
pub(crate) struct Layers {
    /// S, applied to the normal derivative times the speed of the nodes.
    pub(crate) single: Matrix,
    /// K (principal value), applied to the field.
    pub(crate) double: Matrix,
}

/// Summation over the images of a source other than the nearest one.
pub(crate) enum Images {
    /// One by one, up to this number on either side of the nearest image; the fields of the others have decayed.
    Near(i32),
    /// All by the lattice sum.
    All,
}

impl Images {
    /// The summation needed at an imaginary part of the wave number (`decay`, 1/µm) and a period (µm).
    pub(crate) fn needed(decay: f64, period: f64) -> Self {
        // The first image left out, number count + 1, is at least count + ½ periods away. Without decay, count is
        // infinite. With strong decay it may be 0 or less; the minimum of 1 then adds decayed images only.
        let count = (DECAYED / (decay * period) - 0.5).ceil();
        if count <= IMAGES_MAX { Self::Near(count.max(1.0) as i32) } else { Self::All }
    }
}

/// S and K for a wave number (rad/µm; Im ≥ 0) and a Bloch phase in turns.
///
/// Sources are all nodes. Targets are the middle nodes of each group of `stride` consecutive nodes. `stride` is odd and
/// divides the number of nodes. With `stride` fine nodes for each coarse node, the targets lie at the coarse nodes.
///
/// # Errors
/// Special functions that overflow, and lattice sums that do not converge.
pub(crate) fn layer_matrices(
    nodes: &Nodes,
    stride: usize,
    wave_number: Complex64,
    bloch: f64,
) -> Result<Layers, Error> {
    let (n, d) = (nodes.len(), nodes.period);
    let images = Images::needed(wave_number.im, d);
    let window = window_range(wave_number.im, d);
    let height = nodes.height();
    // Images summed one by one on either side of the nearest one.
    let image_count = match images {
        Images::Near(count) => count,
        Images::All => 0,
    };
    // Range of distances for the tables of Hankel functions; `Radial::hankel` serves distances that rounding puts just
    // outside. The nearest image is at most half a period away along x. `DISTANCE_MIN` and `HALF_HEIGHT_MIN` bound the
    // points at which the lattice sum is computed.
    let reach = (f64::from(image_count) + 0.5) * d;
    let least = (0.5 * nodes.spacing_min()).min(DISTANCE_MIN * d);
    let most = reach.hypot(height.max(HALF_HEIGHT_MIN * d));
    // Hankel functions from `least` to `most`, Bessel functions up to the window's end.
    let radial = Radial::new(wave_number, least, most, window[1])?;
    let lattice = match images {
        Images::All => Some(LatticeSum::new(d, wave_number, bloch, height, &radial)?),
        Images::Near(_) => None,
    };
    let phases =
        (-image_count - 1..=image_count + 1).map(|p| Complex64::cis(TAU * (bloch * f64::from(p)).fract())).collect();
    let assembly = Assembly { nodes, wave_number, image_count, phases, window, radial, lattice };
    let rows = n / stride;
    let mut result = Layers { single: zeros(rows, n), double: zeros(rows, n) };
    for row in 0..rows {
        assembly.fill_row(row, row * stride + stride / 2, &mut result);
    }
    Ok(result)
}

/// Distances in µm between which the window falls from 1 to 0. Without decay the quotient is infinite, and the period
/// alone decides.
fn window_range(decay: f64, period: f64) -> [f64; 2] {
    [0, 1].map(|i| (WINDOW_DECAYED[i] / decay).min(WINDOW[i] * period))
}

/// Quantities from which the rows of S and K are computed.
struct Assembly<'a> {
    nodes: &'a Nodes,
    wave_number: Complex64,
    /// Number of images summed one by one on either side of the nearest; 0 where the lattice sum has them.
    image_count: i32,
    /// Bloch phase factors e^{2πibp}, p from −(`image_count` + 1) to `image_count` + 1.
    phases: Vec<Complex64>,
    /// Distances in µm between which the window falls from 1 to 0.
    window: [f64; 2],
    /// Hankel functions of kr up to the images summed one by one, Bessel functions up to the end of the window.
    radial: Radial,
    /// Field of all images but the nearest; `None` where they are summed one by one.
    lattice: Option<LatticeSum>,
}

impl Assembly<'_> {
    /// Fills `row` of both matrices with the elements from all sources to node `target`.
    fn fill_row(&self, row: usize, target: usize, into: &mut Layers) {
        let n = self.nodes.len();
        let separations: Vec<Separation> = (0..n).map(|source| self.nodes.separation(target, source)).collect();
        let lattice_fields = self.lattice.as_ref().map(|lattice| {
            let xs: Vec<f64> = separations.iter().map(|s| s.x).collect();
            let zs: Vec<f64> = separations.iter().map(|s| s.z).collect();
            lattice.at(&xs, &zs)
        });
        for (source, separation) in separations.iter().enumerate() {
            let nearest =
                if source == target { self.self_term(source) } else { self.nearest_image(target, source, separation) };
            let others = match &lattice_fields {
                Some(fields) => {
                    let normal = self.nodes.normal[source];
                    let [field, along_x, along_z] = fields[source];
                    // The gradient at the source is minus the gradient with respect to the separation.
                    let along_normal = -(along_x * normal[0] + along_z * normal[1]);
                    let step = self.nodes.step();
                    [field * step, along_normal * (step * self.nodes.speed[source])]
                }
                None => self.other_images(source, separation),
            };
            let phase = self.phase(separation.periods);
            into.single[(row, source)] = (nearest[0] + others[0]) * phase;
            into.double[(row, source)] = (nearest[1] + others[1]) * phase;
        }
        // Near a corner, the quadrature does not resolve the kernel of K on the edge across the corner. The correction
        // makes the integral of the kernel's static part (k → 0) over that edge exact for a constant field.
        into.double[(row, target)] += self.nodes.corner_defect(target);
    }

    /// Bloch phase factor e^{2πib·periods}, for at most `image_count` + 1 periods in either direction: the index of an
    /// image, or the −1, 0 or 1 periods of the nearest image.
    fn phase(&self, periods: i32) -> Complex64 {
        self.phases[(periods + self.image_count + 1) as usize]
    }

    /// Elements of S and K from the source's nearest image to another node, without the image's Bloch phase.
    ///
    /// They are the trapezium rule for the whole kernel, plus the difference between Kress' weights and the trapezium
    /// rule (`log_weights`) for its logarithmic part. With the vector s of length r from source to target, this part is
    /// `−ln(4 sin²((τ − τ')/2))/4π` times J₀(kr) in S, and times k²·J₁(kr)/(kr)·(ν'·s) in K. The kernel of K is
    /// `∂ν'G = (i/4)k·H₁⁽¹⁾(kr)·(ν'·s)/r`, since H₀' = −H₁ and ∂ν'r = −(ν'·s)/r.
    fn nearest_image(&self, target: usize, source: usize, separation: &Separation) -> [Complex64; 2] {
        let r = (separation.x * separation.x + separation.z * separation.z).sqrt();
        if r * self.wave_number.im > DECAYED {
            return [Complex64::ZERO; 2];
        }
        let (k, speed, step) = (self.wave_number, self.nodes.speed[source], self.nodes.step());
        let [h0, h1] = self.radial.hankel(r);
        let quarter_i = Complex64::new(0.0, 0.25);
        let mut single = quarter_i * h0 * step;
        let mut double = quarter_i * k * h1 * (separation.along_normal / r * step * speed);
        let window = window_value(r, self.window);
        if window > 0.0 {
            let log = -window * self.nodes.log_weights[target.abs_diff(source)] / (4.0 * PI);
            let [j0, j1_over_kr] = self.radial.bessel(r);
            single += j0 * log;
            double += k * k * j1_over_kr * (separation.along_normal * speed * log);
        }
        [single, double]
    }

    /// Diagonal elements of S and K, from a node to itself: the trapezium rule for the limits of the kernels without
    /// their logarithm, plus Kress' weight for the logarithm in S.
    ///
    /// The limits are `i/4 − (ln(k·speed/2) + γ)/2π` in S, with Euler's constant γ, and `curvature·speed/4π` in K.
    fn self_term(&self, node: usize) -> [Complex64; 2] {
        let (speed, step) = (self.nodes.speed[node], self.nodes.step());
        let log = ((0.5 * speed) * self.wave_number).ln() + EULER_GAMMA;
        let single = (Complex64::new(0.0, 0.25) - log / TAU) * step - self.nodes.log_weights[0] / (4.0 * PI);
        let double = self.nodes.curvature[node] * speed * step / (4.0 * PI);
        [single, double.into()]
    }

    /// Elements of S and K from the images summed one by one, relative to the Bloch phase of the nearest image. Images
    /// whose field has decayed are neglected. The kernels are those of [`Assembly::nearest_image`].
    fn other_images(&self, source: usize, separation: &Separation) -> [Complex64; 2] {
        let mut sums = [Complex64::ZERO; 2];
        let (normal, d) = (self.nodes.normal[source], self.nodes.period);
        for image in (-self.image_count..=self.image_count).filter(|&image| image != 0) {
            let x = separation.x - f64::from(image) * d;
            let r = (x * x + separation.z * separation.z).sqrt();
            if r * self.wave_number.im > DECAYED {
                continue;
            }
            let [h0, h1] = self.radial.hankel(r);
            let factor = Complex64::new(0.0, 0.25) * self.phase(image) * self.nodes.step();
            let along_normal = normal[0] * x + normal[1] * separation.z;
            sums[0] += factor * h0;
            sums[1] += factor * self.wave_number * h1 * (along_normal / r * self.nodes.speed[source]);
        }
        sums
    }
}

/// Value of the window at distance `r` (µm): 1 up to `from`, 0 beyond `to`, and cos²(π/2·sin²(π/2·s)) at the fraction s
/// of the way between.
fn window_value(r: f64, [from, to]: [f64; 2]) -> f64 {
    let fraction = ((r - from) / (to - from)).clamp(0.0, 1.0);
    // Most distances lie outside of the transition and need no sines.
    if fraction == 0.0 || fraction == 1.0 {
        return 1.0 - fraction;
    }
    let inner = (0.5 * PI * fraction).sin();
    let outer = (0.5 * PI * inner * inner).cos();
    outer * outer
}
