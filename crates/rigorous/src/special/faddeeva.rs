//! The Faddeeva function w, a scaled complementary error function of a complex number.

use num_complex::Complex64;
use std::f64::consts::PI;

/// N of M. Al Azah and S. N. Chandler-Wilde, *Computation of the complex error function using modified trapezoidal
/// rules*, SIAM J. Numer. Anal. 59, 2021. The quadrature rules have N + 1 positive nodes and the step √(π/(N + 1)).
/// With this N their error is near that of double precision.
const N: usize = 11;

/// `w(z) = e^{−z²} erfc(−iz)`, to about 1e-14 of the larger of 1 and |w| for Im z ≥ 0. For Im z < 0 the rounding of
/// e^{−z²} adds |z|²·1e-16; z must not be so far below the axis that e^{−z²} overflows.
///
/// In the first quadrant `(2iz/π)∫₀^∞ e^{−t²}/(z² − t²) dt` is integrated by the trapezium or the midpoint rule (see
/// [`N`]). Where the pole t = z is near the path of integration, its residue `2e^{−z²}/(1 ± e^{−2πiz/step})` is added,
/// with the plus sign for the midpoint rule. The other quadrants follow from w(−z) = 2e^{−z²} − w(z) and w(−z̄) =
/// w̄(z).
pub(crate) fn faddeeva(z: Complex64) -> Complex64 {
    if z.im < 0.0 {
        return 2.0 * (-z * z).exp() - faddeeva(-z);
    }
    if z.re < 0.0 {
        return faddeeva(Complex64::new(-z.re, z.im)).conj();
    }
    let step = (PI / (N + 1) as f64).sqrt();
    let square = z * z;
    // Where z is far from the real axis, the path of integration, the midpoint rule needs no residue; the bound is that
    // of the paper.
    let pole_is_near = z.im < z.re.max(PI / step);
    // Elsewhere the rule is the one whose nodes are farther from Re z: at least a quarter of a step. Nodes of the
    // trapezium rule are the multiples of the step.
    let re_in_steps = z.re / step;
    let is_midpoint_rule = !pole_is_near || (re_in_steps - re_in_steps.round()).abs() < 0.25;
    let mut sum = Complex64::ZERO;
    for k in 0..=N {
        let node = step * if is_midpoint_rule { k as f64 + 0.5 } else { (k + 1) as f64 };
        sum += (-node * node).exp() / (square - node * node);
    }
    let sum = Complex64::new(0.0, 2.0 * step / PI) * z * sum;
    if !pole_is_near {
        return sum;
    }
    // e^{−2πiz/step}. Its argument is the position of the pole between nodes.
    let phase = (Complex64::new(0.0, -2.0 * PI / step) * z).exp();
    // The residue. `phase` overflows for Im z > 57, where the residue is below rounding.
    let correction = |divisor: Complex64| {
        if divisor.is_finite() { 2.0 * (-square).exp() / divisor } else { Complex64::ZERO }
    };
    if is_midpoint_rule {
        sum + correction(1.0 + phase)
    } else {
        // The second term is that of the node at 0, with half the weight of the nodes in the sum.
        sum + Complex64::new(0.0, step / PI) / z + correction(1.0 - phase)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound on the error, relative to the larger of 1 and |w|. It is the rounding of terms that exceed their sum.
    const ERROR: f64 = 1e-14;

    /// References: values of mpmath 1.4 (`exp(-z*z)*erfc(-i*z)`, 30 digits), near and between the nodes of both rules.
    /// The last, at which `phase` overflows, is from the asymptotic series.
    #[test]
    fn agrees_with_tabulated_values() {
        for ((x, y), (re, im)) in [
            ((0.0, 0.0), (1.0, 0.0)),
            ((0.3, 0.2), (0.752_894_790_136_879_2, 0.229_653_152_349_069_96)),
            ((1.02, 0.01), (0.354_338_524_542_426_9, 0.598_075_607_942_253)),
            ((1.28, 0.0), (0.194_290_658_785_488_14, 0.551_181_580_195_405_2)),
            ((2.56, 1e-9), (0.001_424_976_559_948_662_6, 0.244_167_063_445_605_1)),
            ((4.6, 0.05), (0.001_441_007_587_948_539_3, 0.125_765_965_893_723_3)),
            ((0.2, 7.0), (0.079_738_052_448_098_72, 0.002_233_976_184_925_589)),
            ((7.0, 6.2), (0.040_285_394_830_333_9, 0.044_965_074_266_288_74)),
            ((30.0, 0.4), (0.000_251_125_190_617_36, 0.018_813_430_931_074_4)),
            ((-1.5, 0.7), (0.207_989_895_475_203_8, -0.290_846_793_836_760_3)),
            ((0.8, -1.1), (-0.993_040_319_479_554_2, 3.639_289_811_583_18)),
            ((-0.5, -0.6), (1.344_016_624_051_927_7, -1.463_261_765_752_822_3)),
            ((1e-6, 1e-7), (0.999_999_887_161_093_3, 1.128_378_967_094_782_8e-6)),
            ((6.0, 2.0), (0.029_170_144_290_321_64, 0.085_259_670_601_562_23)),
            ((90.0, 80.0), (0.003_112_902_613_786_318_5, 0.003_501_773_926_629_208)),
        ] {
            let w = faddeeva(Complex64::new(x, y));
            assert!((w - Complex64::new(re, im)).norm() < ERROR * w.norm().max(1.0), "{x} {y}: {w}");
        }
    }
}
