//! Choice of heights for missing points; `film.rs` computes them.

use super::HeightFieldError;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Heights that replace missing points of a file or an array.
///
/// ```
/// use ndarray::array;
/// use sunbeam_height_field::{Fill, HeightField};
///
/// let holed = array![[0.0, 0.1, 0.2], [0.1, f64::NAN, 0.3], [0.2, 0.3, 0.4]];
/// let field = HeightField::with_holes(holed, 0.1, 0.1, Fill::Laplace)?;
/// // A plane is continued exactly.
/// assert!((field.heights_um()[[1, 1]] - 0.2).abs() < 1e-9);
/// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// No heights: missing points are an error.
    #[default]
    None,
    /// The solution of Laplace's equation in each hole (connected missing points), with the heights around the hole as
    /// boundary values. The solution stays between the lowest and the highest boundary value.
    Laplace,
    /// The mean of all known heights. Leaves a step around each hole, which diffracts.
    Mean,
}

impl Fill {
    /// Every kind, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::None, Self::Laplace, Self::Mean];

    /// The name used on command lines and in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Laplace => "laplace",
            Self::Mean => "mean",
        }
    }
}

impl fmt::Display for Fill {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Fill {
    type Err = HeightFieldError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|fill| fill.name() == name).ok_or_else(|| HeightFieldError::UnknownName {
            parameter: "fill",
            found: name.to_owned(),
            accepted: Self::ALL.map(Self::name).join(", "),
        })
    }
}
