//! Relative sizes of a relief: one set of tables for a pattern whose pitch and depth vary from place to place
//! (docs/model.md#covers-and-relative-sizes).
//!
//! ```text
//! s, d       size of the pattern and of its heights, relative to the relief of the tables
//! (u, v, w)  scattering vector wi + wo
//! S(f; κ)    power spectrum of the relief of the tables, at the frequency f and the phase rate κ
//! S_sd(f; κ) = s² S(s f; d κ)           power spectrum of the resized relief
//! λ' = λ/s,  λ" = λ/d                   wavelengths that go with f and with κ
//! S_sd/λ²    = S((u, v)/λ'; 2πw/λ")/λ'²
//! ```
//!
//! The equation resizes the coherence window with the pattern, so that orders keep their width relative to their
//! distance. A surface whose table nodes are single orders can keep its window instead ([`Reading::window`]). The width
//! of orders is then multiplied by s in the tables' units, and the divisor is λ².

use crate::numeric::{Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Accepted relative sizes, of patterns and of heights. Tables are built for a surface's largest relief, of size 1. The
/// lower bound is chosen: heights of this relative size make a flat mirror.
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

/// Largest difference of phase between neighbouring slabs of an albedo table, in radians. A *slab* holds the albedos of
/// one 1/λ"; between slabs the albedo is interpolated linearly. The phase is that between the relief's lowest and
/// highest point, per unit of w.
///
/// Measured on the preset `xenopeltis` at half its size: the largest albedo after division by the table is 0.98 both
/// with 3 and with 0.75, so finer slabs gain nothing.
pub(crate) const SLAB_PHASE: f64 = 3.0;
/// [`SLAB_PHASE`] of reliefs whose albedo has ridges, such as gratings. Measured on the preset `blazed` at half its
/// size: the largest albedo after division by the table is 1.017 with 1, and 1.010 with 0.5.
pub(crate) const SLAB_PHASE_OF_RIDGES: f64 = 0.5;

impl SizeRange {
    /// Width of the range of log λ', divided by that of log λ of the tables.
    pub(crate) fn wavelength_ranges(&self) -> f64 {
        let log_range = (WAVELENGTH_MAX_NM / WAVELENGTH_MIN_NM).log2();
        1.0 + (self.scale[1] / self.scale[0]).log2() / log_range
    }

    /// Wavenumbers 1/λ" in 1/nm, from the smallest depth at the longest wavelength to the largest depth at the
    /// shortest.
    pub(crate) fn wavenumbers(&self) -> [f64; 2] {
        [self.depth[0] / WAVELENGTH_MAX_NM, self.depth[1] / WAVELENGTH_MIN_NM]
    }

    /// Number of slabs over 1/λ", between which the phase changes by at most `slab_phase`. `phase_max` is the phase in
    /// radians between the relief's lowest and highest point, per unit of w, at the shortest wavelength.
    pub(crate) fn slabs(&self, phase_max: f64, slab_phase: f64) -> u32 {
        let [low, high] = self.wavenumbers();
        // The phase at the shortest wavelength belongs to the wavenumber 1/λ_min.
        let phase = phase_max * (high - low) * WAVELENGTH_MIN_NM;
        // One slab more than intervals, of which there is at least one.
        (phase / slab_phase).ceil().max(1.0) as u32 + 1
    }

    /// Estimated work to build an albedo table for this range, relative to that for one size. `range_um` is the
    /// relief's range of heights. The albedo of a grating has ridges, which need more slabs.
    pub(crate) fn energy_factor(&self, range_um: f64, is_grating: bool) -> f64 {
        let phase_max = TAU * range_um / (1e-3 * WAVELENGTH_MIN_NM);
        let slab_phase = if is_grating { SLAB_PHASE_OF_RIDGES } else { SLAB_PHASE };
        self.wavelength_ranges() * f64::from(self.slabs(phase_max, slab_phase))
    }

    /// A range that contains this one and has its ends at powers of √2, so that tables of similar ranges are shared.
    pub fn rounded(self) -> Self {
        let rounded = |[low, high]: [f64; 2]| {
            // Ends within a relative 1e-6 of a power count as that power.
            let to_power = |end: f64, round: fn(f64) -> f64| (0.5 * round(2.0 * end.log2())).exp2();
            [to_power(low * (1.0 + 1e-6), f64::floor), to_power(high * (1.0 - 1e-6), f64::ceil)]
                .map(|end| end.clamp(*RELATIVE_SIZE.start(), *RELATIVE_SIZE.end()))
        };
        Self { scale: rounded(self.scale), depth: rounded(self.depth) }
    }
}

/// Arguments of a table's look-up at a wavelength, for a relief of any relative size.
#[derive(Clone, Copy)]
pub struct Reading<N: Numbers> {
    /// Wavelength λ' in nm, by which frequencies follow from direction cosines.
    pub wavelength_nm: N::Real,
    /// Wavelength λ" in nm, by which κ follows from cosines with the normal; `None` if it equals λ'.
    pub depth_wavelength_nm: Option<N::Real>,
    /// Factor on the widths of orders in the tables' units, at most 1; `None` stands for 1.
    pub window: Option<N::Real>,
}

impl<N: Numbers> Reading<N> {
    /// Look-up at a wavelength in nm, for a relief of the tables' own size.
    #[inline(always)]
    pub fn at(wavelength_nm: N::Real) -> Self {
        Self { wavelength_nm, depth_wavelength_nm: None, window: None }
    }

    /// Look-up at a wavelength in nm, for a relief of a relative size. With `keeps_window` the coherence window keeps
    /// its width; otherwise it is resized with the pattern.
    #[inline(always)]
    pub fn resized(wavelength_nm: N::Real, size: Option<RelativeSize<N::Real>>, keeps_window: bool) -> Self {
        match size {
            None => Self::at(wavelength_nm),
            Some(RelativeSize { scale, depth }) => Self {
                wavelength_nm: wavelength_nm / scale,
                depth_wavelength_nm: Some(wavelength_nm / depth),
                window: keeps_window.then_some(scale),
            },
        }
    }

    /// λ", by which κ follows.
    #[inline(always)]
    pub(crate) fn for_kappa_nm(&self) -> N::Real {
        self.depth_wavelength_nm.unwrap_or(self.wavelength_nm)
    }

    /// Frequency `f = (u, v)/λ'` in cycles/µm and phase rate `κ = 2πw/λ"` in rad/µm of a look-up. `tangential` is the
    /// part (u, v) of a scattering vector, and `normal` its part w. Frequencies are of double precision, since orders
    /// are much narrower than their distance from the origin.
    #[inline(always)]
    pub(crate) fn arguments(&self, tangential: [N::Double; 2], normal: N::Real) -> ([N::Double; 2], N::Real) {
        let depth_wavelength_um = self.for_kappa_nm() * N::Real::lit(1e-3);
        let waves_per_um = N::Double::lit(1e3) / N::widen(self.wavelength_nm);
        (tangential.map(|q| q * waves_per_um), normal * N::Real::lit(TAU) / depth_wavelength_um)
    }

    /// `width`, a quantity proportional to the widths of orders, times the factor [`Reading::window`].
    #[inline(always)]
    pub(crate) fn narrowed(&self, width: N::Real) -> N::Real {
        self.window.map_or(width, |window| width * window)
    }

    /// Square of the wavelength in µm by which a power density is divided: λ'², or λ² if the window keeps its width.
    #[inline(always)]
    pub(crate) fn squared_um(&self) -> N::Real {
        // λ'·s = λ.
        let um = self.narrowed(self.wavelength_nm * N::Real::lit(1e-3));
        um * um
    }
}

impl<R: Real> RelativeSize<R> {
    /// The size with both parts within [`RELATIVE_SIZE`].
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
