use super::lookup::{BANDS, SpectralTable};

/// Nodes of a row that share one entry of the cumulative table.
const BLOCK: usize = 8;

/// A node drawn by [`OrderSampler::choose`], with what is left of the random numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderChoice {
    /// Node numbers along x and y.
    pub jx: i64,
    pub jy: i64,
    /// The random numbers, stretched to [0, 1) again.
    pub u: [f64; 2],
}

/// Draws nodes of a [`SpectralTable`] in proportion to their mean power in one κ band: first the row, then a block of
/// the row, then the node.
#[derive(Clone, Debug)]
pub struct OrderSampler {
    rows: usize,
    blocks: usize,
    /// `[band][row]`, cumulative, first entry 0, `rows + 1` long each.
    row_cdf: Vec<f32>,
    /// `[band][row][block]`, cumulative within the row and normalised to it, first entry 0, `blocks + 1` long each.
    block_cdf: Vec<f32>,
}

impl OrderSampler {
    /// Cumulative tables of `table`'s band means.
    pub fn new(table: &SpectralTable) -> Self {
        let rows = table.lattice.y.nodes();
        let columns = table.lattice.x.nodes();
        let blocks = columns.div_ceil(BLOCK);
        let mut row_cdf = Vec::with_capacity(BANDS * (rows + 1));
        let mut block_cdf = Vec::with_capacity(BANDS * rows * (blocks + 1));
        for band in 0..BANDS {
            let mut row_sums = Vec::with_capacity(rows);
            for row in table.offsets.chunks(columns) {
                let power = |&offset: &u32| table.records[4 * offset as usize + band] as f64;
                let sums: Vec<f64> = row.chunks(BLOCK).map(|block| block.iter().map(power).sum()).collect();
                cumulate(&sums, &mut block_cdf);
                row_sums.push(sums.iter().sum());
            }
            cumulate(&row_sums, &mut row_cdf);
        }
        Self { rows, blocks, row_cdf, block_cdf }
    }

    /// Rows of nodes.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Blocks of a row.
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// Nodes in a block.
    pub fn block_len(&self) -> usize {
        BLOCK
    }

    /// `[band][row]` cumulative, `rows + 1` entries a band.
    pub fn row_cdf(&self) -> &[f32] {
        &self.row_cdf
    }

    /// `[band][row][block]` cumulative, `blocks + 1` entries a row.
    pub fn block_cdf(&self) -> &[f32] {
        &self.block_cdf
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.row_cdf.as_slice()) + size_of_val(self.block_cdf.as_slice())
    }

    /// Draws a node of `band` from two random numbers in [0, 1).
    pub fn choose(&self, table: &SpectralTable, band: usize, u: [f64; 2]) -> OrderChoice {
        let (row, uy) = descend(&self.row_cdf[band * (self.rows + 1)..][..self.rows + 1], u[1]);
        let start = (band * self.rows + row) * (self.blocks + 1);
        let (block, ux) = descend(&self.block_cdf[start..][..self.blocks + 1], u[0]);
        let columns = table.lattice.x.nodes();
        let first = block * BLOCK;
        let offsets = &table.offsets[row * columns + first..row * columns + (first + BLOCK).min(columns)];
        let power = |i: usize| table.records[4 * offsets[i] as usize + band] as f64;
        let total: f64 = (0..offsets.len()).map(power).sum();
        let mut left = ux * total;
        let mut chosen = 0;
        while chosen + 1 < offsets.len() && left >= power(chosen) {
            left -= power(chosen);
            chosen += 1;
        }
        let p = power(chosen);
        let ux = if p > 0.0 { (left / p).clamp(0.0, 1.0 - f64::EPSILON) } else { 0.5 };
        let (rx, ry) = (table.lattice.x.reach as i64, table.lattice.y.reach as i64);
        OrderChoice { jx: (first + chosen) as i64 - rx, jy: row as i64 - ry, u: [ux, uy] }
    }
}

/// Appends the cumulative sums of `weights`, normalised, with a leading zero. Weights that are all zero give a uniform
/// table, which is never reached.
fn cumulate(weights: &[f64], out: &mut Vec<f32>) {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    out.push(0.0);
    for (i, w) in weights.iter().enumerate() {
        sum += w;
        let share = if total > 0.0 { sum / total } else { (i + 1) as f64 / weights.len() as f64 };
        out.push(share as f32);
    }
}

/// The interval of a cumulative table that holds `u`, and where in it `u` lies.
fn descend(cdf: &[f32], u: f64) -> (usize, f64) {
    let i = cdf[1..cdf.len() - 1].partition_point(|&c| c as f64 <= u);
    let (low, high) = (cdf[i] as f64, cdf[i + 1] as f64);
    let inside = if high > low { ((u - low) / (high - low)).clamp(0.0, 1.0 - f64::EPSILON) } else { 0.5 };
    (i, inside)
}
