//! The methods and parameter sets that are measured.

use super::{Entry, Errors, Timing};
use crate::benchmarks::{BenchError, DirectionPair};
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::time::Instant;
use sunbeam::colour::SpectralToRgb;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::methods::{
    self, ColourTable, ColourTableOptions, Flss, Method, MethodKind, MethodOptions, Nmm, OrderCounts, Pq,
};
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Progress};
use sunbeam::transform::Series;

const COLOUR_TABLE: &str = "colour-table";

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
    /// The spectral tables, summed at steps that follow the widths of orders.
    Adaptive(Arc<Surface>),
}

impl Candidate {
    /// Whether a colour costs the same work: colour tables of one size are read alike, however well they are filled.
    pub fn costs_like(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
            || self.method == COLOUR_TABLE && other.method == COLOUR_TABLE && self.bytes == other.bytes
    }

    /// Linear sRGB of `f_r` without the Fresnel reflectance, 1/sr; `factor` is its `O·M`, which the tables know.
    pub fn rgb(&self, pair: &DirectionPair, factor: f64) -> [f64; 3] {
        match &self.evaluator {
            Evaluator::Colour(method) => {
                let [wi, wo] = pair.single();
                method.answer_rgb(wi, wo).map(|channel| factor * f64::from(channel))
            }
            Evaluator::Steps(surface, sum) => sum.rgb_of(|nm| surface.eval(pair.wi, pair.wo, nm)),
            Evaluator::Adaptive(surface) => {
                // Wavelengths at which nothing is red or blue make those weights negative.
                let [r, g, b, _] = surface.integrated(pair.wi, pair.wo);
                [r, g, b].map(|channel| channel.max(0.0))
            }
        }
    }

    /// `f_r` at one wavelength in nm; `None` where there are only colours.
    pub fn spectral(&self, pair: &DirectionPair, factor: f64, nm: f64) -> Option<f64> {
        match &self.evaluator {
            Evaluator::Colour(method) => {
                let [wi, wo] = pair.single();
                method.answer_spectral(wi, wo, nm as f32).map(|value| factor * f64::from(value))
            }
            Evaluator::Steps(surface, _) | Evaluator::Adaptive(surface) => Some(surface.eval(pair.wi, pair.wo, nm)),
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
    /// One of the published methods with its parameters; `tolerance` is that of the surface unless it is given.
    fn push<M: Method + 'static>(
        &mut self,
        kind: MethodKind,
        made: M,
        (tolerance, asked): (Option<f64>, &MethodOptions),
        counts: OrderCounts,
        build_seconds: f64,
    ) {
        let mut parameters = Map::new();
        let mut tell = |name: &str, value: Value| {
            if kind.options().contains(&name) {
                parameters.insert(name.to_owned(), value);
            }
        };
        tell("lambda_step_nm", json!(asked.lambda_step_nm));
        tell("terms", json!(counts.terms));
        tell("neighbourhood", json!(counts.neighbourhood));
        tell("series", json!(asked.series));
        tell("weighted", json!(asked.weighted));
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
    }

    fn tolerance(&self, asked: Option<f64>) -> f64 {
        asked.unwrap_or(self.options.tolerance)
    }

    /// One set of orders at several steps between wavelengths, in nm.
    fn flss_steps(
        &mut self,
        tolerance: Option<f64>,
        asked: &MethodOptions,
        steps_nm: &[f64],
    ) -> Result<OrderCounts, BenchError> {
        let start = Instant::now();
        let refused = |source| BenchError::Method { candidate: format!("flss {asked:?}"), source };
        let length_um = self.options.coherence_length_um;
        let made =
            Flss::new(self.field, length_um, self.tolerance(tolerance), asked, &Progress::none()).map_err(refused)?;
        let build_seconds = start.elapsed().as_secs_f64();
        for lambda_step_nm in steps_nm {
            let stepped = made.with_lambda_step(*lambda_step_nm).map_err(refused)?;
            let asked = MethodOptions { lambda_step_nm: *lambda_step_nm, ..asked.clone() };
            self.push(MethodKind::Flss, stepped, (tolerance, &asked), made.counts(), build_seconds);
        }
        Ok(made.counts())
    }

    fn flss(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let sources = MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..default.clone() };
        if few {
            self.flss_steps(None, &default, &[5.0, 25.0])?;
            self.flss_steps(None, &sources, &[5.0])?;
            return Ok(());
        }
        // The defaults come first: ratios are to them.
        let own = self.flss_steps(None, &default, &[5.0, 1.0, 2.0, 10.0, 25.0, 50.0])?;
        self.flss_steps(None, &sources, &[1.0, 5.0, 10.0, 25.0])?;
        // As many terms as Chebyshev's series needs.
        self.flss_steps(None, &MethodOptions { terms: Some(own.terms), ..sources }, &[5.0])?;
        for tolerance in [1e-1, 1e-2] {
            self.flss_steps(Some(tolerance), &default, &[2.0, 5.0, 10.0, 25.0])?;
        }
        for neighbourhood in [1, 3].into_iter().filter(|n| *n < own.neighbourhood) {
            let asked = MethodOptions { neighbourhood: Some(neighbourhood), ..default.clone() };
            self.flss_steps(None, &asked, &[5.0, 25.0])?;
        }
        // Shaders and Rust sum eight terms at a time: in between, fewer cost as much.
        for terms in [16, 8].into_iter().filter(|n| *n < own.terms) {
            self.flss_steps(None, &MethodOptions { terms: Some(terms), ..default.clone() }, &[5.0, 10.0])?;
        }
        Ok(())
    }

    fn nmm(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let unweighted = MethodOptions { weighted: false, ..default.clone() };
        let mut sets = vec![(None, default.clone()), (None, unweighted.clone())];
        if !few {
            // As Single 2014 has it.
            sets.push((None, MethodOptions { series: Series::Taylor, neighbourhood: Some(3), ..unweighted }));
            for neighbourhood in [1, 3, 5] {
                sets.push((None, MethodOptions { neighbourhood: Some(neighbourhood), ..default.clone() }));
            }
        }
        let (length_um, mut own) = (self.options.coherence_length_um, None);
        for (tolerance, asked) in sets {
            if own.is_some() && asked == (MethodOptions { neighbourhood: own, ..default.clone() }) {
                continue;
            }
            let start = Instant::now();
            let made = Nmm::new(self.field, length_um, self.tolerance(tolerance), &asked, &Progress::none())
                .map_err(|source| BenchError::Method { candidate: format!("nmm {asked:?}"), source })?;
            let (counts, seconds) = (made.counts(), start.elapsed().as_secs_f64());
            own.get_or_insert(counts.neighbourhood);
            self.push(MethodKind::Nmm, made, (tolerance, &asked), counts, seconds);
        }
        Ok(())
    }

    fn pq(&mut self, few: bool) -> Result<(), BenchError> {
        let default = MethodOptions::default();
        let all: &[f64] = &[5.0, 1.0, 10.0, 25.0, 50.0];
        let mut sets = vec![(default.clone(), if few { &all[..1] } else { all })];
        if !few {
            sets.push((MethodOptions { series: Series::Taylor, ..default }, &all[..1]));
        }
        for (asked, steps_nm) in sets {
            let start = Instant::now();
            let refused = |source| BenchError::Method { candidate: format!("pq {asked:?}"), source };
            let Options { coherence_length_um, tolerance, .. } = *self.options;
            let made =
                Pq::new(self.field, coherence_length_um, tolerance, &asked, &Progress::none()).map_err(refused)?;
            let (counts, seconds) = (made.counts(), start.elapsed().as_secs_f64());
            for lambda_step_nm in steps_nm {
                let stepped = made.with_lambda_step(*lambda_step_nm).map_err(refused)?;
                let asked = MethodOptions { lambda_step_nm: *lambda_step_nm, ..asked.clone() };
                self.push(MethodKind::Pq, stepped, (None, &asked), counts, seconds);
            }
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
            sets.extend([1e-1, 1e-2].map(|tolerance| (Model::Ensemble, 1.0, tolerance)));
            sets.extend([0.5, 1.0].map(|resolution| (Model::Patch, resolution, own)));
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
            let made = ColourTable::build(self.field, &options).map_err(|source| BenchError::Method {
                candidate: format!("colour table {options:?}"),
                source: source.into(),
            })?;
            let mut parameters =
                Map::from_iter([("resolution".into(), json!(resolution)), ("tolerance".into(), json!(tolerance))]);
            let shown = made.report().coherence_length_um;
            if shown != options.coherence_length_um {
                parameters.insert("coherence_length_shown_um".into(), json!(shown));
            }
            self.made.push(Candidate {
                method: COLOUR_TABLE,
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
        let tolerances: &[f64] = if few { &[own] } else { &[own, 1e-1, 1e-2] };
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
