//! Integral over wavelength along rays of the frequency plane.
//!
//! The result is the colour F of the scattering vector q = wi + wo = (u, v, w). It is sampled on rings: circles about
//! the origin in the plane of (u, v). S(f; κ) is the power spectrum of the relief in the spectral table, at the
//! frequency f in cycles/µm and the phase rate κ in rad/µm. R is the reflectance of the interface, and `weight` the
//! linear sRGB per wavelength ([module](super)).
//!
//! At the azimuth φ on a ring of radius r, light of the wavelength λ has the radial frequency `ρ = r/λ`. So the
//! integral over λ is one along a ray of the frequency plane, from the origin at the azimuth φ, and `dλ/λ² = −dρ/r`:
//!
//! `F = Σ_ρ (Δρ/r)·R·weight(λ)·S(f; κ)` with `f = ρ·(cos φ, sin φ)`, `λ = r/ρ` and `κ = 2πw/λ`.
//!
//! A *record* of the spectral table has S, or its complex amplitude D, at one frequency as a function of κ. It consists
//! of a header of [`HEADER`] numbers, P(0) and P'(0) of a power or D(0) of an amplitude, and of coefficients of a cubic
//! B-spline ([`SpectralTable`]).
//!
//! The rings of a *group* have the same directions. Along each ray the records are therefore interpolated once, at
//! uniform ρ that resolve an order. These records serve every ring of the group and every w. They and the sums over
//! them are in single precision, like the spectral table.

use super::rings::RingPlan;
use crate::colour::{OBSERVER_RANGE_NM, SpectralToRgb};
use crate::table::{HEADER, NodeCurve, NodeQuantity, SpectralTable};
use std::f64::consts::TAU;

/// Number of rays that are integrated together: a cache line of single-precision numbers.
pub(super) const RAYS: usize = 16;
/// One number per ray.
pub(super) type PerRay = [f32; RAYS];
/// Step over ρ in standard deviations of an order. The trapezoid rule errs by 2·exp(−2π²/1.3²) ≈ 2e-5 of a Gaussian.
pub(super) const STEP_SIGMAS: f64 = 1.3;
/// Smallest number of steps over the visible wavelengths, about 6 nm each in the green. More steps take longer; fewer
/// would miss the curvature of the colour matching functions.
pub(super) const STEPS_MIN: f64 = 64.0;
/// Visible wavelengths in µm, shortest and longest.
pub(super) const VISIBLE_UM: (f64, f64) = (OBSERVER_RANGE_NM.0 * 1e-3, OBSERVER_RANGE_NM.1 * 1e-3);

/// Reflectance of the interface, or its ratio to a reference, as a function of the wavelength in nm and the cosine
/// between either direction and the half vector.
pub type Reflectance<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// Points of the rays of one group of rings: uniform radial frequencies ρ, in cycles/µm.
pub(super) struct Path {
    /// ρ of the first point.
    first_per_um: f64,
    /// Distance between points.
    step_per_um: f64,
    /// Number of points.
    count: usize,
}

/// Contribution of the record at one point of a ray to one ring at one w. It is equal for all rays.
pub(super) struct Term {
    /// Index of the point on the path.
    point: usize,
    /// Index of w among the samples over w ([`RingPlan::sampled_w`]).
    w_index: usize,
    /// Index of the first spline coefficient read.
    first: usize,
    /// Weights of the four spline coefficients read.
    weights: [f32; 4],
    /// Factors on a power's header, `P(0)` and `P'(0)`: the power at κ = 0 and its derivative.
    header_factors: [f32; HEADER],
    /// Factor on the spline, real and imaginary part.
    spline_factor: [f32; 2],
    /// Factor on `S/norm`, linear sRGB; `norm` is the spectral table's common factor of all records.
    rgb: [f32; 3],
}

impl Path {
    /// Path of a group of rings, at least one, by ascending radius. `sigma_per_um` is the standard deviation of an
    /// order in cycles/µm.
    pub(super) fn new(group: &[RingPlan], sigma_per_um: f64) -> Self {
        let (inner, outer) = (group[0].radius, group[group.len() - 1].radius);
        // Range of ρ over which the innermost ring, whose range is the shortest, has visible wavelengths.
        let visible_per_um = inner / VISIBLE_UM.0 - inner / VISIBLE_UM.1;
        let step_per_um = (STEP_SIGMAS * sigma_per_um).min(visible_per_um / STEPS_MIN);
        let first_per_um = inner / VISIBLE_UM.1;
        // One point more than steps, and one for the rounding of the quotient.
        let count = ((outer / VISIBLE_UM.0 - first_per_um) / step_per_um) as usize + 2;
        Self { first_per_um, step_per_um, count }
    }

    /// Radial frequency of a point in cycles/µm.
    fn frequency(&self, point: usize) -> f64 {
        self.first_per_um + point as f64 * self.step_per_um
    }

    /// Terms of a ring `[point][w]`: [`RingPlan::w_count`] of them for each point at which the ring has a visible
    /// wavelength, in ascending order. `colours` has the weights of the wavelengths in linear sRGB.
    pub(super) fn terms(
        &self,
        table: &SpectralTable,
        ring: &RingPlan,
        colours: &SpectralToRgb,
        reflectance: Reflectance,
    ) -> Vec<Term> {
        // dλ/λ² = Δρ/r in 1/µm, times the norm of S. The factor 10³ turns the weights, which are per nm, to per µm.
        let scale = 1e3 * self.step_per_um / ring.radius * table.norm();
        let sampled_w = ring.sampled_w();
        let mut terms = Vec::new();
        for point in 0..self.count {
            let frequency = self.frequency(point);
            let wavelength_um = ring.radius / frequency;
            if !(VISIBLE_UM.0..=VISIBLE_UM.1).contains(&wavelength_um) {
                continue;
            }
            let wavelength_nm = 1e3 * wavelength_um;
            let wavelength_rgb = colours.density(wavelength_nm);
            for (w_index, &w) in sampled_w.iter().enumerate() {
                // The largest w belong to look-ups at smaller radii, which interpolate with this ring. At the ring's
                // own radius no pair of directions has a κ beyond the limit, at which records end. The limit depends on
                // |f| alone, so that of the azimuth 0 is that of every ray.
                let kappa = (TAU * w / wavelength_um).min(table.kappa_limit([frequency, 0.0]));
                // The four coefficients of a record's spline that are read at this κ, and the factors of `Term`.
                let curve = NodeCurve::new(table, kappa);
                let (first, weights) = curve.coefficients();
                let (header_factors, spline_factor) = curve.factors();
                // Cosine between either direction and the half vector: |q|/2.
                let cos_half = (0.5 * ring.radius.hypot(w)).min(1.0);
                let scaled_reflectance = scale * reflectance(wavelength_nm, cos_half);
                terms.push(Term {
                    point,
                    w_index,
                    first,
                    weights: weights.map(|weight| weight as f32),
                    header_factors: header_factors.map(|factor| factor as f32),
                    spline_factor: [spline_factor.re as f32, spline_factor.im as f32],
                    rgb: wavelength_rgb.map(|channel| (channel * scaled_reflectance) as f32),
                });
            }
        }
        terms
    }

    /// Number of spline coefficients to interpolate at each point, up to the last that a term reads; 0 without a term.
    /// `terms` are those of a group, `[ring][term]`.
    pub(super) fn coefficient_counts(&self, terms: &[Vec<Term>]) -> Vec<usize> {
        let mut counts = vec![0; self.count];
        for Term { point, first, .. } in terms.iter().flatten() {
            counts[*point] = counts[*point].max(first + 4);
        }
        counts
    }

    /// Samples of F of all rings of the group on the [`RAYS`] rays from `first_ray` on: `[ring][w][channel]`.
    ///
    /// `coefficient_counts` are those of [`Path::coefficient_counts`], `terms` those of [`Path::terms`] for each ring.
    pub(super) fn integrate(
        &self,
        table: &SpectralTable,
        coefficient_counts: &[usize],
        terms: &[Vec<Term>],
        group: &[RingPlan],
        first_ray: usize,
    ) -> Vec<PerRay> {
        let records = self.records(table, coefficient_counts, group[0].directions, first_ray);
        let mut samples = Vec::new();
        for (ring, terms) in group.iter().zip(terms) {
            let start = samples.len();
            samples.resize(start + ring.w_count() * 3, [0.0; RAYS]);
            for at_point in terms.chunks_exact(ring.w_count()) {
                let record = records.at(at_point[0].point);
                // Most points of a grating are far from its orders on all of these rays.
                if record.is_empty() {
                    continue;
                }
                for term in at_point {
                    let density = term.density(table.quantity(), record);
                    for (channel, sums) in term.rgb.iter().zip(&mut samples[start + 3 * term.w_index..]) {
                        for (sum, density) in sums.iter_mut().zip(&density) {
                            *sum += channel * density;
                        }
                    }
                }
            }
        }
        samples
    }

    /// Records interpolated along the [`RAYS`] rays from `first_ray` on, of a circle of `directions` rays.
    fn records(
        &self,
        table: &SpectralTable,
        coefficient_counts: &[usize],
        directions: usize,
        first_ray: usize,
    ) -> Records {
        let rays: [[f64; 2]; RAYS] = std::array::from_fn(|ray| {
            let (sin, cos) = (TAU * (first_ray + ray) as f64 / directions as f64).sin_cos();
            [cos, sin]
        });
        let mut record = Vec::new();
        let mut records = Records { starts: Vec::with_capacity(self.count + 1), values: Vec::new() };
        for (point, &coefficient_count) in coefficient_counts.iter().enumerate() {
            let start = records.values.len();
            records.starts.push(start);
            if coefficient_count == 0 {
                continue;
            }
            let frequency = self.frequency(point);
            for (ray, direction) in rays.iter().enumerate() {
                // Empty, or as long as every other record of this point.
                let f = direction.map(|component| frequency * component);
                table.interpolate_record(f, coefficient_count, &mut record);
                let needed = start + record.len();
                if records.values.len() < needed {
                    records.values.resize(needed, [0.0; RAYS]);
                }
                for (to, from) in records.values[start..].iter_mut().zip(&record) {
                    to[ray] = *from;
                }
            }
        }
        records.starts.push(records.values.len());
        records
    }
}

/// Interpolated records of a [`SpectralTable`] at all points of a path, on [`RAYS`] rays side by side.
struct Records {
    /// Start of each point's record in `values`, then the end of the last.
    starts: Vec<usize>,
    /// Numbers of all records, one after another.
    values: Vec<PerRay>,
}

impl Records {
    /// Record of a point, with [`HEADER`] numbers and the coefficients that its terms read. Zeros on rays that have no
    /// record there; empty where none has one.
    fn at(&self, point: usize) -> &[PerRay] {
        &self.values[self.starts[point]..self.starts[point + 1]]
    }
}

impl Term {
    /// `S/norm` on all rays, from the record of the term's point.
    ///
    /// With s the value of the spline, a power is `header_factors·(P(0), P'(0)) + spline_factor·s`, or 0 where rounding
    /// makes it negative. An amplitude has the power `|D(0) + spline_factor·s|²`; its header is D(0).
    fn density(&self, quantity: NodeQuantity, record: &[PerRay]) -> PerRay {
        let components = quantity.components();
        // A complex coefficient has its real part, then its imaginary part.
        let (header, coefficients) = record.split_at(HEADER);
        let coefficients = &coefficients[self.first * components..][..4 * components];
        // One component of the spline.
        let spline = |part: usize| -> PerRay {
            let mut sums = [0.0; RAYS];
            for (weight, values) in self.weights.iter().zip(coefficients.iter().skip(part).step_by(components)) {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            }
            sums
        };
        match quantity {
            NodeQuantity::Power => {
                let spline = spline(0);
                std::array::from_fn(|ray| {
                    let from_header = self.header_factors[0] * header[0][ray] + self.header_factors[1] * header[1][ray];
                    (from_header + self.spline_factor[0] * spline[ray]).max(0.0)
                })
            }
            NodeQuantity::Amplitude => {
                let (re, im) = (spline(0), spline(1));
                let [a, b] = self.spline_factor;
                std::array::from_fn(|ray| {
                    let re_sum = header[0][ray] + a * re[ray] - b * im[ray];
                    let im_sum = header[1][ray] + a * im[ray] + b * re[ray];
                    re_sum * re_sum + im_sum * im_sum
                })
            }
        }
    }
}
