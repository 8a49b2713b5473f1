//! The lobe in colours, for variants that carry no wavelengths: the spectral one, integrated.

use crate::numeric::math::lerp;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::reflectance::SpectralLobe;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::f64::consts::{LN_2, LOG2_E, TAU};

/// Wavelengths of the integral: steps are as in [`crate::reflectance::Surface::integrated`].
const STEPS: (f64, f64) = (64.0, 1024.0);
/// Step in standard deviations of an order's Gaussian.
const STEP_SIGMAS: f64 = 1.5;
/// Centre in nm and rate per nm of the density `∝ sech²(rate·(λ − centre))` that wavelengths are sampled with, which
/// follows what the eye sees (Radziszewski et al., *An improved technique for full spectral rendering*, WSCG 2009).
const CENTRE_NM: f64 = 538.0;
const RATE: f64 = 0.0072;

/// A spectral lobe with the weights of wavelengths, at every whole nm `[red, green, blue, luminance]`.
#[derive(Clone, Copy)]
pub struct IntegratedLobe<'a, N: Numbers> {
    pub lobe: SpectralLobe<'a, N>,
    pub weights: N::Words,
}

impl<N: Numbers> IntegratedLobe<'_, N> {
    /// `f_r` in 1/sr as linear sRGB and luminance, and the density of [`IntegratedLobe::sample`]; either stays zero
    /// unless it is wanted. By the midpoint rule in the wavenumber.
    pub fn eval_pdf(
        &self,
        (value_wanted, density_wanted): (bool, bool),
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        active: N::Mask,
    ) -> ([N::Real; 4], N::Real) {
        let lit = N::Real::lit;
        let table = &self.lobe.layout.table;
        let (first, span) = (1.0 / WAVELENGTH_MAX_NM, 1.0 / WAVELENGTH_MIN_NM - 1.0 / WAVELENGTH_MAX_NM);
        let [across_x, across_y] = [0, 1]
            .map(|axis| (wi[axis] + wo[axis]) * lit(1e3 * table.period_um[axis] / (table.sigma[axis] * STEP_SIGMAS)));
        let orders = (across_x * across_x + across_y * across_y).sqrt();
        let knots = (wi[2] + wo[2]) * lit(1e3 * TAU / table.kappa_step);
        // Masked lanes may hold anything.
        let steps = (orders.max(knots) * lit(span)).clip(lit(STEPS.0), lit(STEPS.1)).floor();
        let step = lit(span) / steps;
        let (_, values, density) = N::while_loop(
            c"wavelengths",
            (lit(0.0), [lit(0.0); 4], lit(0.0)),
            |(k, ..)| active & k.lt(steps),
            |(k, mut values, mut density)| {
                let nm = lit(1.0) / (k + lit(0.5)).fma(step, lit(first));
                let width_nm = step * nm * nm;
                let (value, pdf) = match (value_wanted, density_wanted) {
                    (true, true) => {
                        let ([value], pdf) = self.lobe.eval_pdf(wi, wo, [nm], active);
                        (value, pdf)
                    }
                    (true, false) => (self.lobe.eval(wi, wo, [nm], active)[0], lit(0.0)),
                    _ => (lit(0.0), self.lobe.pdf(wi, wo, [nm], active)),
                };
                if value_wanted {
                    for (sum, weight) in values.iter_mut().zip(self.weights_at(nm, active)) {
                        *sum = (value * width_nm).fma(weight, *sum);
                    }
                }
                if density_wanted {
                    density = (pdf * width_nm).fma(wavelength_pdf(nm), density);
                }
                (k + lit(1.0), values, density)
            },
        );
        (values.map(|value| value.max(lit(0.0))), density)
    }

    /// A direction from three numbers in [0, 1), of which the first picks the even share or a wavelength. The zero
    /// vector where there is none.
    pub fn sample(&self, wi: [N::Real; 3], u: [N::Real; 3], even_share: f64, active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let rest = (u[0] - lit(even_share)) * lit(1.0 / (1.0 - even_share));
        self.lobe.sample(wi, [wavelength(rest.max(lit(0.0)))], u, active)
    }

    fn weights_at(&self, nm: N::Real, active: N::Mask) -> [N::Real; 4] {
        let lit = N::Real::lit;
        let last = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
        let t = (nm - lit(WAVELENGTH_MIN_NM)).clip(lit(0.0), lit(last));
        let i = N::index(t).min(N::Index::lit(last as u32 - 1));
        let row = |i: N::Index| N::gather::<4>(self.weights, i, active).map(N::from_bits);
        let (low, high, part) = (row(i), row(i + N::Index::lit(1)), t - N::real(i));
        std::array::from_fn(|c| lerp(low[c], high[c], part))
    }
}

/// `tanh` of the argument of the density at the ends of the range.
fn ends() -> (f64, f64) {
    let end = |nm: f64| (RATE * (nm - CENTRE_NM)).tanh();
    (end(WAVELENGTH_MIN_NM), end(WAVELENGTH_MAX_NM))
}

/// The wavelength in nm for a number in [0, 1), by the inverse of the distribution over the tables' range.
fn wavelength<R: Real>(u: R) -> R {
    let lit = R::lit;
    let (low, high) = ends();
    let t = u.fma(lit(high - low), lit(low));
    let atanh = ((lit(1.0) + t) / (lit(1.0) - t)).log2() * lit(0.5 * LN_2);
    (atanh * lit(1.0 / RATE) + lit(CENTRE_NM)).clip(lit(WAVELENGTH_MIN_NM), lit(WAVELENGTH_MAX_NM))
}

/// Density of [`wavelength`] in 1/nm.
fn wavelength_pdf<R: Real>(nm: R) -> R {
    let lit = R::lit;
    let (low, high) = ends();
    let e = ((nm - lit(CENTRE_NM)) * lit(RATE * LOG2_E)).exp2();
    // sech(x) = 2/(eˣ + e⁻ˣ).
    let sech = lit(2.0) / (e + lit(1.0) / e);
    sech * sech * lit(RATE / (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SurfaceConfig;
    use crate::numeric::Plain;
    use crate::reflectance::{Surface, UNIFORM_SHARE, WavelengthWeights};

    /// Midpoints of the tenths of a nm of the tables' range.
    fn tenths() -> impl Iterator<Item = f64> {
        let count = ((WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) * 10.0).round() as u32;
        (0..count).map(|k| WAVELENGTH_MIN_NM + (f64::from(k) + 0.5) * 0.1)
    }

    #[test]
    fn wavelengths_have_their_density() {
        let mut sum = 0.0;
        for nm in tenths() {
            sum += 0.1 * wavelength_pdf(nm);
            // The inverse of the distribution function, to the midpoint rule's second order.
            assert!((wavelength(sum - 0.05 * wavelength_pdf(nm)) - nm).abs() < 1e-3, "{nm}");
        }
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }

    fn surface() -> Surface {
        let config = SurfaceConfig::from_json(r#"{"preset": "blazed", "coherence_length": 20.0}"#).unwrap();
        config.build(&crate::cache::Cache::off()).unwrap().0
    }

    fn direction(x: f64, y: f64) -> [f64; 3] {
        [x, y, (1.0 - x * x - y * y).sqrt()]
    }

    #[test]
    fn values_and_densities_are_those_of_the_spectral_lobe_integrated() {
        let surface = surface();
        let weights: Vec<u32> = WavelengthWeights::per_nm().iter().flatten().map(|w| w.to_bits()).collect();
        let lobe = IntegratedLobe::<Plain<f64>> { lobe: surface.lobe::<f64>(), weights: &weights };
        let (wi, wo) = (direction(0.3, 0.1), direction(-0.1, -0.05));
        let (values, pdf) = lobe.eval_pdf((true, true), wi, wo, true);
        for (value, wanted) in values.iter().zip(surface.integrated(wi, wo)) {
            // The same rule; weights are kept in single precision.
            assert!((value - wanted.max(0.0)).abs() < 1e-6 * values[3], "{values:?} {wanted}");
        }
        assert_eq!(lobe.eval_pdf((true, false), wi, wo, true), (values, 0.0));
        assert_eq!(lobe.eval_pdf((false, true), wi, wo, true), ([0.0; 4], pdf));
        // By a rule of its own: even steps in the wavelength.
        let mean: f64 =
            tenths().map(|nm| 0.1 * wavelength_pdf(nm) * surface.lobe::<f64>().pdf(wi, wo, [nm], true)).sum();
        assert!((pdf - mean).abs() < 2e-3 * mean, "{pdf} {mean}");
        let drawn = lobe.sample(wi, [0.5, 0.3, 0.7], UNIFORM_SHARE, true);
        assert!(drawn[2] >= 0.0 && drawn.iter().map(|c| c * c).sum::<f64>() < 1.0 + 1e-6);
    }
}
