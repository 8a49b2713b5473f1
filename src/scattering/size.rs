//! Relative sizes of a relief: one set of tables serves a pattern whose pitch and depth vary from place to place
//! (the part on sizes of docs/model.md#covers-and-relative-sizes).
//!
//! ```text
//! s, d       size of the pattern and of its heights, relative to the relief of the tables; at most 1
//! λ          wavelength
//! (u, v, w)  scattering vector wi + wo of two unit vectors away from the surface; w along the normal
//! f          spatial frequency (u, v)/λ in cycles/µm
//! κ          phase rate 2πw/λ in rad per µm of height
//! S(f; κ)    power spectrum in µm² of the relief of the tables; the reflectance is proportional to S/λ²
//! S_sd(f; κ) = s² S(s f; d κ)                            power spectrum of the resized relief
//! λ' = λ/s,  λ" = λ/d                                    wavelengths that replace λ in f and in κ
//! S_sd((u, v)/λ; 2πw/λ)/λ² = S((u, v)/λ'; 2πw/λ")/λ'²    look-up for the resized relief
//! ```
//!
//! In this look-up the coherence window, within which light interferes, is resized with the pattern: the width of an
//! order and the distance between orders change by the same factor. A surface can instead keep the width of its window,
//! if each node of its table is one diffraction order. Orders then keep their width in f, so their width in the
//! frequency s f of the look-up is s times that of the tables ([`Reading::order_width_factor`]). Their peak is that of
//! the tables, since the peak depends on the window alone. So S_sd(f; κ) is S(s f; d κ) with narrowed orders, without
//! the factor s², and the divisor of S is λ² in place of λ'².
//!
//! Look-ups are generic over a family of numbers `N`: an `N::Real` is one number, a SIMD vector or a traced variable
//! (`src/numeric`). `lit` makes a constant, and `widen` converts to double precision.

use crate::numeric::{Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Accepted relative sizes, of patterns and of heights. Tables are built for a surface's largest relief, of size 1.
///
/// At the lower bound a relief 1 µm high is 1 nm high and acts as a mirror. A period below 180 µm has shrunk below half
/// the shortest wavelength, where only order 0 leaves. Zero is excluded, since wavelengths are divided by sizes.
pub const RELATIVE_SIZE: RangeInclusive<f64> = 1e-3..=1.0;

/// Size of a relief relative to that of its tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeSize<R> {
    /// Size s of the pattern along the surface.
    pub scale: R,
    /// Size d of the heights.
    pub depth: R,
}

/// Ranges of the relative sizes of a surface, each `[smallest, largest]` within [`RELATIVE_SIZE`]. Albedos are
/// tabulated for them; other sizes take the albedo of the nearest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeRange {
    /// Range of [`RelativeSize::scale`].
    pub scale: [f64; 2],
    /// Range of [`RelativeSize::depth`].
    pub depth: [f64; 2],
}

/// Largest step of phase between neighbouring slabs of an albedo table, in radians. A *slab* holds the albedos of one
/// 1/λ"; between slabs the albedo is interpolated linearly. The phase is that between the relief's lowest and highest
/// point at w = 1.
///
/// Measured on a rough tile of 2.4 µm by 2 µm, 0.3 µm deep, at relative sizes from 0.5 to 1: the largest albedo after
/// division by the table, ideally at most 1, is 0.98 with 3, 1 and 0.5. So finer slabs gain nothing there.
pub(crate) const SLAB_PHASE: f64 = 3.0;
/// [`SLAB_PHASE`] of reliefs whose albedo has ridges, such as gratings. Measured on the preset `lamellar` at relative
/// sizes from 0.5 to 1: the largest albedo after division by the table is 1.066 with 3, 1.013 with 1, and 1.002 with
/// 0.5. Time and memory are proportional to the number of slabs.
pub(crate) const SLAB_PHASE_OF_RIDGES: f64 = 0.5;

impl SizeRange {
    /// Width of the range of log λ', divided by the width of the range of log λ; at least 1. λ is any wavelength of the
    /// tables, and λ' = λ/s with any scale s of this range.
    pub(crate) fn wavelength_ranges(&self) -> f64 {
        let log_range = (WAVELENGTH_MAX_NM / WAVELENGTH_MIN_NM).log2();
        1.0 + (self.scale[1] / self.scale[0]).log2() / log_range
    }

    /// Smallest and largest wavenumber 1/λ" = d/λ in 1/nm: the smallest depth at the longest wavelength, and the
    /// largest depth at the shortest.
    pub(crate) fn wavenumbers(&self) -> [f64; 2] {
        [self.depth[0] / WAVELENGTH_MAX_NM, self.depth[1] / WAVELENGTH_MIN_NM]
    }

    /// Number of slabs over 1/λ", between which the phase changes by at most `slab_phase` radians. `phase_max` is the
    /// phase in radians between the lowest and highest point of the relief of size 1, at w = 1 and the shortest
    /// wavelength.
    pub(crate) fn slabs(&self, phase_max: f64, slab_phase: f64) -> u32 {
        let [low, high] = self.wavenumbers();
        // The phase at the shortest wavelength belongs to the wavenumber 1/λ_min.
        let phase = phase_max * (high - low) * WAVELENGTH_MIN_NM;
        // One slab more than intervals, of which there is at least one.
        (phase / slab_phase).ceil().max(1.0) as u32 + 1
    }

    /// Estimated work to build an albedo table for this range, over that of a table without relative sizes, which has
    /// no slabs. `height_um` is the peak-to-valley height of the relief. The albedo of a grating has ridges, which need
    /// more slabs.
    pub(crate) fn albedo_cost_factor(&self, height_um: f64, is_grating: bool) -> f64 {
        let phase_max = TAU * height_um / (1e-3 * WAVELENGTH_MIN_NM);
        let slab_phase = if is_grating { SLAB_PHASE_OF_RIDGES } else { SLAB_PHASE };
        self.wavelength_ranges() * f64::from(self.slabs(phase_max, slab_phase))
    }

    /// Range whose ends are the nearest powers of √2 outside this one, so that similar ranges share tables. Ends are
    /// clamped to [`RELATIVE_SIZE`]. An end that lies beyond a power by at most a relative 1e-6 becomes that power, so
    /// that rounding errors do not enlarge the range.
    pub fn rounded(self) -> Self {
        let rounded = |[low, high]: [f64; 2]| {
            // A power of √2 is 2^(i/2) for a whole number i.
            let to_power = |end: f64, round: fn(f64) -> f64| (0.5 * round(2.0 * end.log2())).exp2();
            [to_power(low * (1.0 + 1e-6), f64::floor), to_power(high * (1.0 - 1e-6), f64::ceil)]
                .map(|end| end.clamp(*RELATIVE_SIZE.start(), *RELATIVE_SIZE.end()))
        };
        Self { scale: rounded(self.scale), depth: rounded(self.depth) }
    }
}

/// Wavelengths with which tables are read for light of one wavelength λ and a relief of any relative size. With a
/// scattering vector they give the arguments of a look-up ([`Reading::resized`]).
#[derive(Clone, Copy)]
pub struct Reading<N: Numbers> {
    /// Wavelength λ' in nm: frequencies are `(u, v)/λ'`.
    pub wavelength_nm: N::Real,
    /// Wavelength λ" in nm: phase rates are `2πw/λ"`; `None` if λ" equals λ'.
    pub depth_wavelength_nm: Option<N::Real>,
    /// Factor on the standard deviations of orders, in the frequencies of the tables. It is s where the window keeps
    /// its width, so at most 1; `None` stands for 1.
    pub order_width_factor: Option<N::Real>,
}

impl<N: Numbers> Reading<N> {
    /// Look-up at a wavelength in nm, for a relief of the tables' own size.
    #[inline(always)]
    pub fn at(wavelength_nm: N::Real) -> Self {
        Self { wavelength_nm, depth_wavelength_nm: None, order_width_factor: None }
    }

    /// Look-up at a wavelength in nm, for a relief of a relative size within [`RELATIVE_SIZE`] (`None` for the tables'
    /// own). With `keeps_window` the coherence window keeps its width, so orders narrow in the tables' units. Otherwise
    /// the window is resized with the pattern.
    #[inline(always)]
    pub fn resized(wavelength_nm: N::Real, size: Option<RelativeSize<N::Real>>, keeps_window: bool) -> Self {
        match size {
            None => Self::at(wavelength_nm),
            Some(RelativeSize { scale, depth }) => Self {
                wavelength_nm: wavelength_nm / scale,
                depth_wavelength_nm: Some(wavelength_nm / depth),
                order_width_factor: keeps_window.then_some(scale),
            },
        }
    }

    /// Wavelength λ" in nm, with which κ is computed.
    #[inline(always)]
    pub(crate) fn for_kappa_nm(&self) -> N::Real {
        self.depth_wavelength_nm.unwrap_or(self.wavelength_nm)
    }

    /// Arguments of a look-up: frequency `(u, v)/λ'` in cycles/µm and phase rate `2πw/λ"` in rad/µm. `tangential` is
    /// the part (u, v) of a scattering vector, and `normal` its part w. Frequencies have double precision, since
    /// orders are much narrower than their distance from the origin.
    #[inline(always)]
    pub(crate) fn arguments(&self, tangential: [N::Double; 2], normal: N::Real) -> ([N::Double; 2], N::Real) {
        let depth_wavelength_um = self.for_kappa_nm() * N::Real::lit(1e-3);
        let waves_per_um = N::Double::lit(1e3) / N::widen(self.wavelength_nm);
        (tangential.map(|q| q * waves_per_um), normal * N::Real::lit(TAU) / depth_wavelength_um)
    }

    /// Width of an order in the tables' units: `width`, that of the tables, times [`Reading::order_width_factor`].
    #[inline(always)]
    pub(crate) fn narrowed(&self, width: N::Real) -> N::Real {
        self.order_width_factor.map_or(width, |factor| width * factor)
    }

    /// Divisor of S in µm²: λ'², or λ² if the window keeps its width.
    #[inline(always)]
    pub(crate) fn divisor_um2(&self) -> N::Real {
        let um = self.wavelength_nm * N::Real::lit(1e-3);
        // The factor is s, and λ'·s = λ.
        let um = self.order_width_factor.map_or(um, |scale| um * scale);
        um * um
    }
}

impl<R: Real> RelativeSize<R> {
    /// The size with scale and depth clamped to [`RELATIVE_SIZE`].
    #[inline(always)]
    pub fn clipped(self) -> Self {
        let (low, high) = (R::lit(*RELATIVE_SIZE.start()), R::lit(*RELATIVE_SIZE.end()));
        Self { scale: Number::clip(self.scale, low, high), depth: Number::clip(self.depth, low, high) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_ranges_contain_the_given_ones() {
        let given = SizeRange { scale: [0.6, 0.9], depth: [0.5, 1.0] };
        let rounded = given.rounded();
        assert_eq!(rounded.depth, [0.5, 1.0]);
        assert!((rounded.scale[0] - 0.5).abs() < 1e-12 && rounded.scale[1] == 1.0);
    }
}
