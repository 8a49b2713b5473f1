//! Integral over wavelength along rays of the frequency plane.
//!
//! At a direction of a ring, all wavelengths lie on one ray: `ρ = |f| = r/λ`, and `dλ/λ² = −dρ/r`. Rings of a group
//! share their directions. The records of the spectral table are therefore interpolated once along each ray, on a grid
//! of ρ that resolves orders, and then read by every ring at every w.

use super::rings::RingPlan;
use crate::colour::{OBSERVER_RANGE_NM, SpectralToRgb};
use crate::table::{NodeCurve, NodeQuantity, SpectralTable};
use std::f64::consts::TAU;

/// Number of rays integrated together, one per lane. Chosen: two or four SIMD vectors.
pub(super) const LANES: usize = 16;
/// One number per ray.
pub(super) type Lanes = [f32; LANES];
/// Step along a ray in standard deviations of an order's Gaussian. The trapezoid rule then errs by
/// `2·exp(−2π²/1.3²) ≈ 2e-5`.
pub(super) const STEP_SIGMAS: f64 = 1.3;
/// Fewest steps over the visible wavelengths: 6 nm on average, over which the colour matching functions are smooth.
pub(super) const STEPS_MIN: f64 = 64.0;
/// The visible wavelengths in µm.
pub(super) const VISIBLE_UM: (f64, f64) = (OBSERVER_RANGE_NM.0 * 1e-3, OBSERVER_RANGE_NM.1 * 1e-3);

/// Reflectance of the interface from wavelength (nm) and cosine at the half vector.
pub type Reflectance<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// Uniform grid of ρ along the rays of one group of rings.
pub(super) struct Path {
    /// First ρ in cycles/µm.
    first: f64,
    /// Step of ρ in cycles/µm.
    step: f64,
    /// Number of points.
    count: usize,
}

/// Contribution of the record at one point of the path to one ring at one w: the evaluation of a [`NodeCurve`] at κ,
/// and the colour of the wavelength.
pub(super) struct Reading {
    /// Point of the path.
    point: usize,
    /// Index of w among the ring's samples.
    height: usize,
    /// First of the four spline coefficients.
    first: usize,
    /// Weights of the four spline coefficients.
    weights: [f32; 4],
    /// Factors of the record's header, its value and slope at κ = 0.
    from_zero: [f32; 2],
    /// Factor of the spline, real and imaginary part.
    factor: [f32; 2],
    /// Colour per unit of density, with the quadrature weight and the reflectance.
    colour: [f32; 3],
}

impl Path {
    /// The path of a group; `sigma` as in [`super::rings::Rings::plan`].
    pub(super) fn new(group: &[RingPlan], sigma: f64) -> Self {
        let (inner, outer) = (group[0].radius, group[group.len() - 1].radius);
        let visible = inner / VISIBLE_UM.0 - inner / VISIBLE_UM.1;
        let step = (STEP_SIGMAS * sigma).min(visible / STEPS_MIN);
        let first = inner / VISIBLE_UM.1;
        Self { first, step, count: ((outer / VISIBLE_UM.0 - first) / step) as usize + 2 }
    }

    /// Frequency ρ at a point of the path, in cycles/µm.
    fn frequency(&self, point: usize) -> f64 {
        self.first + point as f64 * self.step
    }

    /// Readings of one ring, shared by all rays: [`RingPlan::heights`] for each point at a visible wavelength.
    pub(super) fn readings(
        &self,
        table: &SpectralTable,
        ring: &RingPlan,
        colours: &SpectralToRgb,
        reflectance: Reflectance,
    ) -> Vec<Reading> {
        // dλ/λ² in 1/µm, times the normalisation of S; colours are per nm.
        let scale = 1e3 * self.step / ring.radius * table.norm();
        let samples = ring.samples();
        let mut readings = Vec::new();
        for point in 0..self.count {
            let frequency = self.frequency(point);
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
                let (from_zero, factor) = curve.factors();
                let reflected = scale * reflectance(wavelength_nm, (0.5 * ring.radius.hypot(w)).min(1.0));
                readings.push(Reading {
                    point,
                    height,
                    first,
                    weights: weights.map(|weight| weight as f32),
                    from_zero: from_zero.map(|factor| factor as f32),
                    factor: [factor.re as f32, factor.im as f32],
                    colour: colour.map(|channel| (channel * reflected) as f32),
                });
            }
        }
        readings
    }

    /// Number of coefficients of the record that the readings of all rings need, for each point.
    pub(super) fn coefficients(&self, readings: &[Vec<Reading>]) -> Vec<usize> {
        let mut counts = vec![0; self.count];
        for Reading { point, first, .. } in readings.iter().flatten() {
            counts[*point] = counts[*point].max(first + 4);
        }
        counts
    }

    /// Colours of all rings of the group on [`LANES`] rays from `first_ray` on: `[ring][height][channel]`.
    pub(super) fn integrate(
        &self,
        table: &SpectralTable,
        coefficients: &[usize],
        readings: &[Vec<Reading>],
        group: &[RingPlan],
        first_ray: usize,
    ) -> Vec<Lanes> {
        let records = self.records(table, coefficients, group[0].directions, first_ray);
        let mut colours = Vec::new();
        for (ring, readings) in group.iter().zip(readings) {
            let start = colours.len();
            colours.resize(start + ring.heights() * 3, [0.0; LANES]);
            // For gratings most points are far from all orders.
            let covered = readings.chunks_exact(ring.heights()).filter(|at_point| !records.is_empty(at_point[0].point));
            for reading in covered.flatten() {
                let Some(density) = reading.density(table.quantity(), &records) else { continue };
                for (colour, sums) in reading.colour.iter().zip(&mut colours[start + 3 * reading.height..]) {
                    for (sum, density) in sums.iter_mut().zip(&density) {
                        *sum += colour * density;
                    }
                }
            }
        }
        colours
    }

    /// Interpolates the spectral table's records along the rays, one ray per lane.
    fn records(&self, table: &SpectralTable, coefficients: &[usize], directions: usize, first_ray: usize) -> Records {
        let rays: [[f64; 2]; LANES] = std::array::from_fn(|lane| {
            let (sin, cos) = (TAU * (first_ray + lane) as f64 / directions as f64).sin_cos();
            [cos, sin]
        });
        let mut record = Vec::new();
        let mut records = Records { starts: Vec::with_capacity(self.count + 1), values: Vec::new() };
        for (point, &coefficients) in coefficients.iter().enumerate() {
            let start = records.values.len();
            records.starts.push(start);
            if coefficients == 0 {
                continue;
            }
            let frequency = self.frequency(point);
            for (lane, ray) in rays.iter().enumerate() {
                table.interpolated_record(ray.map(|component| frequency * component), coefficients, &mut record);
                let needed = start + record.len();
                if records.values.len() < needed {
                    records.values.resize(needed, [0.0; LANES]);
                }
                for (to, from) in records.values[start..].iter_mut().zip(&record) {
                    to[lane] = *from;
                }
            }
        }
        records.starts.push(records.values.len());
        records
    }
}

/// Records interpolated along a path: `[point][number]`, where points without nodes nearby have no numbers.
struct Records {
    /// Start of each point's record in `values`, and the end of the last.
    starts: Vec<usize>,
    /// Numbers of the records, one lane per ray.
    values: Vec<Lanes>,
}

impl Records {
    /// Whether no lane has a record at this point.
    fn is_empty(&self, point: usize) -> bool {
        self.starts[point] == self.starts[point + 1]
    }

    /// `count` numbers of a point's record from `first` on; `None` beyond its end.
    fn numbers(&self, point: usize, first: usize, count: usize) -> Option<&[Lanes]> {
        self.values[self.starts[point]..self.starts[point + 1]].get(first..first + count)
    }
}

impl Reading {
    /// Density `S/norm` on all lanes; `None` without a record.
    fn density(&self, quantity: NodeQuantity, records: &Records) -> Option<Lanes> {
        let zero = records.numbers(self.point, 0, 2)?;
        let components = quantity.components();
        let curve = records.numbers(self.point, 2 + self.first * components, 4 * components)?;
        let spline = |part: usize| -> Lanes {
            let mut sums = [0.0; LANES];
            for (weight, values) in self.weights.iter().zip(curve.iter().skip(part).step_by(components)) {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            }
            sums
        };
        Some(match quantity {
            NodeQuantity::Power => {
                let spline = spline(0);
                std::array::from_fn(|lane| {
                    let at_zero = self.from_zero[0] * zero[0][lane] + self.from_zero[1] * zero[1][lane];
                    (at_zero + self.factor[0] * spline[lane]).max(0.0)
                })
            }
            NodeQuantity::Amplitude => {
                let (re, im) = (spline(0), spline(1));
                std::array::from_fn(|lane| {
                    let re_sum = zero[0][lane] + self.factor[0] * re[lane] - self.factor[1] * im[lane];
                    let im_sum = zero[1][lane] + self.factor[0] * im[lane] + self.factor[1] * re[lane];
                    re_sum * re_sum + im_sum * im_sum
                })
            }
        })
    }
}
