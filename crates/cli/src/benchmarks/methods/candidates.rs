//! The methods and parameter sets that are measured on one surface.
//!
//! A *candidate* (candidate.rs) is a method with one set of parameters:
//!
//! - the step between wavelengths in nm;
//! - the series of the phase screen, Chebyshev or Taylor, and its number of terms;
//! - the *neighbourhood*, the number of orders summed along each axis;
//! - the tolerance, a relative error, from which the library derives the terms and the neighbourhood unless given;
//! - the resolution of a colour table, a factor on its number of samples along each axis.
//!
//! The published methods (docs/realtime.md) are measured with the library's defaults, with the parameters of Single
//! 2014, and with cheaper or finer ones:
//!
//! - FLSS (full lambda spectral sampling) sums the diffraction orders nearest to the direction of view, at equal steps
//!   of the wavelength;
//! - NMM sums such orders only at the wavelengths of which an order leaves towards the viewer. Unless `weighted` is
//!   false, each wavelength has the width of the interval that it represents as a weight;
//! - PQ sums over a finite number of tiles, P along x and Q along y;
//! - Stam's method knows only the spacing of the relief's grooves along x.
//!
//! These methods evaluate one fixed coherence window ([`Model::Patch`]). Tables also have the mean over all positions
//! of the window ([`Model::Ensemble`]).
//!
//! Single 2014 is M. Single's thesis, *An Interactive Shader for Natural Diffraction Gratings* (Bern).

use super::candidate::{COLOUR_TABLE, Candidate, Evaluator, SPECTRAL_TABLE};
use crate::benchmarks::BenchError;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::time::Instant;
use sunbeam::colour::SpectralToRgb;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::methods::{
    ColourTable, ColourTableOptions, Flss, Method, MethodError, MethodKind, MethodOptions, Nmm, OrderCounts, Pq, Stam,
};
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Progress};
use sunbeam::transform::Series;

/// Steps between wavelengths in nm. The default, 5, comes first, since the first candidate is the baseline. Parameter
/// sets besides the default have only some of the steps, which saves time.
const STEPS_NM: [f64; 6] = [5.0, 1.0, 2.0, 10.0, 25.0, 50.0];
/// Tolerances that are measured besides that of the surface.
const TOLERANCES: [f64; 2] = [1e-1, 1e-2];

/// Builds every candidate of a surface. The first is FLSS with its defaults, the baseline of the ratios of times.
///
/// `options` are those of the surface. `few` restricts each method to a few parameter sets. `progress` receives the
/// name of each stage when it begins.
///
/// # Errors
/// A method that cannot be built.
pub(super) fn build_all(
    field: &HeightField,
    options: &Options,
    few: bool,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Candidate>, BenchError> {
    let mut builder = Builder { field, options, few, built: Vec::new() };
    progress("building flss");
    builder.flss()?;
    progress("building nmm, pq and stam");
    builder.nmm()?;
    builder.pq()?;
    builder.stam()?;
    progress("building colour tables");
    builder.colour_tables()?;
    progress("building spectral tables");
    builder.spectral_tables()?;
    Ok(builder.built)
}

/// Parameters of a published method.
#[derive(Clone, Default, PartialEq)]
struct Parameters {
    /// Tolerance; `None` for the surface's, which the report leaves out.
    tolerance: Option<f64>,
    /// All other parameters.
    options: MethodOptions,
}

/// The candidates of one surface so far.
struct Builder<'a> {
    field: &'a HeightField,
    /// Options of the surface.
    options: &'a Options,
    /// Whether each method is restricted to a few parameter sets.
    few: bool,
    built: Vec<Candidate>,
}

impl Builder<'_> {
    /// [`TOLERANCES`] without the surface's, whose candidates would appear twice.
    fn other_tolerances(&self) -> Vec<f64> {
        TOLERANCES.into_iter().filter(|tolerance| *tolerance != self.options.tolerance).collect()
    }

    /// Adds a published method, and reports only the parameters that it reads. `counts` are the numbers of terms and
    /// orders that it sums. They are reported in place of the options, which may be `None`.
    fn push<M: Method + 'static>(
        &mut self,
        kind: MethodKind,
        method: M,
        parameters: &Parameters,
        counts: OrderCounts,
        build_seconds: f64,
    ) {
        let Parameters { tolerance, options } = parameters;
        let all = [
            ("lambda_step_nm", json!(options.lambda_step_nm)),
            ("terms", json!(counts.terms)),
            ("neighbourhood", json!(counts.neighbourhood)),
            ("series", json!(options.series)),
            ("weighted", json!(options.weighted)),
        ];
        let used = all.into_iter().filter(|(name, _)| kind.options().contains(name));
        let mut reported: Map<String, Value> = used.map(|(name, value)| (name.to_owned(), value)).collect();
        if let Some(tolerance) = tolerance {
            reported.insert("tolerance".into(), json!(tolerance));
        }
        self.built.push(Candidate {
            method: kind.name(),
            model: Model::Patch,
            parameters: reported,
            // The surface's tolerance counts as the default one.
            is_default: *parameters == Parameters::default(),
            bytes: shader_bytes(&method),
            build_seconds,
            evaluator: Evaluator::Colour(Box::new(method)),
        });
    }

    /// Adds FLSS with one set of parameters at several steps between wavelengths, which share the transforms of the
    /// relief. Returns the numbers of terms and orders that FLSS sums.
    fn flss_steps(&mut self, parameters: &Parameters, steps_nm: &[f64]) -> Result<OrderCounts, BenchError> {
        let start = Instant::now();
        let Parameters { tolerance, options } = parameters;
        // Adds the candidate's name to an error.
        let named = |source| BenchError::Method { candidate: format!("flss {options:?}"), source };
        let tolerance = tolerance.unwrap_or(self.options.tolerance);
        let method = Flss::new(self.field, self.options.coherence_length_um, tolerance, options, &Progress::none())
            .map_err(named)?;
        let build_seconds = start.elapsed().as_secs_f64();
        for lambda_step_nm in steps_nm.iter().copied() {
            let stepped = method.with_lambda_step(lambda_step_nm).map_err(named)?;
            let options = MethodOptions { lambda_step_nm, ..options.clone() };
            let parameters = Parameters { options, ..*parameters };
            self.push(MethodKind::Flss, stepped, &parameters, method.counts(), build_seconds);
        }
        Ok(method.counts())
    }

    /// Adds FLSS with its parameter sets.
    fn flss(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        // Parameters with these options and the surface's tolerance.
        let with = |options: MethodOptions| Parameters { tolerance: None, options };
        // Single 2014: Taylor's series and 3 × 3 orders.
        let single_2014 = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..default.clone() };
        if self.few {
            self.flss_steps(&with(default), &[5.0, 25.0])?;
            self.flss_steps(&with(single_2014), &[5.0])?;
            return Ok(());
        }
        let default_counts = self.flss_steps(&with(default.clone()), &STEPS_NM)?;
        self.flss_steps(&with(single_2014.clone()), &[1.0, 5.0, 10.0, 25.0])?;
        // Taylor's series with as many terms as Chebyshev's.
        self.flss_steps(&with(MethodOptions { terms: Some(default_counts.terms), ..single_2014 }), &[5.0])?;
        for tolerance in self.other_tolerances() {
            let parameters = Parameters { tolerance: Some(tolerance), options: default.clone() };
            self.flss_steps(&parameters, &[2.0, 5.0, 10.0, 25.0])?;
        }
        for neighbourhood in [1, 3].into_iter().filter(|n| *n < default_counts.neighbourhood) {
            let options = MethodOptions { neighbourhood: Some(neighbourhood), ..default.clone() };
            self.flss_steps(&with(options), &[5.0, 25.0])?;
        }
        // Shader and Rust code sum eight terms at a time, so only multiples of eight differ in time.
        for terms in [16, 8].into_iter().filter(|n| *n < default_counts.terms) {
            self.flss_steps(&with(MethodOptions { terms: Some(terms), ..default.clone() }), &[5.0, 10.0])?;
        }
        Ok(())
    }

    /// Adds NMM with one parameter set. Returns the numbers of terms and orders that it sums.
    fn nmm_with(&mut self, options: MethodOptions) -> Result<OrderCounts, BenchError> {
        let start = Instant::now();
        let Options { coherence_length_um, tolerance, .. } = *self.options;
        let method = Nmm::new(self.field, coherence_length_um, tolerance, &options, &Progress::none())
            .map_err(|source| BenchError::Method { candidate: format!("nmm {options:?}"), source })?;
        let (counts, build_seconds) = (method.counts(), start.elapsed().as_secs_f64());
        self.push(MethodKind::Nmm, method, &Parameters { tolerance: None, options }, counts, build_seconds);
        Ok(counts)
    }

    /// Adds NMM with its parameter sets.
    fn nmm(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let unweighted = MethodOptions { weighted: false, ..default.clone() };
        let default_counts = self.nmm_with(default.clone())?;
        self.nmm_with(unweighted.clone())?;
        if self.few {
            return Ok(());
        }
        // Single 2014: Taylor's series and 3 × 3 orders, unweighted.
        self.nmm_with(MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..unweighted })?;
        // The default neighbourhood is measured already.
        for neighbourhood in [1, 3, 5].into_iter().filter(|n| *n != default_counts.neighbourhood) {
            self.nmm_with(MethodOptions { neighbourhood: Some(neighbourhood), ..default.clone() })?;
        }
        Ok(())
    }

    /// Adds PQ with one set of parameters at several steps between wavelengths, which share the relief's transforms.
    fn pq_steps(&mut self, options: &MethodOptions, steps_nm: &[f64]) -> Result<(), BenchError> {
        let start = Instant::now();
        let Options { coherence_length_um, tolerance, .. } = *self.options;
        // Adds the candidate's name to an error.
        let named = |source| BenchError::Method { candidate: format!("pq {options:?}"), source };
        let method = Pq::new(self.field, coherence_length_um, tolerance, options, &Progress::none()).map_err(named)?;
        let (counts, build_seconds) = (method.counts(), start.elapsed().as_secs_f64());
        for lambda_step_nm in steps_nm.iter().copied() {
            let stepped = method.with_lambda_step(lambda_step_nm).map_err(named)?;
            let options = MethodOptions { lambda_step_nm, ..options.clone() };
            self.push(MethodKind::Pq, stepped, &Parameters { tolerance: None, options }, counts, build_seconds);
        }
        Ok(())
    }

    /// Adds PQ with its parameter sets.
    fn pq(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        if self.few {
            return self.pq_steps(&default, &[5.0]);
        }
        self.pq_steps(&default, &[5.0, 1.0, 10.0, 25.0, 50.0])?;
        self.pq_steps(&MethodOptions { series: Series::Taylor, ..default }, &[5.0])
    }

    /// Adds Stam's method, or nothing where the relief has no period along x.
    fn stam(&mut self) -> Result<(), BenchError> {
        let start = Instant::now();
        match Stam::new(self.field, self.options.coherence_length_um, &MethodOptions::default()) {
            Err(MethodError::NoPeriod) => return Ok(()),
            Err(source) => return Err(BenchError::Method { candidate: "stam".into(), source }),
            Ok(method) => self.built.push(Candidate {
                method: MethodKind::Stam.name(),
                model: Model::Patch,
                parameters: Map::new(),
                is_default: true,
                bytes: shader_bytes(&method),
                build_seconds: start.elapsed().as_secs_f64(),
                evaluator: Evaluator::Colour(Box::new(method)),
            }),
        }
        Ok(())
    }

    /// Adds colour tables of both models, with several resolutions and tolerances.
    fn colour_tables(&mut self) -> Result<(), BenchError> {
        let default_tolerance = self.options.tolerance;
        // Model, resolution and tolerance of each table. By default the model is the ensemble and the resolution 1.
        // Resolutions are spaced by about √2.
        let mut sets = vec![(Model::Ensemble, 1.0, default_tolerance), (Model::Ensemble, 0.5, default_tolerance)];
        if !self.few {
            sets.extend([0.35, 0.7, 1.4].map(|resolution| (Model::Ensemble, resolution, default_tolerance)));
            sets.extend(self.other_tolerances().into_iter().map(|tolerance| (Model::Ensemble, 1.0, tolerance)));
            sets.extend([0.5, 1.0].map(|resolution| (Model::Patch, resolution, default_tolerance)));
        }
        for (model, resolution, tolerance) in sets {
            let options = ColourTableOptions {
                coherence_length_um: self.options.coherence_length_um,
                model,
                tiling: self.options.tiling,
                tolerance,
                resolution,
                build_limit: self.options.build_limit,
            };
            let table = ColourTable::build(self.field, &options).map_err(|source| BenchError::Method {
                candidate: format!("colour table {options:?}"),
                source: source.into(),
            })?;
            let mut parameters =
                Map::from_iter([("resolution".into(), json!(resolution)), ("tolerance".into(), json!(tolerance))]);
            // A table that would be too large is built for a shorter coherence length, which is then reported.
            let coherence_length_um = table.report().coherence_length_um;
            if coherence_length_um != options.coherence_length_um {
                parameters.insert("coherence_length_shown_um".into(), json!(coherence_length_um));
            }
            self.built.push(Candidate {
                method: COLOUR_TABLE,
                model,
                parameters,
                is_default: resolution == 1.0 && tolerance == default_tolerance && model == Model::Ensemble,
                bytes: table.report().bytes as u64,
                build_seconds: table.report().build_seconds,
                evaluator: Evaluator::Colour(Box::new(table)),
            });
        }
        Ok(())
    }

    /// Adds spectral tables of both models, with several tolerances, summed over several steps between wavelengths.
    fn spectral_tables(&mut self) -> Result<(), BenchError> {
        let default_tolerance = self.options.tolerance;
        let default_step_nm = MethodOptions::default().lambda_step_nm;
        // Model and tolerance of the tables.
        let mut sets = vec![(Model::Ensemble, default_tolerance)];
        if !self.few {
            sets.extend(self.other_tolerances().into_iter().map(|tolerance| (Model::Ensemble, tolerance)));
            sets.push((Model::Patch, default_tolerance));
        }
        for (model, tolerance) in sets {
            let surface = Surface::new(self.field, &Options { model, tolerance, ..self.options.clone() })?;
            let surface = Arc::new(surface);
            let has_default_tables = tolerance == default_tolerance && model == Model::Ensemble;
            let steps_nm = if has_default_tables && !self.few { STEPS_NM.to_vec() } else { vec![default_step_nm] };
            for step_nm in steps_nm {
                let parameters = [("tolerance".into(), json!(tolerance)), ("lambda_step_nm".into(), json!(step_nm))];
                self.built.push(Candidate {
                    method: SPECTRAL_TABLE,
                    model,
                    parameters: Map::from_iter(parameters),
                    is_default: has_default_tables && step_nm == default_step_nm,
                    bytes: surface.report().bytes as u64,
                    build_seconds: surface.report().build_seconds,
                    evaluator: Evaluator::Spectral(surface.clone(), SpectralToRgb::visible(step_nm)?),
                });
            }
        }
        Ok(())
    }
}

/// Size in bytes of the data that a method looks up. Its shader holds the same data as the code on the CPU.
fn shader_bytes(method: &dyn Method) -> u64 {
    method.shader().storage.iter().map(|data| data.len() as u64).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunbeam::height_field::Preset;

    #[test]
    fn a_surface_with_another_tolerance_has_one_default() {
        let field = Preset::Blazed.build(None, None).unwrap();
        let options =
            Options { tolerance: 1e-2, coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
        let mut builder = Builder { field: &field, options: &options, few: false, built: Vec::new() };
        builder.spectral_tables().unwrap();
        assert_eq!(builder.built.iter().filter(|candidate| candidate.is_default).count(), 1);
        assert_eq!(builder.other_tolerances(), [1e-1]);
    }
}
