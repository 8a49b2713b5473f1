//! The orders for one direction of light: the whole question at once, with its checks.

use crate::discretisation::NODES_MAX;
use crate::error::positive;
use crate::{Amplitudes, Discretisation, Error, Jones, Medium, Profile, Resolution, check_size};
use std::f64::consts::TAU;

/// What power and reciprocity may be off, as a share of the light.
const TOLERANCE: f64 = 5e-4;

/// The least cosine of the incidence: below it an order's power is the ratio of two vanishing ones.
const COSINE_MIN: f64 = 1e-7;

/// One order that leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Its index m: `wo.x = −wi.x + m·λ/period`.
    pub index: i32,
    /// Its unit vector, away from the surface.
    pub direction: [f64; 3],
    /// Its Jones matrix in [`transverse_basis`] of the light and of the order; |·|² is a share of the light's power.
    pub jones: Jones,
}

impl Order {
    /// Share of the power of light whose magnetic field has no component along the grooves (TE where light falls across them).
    pub fn te(&self) -> f64 {
        self.jones[0][0].norm_sqr() + self.jones[1][0].norm_sqr()
    }

    /// Share of the power of light whose electric field has no component along the grooves (TM where light falls across them).
    pub fn tm(&self) -> f64 {
        self.jones[0][1].norm_sqr() + self.jones[1][1].norm_sqr()
    }

    /// Share of the power of unpolarised light.
    pub fn efficiency(&self) -> f64 {
        0.5 * (self.te() + self.tm())
    }
}

/// All orders that leave, for light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Orders {
    /// By rising index.
    pub orders: Vec<Order>,
    /// Share of TE and TM light that crosses into the lower medium: absorbed by a metal, transmitted into a dielectric.
    pub absorbed: [f64; 2],
    /// Nodes on one period of the solution.
    pub nodes: usize,
    /// [`Amplitudes::balance_error`] of the solution.
    pub balance_error: f64,
    /// [`Amplitudes::reciprocity_error`] of the solution.
    pub reciprocity_error: f64,
}

/// What a solution will cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Nodes on one period, at first.
    pub nodes: usize,
    /// Time on one core of a single (t, b), in seconds: right to a factor of about two.
    pub seconds: f64,
}

impl Estimate {
    /// Of a profile above a medium at a wavelength (nm), without solving.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive.
    pub fn new(profile: &Profile, medium: &Medium, wavelength_nm: f64) -> Result<Self, Error> {
        let nodes = Resolution::new(profile, medium, wavelength_nm)?.nodes;
        let n = nodes as f64;
        // The matrices go by the square of the nodes, the factorisation by the cube; measured.
        Ok(Self { nodes, seconds: 1.5e-6 * n * n + 5e-9 * n * n * n })
    }
}

/// Solves for light of a wavelength (nm) from the unit vector `wi`, which points away from the surface, z up.
///
/// Power and reciprocity are held to 5e-4; where they are off, nodes are doubled.
///
/// # Errors
/// A direction at or below the horizon or not of unit length, a problem that is too large, or one whose checks
/// fail with 2048 nodes.
pub fn solve_orders(profile: &Profile, medium: &Medium, wavelength_nm: f64, wi: [f64; 3]) -> Result<Orders, Error> {
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    let length = wi.iter().map(|c| c * c).sum::<f64>().sqrt();
    if !(1.0 - 1e-6..=1.0 + 1e-6).contains(&length) {
        return Err(Error::OutOfRange { quantity: "length of wi", found: length, accepted: "1" });
    }
    if wi[2] < COSINE_MIN {
        return Err(Error::OutOfRange { quantity: "z of wi", found: wi[2], accepted: "1e-7 to 1, above the horizon" });
    }
    let period = profile.period_um();
    // √(1 − y²) from the other two, which keeps its digits along the grooves.
    let across = wi[0].hypot(wi[2]);
    let (t, b) = (across * k * period / TAU, -wi[0] * k * period / TAU);
    check_size(profile, medium, wavelength_nm, wi[1].abs().min(1.0))?;
    let mut resolution = Resolution::new(profile, medium, wavelength_nm)?;
    loop {
        let mesh = Discretisation::new(profile, resolution)?;
        let there = mesh.air(t, b)?.solve(medium, wavelength_nm)?;
        let back = mesh.air(t, -b)?.solve(medium, wavelength_nm)?;
        let (balance_error, reciprocity_error) = (there.balance_error(), there.reciprocity_error(&back));
        if balance_error <= TOLERANCE && reciprocity_error <= TOLERANCE {
            let orders = leaving(&there, k, wi[1]);
            let absorbed = there.absorbed(0);
            return Ok(Orders { orders, absorbed, nodes: mesh.nodes(), balance_error, reciprocity_error });
        }
        resolution.nodes *= 2;
        if resolution.nodes > NODES_MAX {
            return Err(Error::Unresolved {
                nodes: mesh.nodes(),
                balance: balance_error,
                reciprocity: reciprocity_error,
                tolerance: TOLERANCE,
            });
        }
    }
}

/// The orders for light in order 0, whose wave number along y is −k·wi.y; the solution is for a positive one.
fn leaving(amplitudes: &Amplitudes, k: f64, wi_y: f64) -> Vec<Order> {
    let orders = amplitudes.orders().iter().zip(amplitudes.alpha_per_um()).zip(amplitudes.beta_per_um());
    orders
        .map(|((&index, alpha), beta)| {
            let mut jones = amplitudes.jones(index, 0);
            // Mirrored along y, a wave's Ey changes its sign and Hy does not.
            if wi_y > 0.0 {
                jones[0][1] = -jones[0][1];
                jones[1][0] = -jones[1][0];
            }
            Order { index, direction: [alpha / k, -wi_y, beta / k], jones }
        })
        .collect()
}

/// The unit electric vectors of the two states of a wave that travels along the unit vector `d`, neither along y: the first of
/// the state without Hy, `(ŷ − (ŷ·d)d)/|…|`, the second of that without Ey, `first × d`. Light from wi travels along −wi.
pub fn transverse_basis(d: [f64; 3]) -> [[f64; 3]; 2] {
    let across = d[0].hypot(d[2]);
    let first = [-d[1] * d[0] / across, across, -d[1] * d[2] / across];
    [first, [d[2] / across, 0.0, -d[0] / across]]
}
