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
    // In double precision, since the accurate integral of a large tile has very many parts.
    let (mut before, mut after) = (0.0, 0.0);
    integral.visit::<Lanes>(wi, [nm; 2], |wo, part| {
        before += Lanes::total(part);
        after += Lanes::total(match &divided {
            None => part,
            Some((view, place)) => part * view.factor_at(place, &view.place(wo), &reading, Lanes::mask(true)),
        });
    });
    [before, after]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::Preset;
    use crate::numeric::Plain;
    use crate::scattering::{Options, build_table};

    /// Summed in single precision, the albedo of this tile is too small by 4e-4.
    #[test]
    fn albedos_of_large_tiles_are_summed_in_double_precision() {
        // Rounding of directions and factors to single precision.
        const SINGLE: f64 = 1e-5;
        let options = Options::default();
        let field = Preset::Xenopeltis.build(None, None).unwrap();
        let table = build_table(&field, &options, &Progress::none()).unwrap().table;
        let integral = AlbedoIntegral::accurate(&table, &options).unwrap();
        let (wi, nm) = ([0.6, 0.0, 0.8], 550.0);
        let mut exact = 0.0;
        integral.visit::<Plain<f64>>(wi, [nm; 2], |_, part| exact += part);
        let [albedo, divided] = integrated_albedos(&integral, None, wi, nm);
        assert!((albedo / exact - 1.0).abs() < SINGLE && divided == albedo, "{albedo} {divided} {exact}");
    }
}
