//! Polarisation of a grating's orders: a table of normalised Jones matrices beside the efficiencies, and the Mueller
//! matrices computed from it (docs/model.md#gratings-by-maxwells-equations; symbols: `mod.rs`).
//!
//! Jones matrices are between the two polarisation states of an order, Ey and Hy, with y along the grooves. The table
//! holds their *shapes* (`jones_shape.rs`): matrices `[EE, EH, HE, HH]`, the outgoing state first, whose crossed
//! elements EH and HE are divided by ky/k. A shape is scaled to power 1; the *power* of a matrix is half the sum of its
//! elements' squared magnitudes. [`JonesTable`](super::JonesTable) builds the table, [`JonesView`] reads it.
//!
//! Table data are words of 32 bits. A shape is a *packet* of four words, one for each element. The lower half of a
//! word is the real part and the upper half the imaginary part, both as `x/UNIT + ZERO` in 16 bits. Look-ups are
//! generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable.

use super::channels::Channels;
use super::efficiencies::{EfficiencyView, Node};
use super::layout::EfficiencyLayout;
use crate::numeric::math::u16_pair;
use crate::numeric::{Number, Numbers, Real};

/// Value of one unit of a stored 16-bit integer. Elements of a shape of power 1 are at most √2 in magnitude; the range
/// of ±1.45 leaves room for the error of resampling.
pub(super) const UNIT: f64 = 1.45 / 32_767.0;
/// Stored integer that represents zero.
pub(super) const ZERO: f64 = 32_768.0;

/// A complex number: real part, imaginary part.
type Complex<N> = [<N as Numbers>::Real; 2];

/// Look-up in a [`JonesTable`](super::JonesTable), over the numbers `N`.
#[derive(Clone, Copy)]
pub struct JonesView<N: Numbers> {
    /// Wavelengths, cells and nodes of the table.
    pub(super) layout: EfficiencyLayout,
    /// Table data, arranged as [`JonesTable`](super::JonesTable) describes.
    pub(super) words: N::Words,
}

impl<N: Numbers> JonesView<N> {
    /// Mueller matrix of an order, row by row, divided by its first element.
    ///
    /// `channels` lists the orders on either side of the relief for the incident wave. The second argument has the
    /// indices of the channels of incident and outgoing light. `nm` is the wavelength, and `ky_over_k` the component of
    /// the wave vector along the grooves over 2π/λ. The table is read where `active` is true. The first axis of the
    /// frames of incident and outgoing light is the grooves' direction, made transverse to the light.
    #[inline(always)]
    pub(super) fn matrix(
        &self,
        channels: &Channels<N>,
        [incident, outgoing]: [N::Index; 2],
        nm: N::Real,
        ky_over_k: N::Real,
        active: N::Mask,
    ) -> [N::Real; 16] {
        let real = N::Real::lit;
        // The table has the nodes of a table of efficiencies, so the view of such a table finds them.
        let nodes = EfficiencyView::<N> { layout: self.layout, words: self.words };
        let count = channels.count;
        let entry = incident * count + outgoing;
        // The shape's elements `[real, imaginary]` in units of UNIT, interpolated between the eight nodes around the
        // wave and its wavelength. The nodes' weights sum to 1, so ZERO is subtracted once.
        let mut shape = [[real(-ZERO); 2]; 4];
        for (Node { cell_offset, index }, weight) in nodes.weighted_nodes(channels, nm, active) {
            let packet = N::gather::<4>(self.words, cell_offset + index * count * count + entry, active);
            for (element, word) in shape.iter_mut().zip(packet) {
                let parts = u16_pair::<N>(word);
                *element = [0, 1].map(|c| parts[c].fma(weight, element[c]));
            }
        }
        let [ee, eh, he, hh] = shape;
        // From a shape to the Jones matrix between the axes of the frames. The electric field of the Ey state points
        // along the first axis; that of the Hy state points against the second, since frames are right-handed.
        let crossed = |element: Complex<N>| element.map(|part| -(part * ky_over_k));
        mueller::<N>([ee, crossed(eh), crossed(he), hh])
    }
}

/// Mueller matrix of the Jones matrix `[xx, xy, yx, yy]` (outgoing state first), row by row, divided by its first
/// element.
///
/// Fields vary in time as exp(−iωt). The Stokes parameters of a field (x, y) are |x|² + |y|², |x|² − |y|², `2 Re(x y*)`
/// and `2 Im(x y*)`, as in Mitsuba. Elements of the Jones matrix are in units of [`UNIT`]. If its power in these units
/// is at most 1, it counts as zero, and the Mueller matrix is that of an ideal depolariser.
#[inline(always)]
pub(super) fn mueller<N: Numbers>([xx, xy, yx, yy]: [Complex<N>; 4]) -> [N::Real; 16] {
    let (real, half) = (N::Real::lit, N::Real::lit(0.5));
    // a·b*.
    let times = |a: Complex<N>, b: Complex<N>| [a[0].fma(b[0], a[1] * b[1]), a[1] * b[0] - a[0] * b[1]];
    // Halves of the squared magnitudes, whose sum is the power, and the products of elements in one row, one column and
    // one diagonal.
    let [pxx, pxy, pyx, pyy] = [xx, xy, yx, yy].map(|z| times(z, z)[0] * half);
    let [x_row, y_row] = [times(xx, xy), times(yx, yy)];
    let [x_column, y_column] = [times(xx, yx), times(xy, yy)];
    let [diagonal, antidiagonal] = [times(xx, yy), times(xy, yx)];
    let power = pxx + pxy + pyx + pyy;
    let matrix = [
        [power, pxx - pxy + pyx - pyy, x_row[0] + y_row[0], -(x_row[1] + y_row[1])],
        [pxx + pxy - pyx - pyy, pxx - pxy - pyx + pyy, x_row[0] - y_row[0], y_row[1] - x_row[1]],
        [
            x_column[0] + y_column[0],
            x_column[0] - y_column[0],
            diagonal[0] + antidiagonal[0],
            antidiagonal[1] - diagonal[1],
        ],
        [
            x_column[1] + y_column[1],
            x_column[1] - y_column[1],
            diagonal[1] + antidiagonal[1],
            diagonal[0] - antidiagonal[0],
        ],
    ];
    // A shape of power 1 has 1/UNIT² = 5e8 here.
    let has_power = real(1.0).lt(power);
    let scale = real(1.0) / N::Real::select(has_power, power, real(1.0));
    std::array::from_fn(|i| {
        let depolariser = real(if i == 0 { 1.0 } else { 0.0 });
        N::Real::select(has_power, matrix[i / 4][i % 4] * scale, depolariser)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;

    #[test]
    fn zero_matrices_depolarise() {
        let matrix = mueller::<Plain<f64>>([[0.0; 2]; 4]);
        assert_eq!(matrix[0], 1.0);
        assert!(matrix[1..].iter().all(|&element| element == 0.0));
    }
}
