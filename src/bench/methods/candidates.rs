//! The methods and parameter sets that are measured.

use super::{Entry, Errors, Timing};
use crate::bench::{BenchError, DirectionPair};
use crate::colour::SpectralToRgb;
use crate::height_field::HeightField;
use crate::methods::{
    self, ColourTable, ColourTableOptions, Flss, Method, MethodKind, MethodOptions, Nmm, OrderCounts, Pq,
};
use crate::reflectance::{Options, Surface};
use crate::table::Model;
use crate::transform::Series;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::time::Instant;

/// Something that turns directions into a colour.
pub(super) struct Candidate {
    method: &'static str,
    pub model: Model,
    parameters: Map<String, Value>,
    is_default: bool,
    bytes: u64,
    build_seconds: f64,
    pub evaluator: Evaluator,
}

pub(super) enum Evaluator {
    /// A method of colours, in single precision.
    Colour(Box<dyn Method>),
    /// The spectral tables, summed at equal steps of the wavelength.
    Steps(Arc<Surface>, SpectralToRgb),
    /// The spectral tables, summed at steps that follow the widths of orders, as the plugin does for colours.
    Adaptive(Arc<Surface>),
}

impl Candidate {
    /// Linear sRGB of `f_r` without the Fresnel reflectance, 1/sr; `factor` is its `O·M`, which the tables know.
    pub fn rgb(&self, pair: &DirectionPair, factor: f64) -> [f64; 3] {
        match &self.evaluator {
            Evaluator::Colour(method) => method.response(pair.sum()).map(|channel| factor * f64::from(channel)),
            Evaluator::Steps(surface, sum) => {
                surface.pair(pair.wi, pair.wo).map_or([0.0; 3], |pair| sum.rgb_of(|nm| pair.at(nm).f))
            }
            Evaluator::Adaptive(surface) => {
                let [r, g, b, _] = surface.eval_pdf_integrated(pair.wi, pair.wo).rgb_y;
                [r, g, b]
            }
        }
    }

    /// `f_r` at one wavelength in nm; `None` where there are only colours.
    pub fn spectral(&self, pair: &DirectionPair, factor: f64, nm: f64) -> Option<f64> {
        match &self.evaluator {
            Evaluator::Colour(method) => method.spectral(pair.sum(), nm as f32).map(|value| factor * f64::from(value)),
            Evaluator::Steps(surface, _) | Evaluator::Adaptive(surface) => {
                Some(surface.eval_pdf(pair.wi, pair.wo, nm).f)
            }
        }
    }

    pub fn entry(self, errors: Errors, cpu: Timing, gpu: Option<Timing>) -> Entry {
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

/// Builds candidates of one surface.
struct Builder<'a> {
    field: &'a HeightField,
    options: &'a Options,
    made: Vec<Candidate>,
}

pub(super) fn candidates(
    field: &HeightField,
    options: &Options,
    few: bool,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Candidate>, BenchError> {
    let mut builder = Builder { field, options, made: Vec::new() };
    progress("building flss");
    builder.flss(few)?;
    progress("building nmm, pq and stam");
    builder.nmm(few)?;
    builder.pq(few)?;
    builder.stam()?;
    progress("building colour tables");
    builder.colour_tables(few)?;
    progress("building spectral tables");
    builder.spectral_tables(few)?;
    Ok(builder.made)
}

impl Builder<'_> {
    /// One of the sources' methods, at the surface's tolerance or another.
    fn order_method<M: Method + 'static>(
        &mut self,
        kind: MethodKind,
        tolerance: Option<f64>,
        asked: &MethodOptions,
        make: impl Fn(&HeightField, f64, f64, &MethodOptions) -> Result<M, methods::MethodError>,
        describe: impl Fn(&M) -> (OrderCounts, Map<String, Value>),
    ) -> Result<OrderCounts, BenchError> {
        let start = Instant::now();
        let used = tolerance.unwrap_or(self.options.tolerance);
        let made = make(self.field, self.options.coherence_length_um, used, asked);
        let made = made.map_err(|source| BenchError::Method { candidate: format!("{kind} {asked:?}"), source })?;
        let build_seconds = start.elapsed().as_secs_f64();
        let (counts, mut parameters) = describe(&made);
        if kind.options().contains(&"lambda_step_nm") {
            parameters.insert("lambda_step_nm".into(), json!(asked.lambda_step_nm));
        }
        parameters.insert("terms".into(), json!(counts.terms));
        parameters.insert("series".into(), json!(asked.series));
        if let Some(tolerance) = tolerance {
            parameters.insert("tolerance".into(), json!(tolerance));
        }
        self.made.push(Candidate {
            method: kind.name(),
            model: Model::Patch,
            parameters,
            is_default: tolerance.is_none() && *asked == MethodOptions::default(),
            bytes: bytes(&made),
            build_seconds,
            evaluator: Evaluator::Colour(Box::new(made)),
        });
        Ok(counts)
    }

    fn one_flss(&mut self, tolerance: Option<f64>, asked: &MethodOptions) -> Result<OrderCounts, BenchError> {
        self.order_method(MethodKind::Flss, tolerance, asked, Flss::new, |made| {
            let counts = made.counts();
            (counts, Map::from_iter([("neighbourhood".into(), json!(counts.neighbourhood))]))
        })
    }

    fn flss(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let sources = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..default.clone() };
        let own = self.one_flss(None, &default)?;
        let step = |lambda_step_nm| MethodOptions { lambda_step_nm, ..default.clone() };
        self.one_flss(None, &step(25.0))?;
        self.one_flss(None, &sources)?;
        if few {
            return Ok(());
        }
        for nm in [1.0, 10.0, 50.0] {
            self.one_flss(None, &step(nm))?;
        }
        for nm in [1.0, 10.0, 25.0] {
            self.one_flss(None, &MethodOptions { lambda_step_nm: nm, ..sources.clone() })?;
        }
        self.one_flss(None, &MethodOptions { series: Series::Taylor, ..default.clone() })?;
        // As many terms as Chebyshev's series needs.
        self.one_flss(None, &MethodOptions { series: Series::Taylor, terms: Some(own.terms), ..default.clone() })?;
        for neighbourhood in [1, 2, 3, 4, 5, 7].into_iter().filter(|n| *n < own.neighbourhood) {
            self.one_flss(None, &MethodOptions { neighbourhood: Some(neighbourhood), ..default.clone() })?;
        }
        // Shaders and Rust sum eight terms at a time: in between, fewer cost as much.
        for terms in [own.terms.saturating_sub(3), 16, 8].into_iter().filter(|n| (1..own.terms).contains(n)) {
            self.one_flss(None, &MethodOptions { terms: Some(terms), ..default.clone() })?;
        }
        for tolerance in [1e-1, 1e-2, 1e-4] {
            self.one_flss(Some(tolerance), &default)?;
        }
        for (nm, tolerance) in [(1.0, 1e-2), (2.0, 1e-2), (10.0, 1e-2), (10.0, 1e-1), (25.0, 1e-1), (50.0, 1e-1)] {
            self.one_flss(Some(tolerance), &step(nm))?;
        }
        self.one_flss(None, &MethodOptions { lambda_step_nm: 25.0, neighbourhood: Some(1), ..default.clone() })?;
        Ok(())
    }

    fn nmm(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        for weighted in [false, true] {
            let mut sets = vec![(None, MethodOptions { weighted, ..default.clone() })];
            if !few {
                sets.push((None, MethodOptions { weighted, neighbourhood: Some(3), ..default.clone() }));
                sets.push((Some(1e-2), MethodOptions { weighted, ..default.clone() }));
                sets.push((Some(1e-1), MethodOptions { weighted, ..default.clone() }));
                let sources = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..default.clone() };
                sets.push((None, MethodOptions { weighted, ..sources }));
            }
            for (tolerance, asked) in sets {
                self.order_method(MethodKind::Nmm, tolerance, &asked, Nmm::new, |made| {
                    let counts = made.counts();
                    let neighbourhood = ("neighbourhood".into(), json!(counts.neighbourhood));
                    (counts, Map::from_iter([neighbourhood, ("weighted".into(), json!(weighted))]))
                })?;
            }
        }
        Ok(())
    }

    fn pq(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let step = |lambda_step_nm| MethodOptions { lambda_step_nm, ..default.clone() };
        let mut sets = vec![(None, default.clone())];
        if !few {
            sets.extend([1.0, 10.0, 25.0, 50.0].map(|nm| (None, step(nm))));
            sets.extend([1e-2, 1e-1].map(|tolerance| (Some(tolerance), default.clone())));
            sets.push((None, MethodOptions { series: Series::Taylor, ..default.clone() }));
        }
        for (tolerance, asked) in sets {
            self.order_method(MethodKind::Pq, tolerance, &asked, Pq::new, |made| {
                (made.counts(), Map::from_iter([("repeats".into(), json!(made.repeats()))]))
            })?;
        }
        Ok(())
    }

    /// Left out where the relief has no period along x.
    fn stam(&mut self) -> Result<(), BenchError> {
        let start = Instant::now();
        let asked = MethodOptions::default();
        match methods::Stam::new(self.field, self.options.coherence_length_um, &asked) {
            Err(methods::MethodError::NoPeriod) => return Ok(()),
            Err(source) => return Err(BenchError::Method { candidate: "stam".into(), source }),
            Ok(made) => self.made.push(Candidate {
                method: MethodKind::Stam.name(),
                model: Model::Patch,
                parameters: Map::new(),
                is_default: true,
                bytes: bytes(&made),
                build_seconds: start.elapsed().as_secs_f64(),
                evaluator: Evaluator::Colour(Box::new(made)),
            }),
        }
        Ok(())
    }

    fn colour_tables(&mut self, few: bool) -> Result<(), BenchError> {
        let own = self.options.tolerance;
        let mut sets = vec![(Model::Ensemble, 1.0, own), (Model::Ensemble, 0.5, own)];
        if !few {
            sets.extend([0.35, 0.7, 1.4].map(|resolution| (Model::Ensemble, resolution, own)));
            sets.extend([1e-1, 1e-2, 1e-4].map(|tolerance| (Model::Ensemble, 1.0, tolerance)));
            sets.extend([0.5, 0.7, 1.0, 1.4].map(|resolution| (Model::Patch, resolution, own)));
        }
        for (model, resolution, tolerance) in sets {
            let options = ColourTableOptions {
                coherence_length_um: self.options.coherence_length_um,
                model,
                tiling: self.options.tiling,
                tolerance,
                resolution,
            };
            let made = ColourTable::build(self.field, &options)
                .map_err(|source| BenchError::Method { candidate: format!("colour table {options:?}"), source })?;
            let mut parameters =
                Map::from_iter([("resolution".into(), json!(resolution)), ("tolerance".into(), json!(tolerance))]);
            let shown = made.report().coherence_length_um;
            if shown != options.coherence_length_um {
                parameters.insert("coherence_length_shown_um".into(), json!(shown));
            }
            self.made.push(Candidate {
                method: "colour-table",
                model,
                parameters,
                is_default: resolution == 1.0 && tolerance == own && model == Model::Ensemble,
                bytes: made.report().bytes as u64,
                build_seconds: made.report().build_seconds,
                evaluator: Evaluator::Colour(Box::new(made)),
            });
        }
        Ok(())
    }

    fn spectral_tables(&mut self, few: bool) -> Result<(), BenchError> {
        let own = self.options.tolerance;
        let tolerances: &[f64] = if few { &[own] } else { &[own, 1e-1, 1e-2, 1e-4] };
        let mut sets: Vec<(Model, f64)> = tolerances.iter().map(|tolerance| (Model::Ensemble, *tolerance)).collect();
        if !few {
            sets.push((Model::Patch, own));
        }
        for (model, tolerance) in sets {
            let surface = Surface::new(self.field, &Options { model, tolerance, ..self.options.clone() })?;
            let surface = Arc::new(surface);
            let candidate = |parameter: (String, Value), is_default, evaluator| Candidate {
                method: "spectral-table",
                model,
                parameters: Map::from_iter([("tolerance".into(), json!(tolerance)), parameter]),
                is_default,
                bytes: surface.report().bytes as u64,
                build_seconds: surface.report().build_seconds,
                evaluator,
            };
            let is_own = tolerance == own && model == Model::Ensemble;
            let steps: &[f64] = if is_own && !few { &[5.0, 1.0, 2.0, 10.0, 25.0, 50.0] } else { &[5.0] };
            for nm in steps {
                let evaluator = Evaluator::Steps(surface.clone(), SpectralToRgb::visible(*nm)?);
                let parameter = ("lambda_step_nm".into(), json!(nm));
                self.made.push(candidate(parameter, is_own && *nm == 5.0, evaluator));
            }
            if is_own {
                let parameter = ("lambda_step_nm".into(), json!("adaptive"));
                self.made.push(candidate(parameter, false, Evaluator::Adaptive(surface.clone())));
            }
        }
        Ok(())
    }
}

/// Bytes of the data that a method looks up.
fn bytes(method: &dyn Method) -> u64 {
    method.shader().storage.iter().map(|data| data.len() as u64).sum()
}
