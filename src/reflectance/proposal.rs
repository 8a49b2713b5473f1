//! The density that orders are drawn from: power times what the model makes of the direction.

use super::cell_shares::{CellShares, Corners, Incidence};
use super::surface::Options;
use super::{Pair, Vec3};
use crate::table::{
    BandReading, Density, LEAVES_MET_MAX, LeafAxis, Leaves, OrderChoice, SpectralTable, WAVELENGTH_MIN_NM, pick,
};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Share of a leaf's weight that takes its power to be anywhere in it: a leaf whose power is about one strong node beyond
/// the horizon may have weaker ones above.
pub const ANYWHERE_SHARE: f64 = 0.1;
/// Cosine up to which samples from beyond the horizon are put back inside.
pub const FOLD_COS_MAX: f64 = 0.3;
/// Least cos²θo and distance from the normal at which a leaf is judged.
const COS_SQUARED_MIN: f64 = 1e-9;
const RHO_MIN: f64 = 1e-12;

/// Probabilities of a table's nodes for every incidence and wavelength.
///
/// A node `j` of the leaf `l` in the cell `c` is drawn with probability
/// `P_j = T_c(wi, λ) · F_l p_j(κ_l) / Σ_{l' in c} F_l' p_l'(κ_l')`, where `p` is the power in the tabulated κ bands. Where few
/// orders propagate, all of them make one cell: `F` is then the part of the leaf's power that propagates times `O·M`
/// towards the middle of that part, and κ_l belongs to that direction. Else `T` mixes the shares that cells have at
/// the nodes of a grid of incidences ([`CellShares`]); `O·M` is much the same all over a cell, so `F` is the part that
/// propagates alone, and κ_l that of the middle of the cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Proposal {
    leaves: Leaves,
    /// Empty where there is one cell.
    shares: CellShares,
}

impl Proposal {
    /// The proposal for a table.
    pub(super) fn new(table: &SpectralTable, options: &Options) -> Self {
        let leaves = Leaves::new(table, 2e3 / WAVELENGTH_MIN_NM);
        let mut proposal = Self { leaves, shares: CellShares::default() };
        if proposal.has_cells() {
            let (x, y) = (&proposal.leaves.x, &proposal.leaves.y);
            proposal.shares = CellShares::build(x, y, |wi, nm| {
                let local = Local::new(&proposal, table, options, wi, nm, Default::default());
                let mut weights = Vec::new();
                local.visit([0..x.count, 0..y.count], None, |leaf, weight| weights.push((leaf, weight)));
                weights
            });
        }
        proposal
    }

    fn has_cells(&self) -> bool {
        self.leaves.x.cells * self.leaves.y.cells > 1
    }

    /// The leaves.
    pub fn leaves(&self) -> &Leaves {
        &self.leaves
    }

    /// The shares of cells, empty where there is one.
    pub fn shares(&self) -> &CellShares {
        &self.shares
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.leaves.bytes() + self.shares.bytes()
    }

    /// The proposal at one incidence and wavelength (nm).
    pub(super) fn at<'a>(
        &'a self,
        table: &'a SpectralTable,
        options: &'a Options,
        wi: Vec3,
        incidence: &Incidence,
        wavelength_nm: f64,
    ) -> Local<'a> {
        let corners = if self.has_cells() { CellShares::corners(incidence, wavelength_nm) } else { Default::default() };
        let mut local = Local::new(self, table, options, wi, wavelength_nm, corners);
        if !self.has_cells() {
            local.whole = local.cell_weight([0, 0], None);
        }
        local
    }

    /// Standard deviation of the widest node in cycles/µm. Times the wavelength, two, and under a root it is the cosine
    /// at which an order that leaves along the surface is one standard deviation inside.
    pub fn fold_sigma(table: &SpectralTable) -> f64 {
        let ((sx, sy), lattice) = (table.proposal_sigma(), table.lattice());
        (sx / lattice.x.period_um).max(sy / lattice.y.period_um)
    }
}

/// A [`Proposal`] at one incidence and wavelength.
pub(super) struct Local<'a> {
    proposal: &'a Proposal,
    table: &'a SpectralTable,
    options: &'a Options,
    wi: Vec3,
    wavelength_um: f64,
    /// Direction cosines per node, and how far from its centre a leaf reaches, along x and y.
    step: [f64; 2],
    reach: [f64; 2],
    /// c_m of the fold.
    fold_cos: f64,
    corners: Corners,
    /// Weight of all leaves where they are one cell.
    whole: f64,
}

/// How the leaves that one look-up meets are drawn.
struct Window {
    first: [usize; 2],
    /// Nodes of a leaf as powers of two.
    shift: [u32; 2],
    leaves: [[BandReading; LEAVES_MET_MAX]; LEAVES_MET_MAX],
}

impl Window {
    /// `P_j` of the node of a column and row with these band means.
    fn draw(&self, column: usize, row: usize, means: &[f32]) -> f64 {
        self.leaves[(row >> self.shift[1]) - self.first[1]][(column >> self.shift[0]) - self.first[0]].of(means)
    }
}

impl<'a> Local<'a> {
    fn new(
        proposal: &'a Proposal,
        table: &'a SpectralTable,
        options: &'a Options,
        wi: Vec3,
        wavelength_nm: f64,
        corners: Corners,
    ) -> Self {
        let wavelength_um = wavelength_nm * 1e-3;
        let lattice = table.lattice();
        let step = [wavelength_um / lattice.x.period_um, wavelength_um / lattice.y.period_um];
        let [x, y] = proposal.leaves.reach();
        let reach = [step[0] * x, step[1] * y];
        let fold_cos = (2.0 * wavelength_um * Proposal::fold_sigma(table)).sqrt().min(1.0);
        Self { proposal, table, options, wi, wavelength_um, step, reach, fold_cos, corners, whole: 0.0 }
    }

    /// `S` and the density over frequency at the direction cosines `q` and `kappa`.
    pub fn lookup(&self, q: [f64; 2], kappa: f64) -> Density {
        let f = self.frequency(q);
        let window = self.window(f);
        self.table.lookup(f, kappa, |column, row, means| window.draw(column, row, means))
    }

    /// Density over frequency, times cosθo, of what the fold brings to the direction cosines `q` at a cosine.
    ///
    /// What lies at ρ² = 1 + e is put at cosθ = e/c: with `dq = ½ d(ρ²) dφ` the density over direction cosines becomes
    /// `p(q*) de/d(cos²θ) = p(q*)·c/(2cosθ)`.
    pub fn folded(&self, q: [f64; 2], cos: f64) -> f64 {
        if cos >= FOLD_COS_MAX {
            return 0.0;
        }
        let further = ((1.0 + self.fold_cos * cos) / (1.0 - cos * cos)).sqrt();
        let f = self.frequency([q[0] * further, q[1] * further]);
        let window = self.window(f);
        0.5 * self.fold_cos * self.table.proposal(f, |column, row, means| window.draw(column, row, means))
    }

    /// A direction from two random numbers in [0, 1), `None` where the place drawn lies too far beyond the horizon.
    pub fn sample(&self, u: [f64; 2]) -> Option<Vec3> {
        let order = self.choose(u)?;
        // Box–Muller. The radius, which is the more sensitive, comes from the number that was stretched less.
        let radius = (-2.0 * (1.0 - order.u[1]).ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * order.u[0]).sin_cos();
        let (sx, sy) = self.table.proposal_sigma();
        let x = self.step[0] * (order.jx as f64 + sx * radius * cos) - self.wi[0];
        let y = self.step[1] * (order.jy as f64 + sy * radius * sin) - self.wi[1];
        let squared = x * x + y * y;
        if squared < 1.0 {
            return Some([x, y, (1.0 - squared).sqrt()]);
        }
        let cos = (squared - 1.0) / self.fold_cos;
        let inward = ((1.0 - cos * cos) / squared).sqrt();
        (cos > 0.0 && cos < FOLD_COS_MAX).then_some([x * inward, y * inward, cos])
    }

    fn choose(&self, u: [f64; 2]) -> Option<OrderChoice> {
        let leaves = &self.proposal.leaves;
        let (cell, [ux, uy]) =
            if self.proposal.has_cells() { self.proposal.shares.choose(&self.corners, u)? } else { ([0; 2], u) };
        let [columns, rows] = self.leaves_of(cell);
        let leaf = |i: usize| [columns.start + i % columns.len(), rows.start + i / columns.len()];
        let reading = self.cell_reading(cell);
        let weight = |i: usize| self.leaf_weight(leaf(i), reading);
        let (chosen, uy) = pick(columns.len() * rows.len(), weight, uy)?;
        let chosen = leaf(chosen);
        leaves.choose(self.table, chosen, &self.leaf(chosen, reading), [ux, uy])
    }

    fn frequency(&self, q: [f64; 2]) -> [f64; 2] {
        [(q[0] + self.wi[0]) / self.wavelength_um, (q[1] + self.wi[1]) / self.wavelength_um]
    }

    /// The leaves about a frequency.
    fn window(&self, f: [f64; 2]) -> Window {
        let (x, y) = (&self.proposal.leaves.x, &self.proposal.leaves.y);
        let node = self.table.first_node(f);
        let first = [node[0] / x.len, node[1] / y.len];
        let shift = [x.len.ilog2(), y.len.ilog2()];
        let mut window = Window { first, shift, leaves: Default::default() };
        let first_cell = [first[0] / x.in_cell, first[1] / y.in_cell];
        // Cells are no smaller than leaves, so a look-up meets no more of them.
        let mut cells = [[(0.0, None); LEAVES_MET_MAX]; LEAVES_MET_MAX];
        for (cy, row) in (first_cell[1]..y.cells).zip(cells.iter_mut()).take(y.cells_met) {
            for (cx, value) in (first_cell[0]..x.cells).zip(row).take(x.cells_met) {
                let reading = self.cell_reading([cx, cy]);
                *value = (self.share_per_weight([cx, cy], reading), reading);
            }
        }
        for (gy, row) in (first[1]..y.count).zip(window.leaves.iter_mut()).take(y.met) {
            for (gx, leaf) in (first[0]..x.count).zip(row).take(x.met) {
                let (factor, reading) = cells[gy / y.in_cell - first_cell[1]][gx / x.in_cell - first_cell[0]];
                *leaf = self.leaf([gx, gy], reading).times(factor);
            }
        }
        window
    }

    /// A cell's share over the weight of its leaves.
    fn share_per_weight(&self, cell: [usize; 2], reading: Option<BandReading>) -> f64 {
        let (share, weight) = if self.proposal.has_cells() {
            let share = self.proposal.shares.share(&self.corners, cell);
            (share, if share > 0.0 { self.cell_weight(cell, reading) } else { 0.0 })
        } else {
            (1.0, self.whole)
        };
        if weight > 0.0 { share / weight } else { 0.0 }
    }

    fn cell_weight(&self, cell: [usize; 2], reading: Option<BandReading>) -> f64 {
        let mut sum = 0.0;
        self.visit(self.leaves_of(cell), reading, |_, weight| sum += weight);
        sum
    }

    /// The leaves of a cell, along x and y.
    fn leaves_of(&self, cell: [usize; 2]) -> [Range<usize>; 2] {
        let range = |axis: &LeafAxis, cell: usize| cell * axis.in_cell..((cell + 1) * axis.in_cell).min(axis.count);
        let all = [range(&self.proposal.leaves.x, cell[0]), range(&self.proposal.leaves.y, cell[1])];
        if self.proposal.has_cells() { all } else { self.propagating(all) }
    }

    /// Visits the leaves in a rectangle that may propagate, with their weights.
    fn visit(&self, leaves: [Range<usize>; 2], reading: Option<BandReading>, mut visit: impl FnMut([usize; 2], f64)) {
        let [columns, rows] = self.propagating(leaves);
        for gy in rows {
            for gx in columns.clone() {
                visit([gx, gy], self.leaf_weight([gx, gy], reading));
            }
        }
    }

    /// The part of a rectangle of leaves about the disc of what propagates.
    fn propagating(&self, leaves: [Range<usize>; 2]) -> [Range<usize>; 2] {
        let lattice = self.table.lattice();
        let clip = |axis: usize, range: &Range<usize>, len: usize, reach: usize| {
            let leaf = |q: f64| ((q + self.wi[axis]) / self.step[axis] + reach as f64) / len as f64;
            let (low, high) = (leaf(-1.0 - self.reach[axis]) - 1.0, leaf(1.0 + self.reach[axis]) + 1.0);
            let low = (low.max(0.0) as usize).clamp(range.start, range.end);
            low..(high.max(0.0) as usize).clamp(low, range.end)
        };
        let (x, y) = (&self.proposal.leaves.x, &self.proposal.leaves.y);
        [clip(0, &leaves[0], x.len, lattice.x.reach), clip(1, &leaves[1], y.len, lattice.y.reach)]
    }

    fn leaf_weight(&self, leaf: [usize; 2], reading: Option<BandReading>) -> f64 {
        self.leaf(leaf, reading).of(self.proposal.leaves.power(leaf[0], leaf[1]))
    }

    /// `F_l` and where its power is read: at κ_l, or as its cell has it, which is then judged for all of its leaves.
    fn leaf(&self, leaf: [usize; 2], cell: Option<BandReading>) -> BandReading {
        let place = Place::new(self, leaf);
        let part = place.part();
        if let Some(reading) = cell {
            return reading.times(part);
        }
        if part <= 0.0 {
            return BandReading::default();
        }
        let wo = place.direction();
        let Some(pair) = Pair::new(self.wi, wo) else { return BandReading::default() };
        let factor = part * self.options.angular_factor(&pair);
        BandReading::new(factor, self.table.band_position(pair.kappa(self.wavelength_um)))
    }

    /// Where the powers of a cell's leaves are read: at the κ of its middle. `None` where there is only one cell.
    fn cell_reading(&self, cell: [usize; 2]) -> Option<BandReading> {
        let lattice = self.table.lattice();
        let middle = |axis: &LeafAxis, cell: usize, reach: usize| {
            let len = (axis.in_cell * axis.len) as f64;
            (cell as f64 + 0.5) * len - 0.5 - reach as f64
        };
        let leaves = &self.proposal.leaves;
        let x = self.step[0] * middle(&leaves.x, cell[0], lattice.x.reach) - self.wi[0];
        let y = self.step[1] * middle(&leaves.y, cell[1], lattice.y.reach) - self.wi[1];
        let cos = (1.0 - x * x - y * y).max(0.0).sqrt();
        let kappa = std::f64::consts::TAU * (self.wi[2] + cos) / self.wavelength_um;
        self.proposal.has_cells().then(|| BandReading::new(1.0, self.table.band_position(kappa)))
    }
}

/// A leaf as an incidence sees it: its centre of power in direction cosines, and half its extents along the radius.
struct Place {
    x: f64,
    y: f64,
    rho: f64,
    half: f64,
    reach: f64,
}

impl Place {
    fn new(local: &Local, leaf: [usize; 2]) -> Self {
        let lattice = local.table.lattice();
        let [x, y, half_x, half_y] = local.proposal.leaves.place_of(leaf[0], leaf[1]);
        let x = local.step[0] * (x - lattice.x.reach as f64) - local.wi[0];
        let y = local.step[1] * (y - lattice.y.reach as f64) - local.wi[1];
        let rho = (x * x + y * y).sqrt().max(RHO_MIN);
        let radial = |half: [f64; 2]| (x.abs() * half[0] + y.abs() * half[1]) / rho;
        let half = radial([local.step[0] * half_x, local.step[1] * half_y]);
        Self { x, y, rho, half, reach: radial(local.reach) }
    }

    /// The part inside the horizon.
    fn part(&self) -> f64 {
        if self.rho + self.reach <= 1.0 {
            return 1.0;
        }
        let part = |half: f64| (0.5 + 0.5 * (1.0 - self.rho) / half).clamp(0.0, 1.0);
        let near = part(self.half);
        // Much as the integral of a Gaussian.
        let inside = near * near * (3.0 - 2.0 * near);
        (1.0 - ANYWHERE_SHARE) * inside + ANYWHERE_SHARE * part(self.reach)
    }

    /// The direction of the middle of that part.
    fn direction(&self) -> Vec3 {
        let inward = (1.0 - self.rho).max(0.5 * (1.0 - self.rho + self.half)).max(0.25 * self.half).min(1.0);
        let cos = (inward * (2.0 - inward)).max(COS_SQUARED_MIN).sqrt();
        let scale = (1.0 - inward) / self.rho;
        [self.x * scale, self.y * scale, cos]
    }
}
