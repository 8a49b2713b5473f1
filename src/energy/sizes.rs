//! Table of the divisor A ([`super`]) for a relief of several relative sizes: `scale` s of its pattern, `depth` d of
//! its heights.
//!
//! The albedo of a resized relief depends on two wavelengths ([`Reading`](crate::scattering::Reading)). λ' = λ/s sets
//! the frequencies (u, v)/λ', and λ" = λ/d the phase rate κ = 2πw/λ". A *plane* is the grid over directions at one λ'
//! and one λ", and a *slab* has all planes of one λ". Planes are uniform in log λ', and slabs in 1/λ", to which the
//! phase of the heights is proportional.

use crate::numeric::Real;
use crate::scattering::SizeRange;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};

/// Planes and slabs of an [`AlbedoTable`] for several relative sizes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeAxes {
    /// Binary logarithm of the wavelength λ' in nm of the first plane.
    pub log_wavelength_min: f32,
    /// Planes per octave of λ'.
    pub planes_per_octave: f32,
    /// Number of slabs, at least two.
    pub slabs: u32,
    /// Wavenumber 1/λ" of the first slab, in 1/nm.
    pub wavenumber_min: f32,
    /// Slabs per wavenumber in 1/nm.
    pub slabs_per_wavenumber: f32,
}

impl SizeAxes {
    /// Number of planes that cover a range of sizes, and the axes of planes and slabs.
    ///
    /// `planes_of_one_size` is the number of planes that a relief of one size has over the tables' range of
    /// wavelengths. `phase_max` is the phase in radians between the relief's lowest and highest point, per unit of
    /// `w = cosθi + cosθo`, at the shortest λ and the relief's own depth. `slab_phase` is the largest change of this
    /// phase between two slabs.
    pub(super) fn covering(sizes: &SizeRange, planes_of_one_size: u32, phase_max: f64, slab_phase: f64) -> (u32, Self) {
        let shortest_nm = WAVELENGTH_MIN_NM / sizes.scale[1];
        // In proportion to the range of log λ', which `wavelength_ranges` gives relative to that of log λ.
        let planes = (f64::from(planes_of_one_size - 1) * sizes.wavelength_ranges()).ceil() as u32 + 1;
        let octaves = sizes.wavelength_ranges() * (WAVELENGTH_MAX_NM / WAVELENGTH_MIN_NM).log2();
        let wavenumbers = sizes.wavenumbers();
        let slabs = sizes.slabs(phase_max, slab_phase);
        let axes = Self {
            log_wavelength_min: shortest_nm.log2() as f32,
            planes_per_octave: (f64::from(planes - 1) / octaves) as f32,
            slabs,
            wavenumber_min: wavenumbers[0] as f32,
            slabs_per_wavenumber: (f64::from(slabs - 1) / (wavenumbers[1] - wavenumbers[0])) as f32,
        };
        (planes, axes)
    }

    /// Wavelength λ' in nm at the position `at` among the planes, in planes from the first.
    pub(super) fn plane_nm(&self, at: f64) -> f64 {
        (f64::from(self.log_wavelength_min) + at / f64::from(self.planes_per_octave)).exp2()
    }

    /// Wavelength λ" in nm of a slab.
    pub(super) fn slab_nm(&self, slab: u32) -> f64 {
        1.0 / (f64::from(self.wavenumber_min) + f64::from(slab) / f64::from(self.slabs_per_wavenumber))
    }

    /// Position among the planes at a wavelength λ' in nm.
    #[inline(always)]
    pub(super) fn plane<R: Real>(&self, wavelength_nm: R) -> R {
        (wavelength_nm.log2() - R::lit(self.log_wavelength_min.into())) * R::lit(self.planes_per_octave.into())
    }

    /// Position among the slabs at a wavelength λ" in nm.
    #[inline(always)]
    pub(super) fn slab<R: Real>(&self, wavelength_nm: R) -> R {
        (R::lit(1.0) / wavelength_nm - R::lit(self.wavenumber_min.into())) * R::lit(self.slabs_per_wavenumber.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::{AlbedoIntegral, AlbedoTable};
    use crate::height_field::random::Random;
    use crate::height_field::{HeightField, Preset};
    use crate::numeric::Plain;
    use crate::scattering::{Options, Reading, RelativeSize, build_table};
    use crate::table::Progress;
    use std::f64::consts::TAU;

    /// Largest albedos `[below 87°, beyond]` of a grating after division by the table of all sizes. `count` random
    /// sizes are tried, each at 40 random incidences and wavelengths. Each resized grating has its own spectral table,
    /// which is integrated accurately.
    fn largest_albedos(field: &HeightField, options: &Options, count: usize) -> [f64; 2] {
        let table = build_table(field, options, &Progress::none()).unwrap().table;
        let albedos = AlbedoTable::build(&table, options, &Progress::none()).unwrap().0;
        let view = albedos.view::<f64>();
        let mut random = Random::new(11);
        let mut largest = [0f64; 2];
        for _ in 0..count {
            let SizeRange { scale, depth } = options.sizes.unwrap();
            let [scale, depth] = [scale, depth].map(|[low, high]| low + (high - low) * random.between(0.0, 1.0));
            let own = Options { sizes: None, ..options.clone() };
            let resized = build_table(&field.resized(scale, depth), &own, &Progress::none()).unwrap().table;
            let integral = AlbedoIntegral::accurate(&resized, &own).unwrap();
            for _ in 0..40 {
                let (theta, phi) = (random.between(0.0, 1.55f64), random.between(0.0, TAU));
                let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                let nm = random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                let size = Some(RelativeSize { scale, depth });
                let reading = Reading::<Plain<f64>>::resized(nm, size, true);
                let mut albedo = 0.0;
                integral.visit::<Plain<f64>>(wi, [nm; 2], |wo, part| {
                    albedo += part * view.factor(wi, wo, &reading, true);
                });
                let is_beyond = usize::from(theta > 87f64.to_radians());
                largest[is_beyond] = largest[is_beyond].max(albedo);
            }
        }
        largest
    }

    #[test]
    fn albedos_of_resized_reliefs_are_limited() {
        // Bound of surfaces of one size: 1.01 and the tolerance of the tables.
        const LIMIT: f64 = 1.011;
        // Orders at scales above the smallest are wider than the table's, and so is their pole at the horizon: measured
        // 1.066, in directions that carry little light.
        const AT_HORIZON: f64 = 1.07;
        let sizes = |scale, depth| Options {
            coherence_length_um: 20.0,
            sizes: Some(SizeRange { scale, depth }),
            ..Options::default()
        };
        for (preset, options, count) in [
            (Preset::Blazed, sizes([0.5, 1.0], [1.0, 1.0]), 20),
            (Preset::Blazed, sizes([0.5, 0.5], [1.0, 1.0]), 20),
            (Preset::Sinusoidal, sizes([0.35, 1.0], [0.25, 1.0]), 25),
        ] {
            let [largest, at_horizon] = largest_albedos(&preset.build(None, None).unwrap(), &options, count);
            println!("{preset:?}: {largest}, {at_horizon} beyond 87 degrees");
            assert!(largest < LIMIT && at_horizon < AT_HORIZON, "{preset:?}: {largest}, {at_horizon}");
        }
    }
}
