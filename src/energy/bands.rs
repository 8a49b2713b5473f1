//! Divisors of red, green and blue, for renderers that carry colours. `methods/albedo.wgsl` evaluates them in WGSL.
//!
//! The reflectance of the directions wi and wo is divided by `max(1, A(wi), A(wo))`, with the tabulated divisor A of a
//! direction at a wavelength (`mod.rs`).
//!
//! A colour channel is a *band*: an integral over wavelengths with its weights in linear sRGB. The divisor of a band is
//! the mean of the divisors by wavelength, with the positive parts of the weights. Red has large negative weights near
//! 500 nm; with them, a saturated red would count as an albedo above one although no wavelength's albedo is.
//!
//! The mean is computed from the divisors at three wavelengths ([`BAND_NODES_NM`]).

use super::AlbedoView;
use super::grid::GridPlace;
use crate::numeric::{Number, Numbers, Real};
use crate::scattering::{Reading, RelativeSize};
use std::array;

/// Number of bands: red, green and blue.
const BANDS: usize = 3;
/// Number of [`BAND_NODES_NM`]. An evaluation with four would take 10 % longer; fewer follow the albedo less closely.
const BAND_NODES: usize = 3;
/// Wavelengths in nm at which the divisor is read for the bands, near the peaks of blue, green and red.
const BAND_NODES_NM: [f64; BAND_NODES] = [460.0, 540.0, 620.0];
/// Weights `[band][node]` of [`BAND_NODES_NM`] in the mean over a band. They are not negative and sum to 1 for each
/// band. They are exact for divisors that are linear between the nodes and constant beyond them.
const BAND_NODE_WEIGHTS: [[f64; BAND_NODES]; BANDS] =
    [[0.0486, 0.2074, 0.7440], [0.1456, 0.7197, 0.1348], [0.9317, 0.0683, 0.0]];

impl<N: Numbers> AlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))` of red, green and blue, of directions of unit length above the surface. `size` is the
    /// relative size of the relief; `None` stands for its own size. 1 unless `active`.
    #[inline(always)]
    pub fn band_factor(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        size: Option<RelativeSize<N::Real>>,
        active: N::Mask,
    ) -> [N::Real; BANDS] {
        self.band_factor_at([wi, wo].map(|w| self.place(w)), size, active)
    }

    /// [`AlbedoView::band_factor`] from the places of wi and wo in the grid.
    #[inline(always)]
    pub(crate) fn band_factor_at(
        &self,
        places: [GridPlace<N>; 2],
        size: Option<RelativeSize<N::Real>>,
        active: N::Mask,
    ) -> [N::Real; BANDS] {
        let [i, o] = places.map(|place| self.band_excess(&place, size, active));
        array::from_fn(|band| N::Real::lit(1.0) / (N::Real::lit(1.0) + i[band].max(o[band])))
    }

    /// `max(1, A) − 1` of red, green and blue at a place; zero unless `active`.
    #[inline(always)]
    fn band_excess(
        &self,
        place: &GridPlace<N>,
        size: Option<RelativeSize<N::Real>>,
        active: N::Mask,
    ) -> [N::Real; BANDS] {
        let lit = N::Real::lit;
        // Look-ups of A read only the wavelengths of `Reading`, so `keeps_window`, here false, has no effect.
        let at_nodes = BAND_NODES_NM.map(|nm| self.excess(place, &Reading::resized(lit(nm), size, false), active));
        BAND_NODE_WEIGHTS
            .map(|weights| (0..BAND_NODES).fold(lit(0.0), |sum, node| at_nodes[node].fma(lit(weights[node]), sum)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::WavelengthWeights;
    use crate::energy::{AlbedoIntegral, AlbedoTable};
    use crate::height_field::{Preset, random::Random};
    use crate::numeric::Plain;
    use crate::scattering::{Options, build_table};
    use crate::table::{Progress, WAVELENGTH_MIN_NM};
    use std::f64::consts::TAU;

    /// Means over the bands of the tents that interpolate linearly between the nodes.
    #[test]
    fn weights_of_nodes_are_those_of_linear_interpolation() {
        let spacing_nm = BAND_NODES_NM[1] - BAND_NODES_NM[0];
        let mut sums = [[0.0; BAND_NODES]; BANDS];
        for (i, weights) in WavelengthWeights::per_nm().iter().enumerate() {
            let nm = (WAVELENGTH_MIN_NM + i as f64).clamp(BAND_NODES_NM[0], BAND_NODES_NM[BAND_NODES - 1]);
            for band in 0..BANDS {
                for node in 0..BAND_NODES {
                    let tent = (1.0 - (nm - BAND_NODES_NM[node]).abs() / spacing_nm).max(0.0);
                    sums[band][node] += tent * f64::from(weights[band].max(0.0));
                }
            }
        }
        for band in 0..BANDS {
            let total: f64 = sums[band].iter().sum();
            for node in 0..BAND_NODES {
                let (expected, found) = (sums[band][node] / total, BAND_NODE_WEIGHTS[band][node]);
                // Rounded to four digits.
                assert!((found - expected).abs() < 6e-5, "{band} {node}: {expected} {found}");
            }
        }
    }

    /// The divided albedo of a band against the mean over the band of the divided albedos by wavelength.
    #[test]
    fn albedos_of_bands_follow_those_by_wavelength() {
        // Largest root mean square of the difference in red, green and blue. The band's divisor is one number for all
        // wavelengths, computed from three of them, and red has negative weights. Measured: 0.027, 0.012, 0.017.
        const RMS: [f64; BANDS] = [0.031, 0.015, 0.02];
        // Difference without a division, far above the tolerance.
        const UNDIVIDED: f64 = 0.1;
        const QUERIES: usize = 200;
        let options = Options::default();
        let field = Preset::Blazed.build(None, None).unwrap();
        let table = build_table(&field, &options, &Progress::none()).unwrap().table;
        let by_wavelength = AlbedoTable::build(&table, &options, &Progress::none()).unwrap().0;
        let view = by_wavelength.view::<f64>();
        let integral = AlbedoIntegral::fast(&table, &options).unwrap();
        let mut random = Random::new(8);
        let (mut squares, mut undivided) = ([0.0; BANDS], [0.0; BANDS]);
        for _ in 0..QUERIES {
            let (theta, phi): (f64, f64) = (random.between(0.0, 1.55), random.between(0.0, TAU));
            let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            // Sums over every fifth nm: of the band's albedos, of those by wavelength, and of those not divided.
            let mut sums = [[0.0; 3]; BANDS];
            let mut totals = [0.0; BANDS];
            for (i, weights) in WavelengthWeights::per_nm().iter().enumerate().step_by(5) {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let weights = [0, 1, 2].map(|band| f64::from(weights[band]));
                (0..BANDS).for_each(|band| totals[band] += weights[band]);
                integral.visit::<Plain<f64>>(wi, [nm; 2], |wo, part| {
                    let of_band = view.band_factor(wi, wo, None, true);
                    let exact = by_wavelength.factor(wi, wo, nm);
                    for band in 0..BANDS {
                        let part = weights[band] * part;
                        let parts = [part * of_band[band], part * exact, part];
                        sums[band].iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
                    }
                });
            }
            for band in 0..BANDS {
                let [of_band, exact, plain] = sums[band].map(|sum| sum / totals[band]);
                squares[band] += (of_band - exact).powi(2) / QUERIES as f64;
                undivided[band] += (plain - exact).powi(2) / QUERIES as f64;
            }
        }
        let [rms, undivided] = [squares, undivided].map(|squares| squares.map(f64::sqrt));
        println!("{rms:.4?}, undivided {undivided:.4?}");
        for band in 0..BANDS {
            assert!(
                rms[band] < RMS[band] && undivided[band] > UNDIVIDED,
                "band {band}: {rms:?}, undivided {undivided:?}"
            );
        }
    }
}
