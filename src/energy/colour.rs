//! Table of the divisor A ([module](super)) of red, green and blue, which renderers that carry colours read.
//! `methods/albedo.wgsl` evaluates it in WGSL.
//!
//! A colour channel is a band: an integral over wavelengths with its weights in linear sRGB. The divisor of a band is
//! the mean of the divisors by wavelength, with the positive parts of the weights. Red has large negative weights near
//! 500 nm; with them, a saturated red would count as an albedo above one although no wavelength's albedo is.

use super::grid::{GridPlace, place};
use super::{AlbedoLayout, AlbedoTable, bf16_above};
use crate::colour::WavelengthWeights;
use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::Options;
use crate::table::{Progress, SpectralTable, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};
use std::array;

/// Number of bands: red, green and blue.
const BANDS: usize = 3;
/// Number of [`BAND_NODES_NM`]. An evaluation with four would take 10 % longer; fewer follow the albedo less closely.
pub(crate) const BAND_NODES: usize = 3;
/// Wavelengths in nm at which an [`AlbedoTable`] is read for the bands. Chosen near the peaks of blue, green and red.
/// Such a table replaces that of this file for several sizes and for transparent bodies.
pub(crate) const BAND_NODES_NM: [f64; BAND_NODES] = [460.0, 540.0, 620.0];
/// Weights `[band][node]` of [`BAND_NODES_NM`] in the mean over a band ([`band_weights`]).
pub(crate) const BAND_NODE_WEIGHTS: [[f64; BAND_NODES]; BANDS] =
    [[0.0486, 0.2074, 0.7440], [0.1456, 0.7197, 0.1348], [0.9317, 0.0683, 0.0]];
/// Number of words of a cell: two for each band, and two of padding, since words are read in packets of four.
const WORDS: usize = 8;

/// Table of the divisor A over directions, in linear sRGB under D65 with the weights of [`WavelengthWeights`].
///
/// It resembles an [`AlbedoTable`](super::AlbedoTable) with bands in place of planes of wavelength, and also holds
/// `(A − 1)·cos²θ`, finite up to the horizon, with θ from the normal.
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
    /// Builds the table of an ensemble at the relief's own size; `None` for a table of amplitudes, whose powers do not
    /// add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<Self> {
        let options = Options { sizes: None, ..options.clone() };
        AlbedoTable::build_alone(table, &options, progress).map(|by_wavelength| Self::of(&by_wavelength))
    }

    /// Means over the bands of a table for one size. The mean is that of the tabulated values, which a look-up
    /// interpolates linearly.
    fn of(by_wavelength: &AlbedoTable) -> Self {
        let &AlbedoLayout { cells, planes, planes_per_nm, .. } = by_wavelength.layout();
        let weights = band_weights(WAVELENGTH_MIN_NM, 1.0 / f64::from(planes_per_nm), planes as usize);
        let in_plane = (cells * cells) as usize;
        let mut words = Vec::with_capacity(WORDS * in_plane);
        for cell in 0..in_plane {
            // Both corners in row y or y + 1 of the cell (`row` 0 or 1), in one plane. A packet of four words has both
            // rows of the gap's lower plane, then those of its upper plane.
            let corners = |plane: usize, row: usize| {
                let gap = plane.min(planes as usize - 2);
                bf16_pair::<Plain<f64>>(by_wavelength.words()[4 * (gap * in_plane + cell) + 2 * (plane - gap) + row])
            };
            for band in 0..BANDS {
                for row in 0..2 {
                    let [left, right] = [0, 1].map(|corner| {
                        let mean = weights
                            .iter()
                            .enumerate()
                            .map(|(plane, weights)| weights[band] * corners(plane, row)[corner]);
                        bf16_above(mean.sum::<f64>() as f32)
                    });
                    words.push(left | right << 16);
                }
            }
            words.resize(WORDS * (cell + 1), 0);
        }
        // Bands have no place on the axis of wavelength, whose fields are 0.
        let layout =
            AlbedoLayout { cells, planes: BANDS as u32, wavelength_min_nm: 0.0, planes_per_nm: 0.0, sizes: None };
        Self { layout, words }
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

/// Weights `[node][band]` of wavelength nodes in the mean over a band. They are exact for values that are linear
/// between the nodes and constant beyond them, not negative, and sum to 1 for each band.
fn band_weights(first_nm: f64, spacing_nm: f64, nodes: usize) -> Vec<[f64; BANDS]> {
    let mut sums = vec![[0.0; BANDS]; nodes];
    for (i, weights) in WavelengthWeights::per_nm().iter().enumerate() {
        let position = (WAVELENGTH_MIN_NM + i as f64 - first_nm) / spacing_nm;
        let position = position.clamp(0.0, (nodes - 1) as f64);
        for (node, sums) in sums.iter_mut().enumerate() {
            let tent = (1.0 - (position - node as f64).abs()).max(0.0);
            // The last weight, of the luminance, is left out.
            (0..BANDS).for_each(|band| sums[band] += tent * f64::from(weights[band].max(0.0)));
        }
    }
    let totals: [f64; BANDS] = array::from_fn(|band| sums.iter().map(|sums| sums[band]).sum());
    sums.into_iter().map(|sums| array::from_fn(|band| sums[band] / totals[band])).collect()
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
        array::from_fn(|band| N::Real::lit(1.0) / (N::Real::lit(1.0) + i[band].max(o[band])))
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
    use crate::energy::AlbedoIntegral;
    use crate::height_field::{Preset, random::Random};
    use crate::scattering::build_table;
    use std::f64::consts::TAU;

    #[test]
    fn weights_of_nodes_are_those_of_linear_interpolation() {
        let spacing_nm = BAND_NODES_NM[1] - BAND_NODES_NM[0];
        for (node, expected) in band_weights(BAND_NODES_NM[0], spacing_nm, BAND_NODES).into_iter().enumerate() {
            for (band, expected) in expected.into_iter().enumerate() {
                let found = BAND_NODE_WEIGHTS[band][node];
                // Rounded to four digits.
                assert!((found - expected).abs() < 6e-5, "{band} {node}: {expected} {found}");
            }
        }
    }

    /// The divided albedo of a band against the mean over the band of the divided albedos by wavelength.
    #[test]
    fn albedos_of_bands_follow_those_by_wavelength() {
        // Largest root mean square of the difference in red, green and blue. The band's divisor is one number for all
        // wavelengths, and red has negative weights. Measured: 0.017, 0.004, 0.004.
        const RMS: [f64; BANDS] = [0.02, 0.006, 0.006];
        // Difference without a division, far above the tolerance.
        const UNDIVIDED: f64 = 0.1;
        const QUERIES: usize = 200;
        let options = Options::default();
        let field = Preset::Blazed.build(None, None).unwrap();
        let table = build_table(&field, &options, &Progress::none()).unwrap().table;
        let by_wavelength = AlbedoTable::build_alone(&table, &options, &Progress::none()).unwrap();
        let bands = ColourAlbedoTable::of(&by_wavelength);
        let integral = AlbedoIntegral::fast(&table, &options).unwrap();
        let mut random = Random::new(8);
        let (mut squares, mut undivided) = ([0.0; BANDS], [0.0; BANDS]);
        for _ in 0..QUERIES {
            let (theta, phi): (f64, f64) = (random.between(0.0, 1.55), random.between(0.0, TAU));
            let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            // Sums over every fifth nm: of the band's albedos, of those by wavelength, and of those not divided.
            let mut sums = [[0.0; 3]; BANDS];
            let mut totals = [0.0; BANDS];
            for (i, weights) in WavelengthWeights::per_nm().iter().enumerate().step_by(5) {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let weights = [0, 1, 2].map(|band| f64::from(weights[band]));
                (0..BANDS).for_each(|band| totals[band] += weights[band]);
                integral.visit::<Plain<f64>>(wi, nm, None, |wo, part| {
                    let of_band = bands.view::<f64>().factor(wi, wo, true);
                    let exact = by_wavelength.factor(wi, wo, nm);
                    for band in 0..BANDS {
                        let part = weights[band] * part;
                        let parts = [part * of_band[band], part * exact, part];
                        sums[band].iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
                    }
                });
            }
            for band in 0..BANDS {
                let [of_band, exact, plain] = sums[band].map(|sum| sum / totals[band]);
                squares[band] += (of_band - exact).powi(2) / QUERIES as f64;
                undivided[band] += (plain - exact).powi(2) / QUERIES as f64;
            }
        }
        let [rms, undivided] = [squares, undivided].map(|squares| squares.map(f64::sqrt));
        println!("{rms:.4?}, undivided {undivided:.4?}");
        for band in 0..BANDS {
            assert!(
                rms[band] < RMS[band] && undivided[band] > UNDIVIDED,
                "band {band}: {rms:?}, undivided {undivided:?}"
            );
        }
    }
}
