//! The orders of a grating for one incidence, by either theory.
//!
//! The relief varies along x, across the grooves; y is along them. The magnetic field H of TE light has no component
//! Hy, the electric field E of TM light no component Ey. An *efficiency* is the fraction of the incident power in an
//! order.
//!
//! Surfaces that only reflect are solved here, bodies that transmit in `both_sides`. Both fill [`SolvedOrders`].

use super::both_sides;
use super::screen::Screen;
use crate::arguments::direction_from_degrees;
use serde::Serialize;
use sunbeam::config::{BuildError, SurfaceConfig, Theory};
use sunbeam::grating::{GratingError, Medium, check_size, solve_orders};
use sunbeam::scattering::{Pair, Vec3};

/// The direction and the wavelength of the light.
pub(super) struct Incidence {
    /// Angle with the normal, in [0, 90).
    pub(super) theta_i_deg: f64,
    /// Azimuth from +x, which is across the grooves, towards +y.
    pub(super) phi_i_deg: f64,
    /// Wavelength in air.
    pub(super) wavelength_nm: f64,
}

impl Incidence {
    /// Unit vector towards the light.
    fn wi(&self) -> Vec3 {
        direction_from_degrees(self.theta_i_deg, self.phi_i_deg)
    }
}

/// The orders of a grating, and the light that is not in them. The scalar theory has only the orders.
#[derive(Serialize)]
pub(super) struct SolvedOrders {
    /// Name of the theory.
    pub(super) theory: &'static str,
    /// Period of the grating.
    pub(super) period_um: f64,
    /// Wavelength of the incidence.
    pub(super) wavelength_nm: f64,
    /// Unit vector towards the light.
    pub(super) wi: Vec3,
    /// The orders that propagate: those above the relief by ascending number, then those below.
    pub(super) orders: Vec<Order>,
    /// Fractions of the TE and of the TM light that are in none of the orders. The material absorbs or, if it is clear,
    /// transmits them; or the flat side of a film reflects them. `None` by the scalar theory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) absorbed: Option<[f64; 2]>,
    /// Largest deviation from 1 of the sum of all fractions, for light from the direction of any order; `None` by the
    /// scalar theory, as is the next field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) balance_error: Option<f64>,
    /// Largest difference between the amplitude of a path and that of the reversed path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reciprocity_error: Option<f64>,
}

/// Side of the relief on which an order leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Side {
    /// Reflected.
    Above,
    /// Transmitted: into the medium of an interface, or into the air behind a film.
    Below,
    /// In the medium of a film, whose flat side reflects it totally.
    Trapped,
}

impl Side {
    /// The name in tables and plots.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Above => "above",
            Self::Below => "below",
            Self::Trapped => "trapped",
        }
    }
}

/// An order that propagates.
#[derive(Serialize)]
pub(super) struct Order {
    /// The side of the relief.
    pub(super) side: Side,
    /// The number m of the order.
    pub(super) order: i32,
    /// Angle of `direction` with the normal.
    pub(super) theta_deg: f64,
    /// Azimuth of `direction` from +x towards +y.
    pub(super) phi_deg: f64,
    /// Unit vector along which the order leaves.
    pub(super) direction: Vec3,
    /// Efficiency for TE light, whose magnetic field has no component along the grooves. By the scalar theory it is
    /// known only for bodies that transmit, with the plane of incidence perpendicular to the grooves, else `None`.
    pub(super) te: Option<f64>,
    /// Efficiency for TM light, whose electric field has no component along the grooves; `None` as in `te`.
    pub(super) tm: Option<f64>,
    /// Efficiency for unpolarised light.
    pub(super) mean: f64,
    /// Real and imaginary parts of the Jones matrix, `[outgoing][incident][part]`; `None` by the scalar theory. Of
    /// outgoing and of incident light, the first state is TE and the second TM.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) jones: Option<[[[f64; 2]; 2]; 2]>,
}

impl SolvedOrders {
    /// Solves the orders of a configuration by its theory.
    pub(super) fn new(config: &SurfaceConfig, incidence: &Incidence) -> Result<Self, BuildError> {
        if let Some(body) = config.body() {
            return both_sides::solve(config, body, incidence.wi(), incidence.wavelength_nm);
        }
        // Refuses a cover, a flat clear layer over the relief: neither solution here has one.
        config.require_bare("the orders")?;
        match config.theory {
            Theory::Rigorous => Self::rigorous(config, incidence.wi(), incidence.wavelength_nm),
            Theory::Scalar => Self::scalar(config, incidence.wi(), incidence.wavelength_nm),
        }
    }

    /// Refuses a grating that is too large for the solver of Maxwell's equations, without solving it.
    pub(super) fn check(config: &SurfaceConfig, incidence: &Incidence) -> Result<(), BuildError> {
        if config.theory == Theory::Rigorous {
            let cosine_along_grooves = incidence.wi()[1].abs();
            check_size(&config.profile()?, &medium_below(config)?, incidence.wavelength_nm, cosine_along_grooves)
                .map_err(GratingError::from)?;
        }
        Ok(())
    }

    /// The orders by Maxwell's equations.
    fn rigorous(config: &SurfaceConfig, wi: Vec3, wavelength_nm: f64) -> Result<Self, BuildError> {
        let (profile, medium) = (config.profile()?, medium_below(config)?);
        let solved = solve_orders(&profile, &medium, wavelength_nm, wi).map_err(GratingError::from)?;
        Ok(Self {
            theory: Theory::Rigorous.name(),
            period_um: profile.period_um(),
            wavelength_nm,
            wi,
            orders: solved.orders.iter().map(|order| Order::with_jones(Side::Above, order)).collect(),
            absorbed: Some(solved.absorbed),
            balance_error: Some(solved.balance_error),
            reciprocity_error: Some(solved.reciprocity_error),
        })
    }

    /// The efficiencies `R·O·M·|c_m|²` of the propagating orders m (docs/model.md#the-reflectance).
    ///
    /// R is the Fresnel factor, O the obliquity factor, M the shadowing factor, c_m the order's amplitude. With the
    /// obliquity `small_slope`, the small-slope factor Q replaces `R·O`.
    fn scalar(config: &SurfaceConfig, wi: Vec3, wavelength_nm: f64) -> Result<Self, BuildError> {
        let (screen, options) = (Screen::new(config, wavelength_nm)?, config.options());
        let mut orders = Vec::new();
        // Reflected orders leave in air, of index 1.
        for (m, [x, y]) in screen.orders(wi, 1.0) {
            let z_squared = 1.0 - x * x - y * y;
            if z_squared <= 0.0 {
                // The order is evanescent.
                continue;
            }
            let wo = [x, y, z_squared.sqrt()];
            // Both directions are above the surface, so there always is a pair.
            let Some(pair) = Pair::new(wi, wo) else { continue };
            let power = screen.power(m, pair.kappa(screen.wavelength_um));
            // R or Q, times O·M.
            let factor = pair.interface(config.index(), options.obliquity) * options.angular_factor(&pair);
            orders.push(Order::with_mean(Side::Above, m, wo, factor * power));
        }
        Ok(Self::of_scalar_theory(screen.period_um, wavelength_nm, wi, orders))
    }

    /// Orders by the scalar theory, which knows neither an absorbed fraction nor errors of a solution.
    pub(super) fn of_scalar_theory(period_um: f64, wavelength_nm: f64, wi: Vec3, orders: Vec<Order>) -> Self {
        Self {
            theory: Theory::Scalar.name(),
            period_um,
            wavelength_nm,
            wi,
            orders,
            absorbed: None,
            balance_error: None,
            reciprocity_error: None,
        }
    }
}

/// The medium below the relief; without a refractive index a perfect conductor.
fn medium_below(config: &SurfaceConfig) -> Result<Medium, GratingError> {
    let Some(index) = config.index() else { return Ok(Medium::Perfect) };
    Ok(Medium::index(index.eta, index.k)?)
}

impl Order {
    /// An order that the solver of Maxwell's equations returns.
    pub(super) fn with_jones(side: Side, order: &sunbeam::grating::Order) -> Self {
        let jones = order.jones.map(|row| row.map(|amplitude| [amplitude.re, amplitude.im]));
        let (te, tm) = (Some(order.te()), Some(order.tm()));
        let unpolarised = Self::with_mean(side, order.index, order.direction, order.efficiency());
        Self { te, tm, jones: Some(jones), ..unpolarised }
    }

    /// Order number `order`, which leaves in `direction` with the efficiency `mean`, without values by polarisation.
    pub(super) fn with_mean(side: Side, order: i32, direction: Vec3, mean: f64) -> Self {
        // The addition turns a negative zero into a positive one. Otherwise `atan2` would give an azimuth of −180° or
        // −0° for directions in the xz plane.
        let direction @ [x, y, z] = direction.map(|component| component + 0.0);
        let (theta_deg, phi_deg) = (x.hypot(y).atan2(z).to_degrees(), y.atan2(x).to_degrees());
        Self { side, order, theta_deg, phi_deg, direction, te: None, tm: None, mean, jones: None }
    }
}
