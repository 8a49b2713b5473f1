//! The divisor of red, green and blue, for renderers that carry colours instead of wavelengths. `methods/albedo.wgsl`
//! is its twin in WGSL.

use super::build::{Builder, Group};
use super::grid::{Grid, GridPlace, place};
use super::{AlbedoIntegral, AlbedoLayout, bf16_above};
use crate::colour::WavelengthWeights;
use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::Options;
use crate::table::{Progress, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};

/// Number of bands: red, green and blue.
const BANDS: usize = 3;
/// Wavelengths of an integral over the bands without ridges. Chosen.
const WAVELENGTHS: usize = 12;
/// Wavelengths of an integral over the bands where narrow orders have ridges. Chosen, so that the test of bands holds
/// 1.01.
const WAVELENGTHS_OF_RIDGES: usize = 32;
/// Cells along a side. Ridges are spread over a band, so the grids of wavelengths would be finer than needed.
const CELLS: u32 = 16;
/// Cells along a side where narrow orders have ridges.
const CELLS_OF_RIDGES: u32 = 32;
/// Words of a cell: two for each band, and two of padding.
const WORDS: usize = 8;

/// The divisor `max(1, A)` of the reflectance in linear sRGB under D65, with the weights of [`WavelengthWeights`].
///
/// It is an [`AlbedoTable`](super::AlbedoTable) with bands in place of wavelengths. A band's reflectance may be
/// negative for some directions, out of gamut, and its albedo includes them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourAlbedoTable {
    layout: AlbedoLayout,
    words: Vec<u32>,
}

impl ColourAlbedoTable {
    /// The table of an ensemble; `None` for a table of amplitudes, whose powers do not add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<Self> {
        let integral = AlbedoIntegral::fast(table, options)?;
        let (cells, wavelengths) = match integral.has_ridges() {
            true => (CELLS_OF_RIDGES, WAVELENGTHS_OF_RIDGES),
            false => (CELLS, WAVELENGTHS),
        };
        let layout = AlbedoLayout { cells, planes: BANDS as u32, wavelength_min_nm: 0.0, planes_per_nm: 0.0 };
        let grid = Grid { cells };
        let group = |_| bands(wavelengths);
        let nodes = Builder::new(&integral, 1, &group).build(grid, progress);
        let cells = cells as usize;
        let words = (0..cells * cells).flat_map(|i| {
            let corner = |band: usize, dx: usize, dy: usize| match &nodes {
                Some(nodes) => bf16_above(nodes.values[(i / cells + dy) * grid.side() + i % cells + dx][band]),
                None => 0,
            };
            std::array::from_fn::<u32, WORDS, _>(|w| match w / 2 {
                band if band < BANDS => corner(band, 0, w % 2) | corner(band, 1, w % 2) << 16,
                _ => 0,
            })
        });
        Some(Self { layout, words: words.collect() })
    }

    /// Arrangement: `[y][x]`, cells of eight words, two for each band and two of padding. A band's first word holds the
    /// corners (x, y) and (x + 1, y), its second (x, y + 1) and (x + 1, y + 1).
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

    /// Whether no albedo exceeds one.
    pub fn is_one(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// The evaluator over plain numbers.
    pub fn view<F>(&self) -> ColourAlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourAlbedoView { layout: self.layout, words: &self.words }
    }
}

/// The bands as one group, integrated over `count` wavelengths.
fn bands(count: usize) -> Group<BANDS> {
    let step = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / count as f64;
    let at = |k: usize| WAVELENGTH_MIN_NM + (k as f64 + 0.5) * step;
    let mut wavelengths: Vec<(f64, [f64; BANDS])> = (0..count)
        .map(|k| {
            let weights = WavelengthWeights::at(at(k));
            (at(k), std::array::from_fn(|band| weights[band]))
        })
        .collect();
    let total: [f64; BANDS] = std::array::from_fn(|band| wavelengths.iter().map(|(_, weights)| weights[band]).sum());
    wavelengths.iter_mut().for_each(|(_, weights)| (0..BANDS).for_each(|band| weights[band] /= total[band]));
    Group { wavelengths, spacing_nm: 0.0 }
}

/// The evaluator of a [`ColourAlbedoTable`], over any [`Numbers`].
pub struct ColourAlbedoView<N: Numbers> {
    /// [`ColourAlbedoTable::layout`].
    pub layout: AlbedoLayout,
    /// [`ColourAlbedoTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> ColourAlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))` of red, green and blue, for directions of unit length above the surface.
    #[inline(always)]
    pub fn factor(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; BANDS] {
        let [i, o] = [wi, wo].map(|w| self.excess(&place(self.layout.cells, w), active));
        std::array::from_fn(|band| N::Real::lit(1.0) / (N::Real::lit(1.0) + i[band].max(o[band])))
    }

    /// `A − 1` of red, green and blue.
    #[inline(always)]
    fn excess(&self, place: &GridPlace<N>, active: N::Mask) -> [N::Real; BANDS] {
        let first = place.cell << 1;
        let low = N::gather::<4>(self.words, first, active).map(bf16_pair::<N>);
        let high = N::gather::<4>(self.words, first + N::Index::lit(1), active).map(bf16_pair::<N>);
        let rows = [[low[0], low[1]], [low[2], low[3]], [high[0], high[1]]];
        rows.map(|rows| {
            let [near, far] = rows.map(|[left, right]| lerp(left, right, place.x));
            lerp(near, far, place.y) * place.per_squared_cosine
        })
    }
}
