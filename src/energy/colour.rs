//! Table of the divisor A ([module](super)), by which reflectances are divided so that no albedo exceeds 1, for red,
//! green and blue: renderers that carry colours read it. `methods/albedo.wgsl` evaluates it in WGSL.
//!
//! A colour channel is a band: an integral over wavelengths with its weights in linear sRGB. Its albedo is the weighted
//! mean of the albedos by wavelength.

use super::build::{Builder, Group, SMALLEST_SIZE};
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
/// Number of wavelengths in an integral over the bands. Chosen: more take longer; fewer sample the bands too coarsely.
const WAVELENGTHS: usize = 12;
/// Number of cells along each side of the grid over directions, and of wavelengths in an integral over the bands, for
/// albedos with ridges, maxima that are narrow in both (`build.rs`). Albedos of bands then stay below 1.01
/// (`tests/core/energy.rs`).
const SAMPLES_OF_RIDGES: u32 = 32;
/// Number of [`BAND_NODES_NM`]. An evaluation with four would take 10 % longer; fewer follow the albedo less closely.
pub(crate) const BAND_NODES: usize = 3;
/// Wavelengths in nm at which an [`AlbedoTable`](super::AlbedoTable) is read for the bands. Chosen near the peaks of
/// blue, green and red. Such a table replaces that of this file for several sizes and for transparent bodies.
pub(crate) const BAND_NODES_NM: [f64; BAND_NODES] = [460.0, 540.0, 620.0];
/// Weights `[band][node]` of [`BAND_NODES_NM`] in the mean over a band, exact for an albedo that is linear between the
/// nodes and constant beyond them. Derived from [`WavelengthWeights`]; a test recomputes them.
pub(crate) const BAND_NODE_WEIGHTS: [[f64; BAND_NODES]; BANDS] =
    [[-0.0940, -0.0078, 1.1019], [0.0823, 0.8087, 0.1090], [1.0350, 0.0006, -0.0355]];
/// Number of words of a cell: two for each band, and two of padding, since words are read in packets of four.
const WORDS: usize = 8;

/// Table of the divisor A over directions, in linear sRGB under D65 with the weights of [`WavelengthWeights`].
///
/// It resembles an [`AlbedoTable`](super::AlbedoTable) with bands in place of planes of wavelength, and also holds
/// `(A − 1)·cos²θ`, finite up to the horizon, with θ from the normal. A band's reflectance is negative in directions
/// whose colour lies outside sRGB. Its albedo includes these negative parts.
///
/// Words are arranged `[y][x]`, with eight for each cell: two for each band, and two of padding. A band's first word
/// has the corners (x, y) and (x + 1, y), its second (x, y + 1) and (x + 1, y + 1). They are 16-bit floats (bfloat16),
/// rounded up, the first in the lower half.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourAlbedoTable {
    /// Dimensions of the table.
    layout: AlbedoLayout,
    /// [`ColourAlbedoTable::words`].
    words: Vec<u32>,
}

impl ColourAlbedoTable {
    /// Builds the table of an ensemble; `None` for a table of amplitudes, whose powers do not add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<Self> {
        let integral = AlbedoIntegral::fast(table, options)?;
        // Integration over a band smooths the albedo, so that the smallest grid suffices without ridges.
        let (cells, wavelengths) = match integral.has_ridges() {
            true => (SAMPLES_OF_RIDGES, SAMPLES_OF_RIDGES as usize),
            false => (SMALLEST_SIZE.0, WAVELENGTHS),
        };
        // Bands have no place on the axis of wavelength, whose fields are 0.
        let layout =
            AlbedoLayout { cells, planes: BANDS as u32, wavelength_min_nm: 0.0, planes_per_nm: 0.0, sizes: None };
        let grid = Grid { cells };
        // A group is a set of wavelengths that are integrated together. All bands share one, so the argument, the
        // position of the group, does not matter.
        let group = |_| bands(wavelengths);
        let cells = cells as usize;
        // All words stay zero where nothing is divided.
        let mut words = vec![0; WORDS * cells * cells];
        if let Some(nodes) = Builder::new(&integral, 1, &group).build(grid, progress) {
            // Bits of a band's value at the grid node in column x and row y, rounded up.
            let bits = |x: usize, y: usize, band: usize| bf16_above(nodes.values[y * grid.side() + x][band]);
            for (i, cell) in words.chunks_exact_mut(WORDS).enumerate() {
                let (x, y) = (i % cells, i / cells);
                for band in 0..BANDS {
                    cell[2 * band] = bits(x, y, band) | bits(x + 1, y, band) << 16;
                    cell[2 * band + 1] = bits(x, y + 1, band) | bits(x + 1, y + 1, band) << 16;
                }
            }
        }
        Some(Self { layout, words })
    }

    /// Dimensions of the table.
    pub fn layout(&self) -> &AlbedoLayout {
        &self.layout
    }

    /// Words of all cells, `[y][x]`, eight words each.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Size of the words in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// Whether the divisor is one everywhere.
    pub fn is_one(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// Evaluator in the precision `F`, `f32` or `f64`.
    pub fn view<F>(&self) -> ColourAlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourAlbedoView { layout: self.layout, words: &self.words }
    }
}

/// The bands as one group, integrated by the midpoint rule over `count` wavelengths. The weights of each band sum to 1.
/// The spacing of groups over wavelength is 0, since there is one group.
fn bands(count: usize) -> Group<BANDS> {
    let step_nm = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / count as f64;
    let mut wavelengths: Vec<(f64, [f64; BANDS])> = (0..count)
        .map(|k| {
            let nm = WAVELENGTH_MIN_NM + (k as f64 + 0.5) * step_nm;
            let weights = WavelengthWeights::at(nm);
            // The last weight, of the luminance, is left out.
            (nm, std::array::from_fn(|band| weights[band]))
        })
        .collect();
    let total: [f64; BANDS] = std::array::from_fn(|band| wavelengths.iter().map(|(_, weights)| weights[band]).sum());
    wavelengths.iter_mut().for_each(|(_, weights)| (0..BANDS).for_each(|band| weights[band] /= total[band]));
    Group { wavelengths, spacing_nm: 0.0 }
}

/// Evaluator of a [`ColourAlbedoTable`] over the numbers `N`.
pub struct ColourAlbedoView<N: Numbers> {
    /// [`ColourAlbedoTable::layout`].
    pub layout: AlbedoLayout,
    /// [`ColourAlbedoTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> ColourAlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))` of red, green and blue, for directions of unit length above the surface. 1 unless
    /// `active`.
    #[inline(always)]
    pub fn factor(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; BANDS] {
        let [i, o] = [wi, wo].map(|w| self.excess(&place(self.layout.cells, w), active));
        std::array::from_fn(|band| N::Real::lit(1.0) / (N::Real::lit(1.0) + i[band].max(o[band])))
    }

    /// `max(1, A) − 1` of red, green and blue at a place; zero unless `active`. The table holds no negative value.
    #[inline(always)]
    fn excess(&self, place: &GridPlace<N>, active: N::Mask) -> [N::Real; BANDS] {
        // A cell has two packets of four words. In names, near and far are the rows y and y + 1.
        let packet = place.cell << 1;
        let [red_near, red_far, green_near, green_far] = N::gather::<4>(self.words, packet, active).map(bf16_pair::<N>);
        let [blue_near, blue_far, ..] =
            N::gather::<4>(self.words, packet + N::Index::lit(1), active).map(bf16_pair::<N>);
        [[red_near, red_far], [green_near, green_far], [blue_near, blue_far]].map(|rows| {
            let [near, far] = rows.map(|[left, right]| lerp(left, right, place.x));
            lerp(near, far, place.y) * place.per_squared_cosine
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_nodes_are_those_of_linear_interpolation() {
        let mut expected = [[0.0; BAND_NODES]; BANDS];
        // One wavelength for each nm.
        for (nm, weights) in bands(471).wavelengths {
            let position = ((nm - BAND_NODES_NM[0]) / (BAND_NODES_NM[1] - BAND_NODES_NM[0])).clamp(0.0, 2.0);
            for (node, at) in [0.0f64, 1.0, 2.0].into_iter().enumerate() {
                let tent = (1.0 - (position - at).abs()).max(0.0);
                (0..BANDS).for_each(|band| expected[band][node] += tent * weights[band]);
            }
        }
        for (found, expected) in BAND_NODE_WEIGHTS.as_flattened().iter().zip(expected.as_flattened()) {
            // Rounded to four digits.
            assert!((found - expected).abs() < 6e-5, "{expected:?}: {found}");
        }
    }
}
