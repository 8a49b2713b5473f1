//! `table`, our own method: the whole integral over wavelength as a table over `(u, v, w)`, read with a few fetches.
//!
//! The colour of a pair of directions, Fresnel and obliquity aside, is
//! `F(q) = ∫ S(f; κ)/λ² · weight(λ) dλ` with `f = (u, v)/λ` and `κ = 2πw/λ`: a function of `q = wi + wo` alone. Its features
//! are very uneven. Across the radius `r = |(u, v)|` they are as fine as the coherence window makes an order, about
//! 0.003; along the radius the integral over wavelength has smeared them to about 4 % of `r`; and in `w` they are as
//! wide as `λ/`(range of heights). So the table has rings ([`rings`]) whose spacing grows in proportion to `r`, as many directions on
//! each as its circumference asks for, and few heights. On a ring F is a cubic B-spline in direction (periodic) and height;
//! between rings it is the cubic through four of them: 64 words of 32 bits a look-up.
//!
//! Since `|q| ≤ 2`, records shorten outwards. Near the horizon `F` falls as `w²` where order zero is not, and the obliquity
//! factor divides by that. So that relative accuracy survives, rings hold `F·(w² + knee²)/(w² + zero²)`, with a `zero` at
//! which the power of order zero, as the ring sees it, takes over.

mod build;
mod pack;
mod path;
mod rings;

use super::{Method, MethodShader, is_query};
pub use build::ColourTableOptions;
use bytemuck::{Pod, Zeroable};
use pack::unpack;
use serde::Serialize;
use std::borrow::Cow;

/// The colour of a surface over `(u, v, w)`; see the [module](self).
pub struct ColourTable {
    layout: Box<TableUniform>,
    /// Spline coefficients, `[ring][direction][height]`, packed by [`pack`].
    words: Vec<u32>,
    report: ColourTableReport,
}

/// What building took and gave.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ColourTableReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Number of rings.
    pub rings: usize,
    /// Directions on the outermost ring.
    pub directions: usize,
    /// The coherence length shown, in µm: that of the surface, or less where its features would take more than
    /// [`ColourTable::LIMIT_BYTES`] or too long to integrate.
    pub coherence_length_um: f64,
    /// Seconds for everything.
    pub build_seconds: f64,
}

/// The uniform struct of `table.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct TableUniform {
    /// Radius below which rings are equally spaced, over `growth`.
    pub knee_radius: f32,
    /// Relative spacing of rings further out.
    pub growth: f32,
    /// Scale of w below which knots are equally spaced again.
    pub w_log: f32,
    /// Added to a word's exponent to make that of a float.
    pub exponent_offset: u32,
    /// The outermost ring's number.
    pub last_ring: u32,
    pub _pad0: u32,
    pub _pad1: u32,
    pub _pad2: u32,
    /// From the centre outwards; those after the last are empty.
    pub rings: [Ring; ColourTable::RINGS_MAX],
}

/// One ring.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct Ring {
    /// First word of the ring.
    pub offset: u32,
    /// Directions, equally spaced from +u towards +v.
    pub directions: u32,
    /// Spline coefficients over height, the first of which belongs to the knot −1.
    pub heights: u32,
    /// Knots per unit of w.
    pub knots_per_w: f32,
    /// Knots per e-fold of `1 + w/w_log`.
    pub knots_per_efold: f32,
    /// `knee²` of the module's page.
    pub knee_squared: f32,
    /// `zero²` of the module's page, at most `knee²`.
    pub zero_squared: f32,
    pub _pad: u32,
}

impl ColourTable {
    /// No table is larger.
    pub const LIMIT_BYTES: usize = 64 << 20;
    /// Nor has more rings, which is what half of the smallest uniform buffer of any adapter holds. The limit of bytes comes
    /// first.
    const RINGS_MAX: usize = 1024;

    /// What building took and gave.
    pub fn report(&self) -> &ColourTableReport {
        &self.report
    }

    /// The value on a ring at `turn` (a direction in turns) and `w`.
    fn on_ring(&self, ring: &Ring, turn: f32, w: f32) -> [f32; 3] {
        let x = turn * ring.directions as f32;
        let y = w * ring.knots_per_w + ring.knots_per_efold * (1.0 + w / self.layout.w_log).ln();
        let (column, row) = (x.floor(), y.floor().min(ring.heights as f32 - 4.0));
        let (across, along) = (cubic_weights(x - column), cubic_weights(y - row));
        let mut sum = [0.0; 3];
        for (a, across) in across.iter().enumerate() {
            let direction = (column as i32 + a as i32 - 1).rem_euclid(ring.directions as i32) as u32;
            let first = (ring.offset + direction * ring.heights + row as u32) as usize;
            for (word, along) in self.words[first..first + 4].iter().zip(along) {
                let value = unpack(*word, self.layout.exponent_offset);
                sum = std::array::from_fn(|c| sum[c] + across * along * value[c]);
            }
        }
        let shape = (w * w + ring.zero_squared) / (w * w + ring.knee_squared);
        sum.map(|value| value * shape)
    }
}

impl Method for ColourTable {
    fn response(&self, q: [f32; 3]) -> [f32; 3] {
        let [u, v, w] = q;
        let radius = (u * u + v * v).sqrt();
        if !is_query(q) {
            return [0.0; 3];
        }
        let turn = turns(u, v);
        let stretched = radius * self.layout.growth / self.layout.knee_radius;
        let position = (stretched + (stretched * stretched + 1.0).sqrt()).ln() / self.layout.growth - 0.5;
        let first = position.floor();
        let weights = lagrange_weights(position - first);
        let mut sum = [0.0; 3];
        for (i, weight) in weights.iter().enumerate() {
            let number = first as i32 + i as i32 - 1;
            // Beyond the centre, the rings of the other side.
            let (index, turn) = if number < 0 { (-1 - number, turn + 0.5) } else { (number, turn) };
            let ring = &self.layout.rings[(index as usize).min(self.layout.last_ring as usize)];
            let value = self.on_ring(ring, turn, w);
            sum = std::array::from_fn(|c| sum[c] + weight * value[c]);
        }
        sum
    }

    fn spectral(&self, _q: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        None
    }

    fn shader(&self) -> MethodShader<'_> {
        MethodShader {
            name: "table",
            wgsl: include_str!("table.wgsl"),
            uniform: bytemuck::bytes_of(&*self.layout).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.words))],
        }
    }
}

/// Coefficients of `atan(a)/2πa` in powers of a² on [0, 1], off by at most 6e-9 of a turn.
const TURNS: [f32; 8] = [
    1.591_548_4e-1,
    -5.304_612e-2,
    3.174_594_5e-2,
    -2.213_627e-2,
    1.534_603e-2,
    -8.898_719e-3,
    3.479_595e-3,
    -6.453_036_6e-4,
];

/// The direction of `(u, v)` in turns from +u towards +v, −½ to ½; 0 for no direction. WGSL leaves `atan2` 4096 units in
/// the last place, which is a quarter of the distance between directions, so both twins have this.
fn turns(u: f32, v: f32) -> f32 {
    let (across, along) = (v.abs(), u.abs());
    let largest = across.max(along);
    if largest == 0.0 {
        return 0.0;
    }
    let ratio = across.min(along) / largest;
    let square = ratio * ratio;
    let octant = ratio * TURNS.iter().rev().fold(0.0, |sum, c| sum * square + c);
    let quadrant = if across > along { 0.25 - octant } else { octant };
    (if u < 0.0 { 0.5 - quadrant } else { quadrant }).copysign(v)
}

/// Weights of the coefficients −1, 0, 1, 2 of a uniform cubic B-spline at `t` in [0, 1].
fn cubic_weights(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [
        s * s * s / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
        t * t * t / 6.0,
    ]
}

/// Weights of the values at −1, 0, 1, 2 of the cubic through them, at `t` in [0, 1].
fn lagrange_weights(t: f32) -> [f32; 4] {
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    [-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_arc_tangent() {
        for i in 0..2000 {
            let angle = (f64::from(i) - 1000.0) * 1e-3 * std::f64::consts::PI;
            let (sin, cos) = angle.sin_cos();
            let found = f64::from(turns(0.3 * cos as f32, 0.3 * sin as f32));
            let expected = angle / std::f64::consts::TAU;
            // The coefficients' error and a few roundings; at the ends ±½ are the same direction.
            let off = (found - expected).abs();
            assert!(off.min((off - 1.0).abs()) < 1e-7, "{found} {expected}");
        }
        assert_eq!(turns(0.0, 0.0), 0.0);
    }
}
