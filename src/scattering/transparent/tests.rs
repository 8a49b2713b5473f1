//! Tests of [`TransparentBody`]: reciprocity, Fresnel's reflectance and transmittance, the small-slope factor, and the
//! first order of a shallow relief.

use super::super::perturbation::first_order;
use super::super::{ComplexIndex, Obliquity, Pair, fresnel_unpolarised};
use super::*;
use crate::height_field::random::Random;
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

type Double = Plain<'static, f64>;

/// Refractive indices of the bodies.
const ETAS: [f64; 4] = [1.2, 1.33, 1.5, 2.4];
/// Coherence length of all bodies in µm. Only [`TransparentBody::normal_min`] depends on it.
const COHERENCE_LENGTH_UM: f64 = 65.0;

fn interface(eta: f64) -> TransparentBody {
    TransparentBody::new(eta, false, COHERENCE_LENGTH_UM)
}

fn film(eta: f64) -> TransparentBody {
    TransparentBody::new(eta, true, COHERENCE_LENGTH_UM)
}

/// A random direction above the relief. One in eight is the normal.
fn above(random: &mut Random) -> Vec3 {
    let cos = if random.unit() < 0.125 { 1.0 } else { random.between(0.02, 1.0) };
    let (sin, turn) = (f64::sqrt(1.0 - cos * cos), TAU * random.unit());
    [sin * turn.cos(), sin * turn.sin(), cos]
}

/// A direction mirrored in the plane of the surface.
fn mirrored([x, y, z]: Vec3) -> Vec3 {
    [x, y, -z]
}

fn pair(body: TransparentBody, wi: Vec3, wo: Vec3) -> TransparentPair<Double> {
    body.pair(&body.wave::<Double>(wi), &body.wave::<Double>(wo))
}

#[test]
fn reflection_on_either_side_has_the_small_slope_factor() {
    // Rounding: the small-slope factor takes its azimuth from |wi + wo|², where digits cancel at grazing angles.
    const ROUNDING: f64 = 1e-8;
    let mut random = Random::new(3);
    for eta in ETAS {
        for _ in 0..500 {
            let (wi, wo) = (above(&mut random), above(&mut random));
            // Below the relief, the other medium has the relative index 1/η.
            for (found, index) in
                [(pair(interface(eta), wi, wo), eta), (pair(interface(eta), mirrored(wi), mirrored(wo)), 1.0 / eta)]
            {
                let index = Some(ComplexIndex { eta: index, k: 0.0 });
                let expected = Pair::new(wi, wo).unwrap().interface(index, Obliquity::SmallSlope);
                assert!((found.power() - expected).abs() < ROUNDING * (1.0 + expected), "{eta} {wi:?} {wo:?}");
            }
        }
    }
}

#[test]
fn refracted_light_has_fresnels_transmittance() {
    const ROUNDING: f64 = 1e-12;
    for eta in ETAS {
        for degrees in 0..90 {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let inside = sin / eta;
            let (wi, wo) = ([sin, 0.0, cos], [-inside, 0.0, -(1.0 - inside * inside).sqrt()]);
            let passed = 1.0 - fresnel_unpolarised(cos, ComplexIndex { eta, k: 0.0 });
            let found = pair(interface(eta), wi, wo);
            assert!((found.power() - passed).abs() < ROUNDING, "{eta} {degrees}: {} {passed}", found.power());
            // Through a film the states s (`powers[0]`) and p (`powers[3]`) have the square of their transmittance.
            let through = pair(film(eta), wi, [-sin, 0.0, -cos]);
            let [s, p] = [through.powers[0], through.powers[3]];
            let expected = 0.5 * (found.powers[0].powi(2) + found.powers[3].powi(2));
            assert!((0.5 * (s + p) - expected).abs() < ROUNDING, "{eta} {degrees}: {s} {p} {expected}");
        }
    }
}

#[test]
fn a_flat_film_transmits_what_neither_side_reflects() {
    const ROUNDING: f64 = 1e-12;
    for eta in ETAS {
        let body = film(eta);
        // At normal incidence both states have the same transmittance at either side.
        let passed = (1.0 - body.reflectance(1.0)).powi(2);
        assert!((body.transmittance(1.0) - passed).abs() < ROUNDING, "{eta}");
        // At Brewster's angle p is not reflected, and s has twice the unpolarised reflectance.
        let brewster = 1.0 / (1.0 + eta * eta).sqrt();
        let passed_s = 1.0 - 2.0 * body.reflectance(brewster);
        assert!((body.transmittance(brewster) - 0.5 * (1.0 + passed_s * passed_s)).abs() < ROUNDING, "{eta}");
    }
}

/// Transmitted powers are those of a shallow relief to first order in its height h, at any azimuth.
///
/// Wave vectors are in units of the wave number in air, and h in its inverse. With an amplitude A of [`first_order`],
/// the power in a state is `h²·|A|²·cn/c1`. c1 and cn are the normal components of the wave vectors in the air and in
/// the medium, and w is their difference. The factor is this power over that of the phase screen's order, `(wh)²`.
#[test]
fn transmitted_powers_are_the_first_order_of_a_shallow_relief() {
    // Rounding of the solved system.
    const ROUNDING: f64 = 1e-8;
    let mut random = Random::new(4);
    for eta in ETAS {
        let mut compared = 0;
        while compared < 300 {
            let (wi, wo) = (above(&mut random), above(&mut random));
            // States s and p are undefined along the normal.
            if wi[2].max(wo[2]) > 0.999 {
                continue;
            }
            compared += 1;
            // Transmitted amplitudes, `[outgoing state][incident state]`.
            let [_, amplitudes] = first_order(wi, wo, Complex64::new(eta, 0.0));
            let inside = [wo[0] / eta, wo[1] / eta];
            let cos = (1.0 - inside[0] * inside[0] - inside[1] * inside[1]).sqrt();
            let found = pair(interface(eta), wi, [inside[0], inside[1], -cos]);
            let w = eta * cos - wi[2];
            let scale = eta * cos / wi[2] / (w * w);
            let expected = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(o, i)| scale * amplitudes[o][i].norm_sqr());
            for (found, expected) in found.powers.into_iter().zip(expected) {
                // Below its bound |w| is replaced.
                let is_bounded = w.abs() < eta * interface(eta).normal_min;
                assert!(
                    is_bounded || (found - expected).abs() < ROUNDING * (1.0 + expected),
                    "{eta} {wi:?} {wo:?}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn swapped_directions_have_equal_powers() {
    const ROUNDING: f64 = 1e-12;
    let mut random = Random::new(5);
    for eta in ETAS {
        for body in [interface(eta), film(eta)] {
            for _ in 0..500 {
                let (a, b) = (above(&mut random), mirrored(above(&mut random)));
                let (there, back) = (pair(body, a, b), pair(body, b, a));
                assert!((there.power() - back.power()).abs() < ROUNDING * (1.0 + there.power()), "{a:?} {b:?}");
                assert_eq!((there.tangential, there.normal), (back.tangential, back.normal));
            }
        }
    }
}

#[test]
fn without_a_contrast_of_indices_light_goes_straight_on() {
    for body in [interface(1.0), film(1.0)] {
        let (wi, wo) = ([0.6, 0.0, 0.8], [-0.6, 0.0, -0.8]);
        assert!((pair(body, wi, wo).power() - 1.0).abs() < 1e-12);
        assert_eq!(pair(body, wi, [-0.6, 0.0, 0.8]).power(), 0.0);
    }
}

#[test]
fn factors_are_finite_at_the_ends_of_all_ranges() {
    let (sin, cos) = ((1.0 - COSINE_MIN * COSINE_MIN).sqrt(), COSINE_MIN);
    let directions = [[0.0, 0.0, 1.0], [sin, 0.0, cos], [-sin, 0.0, cos], [0.6, 0.0, 0.8]];
    let both_sides = directions.into_iter().flat_map(|w| [w, mirrored(w)]).collect::<Vec<_>>();
    for eta in [1.0, 1.2, 1.5, 4.0] {
        for body in [interface(eta), film(eta)] {
            for (wi, wo) in both_sides.iter().flat_map(|wi| both_sides.iter().map(move |wo| (*wi, *wo))) {
                let single = |w: Vec3| body.wave::<Plain<'static, f32>>(w.map(|c| c as f32));
                let double = pair(body, wi, wo).factor();
                let single = body.pair(&single(wi), &single(wo)).factor();
                assert!(double.is_finite() && double >= 0.0, "{body:?} {wi:?} {wo:?}: {double}");
                assert!(single.is_finite() && single >= 0.0, "{body:?} {wi:?} {wo:?}: {single}");
            }
        }
    }
}
