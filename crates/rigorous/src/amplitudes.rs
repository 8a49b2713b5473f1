//! Jones matrices between all propagating orders, and the checks of power balance and reciprocity.
//!
//! αm and βm are the wave numbers of order m across the grooves (x) and upwards (z).

use crate::waves::Waves;
use num_complex::Complex64;

/// Amplitudes between polarisation states, `jones[out][in]`. State 0 has Ey and no Hy, state 1 has Hy and no Ey.
pub type Jones = [[Complex64; 2]; 2];

/// Amplitudes between all propagating orders of one grating, at one (t, b) and wavelength (symbols: [crate]). t is the
/// wave number in the xz plane, b that of order 0 along x, each divided by 2π/period.
///
/// Light incident *in order n* comes from the mirror direction of order n: its wave number is αn along x and −βn along
/// z. Polarisation states are Ey and Hy, with y along the grooves; see [`transverse_basis`](crate::transverse_basis).
///
/// The amplitude from order n to order m is multiplied by √(βm/βn), so that |·|² is a fraction of the incident power.
/// Amplitudes are reciprocal: the matrix from n to m at b is the transpose of the matrix from −m to −n at −b.
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 1 })?;
/// let amplitudes = mesh.air(1.5, 0.2)?.solve(&Medium::Perfect, 550.0)?;
/// // A perfect conductor reflects all light of order 0 into the propagating orders.
/// let reflected: f64 = amplitudes.orders().iter().map(|&order| amplitudes.efficiency(order, 0)).sum();
/// assert!((reflected - 1.0).abs() < 1e-3);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Amplitudes {
    /// Propagating orders.
    waves: Waves,
    /// Jones matrices at index `out · count + in`: `out` and `in` are positions in `waves`, which has `count` orders.
    jones: Vec<Jones>,
    /// Fractions of the incident power that cross into the lower medium, `[position in waves][incident state]`.
    absorbed: Vec<[f64; 2]>,
}

impl Amplitudes {
    /// Collects the Jones matrices. `amplitude(out, in)` is the matrix from incident order n to order m, without the
    /// factor √(βm/βn). `out` and `in` are positions in `waves`. `absorbed` is `[incident order][incident state]`.
    pub(crate) fn new(waves: &Waves, amplitude: impl Fn(usize, usize) -> Jones, absorbed: Vec<[f64; 2]>) -> Self {
        let (count, beta) = (waves.orders.len(), &waves.beta);
        let jones = (0..count * count)
            .map(|i| {
                let (out, from) = (i / count, i % count);
                let weight = (beta[out] / beta[from]).sqrt();
                amplitude(out, from).map(|row| row.map(|value| value * weight))
            })
            .collect();
        Self { waves: waves.clone(), jones, absorbed }
    }

    /// Indices of the orders, ascending.
    pub fn orders(&self) -> &[i32] {
        &self.waves.orders
    }

    /// Wave numbers αm of the orders along x, in rad/µm.
    pub fn alpha_per_um(&self) -> &[f64] {
        &self.waves.alpha
    }

    /// Wave numbers βm of the orders along z, in rad/µm; positive.
    pub fn beta_per_um(&self) -> &[f64] {
        &self.waves.beta
    }

    /// Jones matrix of order `out` for light incident in order `from`; zero where either does not propagate.
    pub fn jones(&self, out: i32, from: i32) -> Jones {
        match (self.position(out), self.position(from)) {
            (Some(out), Some(from)) => self.jones[out * self.waves.orders.len() + from],
            _ => [[Complex64::ZERO; 2]; 2],
        }
    }

    /// Fraction of unpolarised light incident in order `from` that leaves in order `out`; zero where either does not
    /// propagate.
    pub fn efficiency(&self, out: i32, from: i32) -> f64 {
        0.5 * self.jones(out, from).iter().flatten().map(Complex64::norm_sqr).sum::<f64>()
    }

    /// Fractions of the incident power that cross into the lower medium, for light incident in order `from` in the
    /// states Ey and Hy: absorbed by a metal, transmitted into a dielectric. Zero where the order does not propagate.
    ///
    /// They come from integrals of the fields on the profile, not from the amplitudes of the orders. This makes
    /// [`Amplitudes::balance_error`] a check.
    pub fn absorbed(&self, from: i32) -> [f64; 2] {
        self.position(from).map_or([0.0; 2], |from| self.absorbed[from])
    }

    /// Violation of the power balance: the largest |reflected + absorbed − 1| over all incident orders and states.
    ///
    /// Meaningless where ky is imaginary ([`Air::solve`](crate::Air::solve)): the continuation does not conserve power.
    pub fn balance_error(&self) -> f64 {
        let count = self.waves.orders.len();
        let mut worst = 0.0_f64;
        for from in 0..count {
            for state in [0, 1] {
                let reflected: f64 =
                    (0..count).flat_map(|out| self.jones[out * count + from].map(|row| row[state].norm_sqr())).sum();
                worst = worst.max((reflected + self.absorbed[from][state] - 1.0).abs());
            }
        }
        worst
    }

    /// Violation of reciprocity: the largest magnitude of the difference between an amplitude and that of the reversed
    /// path. `reversed` are the amplitudes of the same grating and wavelength at t and −b.
    pub fn reciprocity_error(&self, reversed: &Self) -> f64 {
        let mut worst = 0.0_f64;
        for &out in &self.waves.orders {
            for &from in &self.waves.orders {
                let (forward, backward) = (self.jones(out, from), reversed.jones(-from, -out));
                for i in [0, 1] {
                    for j in [0, 1] {
                        worst = worst.max((forward[i][j] - backward[j][i]).norm());
                    }
                }
            }
        }
        worst
    }

    /// Position of an order in `orders`; `None` where it does not propagate.
    fn position(&self, order: i32) -> Option<usize> {
        self.waves.orders.iter().position(|&m| m == order)
    }
}
