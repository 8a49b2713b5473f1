//! First-order perturbation of a shallow relief (Rice 1951), from the boundary conditions of Maxwell's equations: an
//! independent reference for tests of the small-slope factors.
//!
//! Wave vectors are in units of the wave number in air, and lengths in its inverse. A wave of the wave vector k is
//! `exp(i·k·x)`, so the index n of a medium has an imaginary part of at least 0. The magnetic field is scaled to
//! `k × E`. Polarisation state s has its electric field E along `z × k`, state p along `k × s`.

use super::Vec3;
use sunbeam_fourier::num_complex::Complex64;

/// Components along x, y and the normal z.
type Vector = [Complex64; 3];

/// Plane wave of unit amplitude: its electric field E has E·E = 1, without a complex conjugate.
#[derive(Clone, Copy)]
struct Wave {
    /// Electric and magnetic field at the origin.
    fields: [Vector; 2],
    /// Normal component of the wave vector.
    k_z: Complex64,
}

fn cross(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

/// Waves in the polarisation states s and p of the wave vector `k` in a medium of index `n`. `k` must not be along the
/// normal.
fn states(k: Vector, n: Complex64) -> [Wave; 2] {
    let length = (k[0].re * k[0].re + k[1].re * k[1].re).sqrt();
    let s = [-k[1] / length, k[0] / length, Complex64::default()];
    let p = cross(k, s).map(|c| c / n);
    [s, p].map(|electric| Wave { fields: [electric, cross(k, electric)], k_z: k[2] })
}

/// Amplitudes `[reflected, transmitted][outgoing state][incident state]` of light that arrives from `wi` in air,
/// divided by the height h, to first order in h. The relief has the height `h·exp(iK·x)`. K is the difference of the
/// tangential wave vectors of `wo` and of the arriving light. The transmitted light has the tangential wave vector of
/// `wo`, too. Neither `wi` nor `wo` may be along the normal.
///
/// The amplitudes follow from the boundary conditions: the fields' components along the actual surface are continuous.
pub(super) fn first_order(wi: Vec3, wo: Vec3, n: Complex64) -> [[[Complex64; 2]; 2]; 2] {
    type Fields = nalgebra::Vector4<Complex64>;
    // x and y components of the electric field, then of the magnetic field.
    let tangential = |fields: &[Vector; 2]| Fields::new(fields[0][0], fields[0][1], fields[1][0], fields[1][1]);
    let one = Complex64::new(1.0, 0.0);
    // Wave vector with the tangential part (x, y) in a medium of index n, upwards (1) or downwards (−1).
    let wave_vector = |x: f64, y: f64, sign: f64, n: Complex64| {
        let z = sign * (n * n - x * x - y * y).sqrt();
        [Complex64::new(x, 0.0), Complex64::new(y, 0.0), z]
    };
    // Reflected and transmitted states of one tangential wave vector.
    let outgoing = |x: f64, y: f64| (states(wave_vector(x, y, 1.0, one), one), states(wave_vector(x, y, -1.0, n), n));
    // Amplitudes of the outgoing waves, reflected s and p and transmitted s and p, that make the tangential fields jump
    // by `jump` at z = 0. A jump is the fields in air minus those in the medium.
    let solved = |x: f64, y: f64, jump: Fields| {
        let (up, down) = outgoing(x, y);
        let columns = [
            tangential(&up[0].fields),
            tangential(&up[1].fields),
            -tangential(&down[0].fields),
            -tangential(&down[1].fields),
        ];
        nalgebra::Matrix4::from_columns(&columns).lu().solve(&jump).unwrap()
    };
    let (from, to) = ([-wi[0], -wi[1]], [wo[0], wo[1]]);
    let arriving = states(wave_vector(from[0], from[1], -1.0, one), one);
    let (up, down) = outgoing(from[0], from[1]);
    // Amplitudes of the scattered waves, in the order of `solved`, from light in the incident state s (0) or p (1).
    let scattered_from = |state: usize| {
        let flat = solved(from[0], from[1], -tangential(&arriving[state].fields));
        // Waves at a flat surface with their amplitudes; waves in the medium count negatively.
        let waves =
            [(arriving[state], one), (up[0], flat[0]), (up[1], flat[1]), (down[0], -flat[2]), (down[1], -flat[3])];
        // The tangential fields F of these waves jump at the relief by h·∂F/∂z + F_z·∇h, to first order in the height
        // h. The scattered waves must remove this jump. ∂/∂z is a factor i·k_z, and ∇h is iK·h.
        let mut jump = Fields::zeros();
        for (Wave { fields, k_z }, amplitude) in waves {
            jump -= tangential(&fields) * (Complex64::i() * k_z * amplitude);
            for (i, field) in fields.iter().enumerate() {
                for axis in 0..2 {
                    jump[2 * i + axis] -= Complex64::i() * (to[axis] - from[axis]) * field[2] * amplitude;
                }
            }
        }
        solved(to[0], to[1], jump)
    };
    let [s, p] = [scattered_from(0), scattered_from(1)];
    [[[s[0], p[0]], [s[1], p[1]]], [[s[2], p[2]], [s[3], p[3]]]]
}
