//! Table of the divisor A for transparent bodies: the sum of what they reflect and transmit.
//!
//! One divisor serves reflection and transmission, `max(1, A(wi), A(wo))`, each direction on its own side of the
//! relief. So energy is conserved and reciprocity kept. Light that a film traps counts as transmitted.
//!
//! Wave vectors are in units of the wave number in the medium, whose index is n: they have the length 1 in the medium
//! and 1/n in air. In these units the relief is magnified n times, and S is the power spectrum of that. Ki and Ko are
//! the wave vectors of wi and wo, and w is the normal component of Ki + Ko. S is read at the frequency
//! `(Ki + Ko)_xy/λ'` and the phase rate `κ = 2πw/λ"`. λ' is λ over the scale of the relief's pattern, and λ" is λ over
//! that of its heights (`sizes.rs`).
//!
//! The albedo is `a(wi) = Σ_m F(wi, wo_m)·P_m(κ)` over the portions m of the spectral table (`portion.rs`) and over
//! both sides of wo_m. P_m is a portion's power. The factor F of a body (`scattering/transparent.rs`) vanishes at the
//! horizon, so albedos are finite there. A follows from a at the nodes, and is raised between them (`nodes.rs`). Each
//! portion counts at its own frequency, or at three frequencies along an axis on which it is wide.
//!
//! S is read at positive w only: S of a negative w is that of −w at the opposite frequency. All directions on a side
//! are taken to have one sign of w (`Passage::turn`), an approximation.
//!
//! The table holds `(A − 1)·cos²θ`, as every [`AlbedoTable`], at the nodes of a grid of directions (`grid.rs`), on
//! planes over λ' and, for several sizes, on slabs over λ" (`sizes.rs`).

use super::build::excess;
use super::grid::Grid;
use super::integral::phase_per_cosine;
use super::nodes::Nodes;
use super::portion::{NARROW_SIDE_PER_UM, Portion, portions};
use super::{AlbedoLayout, AlbedoTable, Real4};
use crate::numeric::{Lanes, Number, Numbers, Real, Values};
use crate::scattering::{Passage, SLAB_PHASE, SizeRange, TYPICAL_WAVELENGTH_UM, TransparentBody, Vec3};
use crate::table::{NodeQuantity, PowerCurves, Progress, SpectralTable, WAVELENGTH_MIN_NM};
use std::f64::consts::TAU;

/// Largest number of portions that count as few. The albedo of few orders changes fastest. Chosen: a larger number
/// takes longer.
const FEW: usize = 100;
/// Numbers of cells along each side of the grid, and of planes over the tables' range of wavelengths, for few portions.
/// With [`SIZE_OF_MANY`], the deepest film of the tests loses 4 % of its albedo to divisors; more take longer.
const SIZE_OF_FEW: (u32, u32) = (24, 11);
/// Cells and planes for more portions. With [`SIZE_OF_FEW`], the albedo's table of a skin's film takes half as long
/// again.
const SIZE_OF_MANY: (u32, u32) = (16, 7);
/// Check points in each cell (`nodes.rs`). With none, an albedo of 1.046 would remain on a sinusoid 1.7 µm high.
/// Chosen: more take longer.
const CHECKS: usize = 4;
/// Standard deviation up to which a Gaussian has a single quadrature node along an axis, in units of the wave number in
/// the medium. Wider ones have those of [`HERMITE_3`]. Chosen: a smaller value takes longer.
const SINGLE_NODE_SIGMA: f64 = 0.01;
/// Abscissae and weights of the three-point Gauss–Hermite rule for a standard normal variate.
const HERMITE_3: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (-1.732_050_807_568_877_2, 1.0 / 6.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// Albedo integral of a transparent body.
struct BodyIntegral<'a> {
    table: &'a SpectralTable,
    /// The body as an interface, even if it is a film, so that light trapped in the film counts as transmitted.
    body: TransparentBody,
    /// Portions of the power.
    portions: Vec<Portion<'a>>,
}

impl AlbedoTable {
    /// Builds the table of a transparent body, from the table of its relief magnified by the index. `None` where no
    /// albedo exceeds one, and for a table of amplitudes, whose powers do not add.
    pub(crate) fn build_of_body(
        table: &SpectralTable,
        body: TransparentBody,
        sizes: Option<&SizeRange>,
        progress: &Progress,
    ) -> Option<Self> {
        if table.quantity() != NodeQuantity::Power {
            return None;
        }
        let integral = BodyIntegral::new(table, body);
        let parts = integral.parts();
        let phase_max = phase_per_cosine(table, 1e-3 * WAVELENGTH_MIN_NM);
        let (cells, planes) = if integral.portions.len() <= FEW { SIZE_OF_FEW } else { SIZE_OF_MANY };
        let layout = AlbedoLayout::new(cells, planes, sizes, phase_max, SLAB_PHASE);
        // No mirror symmetry is used, and these albedos have no pole at the horizon.
        let nodes =
            Nodes { grid: Grid { cells: layout.cells }, planes: layout.planes, is_mirrored: false, has_pole: false };
        let steps = progress.of_steps(2 * layout.slabs() as usize * (nodes.len() + nodes.expected_checks(CHECKS)));
        // The side of air comes first, then that of the medium.
        let mut words = Vec::new();
        for (is_below, slab) in
            [false, true].into_iter().flat_map(|side| (0..layout.slabs()).map(move |slab| (side, slab)))
        {
            // Excess of the divisor for a direction that points upwards on either side.
            let needed = |[x, y, z]: Vec3, plane: f64| {
                let wi = [x, y, if is_below { -z } else { z }];
                excess(integral.albedo(&parts, wi, layout.wavelengths_nm(plane, slab)))
            };
            let mut values = nodes.values(&steps, needed);
            // The last argument, the table's own excess, would allow a coarser integral where that is enough.
            nodes.raise(&mut values, CHECKS, &steps, |wi, plane, _| needed(wi, plane));
            words.extend(nodes.packets(&values));
        }
        let table = Self { layout, words };
        (!table.is_one()).then_some(table)
    }
}

/// Portion of the power, or a part of it that counts at a frequency of its own.
struct Part<'a> {
    /// Frequency along x and y in cycles/µm.
    f: [f64; 2],
    /// Fraction of the portion's power.
    fraction: f64,
    portion: &'a Portion<'a>,
}

impl<'a> BodyIntegral<'a> {
    /// The integral of a body, from the table of its relief magnified by the index.
    fn new(table: &'a SpectralTable, body: TransparentBody) -> Self {
        // The factor of a body has no pole at the horizon, so wide squares suffice.
        let portions = portions(table, NARROW_SIDE_PER_UM);
        Self { table, body: TransparentBody { is_film: false, ..body }, portions }
    }

    /// Quadrature nodes of the integral, at frequencies that the pixels resolve: one of each portion along an axis on
    /// which it is narrow, and [`HERMITE_3`] along an axis on which it is wide. With one, an albedo of 1.12 would
    /// remain on a relief of index 1, 70 nm deep, whose orders are wide. Where there are squares, each portion has one
    /// node, since the sum over so many is smooth.
    fn parts(&self) -> Vec<Part<'_>> {
        let any_squares = self.portions.iter().any(|portion| portion.is_square);
        let mut parts = Vec::new();
        for portion in &self.portions {
            let rules: [&[(f64, f64)]; 2] = portion.sigma_f.map(|sigma| {
                let is_single = any_squares || sigma * TYPICAL_WAVELENGTH_UM < SINGLE_NODE_SIGMA;
                if is_single { &[(0.0, 1.0)] } else { &HERMITE_3[..] }
            });
            for &(x, weight_x) in rules[0] {
                for &(y, weight_y) in rules[1] {
                    let f = [portion.f[0] + x * portion.sigma_f[0], portion.f[1] + y * portion.sigma_f[1]];
                    if self.table.is_resolved(f) {
                        parts.push(Part { f, fraction: weight_x * weight_y, portion });
                    }
                }
            }
        }
        parts
    }

    /// Reflected and transmitted power over the power incident from `wi`: a unit vector away from the relief, below it
    /// for light from the medium. The wavelengths in nm are λ' for frequencies and λ" for κ.
    fn albedo(&self, parts: &[Part<'_>], wi: Vec3, [nm, depth_nm]: [f64; 2]) -> f64 {
        let lit = Real4::lit;
        let incident = self.body.wave::<Lanes>(wi.map(lit));
        let mut albedo = lit(0.0);
        for is_below in [false, true] {
            let to_below = Lanes::mask(is_below);
            let passage = Passage::at_body(self.body, &incident, to_below);
            // Length of outgoing wave vectors over n: 1 in the medium, 1/n in air.
            let length = self.body.reach(is_below);
            for lanes in parts.chunks(Lanes::COUNT) {
                // Surplus lanes repeat the last part with a fraction of zero.
                let at = |lane: usize| &lanes[Ord::min(lane, lanes.len() - 1)];
                let fraction = Lanes::pack(|lane| lanes.get(lane).map_or(0.0, |part| part.fraction));
                // Direction of the outgoing wave vector `turn·λ'f − Ki`. `turn` is the sign of w, and
                // `passage.tangential` is `turn·Ki`.
                let [x, y] = [0, 1].map(|axis| {
                    let outgoing = Lanes::pack(|lane| 1e-3 * nm * at(lane).f[axis]) - passage.tangential[axis];
                    outgoing * passage.turn * lit(1.0 / length)
                });
                let cos_squared = lit(1.0) - x.fma(x, y * y);
                let cos = cos_squared.max(lit(0.0)).sqrt();
                let wo = [x, y, Real4::select(to_below, -cos, cos)];
                let pair = self.body.pair(&incident, &self.body.wave::<Lanes>(wo));
                let kappa = pair.normal() * lit(TAU * 1e3 / depth_nm);
                let power = PowerCurves::<Lanes>::new(self.table, kappa).power(|lane| &at(lane).portion.record);
                // `pair.power()` is F.
                let scattered = power.max(lit(0.0)) * pair.power() * fraction;
                albedo += Real4::select(lit(0.0).lt(cos_squared), scattered, lit(0.0));
            }
        }
        Lanes::total(albedo)
    }
}
