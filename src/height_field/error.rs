use thiserror::Error;

/// Why a height field was refused. Every message names what is wrong and what is accepted.
#[derive(Debug, Error)]
pub enum HeightFieldError {
    #[error("the height field has no pixels; at least one is needed")]
    Empty,
    #[error("the pixel size along {axis} is {value_um} µm; it must be finite and positive")]
    PixelSize { axis: &'static str, value_um: f64 },
    #[error("the height at row {row}, column {column} is {value}; every height must be finite")]
    NotFinite { row: usize, column: usize, value: f64 },
}
