//! First-order perturbation of a shallow relief (Rice 1951), from the boundary conditions of Maxwell's equations: an
//! independent reference for tests of the small-slope factors.

use super::Vec3;
use sunbeam_fourier::num_complex::Complex64;

type Vector = [Complex64; 3];

fn cross(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

/// `([electric, magnetic], k_z)` of a plane wave in the states s and p: its fields at the origin, and the normal
/// component of its wave vector. The wave vector `k` is in units of the wave number in air; `n` is the index of the
/// medium.
fn states(k: Vector, n: Complex64) -> [([Vector; 2], Complex64); 2] {
    let length = (k[0].re * k[0].re + k[1].re * k[1].re).sqrt();
    let s = [-k[1] / length, k[0] / length, Complex64::default()];
    let p = cross(k, s).map(|c| c / n);
    [s, p].map(|electric| ([electric, cross(k, electric)], k[2]))
}

/// Amplitudes `[reflected, transmitted][outgoing state][incident state]` of light that arrives from `wi` in air, per
/// height h and wave number, to first order in h. The relief has the height `h·exp(iK·x)`, where K takes the tangential
/// wave vector of the arriving light to that of `wo`. The transmitted light has the tangential wave vector of `wo`,
/// too.
///
/// They follow from the boundary conditions: the fields' components along the actual surface are continuous.
pub(super) fn first_order(wi: Vec3, wo: Vec3, n: Complex64) -> [[[Complex64; 2]; 2]; 2] {
    type Fields = nalgebra::Vector4<Complex64>;
    let tangential = |fields: &[Vector; 2]| Fields::new(fields[0][0], fields[0][1], fields[1][0], fields[1][1]);
    let one = Complex64::new(1.0, 0.0);
    let wave = |x: f64, y: f64, sign: f64, n: Complex64| {
        let z = sign * (n * n - x * x - y * y).sqrt();
        [Complex64::new(x, 0.0), Complex64::new(y, 0.0), z]
    };
    // Reflected and transmitted states of one tangential wave vector.
    let outgoing = |x: f64, y: f64| (states(wave(x, y, 1.0, one), one), states(wave(x, y, -1.0, n), n));
    // Amplitudes of these states: reflected s and p, transmitted s and p. Their tangential fields in air exceed
    // those in the medium by `jump` at z = 0.
    let solved = |x: f64, y: f64, jump: Fields| {
        let (up, down) = outgoing(x, y);
        let columns = [tangential(&up[0].0), tangential(&up[1].0), -tangential(&down[0].0), -tangential(&down[1].0)];
        nalgebra::Matrix4::from_columns(&columns).lu().solve(&jump).unwrap()
    };
    let (from, to) = ([-wi[0], -wi[1]], [wo[0], wo[1]]);
    let arriving = states(wave(from[0], from[1], -1.0, one), one);
    let (up, down) = outgoing(from[0], from[1]);
    let of_state = |state: usize| {
        let flat = solved(from[0], from[1], -tangential(&arriving[state].0));
        // Waves at a flat surface with their amplitudes; waves in the medium count negatively.
        let waves =
            [(arriving[state], one), (up[0], flat[0]), (up[1], flat[1]), (down[0], -flat[2]), (down[1], -flat[3])];
        // Removes the jumps that they leave on the relief: ∂F/∂z times the height, and F_z times the slope.
        let mut jump = Fields::zeros();
        for ((fields, kz), amplitude) in waves {
            jump -= tangential(&fields) * (Complex64::i() * kz * amplitude);
            for (i, field) in fields.iter().enumerate() {
                for axis in 0..2 {
                    jump[2 * i + axis] -= Complex64::i() * (to[axis] - from[axis]) * field[2] * amplitude;
                }
            }
        }
        solved(to[0], to[1], jump)
    };
    let [s, p] = [of_state(0), of_state(1)];
    [[[s[0], p[0]], [s[1], p[1]]], [[s[2], p[2]], [s[3], p[3]]]]
}
