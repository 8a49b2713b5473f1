//! Integral over wavelength along rays of the frequency plane.
//!
//! Samples of one direction of a ring of radius r lie on one ray: wavelength λ reads the radial frequency `ρ = r/λ`,
//! and `dλ/λ² = −dρ/r`. All rings of a group have the same directions. So along each ray the records of the spectral
//! table are interpolated once, at uniform ρ that resolve an order, and then serve every ring of the group and every w:
//!
//! `F(q) = Σ_ρ (Δρ/r)·R·colour(λ)·S(f; κ)` with `f = ρ·(cos, sin)` and `κ = 2πw/λ`.

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
/// Fewest steps over the visible wavelengths, about 6 nm each. Colour matching functions are smooth over that (chosen).
pub(super) const STEPS_MIN: f64 = 64.0;
/// Visible wavelengths in µm, shortest and longest.
pub(super) const VISIBLE_UM: (f64, f64) = (OBSERVER_RANGE_NM.0 * 1e-3, OBSERVER_RANGE_NM.1 * 1e-3);

/// Reflectance of the interface: a function of the wavelength in nm and the cosine at the half vector.
pub type Reflectance<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// Uniform radial frequencies ρ in cycles/µm along the rays of one group of rings.
pub(super) struct Path {
    first: f64,
    step: f64,
    count: usize,
}

/// Contribution of the record at one ρ to one ring at one w, apart from the ray.
pub(super) struct Term {
    /// Number of ρ along the path.
    node: usize,
    /// Number of w among the ring's samples.
    height: usize,
    /// Number of the first spline coefficient read.
    first: usize,
    /// Weights of the four spline coefficients read.
    weights: [f32; 4],
    /// Factors on a power's header.
    header_factors: [f32; HEADER],
    /// Factor on the spline, real and imaginary part.
    spline_factor: [f32; 2],
    /// Linear sRGB that `S/norm` is multiplied by.
    colour: [f32; 3],
}

impl Path {
    /// Path of a group of rings for orders of standard deviation `sigma` in cycles/µm.
    pub(super) fn new(group: &[RingPlan], sigma: f64) -> Self {
        let (inner, outer) = (group[0].radius, group[group.len() - 1].radius);
        let visible = inner / VISIBLE_UM.0 - inner / VISIBLE_UM.1;
        let step = (STEP_SIGMAS * sigma).min(visible / STEPS_MIN);
        let first = inner / VISIBLE_UM.1;
        Self { first, step, count: ((outer / VISIBLE_UM.0 - first) / step) as usize + 2 }
    }

    fn frequency(&self, node: usize) -> f64 {
        self.first + node as f64 * self.step
    }

    /// Terms of a ring: [`RingPlan::heights`] of them for each visible ρ, in the order of ρ.
    pub(super) fn terms(
        &self,
        table: &SpectralTable,
        ring: &RingPlan,
        colours: &SpectralToRgb,
        reflectance: Reflectance,
    ) -> Vec<Term> {
        // dλ/λ² in 1/µm, times the factor of S; colours are per nm.
        let scale = 1e3 * self.step / ring.radius * table.norm();
        let samples = ring.samples();
        let mut terms = Vec::new();
        for node in 0..self.count {
            let frequency = self.frequency(node);
            let wavelength_um = ring.radius / frequency;
            if !(VISIBLE_UM.0..=VISIBLE_UM.1).contains(&wavelength_um) {
                continue;
            }
            let wavelength_nm = 1e3 * wavelength_um;
            let colour = colours.density(wavelength_nm);
            for (height, &w) in samples.iter().enumerate() {
                let kappa = (TAU * w / wavelength_um).min(table.kappa_limit([frequency, 0.0]));
                let curve = NodeCurve::new(table, kappa);
                let (first, weights) = curve.coefficients();
                let (header_factors, spline_factor) = curve.factors();
                let reflected = scale * reflectance(wavelength_nm, (0.5 * ring.radius.hypot(w)).min(1.0));
                terms.push(Term {
                    node,
                    height,
                    first,
                    weights: weights.map(|weight| weight as f32),
                    header_factors: header_factors.map(|factor| factor as f32),
                    spline_factor: [spline_factor.re as f32, spline_factor.im as f32],
                    colour: colour.map(|channel| (channel * reflected) as f32),
                });
            }
        }
        terms
    }

    /// Number of spline coefficients that are read at each ρ.
    pub(super) fn coefficients(&self, terms: &[Vec<Term>]) -> Vec<usize> {
        let mut counts = vec![0; self.count];
        for Term { node, first, .. } in terms.iter().flatten() {
            counts[*node] = counts[*node].max(first + 4);
        }
        counts
    }

    /// Colours of all rings of the group on [`RAYS`] rays from `first_ray` on: `[ring][height][channel]`.
    pub(super) fn integrate(
        &self,
        table: &SpectralTable,
        coefficients: &[usize],
        terms: &[Vec<Term>],
        group: &[RingPlan],
        first_ray: usize,
    ) -> Vec<PerRay> {
        let records = self.records(table, coefficients, group[0].directions, first_ray);
        let mut colours = Vec::new();
        for (ring, terms) in group.iter().zip(terms) {
            let start = colours.len();
            colours.resize(start + ring.heights() * 3, [0.0; RAYS]);
            // Most ρ of a grating are far from its orders on all of these rays.
            let occupied = terms.chunks_exact(ring.heights()).filter(|at_node| !records.is_empty(at_node[0].node));
            for term in occupied.flatten() {
                let Some(density) = term.density(table.quantity(), &records) else { continue };
                for (colour, sums) in term.colour.iter().zip(&mut colours[start + 3 * term.height..]) {
                    for (sum, density) in sums.iter_mut().zip(&density) {
                        *sum += colour * density;
                    }
                }
            }
        }
        colours
    }

    /// Interpolated records along [`RAYS`] rays of a circle of `directions`, from `first_ray` on.
    fn records(&self, table: &SpectralTable, coefficients: &[usize], directions: usize, first_ray: usize) -> Records {
        let rays: [[f64; 2]; RAYS] = std::array::from_fn(|ray| {
            let (sin, cos) = (TAU * (first_ray + ray) as f64 / directions as f64).sin_cos();
            [cos, sin]
        });
        let mut record = Vec::new();
        let mut records = Records { starts: Vec::with_capacity(self.count + 1), values: Vec::new() };
        for (node, &coefficients) in coefficients.iter().enumerate() {
            let start = records.values.len();
            records.starts.push(start);
            if coefficients == 0 {
                continue;
            }
            let frequency = self.frequency(node);
            for (number, ray) in rays.iter().enumerate() {
                table.interpolate_record(ray.map(|component| frequency * component), coefficients, &mut record);
                let needed = start + record.len();
                if records.values.len() < needed {
                    records.values.resize(needed, [0.0; RAYS]);
                }
                for (to, from) in records.values[start..].iter_mut().zip(&record) {
                    to[number] = *from;
                }
            }
        }
        records.starts.push(records.values.len());
        records
    }
}

/// Interpolated records at all ρ of a path, [`RAYS`] side by side. The record at ρ number n is
/// `values[starts[n]..starts[n + 1]]`, empty where no ray has one.
struct Records {
    starts: Vec<usize>,
    values: Vec<PerRay>,
}

impl Records {
    fn is_empty(&self, node: usize) -> bool {
        self.starts[node] == self.starts[node + 1]
    }

    /// `count` numbers of a record from `first` on; `None` beyond its end.
    fn numbers(&self, node: usize, first: usize, count: usize) -> Option<&[PerRay]> {
        self.values[self.starts[node]..self.starts[node + 1]].get(first..first + count)
    }
}

impl Term {
    /// `S/norm` on all rays; `None` where no ray has a record that is long enough.
    fn density(&self, quantity: NodeQuantity, records: &Records) -> Option<PerRay> {
        let header = records.numbers(self.node, 0, HEADER)?;
        let components = quantity.components();
        let coefficients = records.numbers(self.node, HEADER + self.first * components, 4 * components)?;
        let spline = |part: usize| -> PerRay {
            let mut sums = [0.0; RAYS];
            for (weight, values) in self.weights.iter().zip(coefficients.iter().skip(part).step_by(components)) {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            }
            sums
        };
        Some(match quantity {
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
        })
    }
}
