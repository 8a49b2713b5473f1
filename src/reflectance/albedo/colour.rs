//! The same for renderers that carry colours instead of wavelengths.

use super::build::{layout, raise, scattered};
use super::gathered::Gathered;
use super::grid::{Place, place};
use super::{AlbedoLayout, bf16_above};
use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::reflectance::Vec3;
use crate::reflectance::integrated::WavelengthWeights;
use crate::reflectance::surface::Options;
use crate::table::{KernelKind, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Bands: red, green and blue.
const BANDS: usize = 3;
/// Wavelengths of an integral over a band.
const WAVELENGTHS: usize = 32;
/// Places between the nodes of every cell that are looked at.
const SAMPLES: usize = 2;
/// Words of a cell: two for each band, and as many of padding.
const WORDS: usize = 8;

/// `max(1, A)` of the reflectance in linear sRGB under D65, with the weights of [`WavelengthWeights`].
///
/// As [`super::AlbedoTable`], with bands in place of wavelengths and the albedo itself in place of what suffices: the
/// integral over wavelengths has no poles that a cell could not hold. Where a band's reflectance is negative for some
/// directions, out of gamut, its albedo counts that as it is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourAlbedoTable {
    layout: AlbedoLayout,
    words: Vec<u32>,
}

impl ColourAlbedoTable {
    /// The table of an ensemble; `None` for a table of amplitudes.
    pub fn build(table: &SpectralTable, options: &Options) -> Option<Self> {
        if table.kernel() != KernelKind::Power {
            return None;
        }
        let gathered = Gathered::new(table, options);
        let layout = AlbedoLayout { planes: 1, planes_per_nm: 0.0, ..layout(&gathered) };
        let (side, cells) = (layout.side(), layout.cells as usize);
        let node = |i: usize| {
            let (wi, radius) = layout.direction([(i % side) as f64, (i / side) as f64]);
            if layout.is_beyond(radius) { [0.0; BANDS] } else { excesses(&gathered, wi) }
        };
        let nodes: Vec<[f64; BANDS]> = (0..layout.in_plane()).into_par_iter().map(node).collect();
        let mut values: [Vec<f32>; BANDS] = std::array::from_fn(|band| nodes.iter().map(|v| v[band] as f32).collect());
        let corners = |x: usize, y: usize| [y * side + x, y * side + x + 1, (y + 1) * side + x, (y + 1) * side + x + 1];
        let asked: Vec<_> = (0..cells * cells * SAMPLES)
            .into_par_iter()
            .filter_map(|i| {
                let (x, y) = (i / SAMPLES % cells, i / SAMPLES / cells);
                let [tx, ty, _] = scattered(i);
                let (wi, radius) = layout.direction([x as f64 + tx, y as f64 + ty]);
                let weights = [(1.0 - tx) * (1.0 - ty), tx * (1.0 - ty), (1.0 - tx) * ty, tx * ty];
                let nodes = corners(x, y);
                (radius < 1.0)
                    .then(|| (std::array::from_fn::<_, 4, _>(|k| (nodes[k], weights[k])), excesses(&gathered, wi)))
            })
            .collect();
        for (band, values) in values.iter_mut().enumerate() {
            raise(values, asked.iter().map(|(corners, asked)| (*corners, asked[band])));
        }
        let words = (0..cells * cells).flat_map(|i| {
            let nodes = corners(i % cells, i / cells);
            let half = |band: usize, corner: usize| bf16_above(values[band][nodes[corner]]);
            std::array::from_fn::<u32, WORDS, _>(|w| match w / 2 {
                band if band < BANDS => half(band, w % 2 * 2) | half(band, w % 2 * 2 + 1) << 16,
                _ => 0,
            })
        });
        Some(Self { layout, words: words.collect() })
    }

    /// Arrangement: `[y][x]`, cells of eight words, two for each band and two of padding: the corners (x, y) and (x + 1, y) in one,
    /// those of y + 1 in the other.
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

    /// What evaluates, by value.
    pub fn view<F>(&self) -> ColourAlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourAlbedoView { layout: self.layout, words: &self.words }
    }
}

/// `(A − 1)` of every band times cos²θ, never negative.
fn excesses(gathered: &Gathered, wi: Vec3) -> [f64; BANDS] {
    let step = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / WAVELENGTHS as f64;
    let (mut albedo, mut total) = ([0.0; BANDS], [0.0; BANDS]);
    for k in 0..WAVELENGTHS {
        let nm = WAVELENGTH_MIN_NM + (k as f64 + 0.5) * step;
        let weights = WavelengthWeights::at(nm);
        let mut sum = 0.0;
        gathered.visit(wi, nm, |_, part| sum += part);
        for band in 0..BANDS {
            albedo[band] += weights[band] * sum;
            total[band] += weights[band];
        }
    }
    std::array::from_fn(|band| {
        let albedo = albedo[band] / total[band];
        if albedo > super::build::ALBEDO_MAX { (albedo - 1.0) * wi[2] * wi[2] } else { 0.0 }
    })
}

/// Reads a [`ColourAlbedoTable`], over any [`Numbers`].
pub struct ColourAlbedoView<N: Numbers> {
    /// As of the table.
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

    #[inline(always)]
    fn excess(&self, place: &Place<N>, active: N::Mask) -> [N::Real; BANDS] {
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
