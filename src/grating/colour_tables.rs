//! Tables that a grating's colour lobe reads besides the efficiencies (symbols: `mod.rs`, formulas: `colour_lobe.rs`).
//!
//! | table | axes | entry |
//! | --- | --- | --- |
//! | spectral weights | width τ and mean ν_m of an order's Gaussian | integral of this Gaussian times sRGB's weights |
//! | order 0 | incident direction, projected onto the xz plane: cosine and length | colour of order 0's efficiency |
//! | order weights | bin of the incident direction, order | probability of drawing the order, not normalised |
//!
//! ν is 1/λ in 1/µm. The frequencies `ν·(wi + wo)_xy` of a pair of directions form a line. Along it, order m is a
//! Gaussian over ν. *sRGB's weights* turn a spectrum under D65 into linear sRGB ([`WavelengthWeights`]). A body that
//! transmits has four tables of order 0 ([`OrderZero`]), and order weights for both sides of incident and outgoing
//! light. An efficiency is the fraction of the unpolarised incident power in an order.
//!
//! Look-ups are generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable.
//!
//! The WGSL twin of the look-ups in the first two tables is in `src/methods/grating.wgsl`. A test compares the
//! constants of both.

use super::layout::{Below, InterfaceCells};
use super::surface::GratingSurface;
use crate::colour::WavelengthWeights;
use crate::numeric::math::{GAUSSIAN_REACH, lerp, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::sampling::BELOW_ONE;
use crate::scattering::TransparentBody;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;
use sunbeam_rigorous::Side;

/// Middle of the tables' range of ν in 1/µm. The factor 10³ turns 1/nm into 1/µm.
pub(crate) const NU_MIDDLE: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM + 1.0 / WAVELENGTH_MAX_NM);
/// Half width of the tables' range of ν in 1/µm.
pub(crate) const NU_HALF: f64 = 0.5e3 * (1.0 / WAVELENGTH_MIN_NM - 1.0 / WAVELENGTH_MAX_NM);
/// Scale in 1/µm of the coordinate `τ/(τ + TAU_SCALE)` of a standard deviation τ: about the width of sRGB's weights
/// over ν. Half of the table's nodes are for smaller τ, half for larger ones. Unrelated to the constant 2π.
pub(crate) const TAU_SCALE: f64 = 0.25;
/// Nodes of the table of spectral weights: along τ and along ν_m. More nodes reduce the error of interpolation and
/// enlarge the table.
pub(crate) const WEIGHT_NODES: [u32; 2] = [96, 256];
/// Nodes of the table of order 0 along each axis. More nodes reduce the error of interpolation and lengthen the build.
pub(crate) const ORDER_ZERO_NODES: u32 = 48;
/// Smallest coordinate at which an entry is computed. The node at 0 gets the entry at this coordinate, which is near
/// the limit. Likewise, the last node along τ gets the entry at this distance from 1.
const COORDINATE_MIN: f64 = 1e-3;

/// Smallest divisor: of lengths of `(wi + wo)_xy`, squared direction cosines, probabilities, and wavenumbers in 1/µm.
/// In the exact mirror direction the length is 0. The bound is far below all values of relevance, and the quotients
/// stay finite in single precision.
pub(crate) const DIVISOR_MIN: f64 = 1e-9;

/// Means and standard deviations in 1/µm of the proposed Gaussians: ν is drawn from one of them, each with equal
/// probability. They follow sRGB's weights of blue, green and red; a worse fit makes renderings noisier.
pub(super) const PROPOSED: [(f64, f64); 3] = [(2.2, 0.13), (1.86, 0.13), (1.63, 0.11)];
/// Quantiles of each proposed Gaussian at which efficiencies are averaged. More make the weights of orders closer to
/// their power, and the build longer.
const PROPOSED_NODES: usize = 16;
/// Bins of the incident direction: over the sine of the angle between its projection onto the xz plane and the normal,
/// from 1 to −1, and over the magnitude of its cosine along the grooves, from 0 to 1. Within a bin the probabilities of
/// orders are constant; more bins make them more accurate and the table larger.
const BINS: [u32; 2] = [32, 12];
/// Positions in a bin at which efficiencies are averaged, as fractions of its sides: the centre, and near each corner,
/// so that orders that propagate only near an edge of the bin have a weight.
const BIN_POINTS: [(f64, f64); 5] = [(0.5, 0.5), (0.02, 0.02), (0.02, 0.98), (0.98, 0.02), (0.98, 0.98)];

/// Layout of the three tables in their data, which begin with the spectral weights.
///
/// An entry of spectral weights and of order 0 is a packet of four words: red, green, blue, and zero. Order weights are
/// `[side of the incident light][bin across the grooves][bin along them][entry]`. The entries of such a row are the
/// orders from `−orders` to `orders` that leave above, those that leave below a body that transmits, and the sum. All
/// words are bits of single-precision numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTables {
    /// The highest order that propagates at any incidence and wavelength.
    pub orders: u32,
    /// Number of sides of the relief on which light arrives and leaves: 1 or 2.
    pub sides: u32,
    /// Offset in words of the colours of order 0.
    order_zero: u32,
    /// Offset in words of the order weights.
    order_weights: u32,
}

impl ColourTables {
    /// Builds the tables of a grating. Returns their layout and data.
    pub(super) fn build(grating: &GratingSurface) -> (Self, Vec<u32>) {
        // Order m changes the wave vector's x component by 2πm/d. The component lies between −2πn/λ and 2πn/λ, where n
        // is the larger refractive index of both sides. Hence |m| ≤ 2nd/λ; here d is in µm and λ in nm.
        let efficiencies = grating.layout().efficiencies;
        let orders = (2e3 * grating.layout().period_um * efficiencies.eta_below() / WAVELENGTH_MIN_NM) as u32;
        let sides = if efficiencies.transmits() { 2 } else { 1 };
        let mut words: Vec<f32> = spectral_weight_table();
        let order_zero = words.len() as u32;
        let kinds = if sides == 1 { &OrderZero::ALL[..1] } else { &OrderZero::ALL };
        words.extend(kinds.iter().flat_map(|&kind| order_zero_table(grating, kind)));
        let order_weights = words.len() as u32;
        let tables = Self { orders, sides, order_zero, order_weights };
        words.extend(tables.order_weight_table(grating));
        (tables, words.into_iter().map(f32::to_bits).collect())
    }

    /// The data that evaluation reads, spectral weights and order 0, and the index of the first packet of order 0. The
    /// order weights, which only sampling reads, are left out.
    pub(crate) fn packets<'a>(&self, words: &'a [u32]) -> (&'a [u32], u32) {
        (&words[..self.order_weights as usize], self.order_zero / 4)
    }

    /// Entry of the table of spectral weights ([`spectral_weight_table`]) for red, green and blue. `width` is
    /// `τ/(τ + TAU_SCALE)`. `centre` is 0 and 1 where ν_m lies `GAUSSIAN_REACH·τ` below and above the range of ν.
    #[inline(always)]
    pub(super) fn spectral_weights<N: Numbers>(
        &self,
        words: N::Words,
        width: N::Real,
        centre: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        interpolated::<N>(words, N::Index::lit(0), WEIGHT_NODES, [width, centre], active)
    }

    /// Colour of order 0's efficiency, linear sRGB. The incident direction is given by its projection onto the xz
    /// plane: the cosine of the angle between projection and normal, and the length `√(1 − y²)` of the projection.
    /// `kind` is an [`OrderZero`] as a number.
    #[inline(always)]
    pub(super) fn order_zero<N: Numbers>(
        &self,
        words: N::Words,
        kind: N::Index,
        projected_cosine: N::Real,
        projected_length: N::Real,
        active: N::Mask,
    ) -> [N::Real; 3] {
        let coordinates = [projected_cosine, projected_length];
        let packets = N::Index::lit(ORDER_ZERO_NODES * ORDER_ZERO_NODES);
        let first = N::Index::lit(self.order_zero / 4) + kind * packets;
        interpolated::<N>(words, first, [ORDER_ZERO_NODES; 2], coordinates, active)
    }

    /// Number of entries of a row of order weights without their sum.
    pub(super) fn row_entries(&self) -> u32 {
        self.sides * self.orders_on_side()
    }

    /// Number of orders on one side in a row of order weights.
    pub(super) fn orders_on_side(&self) -> u32 {
        2 * self.orders + 1
    }

    /// Entry of an order, from `−orders` to `orders`, in a row of order weights. The order leaves below the relief
    /// where the mask is true.
    #[inline(always)]
    pub(super) fn row_entry<N: Numbers>(&self, order: N::Real, is_below: N::Mask) -> N::Index {
        // The bound keeps the argument of `index` in its range in inactive lanes.
        let entry = N::index((order + N::Real::lit(f64::from(self.orders))).max(N::Real::lit(0.0)));
        if self.sides == 1 {
            return entry;
        }
        N::Index::select(is_below, entry + N::Index::lit(self.orders_on_side()), entry)
    }

    /// Order of an entry in a row, and whether it leaves below the relief.
    #[inline(always)]
    pub(super) fn order_and_side<N: Numbers>(&self, entry: N::Index) -> (N::Real, N::Mask) {
        let most = N::Real::lit(f64::from(self.orders));
        if self.sides == 1 {
            return (N::real(entry) - most, N::mask(false));
        }
        let above = N::Index::lit(self.orders_on_side());
        let is_below = above.le(entry);
        // The smaller of `above` and the entry avoids a negative difference where it is not selected.
        (N::real(N::Index::select(is_below, entry - above.min(entry), entry)) - most, is_below)
    }

    /// Offset in words of the row of order weights for an incident direction, from below the relief where the mask is
    /// true.
    #[inline(always)]
    pub(super) fn order_weights_row<N: Numbers>(&self, wi: [N::Real; 3], is_below: N::Mask) -> N::Index {
        let real = N::Real::lit;
        let projected_length = (real(1.0) - wi[1] * wi[1]).max(real(DIVISOR_MIN)).sqrt();
        let bin = |coordinate: N::Real, count: u32| {
            N::index(coordinate.clip(real(0.0), real(BELOW_ONE)) * real(f64::from(count)))
        };
        let across = bin((real(1.0) - wi[0] / projected_length) * real(0.5), BINS[0]);
        let along = bin(wi[1].abs(), BINS[1]);
        let row_length = N::Index::lit(self.row_entries() + 1);
        let first = N::Index::lit(self.order_weights) + (across * N::Index::lit(BINS[1]) + along) * row_length;
        if self.sides == 1 {
            return first;
        }
        let rows_above = N::Index::lit(BINS[0] * BINS[1]) * row_length;
        N::Index::select(is_below, first + rows_above, first)
    }

    /// Weight in a row, by its entry ([`ColourTables::row_entry`]).
    #[inline(always)]
    pub(super) fn order_weight<N: Numbers>(
        &self,
        words: N::Words,
        row: N::Index,
        entry: N::Index,
        active: N::Mask,
    ) -> N::Real {
        let [word] = N::gather::<1>(words, row + entry, active);
        N::from_bits(word)
    }

    /// Sum of the weights of a row.
    #[inline(always)]
    pub(super) fn total_weight<N: Numbers>(&self, words: N::Words, row: N::Index, active: N::Mask) -> N::Real {
        self.order_weight::<N>(words, row, N::Index::lit(self.row_entries()), active)
    }

    /// Table of order weights, arranged as [`ColourTables`] describes.
    fn order_weight_table(&self, grating: &GratingSurface) -> Vec<f32> {
        let bins = BINS[0] * BINS[1];
        (0..self.sides * bins)
            .into_par_iter()
            .flat_map_iter(|row| {
                let from = if row < bins { Side::Above } else { Side::Below };
                // Rounded to single precision before the sum, so that it matches the stored weights.
                let weights = self.bin_weights(grating, from, row % bins);
                let mut entries: Vec<f32> = weights.into_iter().map(|weight| weight as f32).collect();
                entries.push(entries.iter().sum());
                entries
            })
            .collect()
    }

    /// Order weights of light from a bin on the side `from`, without their sum. Each is the sum of the order's
    /// efficiencies over points of the bin and over wavenumbers of the [`PROPOSED`] Gaussians.
    fn bin_weights(&self, grating: &GratingSurface, from: Side, bin: u32) -> Vec<f64> {
        let sides = &[Side::Above, Side::Below][..self.sides as usize];
        let orders = self.orders as i32;
        let mut weights = vec![0.0; self.row_entries() as usize];
        for (across, along) in BIN_POINTS {
            // Direction cosines x and y of the incident light at this point of the bin.
            let y = (f64::from(bin % BINS[1]) + along) / f64::from(BINS[1]);
            let sine = 1.0 - 2.0 * (f64::from(bin / BINS[1]) + across) / f64::from(BINS[0]);
            let x = sine * (1.0 - y * y).sqrt();
            for (mean, sigma) in PROPOSED {
                for i in 0..PROPOSED_NODES {
                    let probability = (i as f64 + 0.5) / PROPOSED_NODES as f64;
                    let nu = mean + sigma * normal_quantile(probability);
                    let nm = (1e3 / nu).clamp(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
                    let outgoing = sides.iter().flat_map(|&to| (-orders..=orders).map(move |m| (m, to)));
                    for (weight, (m, to)) in weights.iter_mut().zip(outgoing) {
                        *weight += grating.efficiency_between(nm, [x, y], m, [from, to]);
                    }
                }
            }
        }
        weights
    }
}

/// Kinds of light in order 0, each with a table of its own. Only [`OrderZero::ReflectedAbove`] exists at a grating
/// without transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OrderZero {
    /// Reflected above the relief. The sign of x does not matter, by reciprocity.
    ReflectedAbove,
    /// Reflected below the relief. The sign of x does not matter here either.
    ReflectedBelow,
    /// Transmitted, where the direction above the relief has x ≥ 0. By reciprocity it serves both ways of the light.
    TransmittedPositive,
    /// Transmitted, where the direction above the relief has x < 0.
    TransmittedNegative,
}

impl OrderZero {
    /// All kinds, in the order of their tables.
    const ALL: [Self; 4] =
        [Self::ReflectedAbove, Self::ReflectedBelow, Self::TransmittedPositive, Self::TransmittedNegative];

    /// Sides of incident and outgoing light, and the sign of x of the incident direction, in the table's build.
    fn incidence(self) -> ([Side; 2], f64) {
        match self {
            Self::ReflectedAbove => ([Side::Above; 2], 1.0),
            Self::ReflectedBelow => ([Side::Below; 2], 1.0),
            Self::TransmittedPositive => ([Side::Above, Side::Below], 1.0),
            Self::TransmittedNegative => ([Side::Above, Side::Below], -1.0),
        }
    }
}

/// Table of spectral weights, packets `[width][centre]`:
/// `∫ weight(1/ν) exp(−(ν − ν_m)²/2τ²) dν / width`, with the coordinate `width = τ/(τ + TAU_SCALE)`. The divisor makes
/// the limit of τ → 0 finite; the lobe multiplies by `width` again.
fn spectral_weight_table() -> Vec<f32> {
    // ν and weights of every visible wavelength; the fourth weight is not read.
    let wavelengths: Vec<(f64, [f64; 4])> = WavelengthWeights::per_nm()
        .iter()
        .enumerate()
        .map(|(i, weight)| (1e3 / (WAVELENGTH_MIN_NM + i as f64), weight.map(f64::from)))
        .collect();
    (0..WEIGHT_NODES[0])
        .into_par_iter()
        .flat_map_iter(|row| {
            // The first and last rows stand for zero and infinite width.
            let width = (f64::from(row) / f64::from(WEIGHT_NODES[0] - 1)).clamp(COORDINATE_MIN, 1.0 - COORDINATE_MIN);
            let tau = TAU_SCALE * width / (1.0 - width);
            let wavelengths = &wavelengths;
            (0..WEIGHT_NODES[1]).flat_map(move |column| {
                // From −1 to 1, where the coordinate of look-ups is from 0 to 1.
                let from_middle = 2.0 * f64::from(column) / f64::from(WEIGHT_NODES[1] - 1) - 1.0;
                let nu_m = NU_MIDDLE + from_middle * (NU_HALF + GAUSSIAN_REACH * tau);
                let mut sum = [0.0; 3];
                for (nu, weight) in wavelengths {
                    let offset = (nu - nu_m) / tau;
                    // The integral as a sum over wavelengths 1 nm apart. A weight is weight(λ) dλ, and dν = ν² dλ.
                    let gaussian = (-0.5 * offset * offset).exp() * nu * nu / width;
                    for (total, weight) in sum.iter_mut().zip(weight) {
                        *total += weight * gaussian;
                    }
                }
                [sum[0] as f32, sum[1] as f32, sum[2] as f32, 0.0]
            })
        })
        .collect()
}

/// Table of order 0's colours, packets `[cosine][length]` of the projection (see [`ColourTables::order_zero`]). A
/// colour is the mean of the efficiency over wavelengths, by sRGB's weights times ν², the factor 1/λ² of `f_r`.
///
/// For light reflected below an interface, the efficiency is divided by the reflectance of a flat interface. This
/// removes a square root at the critical angle, which the table would not resolve.
fn order_zero_table(grating: &GratingSurface, kind: OrderZero) -> Vec<f32> {
    let (sides, sign) = kind.incidence();
    let coordinate = |node: u32| (f64::from(node) / f64::from(ORDER_ZERO_NODES - 1)).max(COORDINATE_MIN);
    (0..ORDER_ZERO_NODES * ORDER_ZERO_NODES)
        .into_par_iter()
        .flat_map_iter(|node| {
            let [cosine, length] = [node / ORDER_ZERO_NODES, node % ORDER_ZERO_NODES].map(coordinate);
            let (x, y) = (sign * length * (1.0 - cosine * cosine).sqrt(), (1.0 - length * length).sqrt());
            let flat = match (kind, grating.layout().efficiencies.below) {
                (OrderZero::ReflectedBelow, Below::Interface(interface)) => {
                    flat_reflectance::<Plain<'_, f64>>(interface, cosine * length)
                }
                _ => 1.0,
            };
            let (mut sum, mut total) = ([0.0; 3], [0.0; 3]);
            for (i, weight) in WavelengthWeights::per_nm().iter().enumerate() {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let efficiency = grating.efficiency_between(nm, [x, y], 0, sides) / flat;
                for c in 0..3 {
                    let weight = f64::from(weight[c]) / (nm * nm);
                    sum[c] += weight * efficiency;
                    total[c] += weight;
                }
            }
            [(sum[0] / total[0]) as f32, (sum[1] / total[1]) as f32, (sum[2] / total[2]) as f32, 0.0]
        })
        .collect()
}

/// Reflectance of a flat interface for light that arrives in the medium, at a cosine with the normal. It has a positive
/// lower bound, since efficiencies are divided by it.
#[inline(always)]
pub(super) fn flat_reflectance<N: Numbers>(interface: InterfaceCells, cosine: N::Real) -> N::Real {
    /// The lower bound. It acts for media of nearly the index of air, which hardly reflect.
    const REFLECTANCE_MIN: f64 = 1e-3;
    // `reflectance`, Fresnel's equations, does not read `normal_min`. A direction below the relief has a negative z.
    let body = TransparentBody { eta: interface.eta, is_film: false, normal_min: 0.0 };
    let zero = N::Real::lit(0.0);
    body.wave::<N>([zero, zero, -cosine]).reflectance().max(N::Real::lit(REFLECTANCE_MIN))
}

/// Colour by bilinear interpolation in a table that begins at the packet `first`. The table is
/// `[first axis][second axis]` with `counts` nodes; `coordinates` along both are in [0, 1].
#[inline(always)]
fn interpolated<N: Numbers>(
    words: N::Words,
    first: N::Index,
    counts: [u32; 2],
    coordinates: [N::Real; 2],
    active: N::Mask,
) -> [N::Real; 3] {
    let real = N::Real::lit;
    let index = N::Index::lit;
    // Along each axis, the lower node and the fraction of a step from it.
    let [(i, to_next_i), (j, to_next_j)] = array::from_fn(|axis| {
        let last = f64::from(counts[axis] - 1);
        let x = coordinates[axis].clip(real(0.0), real(1.0)) * real(last);
        let low = x.floor().min(real(last - 1.0));
        (N::index(low), x - low)
    });
    let at = |di: u32, dj: u32| {
        let packet = first + (i + index(di)) * index(counts[1]) + j + index(dj);
        N::gather::<4>(words, packet, active).map(N::from_bits)
    };
    let (a, b, c, d) = (at(0, 0), at(0, 1), at(1, 0), at(1, 1));
    array::from_fn(|component| {
        let low = lerp(a[component], b[component], to_next_j);
        let high = lerp(c[component], d[component], to_next_j);
        lerp(low, high, to_next_i)
    })
}
