//! Mean albedos before and after division.

use super::integral::AlbedoIntegral;
use super::nodes::unit_point;
use super::{AlbedoTable, AlbedoView, Real4};
use crate::numeric::{Lanes, Numbers, Real, Values};
use crate::scattering::{Reading, Vec3};
use crate::table::{Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Number of incident directions and wavelengths over which the means are taken. Chosen: with eight times as many, the
/// means of the presets change by at most 0.002.
const QUERIES: usize = 2000;

/// Albedos before and after division by an [`AlbedoTable`], at the relief's own size and without the Fresnel
/// reflectance.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// Mean albedo before division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_unscaled: f64,
    /// Mean albedo after division, over wavelengths and over incident directions weighted by cosθ.
    pub albedo_mean_scaled: f64,
}

/// Albedos of a direction at a wavelength in nm, before and after division by a table at the relief's own size; equal
/// without a table.
pub(crate) fn integrated_albedos(
    integral: &AlbedoIntegral,
    table: Option<&AlbedoTable>,
    wi: Vec3,
    nm: f64,
) -> [f64; 2] {
    let view = table.map(|table| AlbedoView::<Lanes> { layout: table.layout, words: &table.words });
    let divided = view.as_ref().map(|view| (view, view.place(wi.map(Real4::lit))));
    let reading = Reading::at(Real4::lit(nm));
    let (mut before, mut after) = (Real4::lit(0.0), Real4::lit(0.0));
    integral.visit::<Lanes>(wi, [nm; 2], |wo, part| {
        before += part;
        after += match &divided {
            None => part,
            Some((view, place)) => part * view.factor_at(place, &view.place(wo), &reading, Lanes::mask(true)),
        };
    });
    [before, after].map(Lanes::total)
}

impl AlbedoReport {
    /// Integrates the albedo at [`QUERIES`] incident directions and wavelengths.
    pub(super) fn new(integral: &AlbedoIntegral, table: &AlbedoTable, progress: &Progress) -> Self {
        let steps = progress.of_steps(QUERIES);
        let albedos = |k: usize| {
            steps.one();
            // cosθ is uniform, so that the weight 2·cosθ offsets the pole 1/cosθ of the albedo at the horizon.
            let [cos, turn, z] = unit_point(k);
            let (sin, (sin_phi, cos_phi)) = ((1.0 - cos * cos).sqrt(), (TAU * turn).sin_cos());
            let wi = [sin * cos_phi, sin * sin_phi, cos];
            let nm = WAVELENGTH_MIN_NM + (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) * z;
            // The weights 2·cosθ have the mean 1.
            integrated_albedos(integral, Some(table), wi, nm).map(|albedo| 2.0 * cos * albedo)
        };
        let albedos: Vec<_> = (0..QUERIES).into_par_iter().map(albedos).collect();
        let [before, after] = [0, 1].map(|i| albedos.iter().map(|pair| pair[i]).sum::<f64>() / QUERIES as f64);
        Self { albedo_mean_unscaled: before, albedo_mean_scaled: after }
    }
}
