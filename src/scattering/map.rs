//! Pixels of a map over the hemisphere.

use super::Vec3;

/// Direction at the centre of a pixel of a square map of the hemisphere seen from above: +x right, +y up, row 0 at the
/// top, `size` pixels along each side. `None` outside the disc.
pub fn map_direction(column: usize, row: usize, size: usize) -> Option<Vec3> {
    let place = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
    let (x, y) = (place(column), -place(row));
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 0.0).then(|| [x, y, z_squared.sqrt()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x_is_right_and_y_is_up() {
        assert_eq!(map_direction(0, 0, 8), None);
        let [x, y, _] = map_direction(7, 3, 8).unwrap();
        assert!(x == 0.875 && y == 0.125);
        let [x, y, _] = map_direction(4, 0, 8).unwrap();
        assert!(x == 0.125 && y == 0.875);
    }
}
