//! All orders for one direction of light, solved and checked in one call.
//!
//! x is across the grooves, y along them, z up. k is the wave number in vacuum in rad/µm, ky the wave number along y,
//! d the period in µm. A field changes by the factor e^{2πib} from one period to the next, with the Bloch phase b in
//! turns. *Nodes* are the points of the relief's cross-section at which fields are computed. `lib.rs` has all symbols
//! and the equations.

use crate::discretisation::NODES_MAX;
use crate::error::positive;
use crate::{Amplitudes, Discretisation, Error, Jones, Medium, Profile, Resolution, check_size};
use std::f64::consts::TAU;

/// Largest violation that [`solve_orders`] accepts: of power balance, as a fraction of the incident power, and of
/// reciprocity, as an amplitude. It is far below what a picture shows; smaller values need more nodes.
pub const CHECK_TOLERANCE: f64 = 5e-4;

/// Smallest accepted cosine of incidence. At smaller cosines, efficiencies are ratios of two vanishing powers.
pub(crate) const COSINE_MIN: f64 = 1e-7;

/// Largest accepted deviation of a direction's length from 1, above the rounding of single precision.
const LENGTH_TOLERANCE: f64 = 1e-6;

/// Time for each element of the matrices S and K (`layers.rs`), in seconds; measured on one core.
const SECONDS_PER_ELEMENT: f64 = 1.5e-6;

/// Time of factorisations and matrix products divided by the cube of the number of nodes, in seconds; measured on one
/// core.
const SECONDS_PER_CUBED_NODES: f64 = 5e-9;

/// One propagating order.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Index m. In air, `direction.x = −wi.x + m·λ/period`; [`solve_both_sides`](crate::solve_both_sides) has the
    /// relation for orders in a medium.
    pub index: i32,
    /// Unit vector away from the surface.
    pub direction: [f64; 3],
    /// Jones matrix from the [`transverse_basis`] of the incident light to that of the order, `jones[out][in]`; |·|² is
    /// a fraction of the incident power.
    pub jones: Jones,
}

impl Order {
    /// Efficiency for incident light whose magnetic field has no component along the grooves. It is the efficiency in
    /// TE polarisation where the plane of incidence is perpendicular to the grooves.
    pub fn te(&self) -> f64 {
        self.jones[0][0].norm_sqr() + self.jones[1][0].norm_sqr()
    }

    /// Efficiency for incident light whose electric field has no component along the grooves. It is the efficiency in
    /// TM polarisation where the plane of incidence is perpendicular to the grooves.
    pub fn tm(&self) -> f64 {
        self.jones[0][1].norm_sqr() + self.jones[1][1].norm_sqr()
    }

    /// Efficiency for unpolarised light.
    pub fn efficiency(&self) -> f64 {
        0.5 * (self.te() + self.tm())
    }
}

/// All propagating orders for light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Orders {
    /// Orders by ascending index.
    pub orders: Vec<Order>,
    /// Fractions of the incident power that cross into the lower medium, for light in the states of [`Order::te`] and
    /// of [`Order::tm`]: absorbed by a metal, transmitted into a dielectric.
    pub absorbed: [f64; 2],
    /// Nodes on one period with which the checks passed.
    pub nodes: usize,
    /// [`Amplitudes::balance_error`] of the solution.
    pub balance_error: f64,
    /// [`Amplitudes::reciprocity_error`] of the solution.
    pub reciprocity_error: f64,
}

/// Estimated cost of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Nodes on one period at the first attempt.
    pub nodes: usize,
    /// Time of one solution, at a single direction, on one core in seconds; accurate within a factor of about two.
    pub seconds: f64,
}

impl Estimate {
    /// The cost for a profile above a medium at a wavelength (nm). Nothing is solved, and sizes beyond the solver's
    /// limits are not refused; see [`check_size`].
    ///
    /// ```
    /// use sunbeam_rigorous::{Estimate, Medium, Profile};
    ///
    /// let estimate = Estimate::new(&Profile::blazed(1.2, 0.1)?, &Medium::Perfect, 550.0)?;
    /// assert!(estimate.nodes >= 64 && estimate.seconds < 1.0);
    /// # Ok::<(), sunbeam_rigorous::Error>(())
    /// ```
    ///
    /// # Errors
    /// A wavelength that is not finite and positive.
    pub fn new(profile: &Profile, medium: &Medium, wavelength_nm: f64) -> Result<Self, Error> {
        let nodes = Resolution::new(profile, medium, wavelength_nm)?.nodes;
        let n = nodes as f64;
        Ok(Self { nodes, seconds: SECONDS_PER_ELEMENT * n * n + SECONDS_PER_CUBED_NODES * n * n * n })
    }
}

/// All propagating orders for light of a wavelength (nm) from the unit vector `wi`.
///
/// `wi` points away from the surface, towards the light. x is across the grooves, y along them, z up. Power balance and
/// reciprocity are checked to [`CHECK_TOLERANCE`]. Where a check fails, the problem is solved again with twice the
/// nodes.
///
/// # Errors
/// - [`Error::OutOfRange`]: a direction at or below the horizon or not of unit length, a wavelength that is not finite
///   and positive.
/// - [`Error::TooManyWaves`], [`Error::TooLarge`]: a problem that is too large.
/// - [`Error::NotFinite`]: fields that are not finite.
/// - [`Error::Unresolved`]: a check that still fails where twice the nodes would be more than 2048.
pub fn solve_orders(profile: &Profile, medium: &Medium, wavelength_nm: f64, wi: [f64; 3]) -> Result<Orders, Error> {
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    check_length(wi)?;
    if wi[2] < COSINE_MIN {
        return Err(Error::OutOfRange { quantity: "z of wi", found: wi[2], accepted: "1e-7 to 1, above the horizon" });
    }
    let period = profile.period_um();
    // κ is the wave number in the xz plane. κ/k = √(1 − wi.y²), computed from x and z, keeps its digits for light along
    // the grooves.
    let kappa_over_k = wi[0].hypot(wi[2]);
    // t = κd/2π, and the Bloch phase is b = α₀d/2π turns. The light travels along −wi, so its wave number along x is
    // α₀ = −k·wi.x.
    let (t, b) = (kappa_over_k * k * period / TAU, -wi[0] * k * period / TAU);
    // |wi.y| may exceed 1 by the tolerance of the length.
    check_size(profile, medium, wavelength_nm, wi[1].abs().min(1.0))?;
    let resolution = Resolution::new(profile, medium, wavelength_nm)?;
    let (forward, nodes, [balance_error, reciprocity_error]) = on_sufficient_nodes(profile, resolution, |mesh| {
        // The amplitudes at −b, those of the reversed paths, serve the check of reciprocity alone.
        let forward = mesh.air(t, b)?.solve(medium, wavelength_nm)?;
        let reversed = mesh.air(t, -b)?.solve(medium, wavelength_nm)?;
        let errors = [forward.balance_error(), forward.reciprocity_error(&reversed)];
        Ok((forward, errors))
    })?;
    // The light is incident in order 0.
    let absorbed = forward.absorbed(0);
    Ok(Orders { orders: orders_of(&forward, k, wi[1]), absorbed, nodes, balance_error, reciprocity_error })
}

/// The solution on sufficient nodes, the number of nodes, and the solution's errors of power balance and of
/// reciprocity.
///
/// `solve` returns a solution with both errors. The nodes of `resolution` are doubled until both errors are at most
/// [`CHECK_TOLERANCE`].
///
/// # Errors
/// [`Error::Unresolved`] where more than 2048 nodes would be needed, and the errors of `solve`.
pub(crate) fn on_sufficient_nodes<T>(
    profile: &Profile,
    mut resolution: Resolution,
    solve: impl Fn(&Discretisation) -> Result<(T, [f64; 2]), Error>,
) -> Result<(T, usize, [f64; 2]), Error> {
    loop {
        let mesh = Discretisation::new(profile, resolution)?;
        let (solution, errors) = solve(&mesh)?;
        let nodes = mesh.nodes();
        // An error that is NaN fails the comparison.
        if errors.iter().all(|&error| error <= CHECK_TOLERANCE) {
            return Ok((solution, nodes, errors));
        }
        resolution.nodes *= 2;
        if resolution.nodes > NODES_MAX {
            let [balance, reciprocity] = errors;
            return Err(Error::Unresolved { nodes, balance, reciprocity, tolerance: CHECK_TOLERANCE });
        }
    }
}

/// Lists the orders for light incident in order 0 with the wave number ky = −k·`wi_y` along y; k in rad/µm.
///
/// `amplitudes` were solved for ky = k·|`wi_y`|. For a negative ky the Jones matrices follow by reflection.
fn orders_of(amplitudes: &Amplitudes, k: f64, wi_y: f64) -> Vec<Order> {
    let orders = amplitudes.orders().iter().zip(amplitudes.alpha_per_um()).zip(amplitudes.beta_per_um());
    orders
        .map(|((&index, alpha), beta)| {
            let jones = flipped(amplitudes.jones(index, 0), wi_y);
            Order { index, direction: [alpha / k, -wi_y, beta / k], jones }
        })
        .collect()
}

/// Refuses a direction whose length is not 1.
///
/// # Errors
/// [`Error::OutOfRange`] with the length.
pub(crate) fn check_length(wi: [f64; 3]) -> Result<(), Error> {
    let length = wi.iter().map(|c| c * c).sum::<f64>().sqrt();
    if (1.0 - LENGTH_TOLERANCE..=1.0 + LENGTH_TOLERANCE).contains(&length) {
        return Ok(());
    }
    Err(Error::OutOfRange { quantity: "length of wi", found: length, accepted: "1" })
}

/// Jones matrix for light from a direction with the y component `wi_y`, given the Jones matrix for the same |ky| and
/// ky ≥ 0.
///
/// Elements are named by the outgoing and the incident state: e has Ey, h has Hy. Light from `wi_y` > 0 has ky < 0. The
/// mirror image y → −y reverses the sign of Ey but not of Hy, so the two elements that mix the states change their
/// signs.
pub(crate) fn flipped([[ee, eh], [he, hh]]: Jones, wi_y: f64) -> Jones {
    if wi_y > 0.0 { [[ee, -eh], [-he, hh]] } else { [[ee, eh], [he, hh]] }
}

/// Unit electric vectors of the two polarisation states of a wave that travels along the unit vector `d`, which is not
/// ±y.
///
/// The first belongs to the state without Hy: `(ŷ − (ŷ·d)d)/|ŷ − (ŷ·d)d|`. The second belongs to the state without Ey:
/// `first × d`. Light from the direction wi travels along −wi.
///
/// ```
/// // Straight down: E along y, and E along −x.
/// assert_eq!(sunbeam_rigorous::transverse_basis([0.0, 0.0, -1.0]), [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
/// ```
pub fn transverse_basis(d: [f64; 3]) -> [[f64; 3]; 2] {
    // √(1 − d.y²), the length of ŷ − (ŷ·d)d.
    let across = d[0].hypot(d[2]);
    let first = [-d[1] * d[0] / across, across, -d[1] * d[2] / across];
    let second = [d[2] / across, 0.0, -d[0] / across];
    [first, second]
}
