//! The orders on both sides of a body that transmits, for one incidence, by either theory.
//!
//! The relief varies along x alone, and its grooves are along y. The body is an interface to a medium, or a film of the
//! medium with a flat lower side. An order below a film either passes the flat side, or is reflected there totally and
//! stays trapped. The magnetic field of TE light has no component along y, nor has the electric field of TM light.

use super::screen::Screen;
use super::solve::{Order, Side, SolvedOrders};
use sunbeam::config::{BuildError, SurfaceConfig, Theory};
use sunbeam::grating::{GratingError, solve_both_sides};
use sunbeam::scattering::{BodyOrder, TransparentBody, Vec3};

/// Solves the orders by the configuration's theory.
pub(super) fn solve(
    config: &SurfaceConfig,
    body: TransparentBody,
    wi: Vec3,
    wavelength_nm: f64,
) -> Result<SolvedOrders, BuildError> {
    match config.theory {
        Theory::Rigorous => rigorous(config, body, wi, wavelength_nm),
        Theory::Scalar => scalar(config, body, wi, wavelength_nm),
    }
}

/// The orders by Maxwell's equations.
fn rigorous(
    config: &SurfaceConfig,
    body: TransparentBody,
    wi: Vec3,
    wavelength_nm: f64,
) -> Result<SolvedOrders, BuildError> {
    let profile = config.profile()?;
    let solved = solve_both_sides(&profile, body.eta, wavelength_nm, wi).map_err(GratingError::from)?;
    let above = solved.above.iter().map(|order| Order::with_jones(Side::Above, order));
    let below = solved.below.iter().map(|order| {
        if !body.is_film {
            return Order::with_jones(Side::Below, order);
        }
        match order.through_flat_side(body.eta) {
            Some(passed) => Order::with_jones(Side::Below, &passed),
            None => Order::with_jones(Side::Trapped, order),
        }
    });
    let orders: Vec<Order> = above.chain(below).collect();
    // Fraction of the TE or TM light that no order carries, such as the partial reflection at a film's flat side. It is
    // at least 0, although the sum of the orders may exceed 1 by the error of the balance.
    let uncarried = |state: fn(&Order) -> Option<f64>| (1.0 - orders.iter().filter_map(state).sum::<f64>()).max(0.0);
    Ok(SolvedOrders {
        theory: Theory::Rigorous.name(),
        period_um: profile.period_um(),
        wavelength_nm,
        wi,
        absorbed: Some([uncarried(|order| order.te), uncarried(|order| order.tm)]),
        orders,
        balance_error: Some(solved.balance_error),
        reciprocity_error: Some(solved.reciprocity_error),
    })
}

/// The efficiencies `F·|c_m|²` of the propagating orders m: c_m is the amplitude of the phase screen (`screen.rs`), F
/// the factor of docs/model.md#bodies-that-transmit. F depends on the polarisation; [`BodyOrder`] has its values.
fn scalar(
    config: &SurfaceConfig,
    body: TransparentBody,
    wi: Vec3,
    wavelength_nm: f64,
) -> Result<SolvedOrders, BuildError> {
    let screen = Screen::new(config, wavelength_nm)?;
    // The body that trapped orders cross: they do not pass the flat side of a film.
    let without_flat_side = TransparentBody { is_film: false, ..body };
    let mut orders = Vec::new();
    for is_below in [false, true] {
        // Index of the medium on this side of the relief.
        let side_index = if is_below { body.eta } else { 1.0 };
        // x and y are tangential components of wave vectors, in units of the vacuum wave number.
        for (m, [x, y]) in screen.orders(wi, side_index) {
            let tangential_squared = x * x + y * y;
            if tangential_squared >= side_index * side_index {
                // The order is evanescent.
                continue;
            }
            // The side of the order, the body that it crosses, and the index of the medium of its direction. Below a
            // film, orders with a tangential component below 1 pass the flat side into air; the others are reflected.
            let (side, crossed_body, index) = match (is_below, body.is_film) {
                (false, _) => (Side::Above, body, 1.0),
                (true, true) if tangential_squared < 1.0 => (Side::Below, body, 1.0),
                (true, true) => (Side::Trapped, without_flat_side, side_index),
                (true, false) => (Side::Below, body, side_index),
            };
            let z = (index * index - tangential_squared).sqrt();
            let wo = [x, y, if is_below { -z } else { z }].map(|component| component / index);
            let pair = BodyOrder::new(crossed_body, wi, wo);
            // The amplitude's number: m, or −m where the pair reverses its scattering vector so that it points up.
            let number = screen.number(pair.tangential[0]);
            let power = screen.power(number, pair.kappa(screen.wavelength_um));
            let [te, tm] = te_tm(&pair, wi, x).map_or([None; 2], |factors| factors.map(|factor| Some(factor * power)));
            orders.push(Order { te, tm, ..Order::with_mean(side, m, wo, pair.unpolarised() * power) });
        }
    }
    Ok(SolvedOrders::of_scalar_theory(screen.period_um, wavelength_nm, wi, orders))
}

/// The factors on `|c_m|²` for TE and TM light, of an order with the tangential component `x` in vacuum wave numbers.
///
/// They are known only where the plane of incidence is perpendicular to the grooves. There TE and TM are the states s
/// and p of incident and outgoing light, and light keeps its state.
fn te_tm(pair: &BodyOrder, wi: Vec3, x: f64) -> Option<[f64; 2]> {
    /// Largest direction cosine along the grooves that counts as zero. At an azimuth of 180° it is 1e-16 by rounding.
    const ACROSS: f64 = 1e-12;
    if wi[1].abs() > ACROSS {
        return None;
    }
    // The first letter is the outgoing state, the second the incident one. One direction may be the normal, along which
    // the names s and p are arbitrary. So the states of the direction with the larger tangential component decide which
    // light is TE, and the powers are summed over the states of the other direction.
    let [ss, sp, ps, pp] = pair.powers;
    Some(if x.abs() > wi[0].abs() { [ss + sp, ps + pp] } else { [ss + ps, sp + pp] })
}
