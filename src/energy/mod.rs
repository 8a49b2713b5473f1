//! Energy conservation: the reflectance is divided by the albedo where that exceeds one (docs/model.md, "Energy").
//!
//! ```text
//! f    reflectance of the model as it is, Fresnel reflectance left out (a small slope's factor included), 1/sr
//! f'   f(wi, wo)/max(1, A(wi), A(wo)), the reflectance that conserves energy; reciprocal, because f is
//! a    albedo ∫ f cosθo dωo of an incident direction at a wavelength; a' that of f'
//! A    divisor of a direction. A ≥ a suffices for a' ≤ A/max(1, A) ≤ 1
//! b    any function 1 ≤ b ≤ max(1, A)
//! t    least t ≥ 1 with ∫ f(wi, wo) min(1, t/b(wo)) cosθo dωo ≤ t. A ≥ t suffices for a' ≤ 1:
//!      the integral over t falls with t, and at t = max(1, A(wi)) it bounds a'
//! ```
//!
//! t is below a where narrow orders leave along the surface: a has a pole there, of light that the divisor of its own
//! direction takes away.
//!
//! [`AlbedoTable`] holds A, linear between nodes. Nodes of a grid half as fine get a, and then t with b from these;
//! nodes of the table get t with b from those, and a margin. t still has ridges, narrower than a cell, where an order
//! passes the horizon. Nodes therefore also get the t of orders moved onto their ridge, wherever a ridge crosses the
//! box that the node stands for ([`node_gaussian::Ridge`]). Between nodes an albedo of 1.01 may remain (docs/tables.md,
//! "Energy").

mod build;
mod colour;
mod grid;
mod integral;
mod node_gaussian;
mod power_grid;
mod quadrature;
mod report;

pub use colour::{ColourAlbedoTable, ColourAlbedoView};
pub(crate) use grid::GridPlace;
pub(crate) use integral::AlbedoIntegral;
pub use report::AlbedoReport;

use crate::numeric::math::{bf16_pair, lerp};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::{Options, Vec3};
use crate::table::{Progress, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use build::{Builder, resolution, single_wavelength};
use grid::{Grid, place};
use serde::{Deserialize, Serialize};

/// Part of a build's progress that its nodes take; the report takes the rest.
const NODES_PROGRESS: f64 = 0.9;

/// Arrangement of a table: `[wavelength][y][x]`, cell by cell.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlbedoLayout {
    /// Cells along each side of the square around the disc of directions.
    pub cells: u32,
    /// Nodes in wavelength, at least two; or the number of bands of a table of colours.
    pub planes: u32,
    /// Wavelength of the first plane in nm; zero in a table of colours.
    pub wavelength_min_nm: f32,
    /// Planes per nm of wavelength; zero in a table of colours.
    pub planes_per_nm: f32,
}

/// The divisor A of a direction and a wavelength as a table.
///
/// A node holds `(A − 1)·cos²θ`: zero where nothing is divided, and finite at the horizon, where A has a pole (of the
/// first order for narrow orders, of the second for orders wider than cosθ). A cell is a packet of four words, so that
/// one read serves a look-up: the corners (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) of its lower plane of
/// wavelength and then of its upper, as 16-bit floats (bfloat16), rounded up.
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
    layout: AlbedoLayout,
    words: Vec<u32>,
}

impl AlbedoTable {
    /// The table of an ensemble, with the means before and after division; `None` for a table of amplitudes, whose
    /// powers do not add.
    pub fn build(table: &SpectralTable, options: &Options, progress: &Progress) -> Option<(Self, AlbedoReport)> {
        let integral = AlbedoIntegral::fast(table, options)?;
        let (cells, planes) = resolution(&integral);
        let per_nm = f64::from(planes - 1) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM);
        let layout =
            AlbedoLayout { cells, planes, wavelength_min_nm: WAVELENGTH_MIN_NM as f32, planes_per_nm: per_nm as f32 };
        let grid = Grid { cells };
        let group = |at: f64| single_wavelength(planes, at);
        let builder = Builder::new(&integral, planes as usize, &group);
        let nodes = builder.build(grid, &progress.part(0.0, NODES_PROGRESS));
        let cells = cells as usize;
        let words = (0..cells * cells * (planes as usize - 1)).flat_map(|i| {
            let [x, y, plane] = [i % cells, i / cells % cells, i / cells / cells];
            // Steps along x, along y and to the next plane.
            let corner = |dx: usize, dy: usize, dp: usize| match &nodes {
                Some(nodes) => {
                    let node = (plane + dp) * grid.in_plane() + (y + dy) * grid.side() + x + dx;
                    bf16_above(nodes.values[node][0])
                }
                None => 0,
            };
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dy, dp)| corner(0, dy, dp) | corner(1, dy, dp) << 16)
        });
        let built = Self { layout, words: words.collect() };
        let report = AlbedoReport::new(&integral, &built, &progress.part(NODES_PROGRESS, 1.0));
        Some((built, report))
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

    /// The evaluator over plain numbers.
    pub fn view<F>(&self) -> AlbedoView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        AlbedoView { layout: self.layout, words: &self.words }
    }

    /// `1/max(1, A(wi), A(wo))` in double precision, of directions of unit length above the surface and a wavelength in
    /// nm.
    pub fn factor(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        self.view::<f64>().factor(wi, wo, wavelength_nm, true)
    }
}

/// The evaluator of an [`AlbedoTable`], over any [`Numbers`].
#[derive(Clone, Copy)]
pub struct AlbedoView<N: Numbers> {
    /// [`AlbedoTable::layout`].
    pub layout: AlbedoLayout,
    /// [`AlbedoTable::words`].
    pub words: N::Words,
}

impl<N: Numbers> AlbedoView<N> {
    /// `1/max(1, A(wi), A(wo))`, of directions of unit length above the surface and a wavelength in nm.
    #[inline(always)]
    pub fn factor(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        self.factor_at(&self.place(wi), &self.place(wo), wavelength_nm, active)
    }

    /// `1/max(1, A(wi), A(wo))` of places of directions, which serve every wavelength.
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

    /// The place of a direction in the grid.
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

/// The smallest bfloat16 that is not below `value`, which is not negative.
fn bf16_above(value: f32) -> u32 {
    let bits = value.to_bits();
    (bits >> 16) + u32::from(bits & 0xffff != 0)
}
