//! The air above the relief, and the linear systems that couple it to the lower medium.
//!
//! Symbols and equations are those of `lib.rs`. In matrices over the nodes:
//!
//! - *speed* is |dr/dτ| of a node (`nodes.rs`);
//! - *field* is u (Ey or Hy), *flux* is ∂νu times the speed;
//! - the field in the air satisfies `(½ − K)·u + S·flux = incident`;
//! - the amplitude radiated into order m is `from_field·u + from_flux·flux`, by Green's formula;
//! - *response* is W times the speed, from field to flux (`metal.rs`);
//! - D is the derivative with respect to the nodes' parameter τ (`discretisation.rs`), so `D·u` is ∂su times the speed.
//!
//! An incident wave of order m varies as e^{iαm·x − iβm·z}, an outgoing one as e^{iαm·x + iβm·z}.

use crate::discretisation::Discretisation;
use crate::layers::layer_matrices;
use crate::linear::{Matrix, from_fn, product, solve, zeros};
use crate::metal::response;
use crate::{Amplitudes, Error, Medium, MetalTable};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Smallest distance of t from the cut-off of an order (βm = 0), where the lattice sum has a pole.
///
/// Amplitudes vary as the square root of the distance, so moving t by up to twice this distance changes them by about
/// 1e-5. Larger values change them more; smaller ones approach the pole to within rounding.
const CUTOFF_DISTANCE: f64 = 1e-11;

/// Magnitude of the coupling `(ky/k)(1 − κ²/κm²)` below which Ey and Hy are solved separately, which takes a quarter of
/// the time. It covers the rounding of ky = 0.
const COUPLING_MIN: f64 = 1e-12;

/// The air above one profile at one (t, b), for any wavelength and lower medium (symbols: [crate]).
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 3 })?;
/// let air = mesh.air(1.5, 0.2)?;
/// // One set of matrices serves several wavelengths.
/// for (wavelength_nm, eta, k) in [(550.0, 0.06, 3.59), (633.0, 0.06, 4.28)] {
///     let amplitudes = air.solve(&Medium::index(eta, k)?, wavelength_nm)?;
///     assert!(amplitudes.balance_error() < 1e-3);
/// }
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct Air<'a> {
    /// Nodes of the profile.
    mesh: &'a Discretisation,
    /// κd/2π.
    t: f64,
    /// Bloch phase in turns.
    b: f64,
    /// Indices m of the propagating orders, ascending.
    orders: Vec<i32>,
    /// αm of the orders, in rad/µm.
    alpha: Vec<f64>,
    /// βm of the orders, in rad/µm; positive.
    beta: Vec<f64>,
    /// S, applied to the flux: target node × source node.
    single: Matrix,
    /// ½ − K: target node × source node.
    exterior: Matrix,
    /// S·D.
    single_derivative: Matrix,
    /// D: derivative with respect to the nodes' parameter τ.
    derivative: Matrix,
    /// Incident wave of each order at the nodes: node × order.
    incident: Matrix,
    /// Amplitude of each order radiated by the field: order × node.
    from_field: Matrix,
    /// Amplitude of each order radiated by the flux: order × node.
    from_flux: Matrix,
}

impl<'a> Air<'a> {
    /// Computes layers, derivative, incident waves and radiation matrices at (t, b).
    ///
    /// # Errors
    /// Special functions that overflow.
    pub(crate) fn new(mesh: &'a Discretisation, t: f64, b: f64) -> Result<Self, Error> {
        let period = mesh.profile().period_um();
        let t = away_from_cutoffs(t, b);
        let orders: Vec<i32> =
            ((-t - b).ceil() as i32..=(t - b).floor() as i32).filter(|&m| (b + f64::from(m)).abs() < t).collect();
        let grating_wave_number = TAU / period;
        let alpha: Vec<f64> = orders.iter().map(|&m| grating_wave_number * (b + f64::from(m))).collect();
        // βm = (2π/d)·√(t² − (b + m)²), with the difference as a product, which keeps its digits near a cut-off.
        let beta: Vec<f64> = orders
            .iter()
            .map(|&m| {
                let a = b + f64::from(m);
                grating_wave_number * ((t - a) * (t + a)).sqrt()
            })
            .collect();
        let nodes = &mesh.coarse;
        let layers = layer_matrices(nodes, 1, Complex64::new(grating_wave_number * t, 0.0), b)?;
        let mut exterior = -layers.double;
        exterior.diag_mut().map_inplace(|value| *value += 0.5);
        let derivative = mesh.derivative(b);
        let single_derivative = product(&layers.single, &derivative);
        let (n, count, step) = (nodes.len(), orders.len(), nodes.step());
        let incident = from_fn(n, count, |i, m| Complex64::cis(alpha[m] * nodes.x[i] - beta[m] * nodes.z[i]));
        // Above the relief, the Green's function of a source at (x, z) has in order m the amplitude i/(2dβm) ·
        // e^{−iαm·x − iβm·z}. `green` is this amplitude over i, times the quadrature step.
        let green = |m: usize, i: usize| {
            Complex64::cis(-alpha[m] * nodes.x[i] - beta[m] * nodes.z[i]) * (step / (2.0 * period * beta[m]))
        };
        let from_field = from_fn(count, n, |m, i| {
            let [nx, nz] = nodes.normal[i];
            green(m, i) * ((alpha[m] * nx + beta[m] * nz) * nodes.speed[i])
        });
        let from_flux = from_fn(count, n, |m, i| -Complex64::I * green(m, i));
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

    /// Indices of the propagating orders, ascending.
    pub fn orders(&self) -> &[i32] {
        &self.orders
    }

    /// t = κd/2π, raised by 2e-11 if it was within 1e-11 of the cut-off of an order.
    pub fn t(&self) -> f64 {
        self.t
    }

    /// Bloch phase in turns.
    pub fn b(&self) -> f64 {
        self.b
    }

    /// Amplitudes between all propagating orders at a wavelength (nm).
    ///
    /// ky is the positive root of k² − κ². Where κ exceeds k, ky is imaginary and belongs to no direction of light. The
    /// amplitudes are then the analytic continuation in ky².
    ///
    /// # Errors
    /// A wavelength that is not finite and positive, special functions that overflow, and solutions that are not
    /// finite.
    pub fn solve(&self, medium: &Medium, wavelength_nm: f64) -> Result<Amplitudes, Error> {
        let k = TAU * 1e3 / crate::error::positive("wavelength in nm", wavelength_nm)?;
        match *medium {
            Medium::Perfect => self.solve_perfect(),
            Medium::Index(index) => {
                let kappa_m_squared = index * index * k * k - self.ky_squared(k);
                self.solve_with(index, k, &response(self.mesh, kappa_m_squared, self.b)?)
            }
        }
    }

    /// [`Air::solve`] with the response of a metal from a table for the same discretisation.
    ///
    /// # Errors
    /// Solutions that are not finite.
    pub fn solve_tabulated(&self, metal: &MetalTable<'_>) -> Result<Amplitudes, Error> {
        let k = metal.wave_number_per_um();
        self.solve_with(metal.index(), k, &metal.at(self.ky_squared(k), self.b))
    }

    /// κ in rad/µm.
    fn kappa(&self) -> f64 {
        TAU * self.t / self.mesh.profile().period_um()
    }

    /// ky² = k² − κ² in (rad/µm)², for the wave number k in vacuum (rad/µm); negative where ky is imaginary.
    fn ky_squared(&self, k: f64) -> f64 {
        (k - self.kappa()) * (k + self.kappa())
    }

    /// Solves above a perfect conductor, where Ey and the normal derivative of Hy vanish: two independent systems.
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

    /// Solves for Ey and Hy above a medium of refractive index `index`, at wave number k (rad/µm) in vacuum.
    ///
    /// `response` eliminates the fluxes from the system, which has only the fields as unknowns. The fluxes, the
    /// amplitudes of all orders and the power that crosses into the medium follow from the fields.
    fn solve_with(&self, index: Complex64, k: f64, response: &Matrix) -> Result<Amplitudes, Error> {
        let (n, count) = (self.mesh.nodes(), self.orders.len());
        let ky = Complex64::new(self.ky_squared(k), 0.0).sqrt();
        let kappa_squared = self.kappa() * self.kappa();
        let kappa_m_squared = index * index * k * k - ky * ky;
        // Coefficients of ∂νEy = electric·W Ey − coupling·∂sHy and ∂νHy = magnetic·W Hy + coupling·∂sEy (`lib.rs`).
        let electric = kappa_squared * index * index / kappa_m_squared;
        let magnetic = kappa_squared / kappa_m_squared;
        let coupling = ky / k * (1.0 - magnetic);
        let single_response = product(&self.single, response);
        let is_coupled = coupling.norm() > COUPLING_MIN;
        // Columns of these and all following matrices: incident Ey of each order, then incident Hy of each order.
        let (fields_e, fields_h) = if is_coupled {
            self.solve_coupled(&single_response, electric, magnetic, coupling)?
        } else {
            let zero = zeros(n, count);
            let e = solve(&self.uncoupled(&single_response, electric), &self.incident, "the field of Ey")?;
            let h = solve(&self.uncoupled(&single_response, magnetic), &self.incident, "the field of Hy")?;
            (join_columns(&e, &zero), join_columns(&zero, &h))
        };
        // Flux of one component from its own field and, by the coupling, from that of the other component.
        let flux_of = |own: &Matrix, own_weight: Complex64, other: &Matrix, other_weight: Complex64| {
            let mut flux = product(response, own) * own_weight;
            if is_coupled {
                flux.scaled_add(other_weight, &product(&self.derivative, other));
            }
            flux
        };
        let fluxes_e = flux_of(&fields_e, electric, &fields_h, -coupling);
        let fluxes_h = flux_of(&fields_h, magnetic, &fields_e, coupling);
        let radiated =
            |field: &Matrix, flux: &Matrix| product(&self.from_field, field) + product(&self.from_flux, flux);
        let (out_e, out_h) = (radiated(&fields_e, &fluxes_e), radiated(&fields_h, &fluxes_h));
        let amplitude =
            |out: usize, from: usize| [&out_e, &out_h].map(|wave| [wave[(out, from)], wave[(out, count + from)]]);
        let absorbed = (0..count)
            .map(|from| {
                [from, count + from].map(|column| {
                    let inward = self.inward(&fields_e, &fluxes_e, column) + self.inward(&fields_h, &fluxes_h, column);
                    // The incident wave, of amplitude 1, carries d·βm in the unit of `inward`.
                    inward / (self.mesh.profile().period_um() * self.beta[from])
                })
            })
            .collect();
        Ok(Amplitudes::new(&self.orders, &self.alpha, &self.beta, amplitude, absorbed))
    }

    /// `½ − K + weight·S W`: the system of one component without coupling.
    fn uncoupled(&self, single_response: &Matrix, weight: Complex64) -> Matrix {
        let n = self.mesh.nodes();
        from_fn(n, n, |i, j| self.exterior[(i, j)] + weight * single_response[(i, j)])
    }

    /// Ey and Hy as two matrices, node × incident wave: incident Ey of each order, then incident Hy of each.
    fn solve_coupled(
        &self,
        single_response: &Matrix,
        electric: Complex64,
        magnetic: Complex64,
        coupling: Complex64,
    ) -> Result<(Matrix, Matrix), Error> {
        let (n, count) = (self.mesh.nodes(), self.orders.len());
        let mut system = zeros(2 * n, 2 * n);
        for j in 0..n {
            for i in 0..n {
                let (air, below) = (self.exterior[(i, j)], single_response[(i, j)]);
                let cross = coupling * self.single_derivative[(i, j)];
                system[(i, j)] = air + electric * below;
                system[(n + i, n + j)] = air + magnetic * below;
                system[(i, n + j)] = -cross;
                system[(n + i, j)] = cross;
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
        let rows_from = |first: usize| from_fn(n, 2 * count, |i, j| fields[(first + i, j)]);
        Ok((rows_from(0), rows_from(n)))
    }

    /// `−Im ∫ u* ∂νu ds` over one period, for the incident wave `column`: the power of one component that crosses into
    /// the lower medium, up to a factor common to both components.
    fn inward(&self, field: &Matrix, flux: &Matrix, column: usize) -> f64 {
        let (field, flux) = (field.column(column), flux.column(column));
        -self.mesh.coarse.step() * field.iter().zip(flux).map(|(u, q)| (u.conj() * q).im).sum::<f64>()
    }
}

/// The matrix with the columns of `left`, then those of `right`.
fn join_columns(left: &Matrix, right: &Matrix) -> Matrix {
    let split = left.ncols();
    from_fn(left.nrows(), split + right.ncols(), |i, j| if j < split { left[(i, j)] } else { right[(i, j - split)] })
}

/// t, raised by twice [`CUTOFF_DISTANCE`] where it lies within [`CUTOFF_DISTANCE`] of a cut-off, |b + m| = t.
fn away_from_cutoffs(t: f64, b: f64) -> f64 {
    let distance_to_integer = |x: f64| (x - x.round()).abs();
    let distance = distance_to_integer(t - b).min(distance_to_integer(t + b));
    if distance < CUTOFF_DISTANCE { t + 2.0 * CUTOFF_DISTANCE } else { t }
}
