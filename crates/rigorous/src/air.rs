//! The air above the relief, and the systems that it makes with what lies below.

use crate::discretisation::Discretisation;
use crate::layers::layers;
use crate::linear::{Matrix, from_fn, product, solve, zeros};
use crate::metal::response;
use crate::{Amplitudes, Error, Medium, MetalTable};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// An order closer than this to passing off is moved off: the air's sum has a pole there, a square root of the distance.
const PASSING_OFF: f64 = 1e-11;

/// The air over one profile at one (t, b): matrices and orders, for any wavelength and lower medium.
pub struct Air<'a> {
    mesh: &'a Discretisation,
    t: f64,
    b: f64,
    orders: Vec<i32>,
    /// Wave numbers of the orders along x and z, in 1/µm.
    alpha: Vec<f64>,
    beta: Vec<f64>,
    /// From the normal derivative times the speed to the field.
    single: Matrix,
    /// ½ − K.
    exterior: Matrix,
    /// S times the derivative along the curve.
    single_derivative: Matrix,
    derivative: Matrix,
    /// Columns: the incident waves at the nodes.
    incident: Matrix,
    /// Rows: what the field, and its normal derivative times the speed, radiate into the orders.
    from_field: Matrix,
    from_flux: Matrix,
}

impl<'a> Air<'a> {
    pub(crate) fn new(mesh: &'a Discretisation, t: f64, b: f64) -> Result<Self, Error> {
        let period = mesh.profile().period_um();
        let t = off_the_lines(t, b);
        let orders: Vec<i32> =
            ((-t - b).ceil() as i32..=(t - b).floor() as i32).filter(|&m| (b + f64::from(m)).abs() < t).collect();
        let along = TAU / period;
        let alpha: Vec<f64> = orders.iter().map(|&m| along * (b + f64::from(m))).collect();
        // As a product, which keeps its digits where an order passes off.
        let beta: Vec<f64> = orders
            .iter()
            .map(|&m| {
                let at = b + f64::from(m);
                along * ((t - at) * (t + at)).sqrt()
            })
            .collect();
        let nodes = &mesh.coarse;
        let layers = layers(nodes, 1, Complex64::new(along * t, 0.0), b)?;
        let mut exterior = -layers.double;
        exterior.diag_mut().map_inplace(|value| *value += 0.5);
        let derivative = mesh.derivative(b);
        let single_derivative = product(&layers.single, &derivative);
        let (n, count, step) = (nodes.len(), orders.len(), nodes.step());
        let incident = from_fn(n, count, |i, m| Complex64::cis(alpha[m] * nodes.x[i] - beta[m] * nodes.z[i]));
        let outgoing = |m: usize, i: usize| {
            Complex64::cis(-alpha[m] * nodes.x[i] - beta[m] * nodes.z[i]) * (step / (2.0 * period * beta[m]))
        };
        let from_field = from_fn(count, n, |m, i| {
            let [nx, nz] = nodes.normal[i];
            outgoing(m, i) * ((alpha[m] * nx + beta[m] * nz) * nodes.speed[i])
        });
        let from_flux = from_fn(count, n, |m, i| -Complex64::I * outgoing(m, i));
        let single = layers.single;
        Ok(Self {
            mesh,
            t,
            b,
            orders,
            alpha,
            beta,
            single,
            exterior,
            single_derivative,
            derivative,
            incident,
            from_field,
            from_flux,
        })
    }

    /// The indices of the orders that propagate, rising.
    pub fn orders(&self) -> &[i32] {
        &self.orders
    }

    /// κd/2π, moved by at most 1e-11 off the lines where an order passes off.
    pub fn t(&self) -> f64 {
        self.t
    }

    /// The phase in turns a period.
    pub fn b(&self) -> f64 {
        self.b
    }

    /// All propagating orders for light in each of them, at a wavelength (nm). ky is the positive root of k² − κ²; where κ
    /// exceeds k it is imaginary, and the amplitudes go on analytically.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive, and solutions that are not finite.
    pub fn solve(&self, medium: &Medium, wavelength_nm: f64) -> Result<Amplitudes, Error> {
        let k = TAU * 1e3 / crate::error::positive("wavelength in nm", wavelength_nm)?;
        match *medium {
            Medium::Perfect => self.solve_perfect(),
            Medium::Index(index) => {
                let square = index * index * k * k - self.ky_squared(k);
                self.solve_with(index, k, &response(self.mesh, square, self.b)?)
            }
        }
    }

    /// The same with the metal's response from a table made for these nodes.
    ///
    /// # Errors
    /// Solutions that are not finite.
    pub fn solve_tabulated(&self, metal: &MetalTable<'_>) -> Result<Amplitudes, Error> {
        let k = metal.wave_number_per_um();
        self.solve_with(metal.index(), k, &metal.at(self.ky_squared(k), self.b))
    }

    fn kappa(&self) -> f64 {
        TAU * self.t / self.mesh.profile().period_um()
    }

    fn ky_squared(&self, k: f64) -> f64 {
        (k - self.kappa()) * (k + self.kappa())
    }

    /// Ey vanishes on the metal, and Hy's normal derivative: two problems of their own.
    fn solve_perfect(&self) -> Result<Amplitudes, Error> {
        let flux = solve(&self.single, &self.incident, "the field of Ey")?;
        let field = solve(&self.exterior, &self.incident, "the field of Hy")?;
        let (electric, magnetic) = (product(&self.from_flux, &flux), product(&self.from_field, &field));
        let count = self.orders.len();
        let amplitude = |out: usize, from: usize| {
            let zero = Complex64::ZERO;
            [[electric[(out, from)], zero], [zero, magnetic[(out, from)]]]
        };
        Ok(Amplitudes::new(&self.orders, &self.alpha, &self.beta, amplitude, vec![[0.0; 2]; count]))
    }

    /// The coupled system for (Ey, Hy), of which the lower medium's normal derivatives are eliminated by its response.
    fn solve_with(&self, index: Complex64, k: f64, response: &Matrix) -> Result<Amplitudes, Error> {
        let (n, count) = (self.mesh.nodes(), self.orders.len());
        let ky = Complex64::new(self.ky_squared(k), 0.0).sqrt();
        let kappa_squared = self.kappa() * self.kappa();
        let metal_squared = index * index * k * k - ky * ky;
        // ∂νE = electric·W E − coupling·∂sH and ∂νH = magnetic·W H + coupling·∂sE.
        let electric = kappa_squared * index * index / metal_squared;
        let magnetic = kappa_squared / metal_squared;
        let coupling = ky / k * (1.0 - magnetic);
        let through = product(&self.single, response);
        let coupled = coupling.norm() > 1e-12;
        let (fields_e, fields_h) = if coupled {
            self.solve_coupled(&through, electric, magnetic, coupling)?
        } else {
            let zero = || zeros(n, count);
            let e = solve(&self.planar(&through, electric), &self.incident, "the field of Ey")?;
            let h = solve(&self.planar(&through, magnetic), &self.incident, "the field of Hy")?;
            (beside(&e, &zero()), beside(&zero(), &h))
        };
        let flux_of = |own: &Matrix, other: &Matrix, weight: Complex64, coupling: Complex64| {
            let mut flux = product(response, own) * weight;
            if coupled {
                flux.scaled_add(coupling, &product(&self.derivative, other));
            }
            flux
        };
        let flux_e = flux_of(&fields_e, &fields_h, electric, -coupling);
        let flux_h = flux_of(&fields_h, &fields_e, magnetic, coupling);
        let radiated =
            |field: &Matrix, flux: &Matrix| product(&self.from_field, field) + product(&self.from_flux, flux);
        let (out_e, out_h) = (radiated(&fields_e, &flux_e), radiated(&fields_h, &flux_h));
        // Columns: light in Ey of each order, then light in Hy.
        let amplitude = |out: usize, from: usize| [&out_e, &out_h].map(|of| [of[(out, from)], of[(out, count + from)]]);
        let absorbed = (0..count)
            .map(|from| {
                [from, count + from].map(|column| {
                    let inward = self.inward(&fields_e, &flux_e, column) + self.inward(&fields_h, &flux_h, column);
                    inward / (self.mesh.profile().period_um() * self.beta[from])
                })
            })
            .collect();
        Ok(Amplitudes::new(&self.orders, &self.alpha, &self.beta, amplitude, absorbed))
    }

    /// `½ − K + weight·S W`.
    fn planar(&self, through: &Matrix, weight: Complex64) -> Matrix {
        let n = self.mesh.nodes();
        from_fn(n, n, |i, j| self.exterior[(i, j)] + weight * through[(i, j)])
    }

    /// Ey and Hy at the nodes (rows) for light in Ey of each order and then in Hy of each (columns).
    fn solve_coupled(
        &self,
        through: &Matrix,
        electric: Complex64,
        magnetic: Complex64,
        coupling: Complex64,
    ) -> Result<(Matrix, Matrix), Error> {
        let (n, count) = (self.mesh.nodes(), self.orders.len());
        let mut system = zeros(2 * n, 2 * n);
        for j in 0..n {
            for i in 0..n {
                let (air, below) = (self.exterior[(i, j)], through[(i, j)]);
                let across = coupling * self.single_derivative[(i, j)];
                system[(i, j)] = air + electric * below;
                system[(n + i, n + j)] = air + magnetic * below;
                system[(i, n + j)] = -across;
                system[(n + i, j)] = across;
            }
        }
        let mut right = zeros(2 * n, 2 * count);
        for m in 0..count {
            for i in 0..n {
                right[(i, m)] = self.incident[(i, m)];
                right[(n + i, count + m)] = self.incident[(i, m)];
            }
        }
        let fields = solve(&system, &right, "the coupled fields")?;
        let half = |from: usize| from_fn(n, 2 * count, |i, j| fields[(from + i, j)]);
        Ok((half(0), half(n)))
    }

    /// `−Im ∫ u* ∂νu ds`: what one component carries into the lower medium.
    fn inward(&self, field: &Matrix, flux: &Matrix, column: usize) -> f64 {
        let (field, flux) = (field.column(column), flux.column(column));
        -self.mesh.coarse.step() * field.iter().zip(flux).map(|(u, q)| (u.conj() * q).im).sum::<f64>()
    }
}

fn beside(left: &Matrix, right: &Matrix) -> Matrix {
    let split = left.ncols();
    from_fn(left.nrows(), split + right.ncols(), |i, j| if j < split { left[(i, j)] } else { right[(i, j - split)] })
}

/// t, away from where an order passes off.
fn off_the_lines(t: f64, b: f64) -> f64 {
    let nearest = |p: f64| (p - p.round()).abs();
    if nearest(t - b).min(nearest(t + b)) < PASSING_OFF { t + 2.0 * PASSING_OFF } else { t }
}
