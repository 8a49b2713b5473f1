//! The orders on both sides of a body that transmits, for one incidence, by either theory.

use super::solve::{Order, Side, SolvedOrders};
use sunbeam::config::{BuildError, SurfaceConfig, Theory};
use sunbeam::grating::{GratingError, solve_both_sides};
use sunbeam::scattering::{BodyOrder, TransparentBody, Vec3};
use sunbeam::transform::OrderTransform;

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
    let below = solved.below.iter().map(|order| match order.through_flat_side(body.eta) {
        _ if !body.is_film => Order::with_jones(Side::Below, order),
        Some(passed) => Order::with_jones(Side::Below, &passed),
        None => Order::with_jones(Side::Trapped, order),
    });
    let orders: Vec<Order> = above.chain(below).collect();
    // Fraction of the light in one state that no order carries.
    let left = |fraction: fn(&Order) -> Option<f64>| (1.0 - orders.iter().filter_map(fraction).sum::<f64>()).max(0.0);
    Ok(SolvedOrders {
        theory: Theory::Rigorous.name(),
        period_um: profile.period_um(),
        wavelength_nm,
        wi,
        absorbed: Some([left(|order| order.te), left(|order| order.tm)]),
        orders,
        balance_error: Some(solved.balance_error),
        reciprocity_error: Some(solved.reciprocity_error),
    })
}

/// The efficiencies `F·|c_m|²` of the propagating orders m, with the factor F of docs/model.md#bodies-that-transmit.
///
/// TE and TM are known where the plane of incidence is perpendicular to the grooves: there they are the states s and p
/// of incident and outgoing light, and light keeps its state.
fn scalar(
    config: &SurfaceConfig,
    body: TransparentBody,
    wi: Vec3,
    wavelength_nm: f64,
) -> Result<SolvedOrders, BuildError> {
    // An error for reliefs that vary along y.
    config.profile()?;
    let field = config.height_field()?;
    let transform = OrderTransform::new(&field);
    let (period_um, wavelength_um) = (field.extent_um().0, wavelength_nm * 1e-3);
    // The grating equation, with directions times the index of their medium: wi.x + wo.x = m·step, wi.y + wo.y = 0.
    let step = wavelength_um / period_um;
    let bins = transform.size().0 as i32;
    // The body for trapped orders, which do not pass the flat side of a film.
    let inside = TransparentBody { is_film: false, ..body };
    let mut orders = Vec::new();
    for is_below in [false, true] {
        // Index of the medium on this side of the relief.
        let index = if is_below { body.eta } else { 1.0 };
        let (first, last) = (((wi[0] - index) / step).ceil() as i32, ((wi[0] + index) / step).floor() as i32);
        for m in first..=last {
            let (x, y) = (f64::from(m) * step - wi[0], -wi[1]);
            let tangential_squared = x * x + y * y;
            // The pixels resolve orders below half of their number; a single pixel has order 0.
            let is_resolved = 2 * m.abs() < bins.max(2);
            if tangential_squared >= index * index || !is_resolved {
                continue;
            }
            // The side of the order, the body that it passes, and the index of the medium of its direction.
            let (side, body, index) = match (is_below, body.is_film) {
                (false, _) => (Side::Above, body, 1.0),
                (true, true) if tangential_squared < 1.0 => (Side::Below, body, 1.0),
                (true, true) => (Side::Trapped, inside, index),
                (true, false) => (Side::Below, body, index),
            };
            let z = (index * index - tangential_squared).sqrt();
            let wo = [x, y, if is_below { -z } else { z }].map(|component| component / index);
            let pair = BodyOrder::new(body, wi, wo);
            // Order m of the pair's scattering vector, or −m where the pair reverses this vector so that it points up.
            let bin = (pair.tangential[0] / step).round() as i32;
            // The first row of the transform has the orders along x, negative ones in its upper half.
            let amplitude = transform.amplitudes(pair.kappa(wavelength_um))[bin.rem_euclid(bins) as usize];
            let power = amplitude.norm_sqr();
            // Outgoing state first. For a direction along the normal the names s and p are arbitrary, so powers are
            // summed over them. The states of the direction farther from the normal are TE and TM.
            let [ss, sp, ps, pp] = pair.powers;
            let [te, tm] = if x.abs() > wi[0].abs() { [ss + sp, ps + pp] } else { [ss + ps, sp + pp] };
            let [te, tm] = [te, tm].map(|factor| (wi[1] == 0.0).then_some(factor * power));
            orders.push(Order { te, tm, ..Order::with_mean(side, m, wo, pair.unpolarised() * power) });
        }
    }
    Ok(SolvedOrders::of_scalar_theory(period_um, wavelength_nm, wi, orders))
}
