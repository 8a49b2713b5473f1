//! The energy scaling of outgoing directions as the sampler knows it: coarse, and the same for all wavelengths.

use super::AlbedoScale;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};

/// Azimuths of the grid, the nearest of which is taken, and intervals in cosθ, between which it is linear.
const AZIMUTHS: usize = 16;
const COSINES: usize = 24;
/// Wavelengths of the mean.
const WAVELENGTHS: usize = 12;

/// The mean over wavelengths of an [`AlbedoScale`] on a grid that is quick to read: cosθ at squares, azimuths at equal
/// steps of [`diamond`].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Shade {
    /// `[azimuth][cosine]`, `COSINES + 1` nodes in cosθ; empty where nothing is scaled.
    values: Vec<f32>,
}

impl Shade {
    /// The means of a scaling, or nothing.
    pub(super) fn new(scale: Option<&AlbedoScale>) -> Self {
        let Some(scale) = scale else { return Self::default() };
        let mut values = Vec::with_capacity(AZIMUTHS * (COSINES + 1));
        for azimuth in 0..AZIMUTHS {
            let [x, y] = from_diamond(azimuth as f64 * 4.0 / AZIMUTHS as f64);
            for cosine in 0..=COSINES {
                let cos = (cosine as f64 / COSINES as f64).powi(2);
                let sin = (1.0 - cos * cos).sqrt();
                let sum: f64 = (0..WAVELENGTHS)
                    .map(|l| {
                        let t = (l as f64 + 0.5) / WAVELENGTHS as f64;
                        let nm = WAVELENGTH_MIN_NM + t * (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM);
                        scale.factor([sin * x, sin * y, cos], nm)
                    })
                    .sum();
                values.push((sum / WAVELENGTHS as f64) as f32);
            }
        }
        Self { values }
    }

    /// The scaling towards the azimuth of (x, y) at a cosine.
    pub(super) fn at(&self, x: f64, y: f64, cos: f64) -> f64 {
        if self.values.is_empty() {
            return 1.0;
        }
        // Half a step on, so that no edge lies along an axis or a diagonal.
        let azimuth = (diamond(x, y) * (AZIMUTHS as f64 / 4.0) + 0.5) as usize % AZIMUTHS;
        let i = ((cos.sqrt() * COSINES as f64) as usize).min(COSINES - 1);
        let node = |i: usize| (i as f64 / COSINES as f64).powi(2);
        let pair = &self.values[azimuth * (COSINES + 1) + i..][..2];
        let t = ((cos - node(i)) / (node(i + 1) - node(i))).clamp(0.0, 1.0);
        pair[0] as f64 + t * (pair[1] - pair[0]) as f64
    }

    /// `[azimuth][cosine]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Azimuths and intervals in cosθ.
    pub fn shape() -> (usize, usize) {
        (AZIMUTHS, COSINES)
    }
}

/// An azimuth that needs no trigonometry: from 0 to 4 around the square `|x| + |y| = 1`, beginning at +x.
fn diamond(x: f64, y: f64) -> f64 {
    let along = y.abs() / (x.abs() + y.abs()).max(1e-30);
    match (x >= 0.0, y >= 0.0) {
        (true, true) => along,
        (false, true) => 2.0 - along,
        (false, false) => 2.0 + along,
        (true, false) => 4.0 - along,
    }
}

/// The unit vector of a [`diamond`] azimuth.
fn from_diamond(turn: f64) -> [f64; 2] {
    let (quarter, along) = (turn as usize, turn.fract());
    let (x, y) = match quarter {
        0 => (1.0 - along, along),
        1 => (-along, 1.0 - along),
        2 => (along - 1.0, -along),
        _ => (along, along - 1.0),
    };
    let length = x.hypot(y);
    [x / length, y / length]
}
