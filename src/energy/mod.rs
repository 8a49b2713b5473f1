//! No energy is created: the reflectance is divided by what the albedo would exceed one by (model.md, "The reflectance").
//!
//! `f'(wi, wo) = f(wi, wo) / max(1, A(wi), A(wo))` reflects at most `A(wi)/max(1, A(wi)) ≤ 1` of what falls on it, at every
//! direction and whatever `f` is, if `A(wi)` is at least `∫ f cosθo dωo`, the albedo of the model as it is. It is reciprocal
//! because `f` is.
//!
//! The bound holds for less. Light that leaves in a direction is divided by that direction's `A` as well, so that it is enough if
//!
//! ```text
//! A(wi) ≥ t,  the least t ≥ 1 with  ∫ f(wi, wo) min(1, t/max(1, A(wo))) cosθo dωo ≤ t
//! ```
//!
//! because the integral over `t` falls with `t`, and at `t = max(1, A(wi))` it is the albedo of `f'`. That spares directions from which a
//! narrow order leaves along the surface: the albedo has a pole there, of light that its own direction takes away anyway, and a table would
//! spread it over whole cells. What is asked for falls where `A` rises, so that any `B ≤ A` may stand for `A` in the integral.
//!
//! [`AlbedoTable`] holds `A` on a grid of direction and wavelength. A first grid, half as fine, holds the albedo; a second what is asked for
//! with that in the integral, which is less; this is `B`. Nodes of the table have what is asked for with `B`, and are raised until the table
//! is not below what is asked for at tens of thousands of places between them, and at more about those where it was. At others it can be, by
//! little: see `docs/tables.md`.

mod build;
mod colour;
mod grid;
pub(crate) mod lobes;
mod node_gaussian;
mod power_grid;
mod quadrature;
mod raise;

pub use build::AlbedoReport;
use build::{Fineness, Group, Source};
pub use colour::{ColourAlbedoTable, ColourAlbedoView};
pub(crate) use grid::GridPlace;
use grid::place;

use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::{Options, Vec3};
use crate::table::{Progress, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use lobes::Lobes;
use serde::{Deserialize, Serialize};

/// How the words of a table are arranged: `[wavelength][y][x]`, cell by cell.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlbedoLayout {
    /// Cells along either side of the square about the disc of directions.
    pub cells: u32,
    /// Nodes in wavelength, at least two; the bands where the table holds colours.
    pub planes: u32,
    /// Wavelength of the first plane in nm.
    pub wavelength_min_nm: f32,
    /// Planes of the grid for each nm of wavelength.
    pub planes_per_nm: f32,
}

/// The divisor of the reflectance as a table.
///
/// A node holds `(A − 1)·cos²θ`: zero where nothing is to be divided, and finite at the horizon, where `A` has a pole (of the first order if
/// nodes are narrow, of the second where they are wider than cosθ). A cell is a packet of four words, so that one read serves a look-up: the corners
/// (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) of its lower plane of wavelength and then of its upper, each the upper half of a number of
/// single precision, rounded up.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AlbedoTable {
    layout: AlbedoLayout,
    words: Vec<u32>,
}

impl AlbedoTable {
    /// The table of an ensemble; `None` for a table of amplitudes, whose powers do not add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<(Self, AlbedoReport)> {
        let lobes = Lobes::quick(table, options)?;
        let fineness = Fineness::of(&lobes);
        let Fineness { cells, planes, .. } = fineness;
        let per_nm = f64::from(planes - 1) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM);
        let layout =
            AlbedoLayout { cells, planes, wavelength_min_nm: WAVELENGTH_MIN_NM as f32, planes_per_nm: per_nm as f32 };
        let group = |at: f64| {
            let nm = WAVELENGTH_MIN_NM + at * (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM);
            Group { planes: [at], wavelengths: vec![(nm, [1.0])] }
        };
        let source = Source { lobes: &lobes, fineness, group: &group };
        let nodes = source.build(layout, progress);
        let cells = cells as usize;
        let words = (0..cells * cells * (planes as usize - 1)).flat_map(|i| {
            let half = |k: usize| {
                let node = layout.corner([i % cells, i / cells % cells, i / cells / cells], k);
                bf16_above(nodes.values[node])
            };
            [0, 2, 4, 6].map(|k| half(k) | half(k + 1) << 16)
        });
        Some((Self { layout, words: words.collect() }, source.report(&nodes)))
    }

    /// Arrangement of [`AlbedoTable::words`].
    pub fn layout(&self) -> &AlbedoLayout {
        &self.layout
    }

    /// The packets of all cells.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// Whether no albedo exceeds one, so that nothing is divided.
    pub fn is_one(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// What evaluates, by value.
    pub fn view<F>(&self) -> AlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        AlbedoView { layout: self.layout, words: &self.words }
    }

    /// `1/max(1, A(wi), A(wo))` in double precision, the wavelength in nm.
    pub fn factor(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        self.view::<f64>().factor(wi, wo, wavelength_nm, true)
    }
}

/// Reads an [`AlbedoTable`], over any [`Numbers`].
#[derive(Clone, Copy)]
pub struct AlbedoView<N: Numbers> {
    /// As of the table.
    pub layout: AlbedoLayout,
    /// [`AlbedoTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> AlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))`.
    #[inline(always)]
    pub fn factor(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        self.factor_at(&self.place(wi), &self.place(wo), wavelength_nm, active)
    }

    /// The same for places of directions, which serve every wavelength.
    #[inline(always)]
    pub(crate) fn factor_at(
        &self,
        i: &GridPlace<N>,
        o: &GridPlace<N>,
        wavelength_nm: N::Real,
        active: N::Mask,
    ) -> N::Real {
        let excess = self.excess(i, wavelength_nm, active).max(self.excess(o, wavelength_nm, active));
        N::Real::lit(1.0) / (N::Real::lit(1.0) + excess)
    }

    /// Where in the grid a direction lies.
    #[inline(always)]
    pub(crate) fn place(&self, w: [N::Real; 3]) -> GridPlace<N> {
        place(self.layout.cells, w)
    }

    /// `A − 1`.
    #[inline(always)]
    pub(crate) fn excess(&self, place: &GridPlace<N>, wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let lit = |value: f64| N::Real::lit(value);
        let last = f64::from(self.layout.planes - 1);
        let l = (wavelength_nm - lit(self.layout.wavelength_min_nm.into())) * lit(self.layout.planes_per_nm.into());
        let l = l.clip(lit(0.0), lit(last));
        let plane = l.floor().min(lit(last - 1.0));
        let in_plane = self.layout.cells * self.layout.cells;
        let packet = N::index(plane) * N::Index::lit(in_plane) + place.cell;
        let corners = N::gather::<4>(self.words, packet, active).map(bf16_pair::<N>);
        let [low, high] = [0, 2].map(|first| {
            let [near, far] = [0, 1].map(|row| lerp(corners[first + row][0], corners[first + row][1], place.x));
            lerp(near, far, place.y)
        });
        lerp(low, high, l - plane) * place.per_squared_cosine
    }
}

/// The upper half of a number of single precision that is not below `value`, for values of zero and more.
fn bf16_above(value: f32) -> u32 {
    let bits = value.to_bits();
    (bits >> 16) + u32::from(bits & 0xffff != 0)
}
