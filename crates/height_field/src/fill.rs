//! Heights for points that a file has none for.

use super::HeightFieldError;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// What is put where a file has no height.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// Nothing: such a file is refused.
    #[default]
    None,
    /// The solution of Laplace's equation between the heights around each hole: the smoothest film over it, that never
    /// rises above nor falls below its rim.
    Laplace,
    /// The mean of the heights that there are: leaves a step around each hole, which diffracts.
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
