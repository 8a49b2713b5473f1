//! Energy conservation: the reflectance is divided by albedos that exceed one (docs/model.md#energy).
//!
//! All symbols are functions of a direction (or two) and the wavelength λ:
//!
//! | symbol | meaning |
//! | --- | --- |
//! | `f(wi, wo)` | reflectance of the model in 1/sr, with the small-slope factor but without the Fresnel reflectance |
//! | `a(wi)` | albedo of f: `∫ f cosθo dωo` |
//! | `A(d)` | divisor of a direction d, either wi or wo, tabulated by [`AlbedoTable`] |
//! | `f'(wi, wo)` | `f/max(1, A(wi), A(wo))`, the reflectance that conserves energy; reciprocal, because f is |
//! | `a'(wi)` | albedo of f', which must not exceed 1 |
//! | `b(d)` | lower bound of the divisor, fixed before t is computed: `1 ≤ b ≤ max(1, A)` |
//! | `t(wi)` | least `t ≥ 1` with `∫ f min(1, t/b(wo)) cosθo dωo ≤ t` |
//!
//! `A ≥ a` is sufficient for `a' ≤ 1`, and so is `A ≥ t`: with `T = max(1, A(wi))`, the quotient
//! `∫ f min(1, T/b(wo)) cosθo dωo / T` is an upper bound of a'. It does not rise with T, and is at most 1 from t on.
//!
//! t is smaller than a where narrow orders leave along the surface. There a has a pole, but most of its light is
//! already removed by the divisor of the outgoing direction.
//!
//! One table may serve several *relative sizes* of the relief: a scale of its pattern and a depth of its heights.
//! Frequencies then follow from the wavelength `λ' = λ/scale`, and the phase of the heights from `λ" = λ/depth`
//! (`sizes.rs`).
//!
//! The table holds `(A − 1)·cos²θ` at its nodes, and is linear between them. It is filled in three steps (`build.rs`),
//! which accept albedos slightly above one:
//!
//! 1. The nodes get b, whose excess over one is a fraction of the excess of a.
//! 2. The nodes get the larger of b and t.
//! 3. Where the table lies below t at check points in a cell between nodes, the cell's corners are raised. Cells in
//!    which it lay far below are checked again, at other points (`nodes.rs`).
//!
//! Where an order passes the horizon, t has a ridge narrower than a cell. Tables of narrow orders therefore have more
//! check points. Between these, albedos of up to 1.01 remain, and larger ones where coherence lengths are hundreds of
//! µm (docs/tables.md#energy).

mod bands;
mod build;
mod grid;
mod integral;
mod nodes;
mod portion;
mod quadrature;
mod report;
mod sizes;
mod transparent;

pub(crate) use grid::GridPlace;
pub(crate) use integral::AlbedoIntegral;
pub use report::AlbedoReport;
pub(crate) use report::integrated_albedos;
pub use sizes::SizeAxes;

use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Lanes, Number, Numbers, Plain, Real};
use crate::scattering::{Options, Reading, SizeRange, Vec3};
use crate::table::{Progress, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use grid::place;
use serde::{Deserialize, Serialize};

/// Four numbers, one in each lane.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Fraction of a build's progress at which the nodes are done; the report takes the rest. Chosen; for display only.
const NODES_DONE: f64 = 0.9;

/// Dimensions of an [`AlbedoTable`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlbedoLayout {
    /// Number of cells along each side of the square grid over directions (`grid.rs`).
    pub cells: u32,
    /// Number of planes of wavelength, at least two.
    pub planes: u32,
    /// Wavelength of the first plane in nm; not read for several sizes.
    pub wavelength_min_nm: f32,
    /// Planes per nm of wavelength; not read for several sizes.
    pub planes_per_nm: f32,
    /// Planes and slabs of a table for several relative sizes, whose planes are not uniform in wavelength.
    pub sizes: Option<SizeAxes>,
}

impl AlbedoLayout {
    /// Layout for a range of `sizes`, or for one size. `planes` are those of one size over the tables' range of
    /// wavelengths. `phase_max`, the relief's phase in radians, and `slab_phase`, its largest change between slabs, set
    /// the number of slabs ([`SizeAxes::covering`]).
    fn new(cells: u32, planes: u32, sizes: Option<&SizeRange>, phase_max: f64, slab_phase: f64) -> Self {
        if let Some(sizes) = sizes {
            let (planes, axes) = SizeAxes::covering(sizes, planes, phase_max, slab_phase);
            return Self { cells, planes, wavelength_min_nm: 0.0, planes_per_nm: 0.0, sizes: Some(axes) };
        }
        let planes_per_nm = (f64::from(planes - 1) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM)) as f32;
        Self { cells, planes, wavelength_min_nm: WAVELENGTH_MIN_NM as f32, planes_per_nm, sizes: None }
    }

    /// Number of slabs.
    fn slabs(&self) -> u32 {
        self.sizes.map_or(1, |sizes| sizes.slabs)
    }

    /// Wavelengths [λ', λ"] in nm, for frequencies and for the phase rate (`sizes.rs`), at a position among the planes
    /// of a slab, in planes from the first. They are equal for one size.
    fn wavelengths_nm(&self, plane: f64, slab: u32) -> [f64; 2] {
        match &self.sizes {
            Some(axes) => [axes.plane_nm(plane), axes.slab_nm(slab)],
            None => [f64::from(self.wavelength_min_nm) + plane / f64::from(self.planes_per_nm); 2],
        }
    }
}

/// Table of the divisor A over directions and wavelengths; see the [module](self).
///
/// A node holds `(A − 1)·cos²θ`, or zero where nothing is divided. It is finite at the horizon, where A grows as
/// `1/cosθ` for narrow diffraction orders, and as `1/cos²θ` for orders wider than cosθ.
///
/// Packets are arranged `[side][slab][gap][y][x]`, with the gaps between neighbouring planes of wavelength. A table of
/// a transparent body has the side of air and the side of the medium ([`AlbedoTable::build_of_body`]); others have one.
/// A slab has the planes of one λ" (`sizes.rs`); only tables for several sizes have several. Each cell has a packet of
/// four words, so that a look-up takes one read, or two for several sizes. A packet has the corners (x, y), (x + 1, y),
/// (x, y + 1), (x + 1, y + 1) of the cell's lower plane of wavelength, then those of its upper plane. Two corners share
/// a word as 16-bit floats (bfloat16), rounded up, the first in the lower half.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let surface = Surface::new(&Preset::Sinusoidal.build(None, None)?, &Options::default())?;
/// let table = surface.albedo_table().ok_or("no albedo exceeds one")?;
/// let (wi, wo) = ([0.6, 0.0, 0.8], [0.0, 0.0, 1.0]);
/// let factor = table.factor(wi, wo, 550.0);
/// assert!(factor <= 1.0 && factor == table.factor(wo, wi, 550.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AlbedoTable {
    /// Dimensions of the table.
    layout: AlbedoLayout,
    /// [`AlbedoTable::words`].
    words: Vec<u32>,
}

impl AlbedoTable {
    /// Builds the divisors for an ensemble's spectral table, and reports the albedos before and after division. `None`
    /// for a table of amplitudes, whose powers do not add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<(Self, AlbedoReport)> {
        let integral = AlbedoIntegral::fast(table, options)?;
        let albedos = build::reflecting(&integral, options.sizes.as_ref(), &progress.part(0.0, NODES_DONE));
        let report = AlbedoReport::new(&integral, &albedos, &progress.part(NODES_DONE, 1.0));
        Some((albedos, report))
    }

    /// Dimensions of the table.
    pub fn layout(&self) -> &AlbedoLayout {
        &self.layout
    }

    /// Packets of all cells, `[side][slab][gap][y][x]`, four words each.
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
    pub fn view<F>(&self) -> AlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        AlbedoView { layout: self.layout, words: &self.words }
    }

    /// `1/max(1, A(wi), A(wo))` in double precision, of directions of unit length above the surface and a wavelength in
    /// nm, for the relief's own size.
    pub fn factor(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        self.view::<f64>().factor(wi, wo, &Reading::at(wavelength_nm), true)
    }
}

/// Evaluator of an [`AlbedoTable`] over the numbers `N`.
#[derive(Clone, Copy)]
pub struct AlbedoView<N: Numbers> {
    /// [`AlbedoTable::layout`].
    pub layout: AlbedoLayout,
    /// [`AlbedoTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> AlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))`, of directions of unit length above the surface, at the wavelength and relative size of
    /// `reading`. 1 unless `active`.
    #[inline(always)]
    pub fn factor(&self, wi: [N::Real; 3], wo: [N::Real; 3], reading: &Reading<N>, active: N::Mask) -> N::Real {
        self.factor_at(&self.place(wi), &self.place(wo), reading, active)
    }

    /// [`AlbedoView::factor`] from the places of wi and wo in the grid, which do not depend on the wavelength.
    #[inline(always)]
    pub(crate) fn factor_at(
        &self,
        place_i: &GridPlace<N>,
        place_o: &GridPlace<N>,
        reading: &Reading<N>,
        active: N::Mask,
    ) -> N::Real {
        let excess = self.excess(place_i, reading, active).max(self.excess(place_o, reading, active));
        N::Real::lit(1.0) / (N::Real::lit(1.0) + excess)
    }

    /// Place of a direction of unit length in the table of a transparent body, whose second side is that of directions
    /// below the relief. On either side `w` points into the upper hemisphere; `is_below` tells the sides apart.
    #[inline(always)]
    pub(crate) fn place_at_body(&self, w: [N::Real; 3], is_below: N::Mask) -> GridPlace<N> {
        let AlbedoLayout { cells, planes, .. } = self.layout;
        let in_side = self.layout.slabs() * (planes - 1) * cells * cells;
        let place = self.place(w);
        // Packets of the first side, which are skipped for directions below.
        let first = N::Index::select(is_below, N::Index::lit(in_side), N::Index::lit(0));
        GridPlace { cell: place.cell + first, ..place }
    }

    /// Place of a direction of unit length in the grid.
    #[inline(always)]
    pub(crate) fn place(&self, w: [N::Real; 3]) -> GridPlace<N> {
        place(self.layout.cells, w)
    }

    /// `max(1, A) − 1` at a place; zero unless `active`.
    #[inline(always)]
    pub(crate) fn excess(&self, place: &GridPlace<N>, reading: &Reading<N>, active: N::Mask) -> N::Real {
        let lit = |value: f64| N::Real::lit(value);
        // For a position among `count` planes or slabs, at least two: the fraction from the lower to the upper
        // neighbour, and the index of the lower.
        let between = |position: N::Real, count: u32| {
            let last = f64::from(count - 1);
            let position = position.clip(lit(0.0), lit(last));
            let lower = position.floor().min(lit(last - 1.0));
            (position - lower, N::index(lower))
        };
        let planes = self.layout.planes;
        let Some(sizes) = &self.layout.sizes else {
            let (min_nm, planes_per_nm) =
                (lit(self.layout.wavelength_min_nm.into()), lit(self.layout.planes_per_nm.into()));
            let (fraction, gap) = between((reading.wavelength_nm - min_nm) * planes_per_nm, planes);
            return self.tabulated(place, gap, fraction, active) * place.per_squared_cosine;
        };
        let (plane_fraction, plane) = between(sizes.plane(reading.wavelength_nm), planes);
        let (slab_fraction, slab) = between(sizes.slab(reading.for_kappa_nm()), sizes.slabs);
        let gaps = N::Index::lit(planes - 1);
        let [low, high] = [0, 1].map(|next| {
            let gap = (slab + N::Index::lit(next)) * gaps + plane;
            self.tabulated(place, gap, plane_fraction, active)
        });
        lerp(low, high, slab_fraction) * place.per_squared_cosine
    }

    /// `max(1, A) − 1` of a direction of unit length at a position among the planes, in planes from the first. The
    /// table has a single slab.
    #[inline(always)]
    fn excess_in_plane(&self, w: [N::Real; 3], plane: f64) -> N::Real {
        let place = self.place(w);
        let gap = plane.floor().min(f64::from(self.layout.planes - 2));
        let value = self.tabulated(&place, N::Index::lit(gap as u32), N::Real::lit(plane - gap), N::mask(true));
        value * place.per_squared_cosine
    }

    /// `(max(1, A) − 1)·cos²θ` between two planes, at `fraction` from the lower to the upper. `gap` is the index of the
    /// gap between them among the gaps of all slabs.
    #[inline(always)]
    fn tabulated(&self, place: &GridPlace<N>, gap: N::Index, fraction: N::Real, active: N::Mask) -> N::Real {
        let in_plane = self.layout.cells * self.layout.cells;
        let packet = gap * N::Index::lit(in_plane) + place.cell;
        let corners = N::gather::<4>(self.words, packet, active).map(bf16_pair::<N>);
        // Words 0 and 1 are the rows y and y + 1 of the lower plane, 2 and 3 those of the upper.
        let [low, high] = [0, 2].map(|first| {
            let [near, far] = [0, 1].map(|row| lerp(corners[first + row][0], corners[first + row][1], place.x));
            lerp(near, far, place.y)
        });
        lerp(low, high, fraction)
    }
}
