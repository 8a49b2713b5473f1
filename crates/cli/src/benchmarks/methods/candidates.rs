//! The methods and parameter sets that are measured on one surface.
//!
//! A *candidate* (candidate.rs) is a method with one set of parameters. Parameters: the step between wavelengths in nm,
//! the number of terms of the series of the phase screen (Chebyshev or Taylor), the *neighbourhood*, the number of
//! orders summed along each axis, and the tolerance, from which the library derives the numbers that are not given.
//! Each method is measured with the library's defaults, with the parameters of Single 2014, and with cheaper or finer
//! ones.

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

/// Builds every candidate of a surface, FLSS with its defaults first; `few` restricts each method to a few parameter
/// sets.
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
    /// Tolerance in place of the surface's.
    tolerance: Option<f64>,
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
    /// Adds a published method. `counts` are the terms and orders that it sums.
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
        let known = all.into_iter().filter(|(name, _)| kind.options().contains(name));
        let mut reported: Map<String, Value> = known.map(|(name, value)| (name.to_owned(), value)).collect();
        if let Some(tolerance) = tolerance {
            reported.insert("tolerance".into(), json!(tolerance));
        }
        self.built.push(Candidate {
            method: kind.name(),
            model: Model::Patch,
            parameters: reported,
            is_default: *parameters == Parameters::default(),
            bytes: shader_bytes(&method),
            build_seconds,
            evaluator: Evaluator::Colour(Box::new(method)),
        });
    }

    /// Adds FLSS with one set of orders at several steps between wavelengths, in nm.
    fn flss_steps(&mut self, parameters: &Parameters, steps_nm: &[f64]) -> Result<OrderCounts, BenchError> {
        let start = Instant::now();
        let Parameters { tolerance, options } = parameters;
        let refused = |source| BenchError::Method { candidate: format!("flss {options:?}"), source };
        let tolerance = tolerance.unwrap_or(self.options.tolerance);
        let method = Flss::new(self.field, self.options.coherence_length_um, tolerance, options, &Progress::none())
            .map_err(refused)?;
        let build_seconds = start.elapsed().as_secs_f64();
        for lambda_step_nm in steps_nm.iter().copied() {
            let stepped = method.with_lambda_step(lambda_step_nm).map_err(refused)?;
            let options = MethodOptions { lambda_step_nm, ..options.clone() };
            let parameters = Parameters { options, ..*parameters };
            self.push(MethodKind::Flss, stepped, &parameters, method.counts(), build_seconds);
        }
        Ok(method.counts())
    }

    /// Adds FLSS with its parameter sets.
    fn flss(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let with = |options: MethodOptions| Parameters { tolerance: None, options };
        // Single 2014: Taylor's series and 3 × 3 orders.
        let single = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..default.clone() };
        if self.few {
            self.flss_steps(&with(default), &[5.0, 25.0])?;
            self.flss_steps(&with(single), &[5.0])?;
            return Ok(());
        }
        // The defaults come first: ratios of times are relative to them.
        let default_counts = self.flss_steps(&with(default.clone()), &[5.0, 1.0, 2.0, 10.0, 25.0, 50.0])?;
        self.flss_steps(&with(single.clone()), &[1.0, 5.0, 10.0, 25.0])?;
        // Taylor's series with the number of terms that Chebyshev's needs.
        self.flss_steps(&with(MethodOptions { terms: Some(default_counts.terms), ..single }), &[5.0])?;
        for tolerance in [1e-1, 1e-2] {
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

    /// Adds NMM with its parameter sets.
    fn nmm(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let unweighted = MethodOptions { weighted: false, ..default.clone() };
        let mut sets = vec![default.clone(), unweighted.clone()];
        if !self.few {
            // Single 2014: Taylor's series and 3 × 3 orders, unweighted.
            sets.push(MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..unweighted });
            sets.extend([1, 3, 5].map(|n| MethodOptions { neighbourhood: Some(n), ..default.clone() }));
        }
        let Options { coherence_length_um, tolerance, .. } = *self.options;
        let mut default_neighbourhood = None;
        for options in sets {
            // A set with the default neighbourhood given explicitly would be measured twice.
            let same_as_default = MethodOptions { neighbourhood: default_neighbourhood, ..default.clone() };
            if default_neighbourhood.is_some() && options == same_as_default {
                continue;
            }
            let start = Instant::now();
            let method = Nmm::new(self.field, coherence_length_um, tolerance, &options, &Progress::none())
                .map_err(|source| BenchError::Method { candidate: format!("nmm {options:?}"), source })?;
            let (counts, seconds) = (method.counts(), start.elapsed().as_secs_f64());
            default_neighbourhood.get_or_insert(counts.neighbourhood);
            self.push(MethodKind::Nmm, method, &Parameters { tolerance: None, options }, counts, seconds);
        }
        Ok(())
    }

    /// Adds PQ with its parameter sets.
    fn pq(&mut self) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let steps_nm: &[f64] = if self.few { &[5.0] } else { &[5.0, 1.0, 10.0, 25.0, 50.0] };
        let mut sets = vec![(default.clone(), steps_nm)];
        if !self.few {
            sets.push((MethodOptions { series: Series::Taylor, ..default }, &[5.0]));
        }
        let Options { coherence_length_um, tolerance, .. } = *self.options;
        for (options, steps_nm) in sets {
            let start = Instant::now();
            let refused = |source| BenchError::Method { candidate: format!("pq {options:?}"), source };
            let method =
                Pq::new(self.field, coherence_length_um, tolerance, &options, &Progress::none()).map_err(refused)?;
            let (counts, seconds) = (method.counts(), start.elapsed().as_secs_f64());
            for lambda_step_nm in steps_nm.iter().copied() {
                let stepped = method.with_lambda_step(lambda_step_nm).map_err(refused)?;
                let options = MethodOptions { lambda_step_nm, ..options.clone() };
                self.push(MethodKind::Pq, stepped, &Parameters { tolerance: None, options }, counts, seconds);
            }
        }
        Ok(())
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
        let default = self.options.tolerance;
        let mut sets = vec![(Model::Ensemble, 1.0, default), (Model::Ensemble, 0.5, default)];
        if !self.few {
            sets.extend([0.35, 0.7, 1.4].map(|resolution| (Model::Ensemble, resolution, default)));
            sets.extend([1e-1, 1e-2].map(|tolerance| (Model::Ensemble, 1.0, tolerance)));
            sets.extend([0.5, 1.0].map(|resolution| (Model::Patch, resolution, default)));
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
            let shown = table.report().coherence_length_um;
            if shown != options.coherence_length_um {
                parameters.insert("coherence_length_shown_um".into(), json!(shown));
            }
            self.built.push(Candidate {
                method: COLOUR_TABLE,
                model,
                parameters,
                is_default: resolution == 1.0 && tolerance == default && model == Model::Ensemble,
                bytes: table.report().bytes as u64,
                build_seconds: table.report().build_seconds,
                evaluator: Evaluator::Colour(Box::new(table)),
            });
        }
        Ok(())
    }

    /// Adds spectral tables of both models, with several tolerances, summed over several steps between wavelengths.
    fn spectral_tables(&mut self) -> Result<(), BenchError> {
        let default = self.options.tolerance;
        let mut sets = vec![(Model::Ensemble, default)];
        if !self.few {
            sets.extend([(Model::Ensemble, 1e-1), (Model::Ensemble, 1e-2), (Model::Patch, default)]);
        }
        for (model, tolerance) in sets {
            let surface = Surface::new(self.field, &Options { model, tolerance, ..self.options.clone() })?;
            let surface = Arc::new(surface);
            let has_defaults = tolerance == default && model == Model::Ensemble;
            let every_step = has_defaults && !self.few;
            let steps_nm: &[f64] = if every_step { &[5.0, 1.0, 2.0, 10.0, 25.0, 50.0] } else { &[5.0] };
            for nm in steps_nm {
                let parameters = [("tolerance".into(), json!(tolerance)), ("lambda_step_nm".into(), json!(nm))];
                self.built.push(Candidate {
                    method: SPECTRAL_TABLE,
                    model,
                    parameters: Map::from_iter(parameters),
                    is_default: has_defaults && *nm == 5.0,
                    bytes: surface.report().bytes as u64,
                    build_seconds: surface.report().build_seconds,
                    evaluator: Evaluator::Spectral(surface.clone(), SpectralToRgb::visible(*nm)?),
                });
            }
        }
        Ok(())
    }
}

/// Size in bytes of the data that a method looks up.
fn shader_bytes(method: &dyn Method) -> u64 {
    method.shader().storage.iter().map(|data| data.len() as u64).sum()
}
