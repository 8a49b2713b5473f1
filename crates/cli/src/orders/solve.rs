//! The orders for one direction and wavelength.

use serde::Serialize;
use sunbeam::config::{BuildError, SurfaceConfig, Theory};
use sunbeam::grating::{GratingError, Medium, check_size, solve_orders};
use sunbeam::scattering::{Pair, Vec3};
use sunbeam::transform::OrderTransform;

/// Light from a direction.
pub struct Asked {
    pub theta_i_deg: f64,
    pub phi_i_deg: f64,
    pub wavelength_nm: f64,
}

impl Asked {
    fn wi(&self) -> Vec3 {
        let (theta, phi) = (self.theta_i_deg.to_radians(), self.phi_i_deg.to_radians());
        [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
    }
}

/// The orders of a grating and where its light goes besides.
#[derive(Serialize)]
pub struct Solved {
    pub theory: &'static str,
    pub period_um: f64,
    pub wavelength_nm: f64,
    pub wi: Vec3,
    pub orders: Vec<Order>,
    /// Share of te and of tm light that crosses into the material.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed: Option<[f64; 2]>,
    /// By how much the shares of light differ from 1 in all, the worst of all incident orders.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balance_error: Option<f64>,
    /// By how much amplitudes differ from those of the reversed paths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reciprocity_error: Option<f64>,
}

/// One order that leaves.
#[derive(Serialize)]
pub struct Order {
    pub order: i32,
    pub theta_deg: f64,
    pub phi_deg: f64,
    pub direction: Vec3,
    pub te: Option<f64>,
    pub tm: Option<f64>,
    /// Share of unpolarised light.
    pub mean: f64,
    /// Real and imaginary parts, `[what leaves][what comes in]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jones: Option<[[[f64; 2]; 2]; 2]>,
}

impl Solved {
    /// Of the relief of a configuration.
    pub fn new(config: &SurfaceConfig, asked: &Asked) -> Result<Self, BuildError> {
        match config.theory {
            Theory::Rigorous => Self::rigorous(config, asked.wi(), asked.wavelength_nm),
            Theory::Scalar => Self::scalar(config, asked.wi(), asked.wavelength_nm),
        }
    }

    /// Refuses what the solver does not serve, without solving.
    pub fn check(config: &SurfaceConfig, asked: &Asked) -> Result<(), BuildError> {
        if config.theory == Theory::Rigorous {
            let (profile, along) = (config.profile()?, asked.wi()[1].abs());
            check_size(&profile, &medium(config)?, asked.wavelength_nm, along).map_err(GratingError::from)?;
        }
        Ok(())
    }

    fn rigorous(config: &SurfaceConfig, wi: Vec3, wavelength_nm: f64) -> Result<Self, BuildError> {
        let (profile, medium) = (config.profile()?, medium(config)?);
        let solved = solve_orders(&profile, &medium, wavelength_nm, wi).map_err(GratingError::from)?;
        let orders = solved.orders.iter().map(|order| {
            let jones = order.jones.map(|row| row.map(|amplitude| [amplitude.re, amplitude.im]));
            let (te, tm) = (Some(order.te()), Some(order.tm()));
            Order { te, tm, jones: Some(jones), ..Order::bare(order.index, order.direction, order.efficiency()) }
        });
        Ok(Self {
            theory: Theory::Rigorous.name(),
            period_um: profile.period_um(),
            wavelength_nm,
            wi,
            orders: orders.collect(),
            absorbed: Some(solved.absorbed),
            balance_error: Some(solved.balance_error),
            reciprocity_error: Some(solved.reciprocity_error),
        })
    }

    /// `R·O·M·|c_m|²` of the orders that leave (docs/model.md#the-reflectance).
    fn scalar(config: &SurfaceConfig, wi: Vec3, wavelength_nm: f64) -> Result<Self, BuildError> {
        // Refuses reliefs that vary along y.
        config.profile()?;
        let field = config.height_field()?;
        let (transform, options) = (OrderTransform::new(&field), config.options());
        let (period_um, wavelength_um) = (field.extent_um().0, wavelength_nm * 1e-3);
        let step = wavelength_um / period_um;
        let (first, last) = (((wi[0] - 1.0) / step).ceil() as i32, ((wi[0] + 1.0) / step).floor() as i32);
        let bins = transform.size().0 as i32;
        let mut orders = Vec::new();
        for m in first..=last {
            let (x, y) = (f64::from(m) * step - wi[0], -wi[1]);
            let squared = 1.0 - x * x - y * y;
            if squared <= 0.0 || 2 * m.abs() >= bins.max(2) {
                continue;
            }
            let wo = [x, y, squared.sqrt()];
            let Some(pair) = Pair::new(wi, wo) else { continue };
            let amplitude = transform.amplitudes(pair.kappa(wavelength_um))[m.rem_euclid(bins) as usize];
            let factor = pair.interface(config.index(), options.obliquity) * options.angular_factor(&pair);
            orders.push(Order::bare(m, wo, factor * amplitude.norm_sqr()));
        }
        Ok(Self {
            theory: Theory::Scalar.name(),
            period_um,
            wavelength_nm,
            wi,
            orders,
            absorbed: None,
            balance_error: None,
            reciprocity_error: None,
        })
    }
}

/// The medium below the relief.
fn medium(config: &SurfaceConfig) -> Result<Medium, GratingError> {
    let Some(index) = config.index() else { return Ok(Medium::Perfect) };
    Ok(Medium::index(index.eta, index.k)?)
}

impl Order {
    fn bare(order: i32, direction: Vec3, mean: f64) -> Self {
        // No negative zeros.
        let direction @ [x, y, z] = direction.map(|component| component + 0.0);
        let (theta_deg, phi_deg) = (x.hypot(y).atan2(z).to_degrees(), y.atan2(x).to_degrees());
        Self { order, theta_deg, phi_deg, direction, te: None, tm: None, mean, jones: None }
    }
}
