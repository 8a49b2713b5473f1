//! Amplitudes of all orders for light in each of them.

use num_complex::Complex64;

/// Rows: the state that leaves, (Ey, Hy). Columns: the state that comes in.
pub type Jones = [[Complex64; 2]; 2];

/// What one grating does at one (t, b) and wavelength: every propagating order for light coming in along every one.
///
/// Light "in order n" comes from the mirror direction of order n: it has order n's wave number along x and the opposite one along
/// z. States are those of Ey (without Hy) and of Hy (without Ey), y along the grooves; see
/// [`transverse_basis`](crate::transverse_basis). Amplitudes are weighted by √β so that |·|² is a share of power, and so are
/// reciprocal: the matrix for (m, n) at b is the transpose of that for (−n, −m) at −b.
#[derive(Clone, Debug, PartialEq)]
pub struct Amplitudes {
    orders: Vec<i32>,
    alpha: Vec<f64>,
    beta: Vec<f64>,
    /// `[out · orders + in]`.
    jones: Vec<Jones>,
    /// For light in Ey and in Hy of each order.
    absorbed: Vec<[f64; 2]>,
}

impl Amplitudes {
    pub(crate) fn new(
        orders: &[i32],
        alpha: &[f64],
        beta: &[f64],
        amplitude: impl Fn(usize, usize) -> Jones,
        absorbed: Vec<[f64; 2]>,
    ) -> Self {
        let count = orders.len();
        let jones = (0..count * count)
            .map(|i| {
                let (out, from) = (i / count, i % count);
                let weight = (beta[out] / beta[from]).sqrt();
                amplitude(out, from).map(|row| row.map(|value| value * weight))
            })
            .collect();
        Self { orders: orders.to_vec(), alpha: alpha.to_vec(), beta: beta.to_vec(), jones, absorbed }
    }

    /// The indices of the orders, rising.
    pub fn orders(&self) -> &[i32] {
        &self.orders
    }

    /// Wave numbers of the orders along x, in 1/µm.
    pub fn alpha_per_um(&self) -> &[f64] {
        &self.alpha
    }

    /// Wave numbers of the orders along z, in 1/µm.
    pub fn beta_per_um(&self) -> &[f64] {
        &self.beta
    }

    /// The Jones matrix of order `out` for light in order `from`; zero where either does not propagate.
    pub fn jones(&self, out: i32, from: i32) -> Jones {
        match (self.position(out), self.position(from)) {
            (Some(out), Some(from)) => self.jones[out * self.orders.len() + from],
            _ => [[Complex64::ZERO; 2]; 2],
        }
    }

    /// Share of unpolarised light in order `from` that leaves in order `out`; zero where either does not propagate.
    pub fn efficiency(&self, out: i32, from: i32) -> f64 {
        0.5 * self.jones(out, from).iter().flatten().map(Complex64::norm_sqr).sum::<f64>()
    }

    /// Share of light in Ey and in Hy of order `from` that crosses into the lower medium, from the fields on the curve: what a metal
    /// absorbs, or a dielectric transmits. Zero where the order does not propagate.
    pub fn absorbed(&self, from: i32) -> [f64; 2] {
        self.position(from).map_or([0.0; 2], |from| self.absorbed[from])
    }

    /// The largest difference from 1 of a sum over all orders and what crosses, of all incident states. The fields on the
    /// curve give what crosses, so that it is small only where the air's equations are solved well.
    ///
    /// It says nothing where ky is imaginary and no light has these wave numbers.
    pub fn balance_error(&self) -> f64 {
        let count = self.orders.len();
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

    /// The largest difference of an amplitude from that of the reversed path, in `reversed` at −b.
    pub fn reciprocity_error(&self, reversed: &Self) -> f64 {
        let mut worst = 0.0_f64;
        for &out in &self.orders {
            for &from in &self.orders {
                let (there, back) = (self.jones(out, from), reversed.jones(-from, -out));
                for i in [0, 1] {
                    for j in [0, 1] {
                        worst = worst.max((there[i][j] - back[j][i]).norm());
                    }
                }
            }
        }
        worst
    }

    fn position(&self, order: i32) -> Option<usize> {
        self.orders.iter().position(|&m| m == order)
    }
}
