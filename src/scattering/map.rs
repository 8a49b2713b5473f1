//! Directions of the pixels of a map of the upper hemisphere (orthographic projection).

use super::{Vec3, direction_above};

/// Direction at the centre of a pixel of a square map of the hemisphere seen from above, with `size` pixels along each
/// side, at least 1. +x points right and +y up; row 0 is at the top. The coordinates in the map are the direction's x
/// and y, from −1 to 1. `None` for a pixel whose centre lies on or outside the unit circle.
pub fn map_direction(column: usize, row: usize, size: usize) -> Option<Vec3> {
    // Centre of pixel i in [−1, 1].
    let centre = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
    direction_above(centre(column), -centre(row))
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
