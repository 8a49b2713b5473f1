//! The air above the relief, and the linear systems that couple it to the lower medium.
//!
//! `lib.rs` has the equations. Lengths are in µm, wave numbers in rad/µm. x is across the grooves, y along them, z up.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | d, k, n | period, wave number in vacuum, refractive index of the lower medium |
//! | ky | wave number along y, common to all fields |
//! | κ² = k² − ky², κm² = n²k² − ky² | squared wave number in the xz plane, in the air and in the lower medium |
//! | t = κd/2π | bound of \|b + m\| for orders m that propagate |
//! | b | Bloch phase in turns: a field changes by the factor e^{2πib} from one period to the next |
//! | αm = 2π(b + m)/d, βm = √(κ² − αm²) | wave numbers of order m along x and z |
//! | u, ∂νu, ∂su | field on the curve, Ey or Hy; its derivatives along the normal into the air, and along the curve |
//! | S, K | single and double layer potential in the air: integrals over the curve, as matrices (`layers.rs`) |
//! | W | response of the lower medium: the matrix from u to ∂νu (`metal.rs`) |
//! | τ | parameter of the curve; *nodes* at equal steps of it carry the fields (`nodes.rs`) |
//!
//! In matrices over the nodes:
//!
//! - *speed* is |dr/dτ| of a node at position r;
//! - *field* is u, *flux* is ∂νu times the speed;
//! - the field in the air satisfies `(½ − K)·u + S·flux = incident`;
//! - the amplitude radiated into order m is `from_field·u + from_flux·flux`, by Green's formula;
//! - *response* is W times the speed, from field to flux;
//! - D is the derivative with respect to τ (`discretisation.rs`), so `D·u` is ∂su times the speed.
//!
//! An incident wave of order m varies as e^{iαm·x − iβm·z}, an outgoing one as e^{iαm·x + iβm·z}.

use crate::discretisation::Discretisation;
use crate::layers::layer_matrices;
use crate::linear::{Matrix, from_fn, product, solve, zeros};
use crate::medium::outgoing;
use crate::metal::response;
use crate::waves::{Waves, away_from_cutoffs};
use crate::{Amplitudes, Error, Medium, MetalTable};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// The air above one profile at one (t, b), for any wavelength and lower medium (symbols: [crate]).
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 3 })?;
/// let air = mesh.air(1.5, 0.2)?;
/// // One set of matrices is enough for several wavelengths.
/// for (wavelength_nm, eta, k) in [(550.0, 0.06, 3.59), (633.0, 0.06, 4.28)] {
///     let amplitudes = air.solve(&Medium::index(eta, k)?, wavelength_nm)?;
///     assert!(amplitudes.balance_error() < 1e-3);
/// }
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct Air<'a> {
    /// The profile with its nodes.
    mesh: &'a Discretisation,
    /// κ² in (rad/µm)²; negative where no order propagates in the air.
    kappa_squared: f64,
    /// κd/2π; zero where κ² is negative.
    t: f64,
    /// Bloch phase in turns.
    b: f64,
    /// Propagating orders.
    waves: Waves,
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
        let t = away_from_cutoffs(t, b);
        let kappa = TAU * t / mesh.profile().period_um();
        Self::at(mesh, kappa * kappa, t, b)
    }

    /// [`Air::new`] at κ² in (rad/µm)², which is negative for light from the lower medium that is totally reflected.
    ///
    /// # Errors
    /// Special functions that overflow.
    pub(crate) fn at_kappa_squared(mesh: &'a Discretisation, kappa_squared: f64, b: f64) -> Result<Self, Error> {
        let t = kappa_squared.max(0.0).sqrt() * mesh.profile().period_um() / TAU;
        // With t = 0 no order propagates, so there is no cut-off to keep away from.
        if t > 0.0 { Self::new(mesh, t, b) } else { Self::at(mesh, kappa_squared, 0.0, b) }
    }

    /// Computes all matrices. t is κd/2π, or zero where κ² is not positive.
    fn at(mesh: &'a Discretisation, kappa_squared: f64, t: f64, b: f64) -> Result<Self, Error> {
        let period = mesh.profile().period_um();
        let waves = Waves::propagating(period, t, b);
        let (alpha, beta) = (&waves.alpha, &waves.beta);
        // The nodes that carry the unknown fields. The finer ones serve the lower medium.
        let nodes = &mesh.coarse;
        // The stride 1 makes every node a target. `outgoing(κ²)` is κ, imaginary for a negative κ².
        let layers = layer_matrices(nodes, 1, outgoing(kappa_squared.into()), b)?;
        let mut exterior = -layers.double;
        exterior.diag_mut().map_inplace(|value| *value += 0.5);
        let derivative = mesh.derivative(b);
        let single_derivative = product(&layers.single, &derivative);
        let (n, count, step) = (nodes.len(), alpha.len(), nodes.step());
        let incident = from_fn(n, count, |i, m| Complex64::cis(alpha[m] * nodes.x[i] - beta[m] * nodes.z[i]));
        // Above the relief, order m of the Green's function G of a source at (x, z) has the amplitude
        // i/(2dβm)·e^{−iαm·x − iβm·z}. `green` is this amplitude, divided by i and multiplied by the quadrature step.
        // By Green's formula the field above is ∫ (u·∂νG − ∂νu·G) ds, and ∂ν gives the factor −i(αm·nx + βm·nz).
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
            kappa_squared,
            t,
            b,
            waves,
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
        &self.waves.orders
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
    /// ky is the positive root of k² − κ². Where κ exceeds k, ky² is negative and belongs to no direction of light.
    /// The amplitudes are then their analytic continuation in ky². Tables whose directions extend beyond the horizon
    /// use it.
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

    /// [`Air::solve`] with the response of a metal from a table for the same discretisation. The caller ensures that
    /// ky²/k² is within [`KY_SQUARED_RANGE`](crate::KY_SQUARED_RANGE); the table extrapolates beyond it.
    ///
    /// # Errors
    /// Solutions that are not finite.
    pub fn solve_tabulated(&self, metal: &MetalTable<'_>) -> Result<Amplitudes, Error> {
        let k = metal.wave_number_per_um();
        self.solve_with(metal.index(), k, &metal.at(self.ky_squared(k), self.b))
    }

    /// ky² = k² − κ² in (rad/µm)², for the wave number k in vacuum (rad/µm); negative where ky is imaginary.
    pub(crate) fn ky_squared(&self, k: f64) -> f64 {
        if self.t == 0.0 {
            return k * k - self.kappa_squared;
        }
        let kappa = TAU * self.t / self.mesh.profile().period_um();
        // The product keeps the digits that a difference of squares would lose near ky = 0.
        (k - kappa) * (k + kappa)
    }

    /// The profile with its nodes.
    pub(crate) fn mesh(&self) -> &'a Discretisation {
        self.mesh
    }

    /// Propagating orders.
    pub(crate) fn waves(&self) -> &Waves {
        &self.waves
    }

    /// Solves above a perfect conductor, where Ey and the normal derivative of Hy vanish. This leaves two independent
    /// systems, `S·flux = incident` for Ey and `(½ − K)·u = incident` for Hy. Nothing is absorbed.
    fn solve_perfect(&self) -> Result<Amplitudes, Error> {
        let flux = solve(&self.single, &self.incident, "the field of Ey")?;
        let field = solve(&self.exterior, &self.incident, "the field of Hy")?;
        let (electric, magnetic) = (product(&self.from_flux, &flux), product(&self.from_field, &field));
        let count = self.waves.orders.len();
        // Rows are the outgoing states Ey and Hy, columns the incident ones.
        let amplitude = |out: usize, from: usize| {
            let zero = Complex64::ZERO;
            [[electric[(out, from)], zero], [zero, magnetic[(out, from)]]]
        };
        Ok(Amplitudes::new(&self.waves, amplitude, vec![[0.0; 2]; count]))
    }

    /// Solves for Ey and Hy above a medium of refractive index `index`, at wave number k (rad/µm) in vacuum.
    ///
    /// The amplitudes of all orders and the power that crosses into the medium follow from the fields.
    fn solve_with(&self, index: Complex64, k: f64, response: &Matrix) -> Result<Amplitudes, Error> {
        let count = self.waves.orders.len();
        let continuity = self.continuity(index, k);
        let incident = [&self.incident, &self.incident];
        let fields = self.fields(&continuity, response, incident)?;
        let fluxes = self.fluxes(&continuity, &fields, &fields.each_ref().map(|field| product(response, field)));
        let [out_e, out_h] = self.radiated(&fields, &fluxes);
        // Columns are the incident orders in the state Ey, then those in the state Hy.
        let amplitude =
            |out: usize, from: usize| [&out_e, &out_h].map(|wave| [wave[(out, from)], wave[(out, count + from)]]);
        let absorbed = (0..count)
            .map(|from| {
                [from, count + from].map(|column| {
                    let inward = [0, 1].map(|component| self.inward(&fields[component], &fluxes[component], column));
                    // In the unit of `inward`, the incident wave of amplitude 1 carries the power d·βm of its order m.
                    (inward[0] + inward[1]) / (self.mesh.profile().period_um() * self.waves.beta[from])
                })
            })
            .collect();
        Ok(Amplitudes::new(&self.waves, amplitude, absorbed))
    }

    /// Continuity of the fields above a medium of refractive index `index`, at wave number k (rad/µm) in vacuum.
    pub(crate) fn continuity(&self, index: Complex64, k: f64) -> Continuity {
        let ky = Complex64::new(self.ky_squared(k), 0.0).sqrt();
        let kappa_m_squared = index * index * k * k - ky * ky;
        // κ²/κm².
        let ratio = self.kappa_squared / kappa_m_squared;
        Continuity { weights: [ratio * index * index, ratio], coupling: ky / k * (1.0 - ratio) }
    }

    /// Ey and Hy on the curve, each as a matrix node × incident wave.
    ///
    /// `response` eliminates the fluxes, so the unknowns are the fields. Each incident wave is in the state Ey (without
    /// Hy) or in the state Hy (without Ey). `right[0]` holds right-hand sides of the equation of Ey, for waves in the
    /// state Ey; `right[1]` those of the equation of Hy, for waves in the state Hy. Both are node × wave.
    /// Columns of both results are the waves of `right[0]`, then those of `right[1]`.
    ///
    /// # Errors
    /// Fields that are not finite.
    pub(crate) fn fields(
        &self,
        continuity: &Continuity,
        response: &Matrix,
        right: [&Matrix; 2],
    ) -> Result<[Matrix; 2], Error> {
        let single_response = product(&self.single, response);
        if continuity.is_coupled() {
            return self.coupled_fields(&single_response, continuity, right);
        }
        let [e, h] = [0, 1].map(|i| self.uncoupled_system(&single_response, continuity.weights[i]));
        let (e, h) = (solve(&e, right[0], "the field of Ey")?, solve(&h, right[1], "the field of Hy")?);
        let zero = |columns: &Matrix| zeros(columns.nrows(), columns.ncols());
        Ok([join_columns(&e, &zero(&h)), join_columns(&zero(&e), &h)])
    }

    /// Fluxes of Ey and Hy in the air, from the fields on the curve and from the fluxes `below` in the lower medium.
    pub(crate) fn fluxes(&self, continuity: &Continuity, fields: &[Matrix; 2], below: &[Matrix; 2]) -> [Matrix; 2] {
        let flux = |own: usize, sign: f64| {
            let mut flux = &below[own] * continuity.weights[own];
            if continuity.is_coupled() {
                flux.scaled_add(continuity.coupling * sign, &product(&self.derivative, &fields[1 - own]));
            }
            flux
        };
        [flux(0, -1.0), flux(1, 1.0)]
    }

    /// Amplitudes of Ey and Hy of all orders in the air: order × incident wave.
    pub(crate) fn radiated(&self, fields: &[Matrix; 2], fluxes: &[Matrix; 2]) -> [Matrix; 2] {
        [0, 1].map(|i| product(&self.from_field, &fields[i]) + product(&self.from_flux, &fluxes[i]))
    }

    /// Incident wave of each order at the nodes: node × order.
    pub(crate) fn incident(&self) -> &Matrix {
        &self.incident
    }

    /// S, applied to the flux: target node × source node.
    pub(crate) fn single(&self) -> &Matrix {
        &self.single
    }

    /// `½ − K + weight·S W`, the system of Ey or Hy without coupling. `single_response` is S W, the speed included.
    fn uncoupled_system(&self, single_response: &Matrix, weight: Complex64) -> Matrix {
        let n = self.mesh.nodes();
        from_fn(n, n, |i, j| self.exterior[(i, j)] + weight * single_response[(i, j)])
    }

    /// [`Air::fields`] with the coupling of Ey and Hy: one system of the blocks
    /// `[½ − K + weights[0]·S W, −coupling·S D; coupling·S D, ½ − K + weights[1]·S W]`.
    fn coupled_fields(
        &self,
        single_response: &Matrix,
        &Continuity { weights: [electric, magnetic], coupling }: &Continuity,
        right: [&Matrix; 2],
    ) -> Result<[Matrix; 2], Error> {
        let n = self.mesh.nodes();
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
        let [count_e, count_h] = right.map(Matrix::ncols);
        let joint_right = from_fn(2 * n, count_e + count_h, |i, column| match (i < n, column < count_e) {
            (true, true) => right[0][(i, column)],
            (false, false) => right[1][(i - n, column - count_e)],
            _ => Complex64::ZERO,
        });
        let fields = solve(&system, &joint_right, "the coupled fields")?;
        Ok([0, n].map(|first| from_fn(n, count_e + count_h, |i, j| fields[(first + i, j)])))
    }

    /// `−Im ∫ u* ∂νu ds` over one period, for the incident wave `column`: the power of one component that crosses into
    /// the lower medium, up to a factor common to both components.
    fn inward(&self, field: &Matrix, flux: &Matrix, column: usize) -> f64 {
        let (field, flux) = (field.column(column), flux.column(column));
        -self.mesh.coarse.step() * field.iter().zip(flux).map(|(u, q)| (u.conj() * q).im).sum::<f64>()
    }
}

/// Continuity of the tangential fields (`lib.rs`). It gives ∂νu in the air from the fields on the curve:
/// `∂νEy = weights[0]·W Ey − coupling·∂sHy` and `∂νHy = weights[1]·W Hy + coupling·∂sEy`.
pub(crate) struct Continuity {
    /// Factors of the fluxes in the lower medium, of Ey and of Hy: κ²n²/κm² and κ²/κm².
    pub(crate) weights: [Complex64; 2],
    /// `(ky/k)(1 − κ²/κm²)`; zero where ky = 0.
    coupling: Complex64,
}

impl Continuity {
    /// Whether Ey and Hy are solved together. Two separate systems take a quarter of the time.
    ///
    /// They are solved together if |coupling|² exceeds 8ε, the rounding error of ky²/k² = 1 − κ²/k² at ky = 0: some
    /// seven roundings of κ/k by ε/2, which the square of κ/k doubles.
    fn is_coupled(&self) -> bool {
        self.coupling.norm_sqr() > 8.0 * f64::EPSILON
    }
}

/// The matrix with the columns of `left`, then those of `right`.
pub(crate) fn join_columns(left: &Matrix, right: &Matrix) -> Matrix {
    let split = left.ncols();
    from_fn(left.nrows(), split + right.ncols(), |i, j| if j < split { left[(i, j)] } else { right[(i, j - split)] })
}
