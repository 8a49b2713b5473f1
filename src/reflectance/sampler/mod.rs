//! Directions drawn by what a surface reflects.

pub mod summed_area;
