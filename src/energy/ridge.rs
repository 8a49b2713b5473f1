//! Ridges of the albedo, and the boxes of incident directions and wavelengths for which one node of the albedo's table
//! stands.
//!
//! ρ is the distance of direction cosines from the normal; the horizon has ρ = 1.

/// Distance 1 − ρ of a Gaussian's centre, in its standard deviations, at which the mean of `(1 − ρ)^(−½)` is largest,
/// to three digits. The function counts as 0 for ρ > 1. Near the horizon `1/cosθo` is proportional to it.
const PEAK_SIGMAS: f64 = 0.765;

/// Ridge of the albedo, and the box of a node of the albedo's table.
///
/// The albedo has a ridge along the incidences from which an order leaves along the surface. Such an order adds most to
/// the albedo at some cosθo slightly above the horizon. Where this happens anywhere in the box, the order is counted as
/// if it happened at the node itself. So no ridge lies unseen between nodes; the node's albedo is overestimated.
#[derive(Clone, Copy)]
pub(crate) struct Ridge {
    /// Smallest cosθo at which such an order is counted; [`peak_cosine`] may be larger.
    pub cosine: f64,
    /// Half-sides of the box: for each of the grid's two axes, the change of wi's direction cosines `[x, y]` from the
    /// middle of the box to its side.
    pub half_sides: [[f64; 2]; 2],
    /// Half of the box's range of wavelengths in µm.
    pub half_range_um: f64,
}

/// cosθo of the centre at which the mean of `1/cosθo` over a Gaussian is largest; directions below the horizon count as
/// 0. `sigma` is its standard deviation in direction cosines, far below 1.
pub(super) fn peak_cosine(sigma: f64) -> f64 {
    // cosθo = √(1 − ρ²) at ρ = 1 − PEAK_SIGMAS·σ.
    (1.0 - (1.0 - PEAK_SIGMAS * sigma).powi(2)).max(0.0).sqrt()
}

impl Ridge {
    /// Centre of a Gaussian at the frequency `f` in cycles/µm, moved along the radius onto the ridge if the ridge
    /// crosses the box. `sigma` is its larger standard deviation in direction cosines.
    pub(super) fn moved(&self, centre: [f64; 2], f: [f64; 2], sigma: f64) -> [f64; 2] {
        // Order 0, in the mirror direction, never passes the horizon.
        if f == [0.0; 2] {
            return centre;
        }
        let rho = length(centre);
        let ridge_rho = (1.0 - self.cosine.max(peak_cosine(sigma)).powi(2)).sqrt();
        // Changes of ρ from the middle of the box to its sides: `centre = λf − wi` is linear in wi and λ.
        let along_radius = |[x, y]: [f64; 2]| (centre[0] * x + centre[1] * y) / rho;
        let [first_axis, second_axis] = self.half_sides.map(along_radius);
        // Largest change of ρ within the ellipsoid that touches the box's sides, less σ: a Gaussian so close to the
        // ridge covers it without being moved. It is NaN for ρ = 0, where the comparison below is false.
        let reach = length([length([first_axis, second_axis]), self.half_range_um * along_radius(f)]) - sigma;
        if (rho - ridge_rho).abs() < reach { centre.map(|c| c * ridge_rho / rho) } else { centre }
    }
}

/// `√(x² + y²)` of numbers of order one, faster than `hypot`, which guards against overflow.
pub(super) fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}
