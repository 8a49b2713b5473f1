//! One method with one set of parameters, ready to be timed and compared with the reference.
//!
//! Symbols, as in docs/model.md: the reflectance `f_r` in 1/sr is the Fresnel factor times `O·M·S/λ²`, with the
//! obliquity factor O, the shadowing factor M, the power spectrum S of the relief in µm² and the wavelength λ.

use super::{Entry, Errors, Timing};
use crate::benchmarks::DirectionPair;
use serde_json::{Map, Value};
use std::sync::Arc;
use sunbeam::colour::SpectralToRgb;
use sunbeam::lobe::Surface;
use sunbeam::methods::Method;
use sunbeam::table::Model;

/// Name in the report of the library's method `table`, which looks up colours in a colour table (docs/tables.md).
pub(super) const COLOUR_TABLE: &str = "colour-table";
/// Name in the report of the method that looks up the spectral tables at each wavelength and sums to a colour.
pub(super) const SPECTRAL_TABLE: &str = "spectral-table";

/// A method with its parameters and its data. [`Entry`] documents the fields, except for the evaluator.
pub(super) struct Candidate {
    pub(super) method: &'static str,
    pub(super) model: Model,
    pub(super) parameters: Map<String, Value>,
    pub(super) is_default: bool,
    pub(super) bytes: u64,
    pub(super) build_seconds: f64,
    pub(super) evaluator: Evaluator,
}

/// The evaluator behind a candidate.
pub(super) enum Evaluator {
    /// A method that computes colours, in single precision. Its answers are `S/λ²` in 1/sr, at a wavelength or
    /// integrated to linear sRGB, without `O·M`.
    Colour(Box<dyn Method>),
    /// A surface whose spectral tables are read at each wavelength, with the wavelengths and weights that turn a
    /// spectrum into a colour. Its values are `O·M·S/λ²`, since its options have no energy conservation (mod.rs).
    Spectral(Arc<Surface>, SpectralToRgb),
}

impl Candidate {
    /// Whether a colour takes the same time with both candidates: true for a candidate and itself, and for two colour
    /// tables of equal size, since the work of a look-up does not depend on the data.
    pub(super) fn costs_like(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
            || self.method == COLOUR_TABLE && other.method == COLOUR_TABLE && self.bytes == other.bytes
    }

    /// The linear sRGB of `f_r` in 1/sr, without the Fresnel factor.
    ///
    /// `factor` is `O·M` of the pair. Only answers of [`Evaluator::Colour`] are multiplied by it, since spectral tables
    /// include it.
    pub(super) fn rgb(&self, pair: &DirectionPair, factor: f64) -> [f64; 3] {
        match &self.evaluator {
            Evaluator::Colour(method) => {
                let [wi, wo] = pair.single();
                method.answer_rgb(wi, wo).map(|channel| factor * f64::from(channel))
            }
            Evaluator::Spectral(surface, to_rgb) => to_rgb.rgb_of(|nm| surface.eval(pair.wi, pair.wo, nm)),
        }
    }

    /// `f_r` in 1/sr at a wavelength in nm, without the Fresnel factor; `None` from methods without spectra.
    ///
    /// `factor` is `O·M` of the pair, as in [`Candidate::rgb`].
    pub(super) fn spectral(&self, pair: &DirectionPair, factor: f64, nm: f64) -> Option<f64> {
        match &self.evaluator {
            Evaluator::Colour(method) => {
                let [wi, wo] = pair.single();
                method.answer_spectral(wi, wo, nm as f32).map(|value| factor * f64::from(value))
            }
            Evaluator::Spectral(surface, _) => Some(surface.eval(pair.wi, pair.wo, nm)),
        }
    }

    /// The candidate's entry in the report. `mark_fronts` of mod.rs sets `on_front` and `on_front_of_method` later.
    pub(super) fn into_entry(self, errors: Errors, cpu: Timing, gpu: Option<Timing>) -> Entry {
        let Self { method, model, parameters, is_default, bytes, build_seconds, .. } = self;
        Entry {
            method,
            model,
            parameters,
            is_default,
            bytes,
            build_seconds,
            cpu,
            gpu,
            errors,
            on_front: false,
            on_front_of_method: false,
        }
    }
}
