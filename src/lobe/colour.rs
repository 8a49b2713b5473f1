//! The reflectance in linear sRGB, for renderers that carry colours instead of wavelengths.
//!
//! `f_r = ∫ R·O·M·S/λ² · weight(λ) dλ = O·M·F`, with `F` out of a [`ColourTable`]. What the interface reflects depends
//! on the wavelength, so it belongs inside the integral: gold times a rainbow is not the product of two colours. The
//! table holds it relative to the reflectance for one index, [`ColourSurface::reference`], which is multiplied in
//! exactly: a constant index then costs no accuracy, and what is left of another is smooth up to grazing incidence.

use super::{LinearSrgb, Lobe, are_above, mixture_density, sample_mixture};
use crate::clock::Instant;
use crate::colour_table::{ColourTable, ColourTableError, ColourTableOptions, ColourView, SUM_SQUARED_MAX};
use crate::energy::{ColourAlbedoTable, ColourAlbedoView};
use crate::height_field::HeightField;
use crate::numeric::{Number, Numbers, Plain, Real};
use crate::sampling::{ColourSampler, ColourSamplerView};
use crate::scattering::{
    ComplexIndex, Obliquity, Options, SpectralIndex, Vec3, angular_factor, build_table, floored_cosines,
    fresnel_of_family, fresnel_unpolarised, small_slope,
};
use crate::table::{Model, Progress};
use serde::{Deserialize, Serialize};
use std::array;

/// Share of a build that is taken to be the table's, and what is done before the sampler.
const TABLE_SHARE: f64 = 0.8;
const ALBEDO_DONE: f64 = 0.95;
/// Share of the table of means in what a patch's albedo takes.
const MEAN_SHARE: f64 = 0.5;
/// Wavelengths in nm between which the reference is looked for, and the step.
const VISIBLE_NM: (u32, u32) = (400, 700);
const STEP_NM: usize = 10;

/// A diffracting surface that answers in colours from tables.
#[derive(Serialize, Deserialize)]
pub struct ColourSurface {
    options: Options,
    reference: Option<ComplexIndex>,
    table: ColourTable,
    sampler: ColourSampler,
    /// What the reflectance is divided by to conserve energy, `None` where nothing is.
    albedo: Option<ColourAlbedoTable>,
    report: ColourSurfaceReport,
}

/// What building took and gave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSurfaceReport {
    /// Bytes of the colour table, of the sampler, and of the albedo.
    pub table_bytes: usize,
    /// Bytes of the sampler's table.
    pub sampler_bytes: usize,
    /// Bytes of the albedo's table; zero where energy is not conserved.
    pub albedo_bytes: usize,
    /// The coherence length shown in µm; see [`crate::colour_table::ColourTableReport`].
    pub coherence_length_um: f64,
    /// Seconds for the colour table, with the spectral table it is made of, and for everything.
    pub table_seconds: f64,
    /// Seconds for everything.
    pub build_seconds: f64,
}

impl ColourSurface {
    /// Builds the tables of `field`, with the Fresnel reflectance for `index` inside if there is one.
    ///
    /// # Errors
    /// As [`ColourTable::build`].
    pub fn new(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
    ) -> Result<Self, ColourTableError> {
        Self::watched(field, options, index, &Progress::none())
    }

    /// As [`ColourSurface::new`], telling `progress` how far it has come.
    ///
    /// # Errors
    /// As [`ColourTable::build`].
    pub fn watched(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
        progress: &Progress,
    ) -> Result<Self, ColourTableError> {
        let start = Instant::now();
        options.demand(field).check(options.build_limit)?;
        let reference = index.map(reference);
        let table_options = ColourTableOptions {
            coherence_length_um: options.coherence_length_um,
            model: options.model,
            tiling: options.tiling,
            tolerance: options.tolerance,
            resolution: 1.0,
            build_limit: options.build_limit,
        };
        let relative = |nm: f64, cos: f64| match (index, reference) {
            (Some(index @ SpectralIndex::Sampled(_)), Some(reference)) => {
                let reflected = fresnel_unpolarised(cos, reference);
                // Nothing is reflected at any wavelength where the best of them reflects nothing.
                if reflected > 0.0 { fresnel_unpolarised(cos, index.at(nm)) / reflected } else { 1.0 }
            }
            _ => 1.0,
        };
        let (table, spectral) =
            ColourTable::build_reflecting(field, &table_options, &relative, &progress.part(0.0, TABLE_SHARE))?;
        let table_seconds = start.elapsed().as_secs_f64();
        let rest = progress.part(TABLE_SHARE, ALBEDO_DONE);
        let albedo = match (options.conserve_energy, options.model) {
            (false, _) => None,
            (true, Model::Ensemble) => ColourAlbedoTable::build(&spectral, options, &rest),
            (true, Model::Patch) => {
                // A patch is one member of the ensemble; its albedo is taken to be that of the mean.
                let ensemble = Options { model: Model::Ensemble, ..options.clone() };
                let mean = build_table(field, &ensemble, &rest.part(0.0, MEAN_SHARE))?.table;
                ColourAlbedoTable::build(&mean, options, &rest.part(MEAN_SHARE, 1.0))
            }
        };
        let albedo = albedo.filter(|albedo| !albedo.is_one());
        drop(spectral);
        progress.report(ALBEDO_DONE);
        let view = table.view::<f32>();
        let stam = options.proposed() == Obliquity::Stam;
        let sampler = ColourSampler::new(table.report().order_sigma_per_um, |[u, v, w]| {
            let length_squared = u * u + v * v + w * w;
            let reflected = reference.map_or(1.0, |index| fresnel_of_family(0.5 * length_squared.sqrt(), index));
            let factor = if stam { reflected * (length_squared / w).powi(2) } else { reflected };
            view.relief_rgb(u, v, w, true).map(|channel| channel * factor)
        });
        let report = ColourSurfaceReport {
            table_bytes: table.report().bytes,
            sampler_bytes: sampler.bytes(),
            albedo_bytes: albedo.as_ref().map_or(0, ColourAlbedoTable::bytes),
            coherence_length_um: table.report().coherence_length_um,
            table_seconds,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        progress.report(1.0);
        Ok(Self { options: options.clone(), reference, table, sampler, albedo, report })
    }

    /// The options it was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The index whose reflectance is multiplied in by the evaluator; `None` where everything is reflected.
    pub fn reference(&self) -> Option<ComplexIndex> {
        self.reference
    }

    /// The table of colours, relative to the reference.
    pub fn table(&self) -> &ColourTable {
        &self.table
    }

    /// What directions are drawn from.
    pub fn sampler(&self) -> &ColourSampler {
        &self.sampler
    }

    /// What the reflectance is divided by to conserve energy, `None` where nothing is.
    pub fn albedo(&self) -> Option<&ColourAlbedoTable> {
        self.albedo.as_ref()
    }

    /// What building took and gave.
    pub fn report(&self) -> &ColourSurfaceReport {
        &self.report
    }

    /// The words of the tables: colours, sampler and albedo.
    pub fn words(&self) -> [&[u32]; 3] {
        let albedo = self.albedo.as_ref().map_or(&[] as &[u32], ColourAlbedoTable::words);
        [self.table.words(), self.sampler.words(), albedo]
    }

    /// The evaluator as numbers by value have it.
    pub fn lobe<F>(&self) -> ColourLobe<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        self.lobe_over(self.words())
    }

    /// The evaluator over a family of numbers, whose words are those of [`ColourSurface::words`].
    pub fn lobe_over<N: Numbers>(&self, [table, sampler, albedo]: [N::Words; 3]) -> ColourLobe<N> {
        ColourLobe {
            factors: self.factors(),
            table: ColourView { layout: *self.table.layout(), words: table },
            sampler: ColourSamplerView { layout: self.sampler.layout(), words: sampler },
            albedo: self.albedo.as_ref().map(|table| ColourAlbedoView { layout: *table.layout(), words: albedo }),
        }
    }

    /// What an evaluator multiplies the table's colours by.
    pub fn factors(&self) -> ColourFactors {
        let Options { obliquity, shadowing, .. } = self.options;
        ColourFactors { reference: self.reference, obliquity, shadowing, gamut: Gamut::Keep }
    }

    /// `f_r` in 1/sr as linear sRGB: as [`Surface::eval`](super::Surface::eval), and with the Fresnel reflectance of
    /// the index that it was built for; see [`Lobe::eval`].
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        self.lobe::<f64>().eval(wi, wo, LinearSrgb, true)
    }
}

/// The index with the largest reflectance at normal incidence.
fn reference(index: &SpectralIndex) -> ComplexIndex {
    let normal = |index: &ComplexIndex| fresnel_unpolarised(1.0, *index);
    let first = index.at(f64::from(VISIBLE_NM.0));
    (VISIBLE_NM.0..=VISIBLE_NM.1)
        .step_by(STEP_NM)
        .map(|nm| index.at(f64::from(nm)))
        .fold(first, |best, index| if normal(&index) > normal(&best) { index } else { best })
}

/// What an evaluator multiplies the table's colours by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourFactors {
    /// See [`ColourSurface::reference`].
    pub reference: Option<ComplexIndex>,
    /// The obliquity factor that the table holds.
    pub obliquity: Obliquity,
    /// V-cavity shadowing and masking.
    pub shadowing: bool,
    /// What becomes of negative channels.
    pub gamut: Gamut,
}

/// What becomes of colours outside sRGB, one or two of whose channels are negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gamut {
    /// They are answered as they are: sums of them are the colours that the spectra would give.
    Keep,
    /// They are mixed with as much grey of the same luminance as leaves no channel negative, for renderers that take
    /// negative channels for mistakes. (Channels cut off at zero would add light: a sixth of red on a grating.)
    Desaturate,
}

/// The evaluator of a [`ColourSurface`] over one family of numbers.
pub struct ColourLobe<N: Numbers> {
    /// What multiplies the table.
    pub factors: ColourFactors,
    /// The colours.
    pub table: ColourView<N>,
    /// Where directions are drawn.
    pub sampler: ColourSamplerView<N>,
    /// What conserves energy.
    pub albedo: Option<ColourAlbedoView<N>>,
}

impl<N: Numbers> ColourLobe<N> {
    /// `f_r` in linear sRGB, whatever the lobe's gamut.
    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let active = active & are_above::<N>(wi, wo);
        let cosines = floored_cosines(wi, wo);
        let (u, v, w) = (wi[0] + wo[0], wi[1] + wo[1], cosines[0] + cosines[1]);
        let length_squared = w.fma(w, u.fma(u, v * v));
        // False for NaN and infinities.
        let active = active & length_squared.le(lit(SUM_SQUARED_MAX.into()));
        let colour = self.table.relief_rgb(u, v, w, active);
        let mut factor = angular_factor(self.factors.obliquity, self.factors.shadowing, [u, v, w], cosines);
        if let Some(index) = self.factors.reference {
            factor = factor
                * match self.factors.obliquity {
                    Obliquity::SmallSlope => small_slope([u, v, w], cosines, Some(index)),
                    Obliquity::Stam | Obliquity::Unit => fresnel_of_family(length_squared.sqrt() * lit(0.5), index),
                };
        }
        let divisor = match &self.albedo {
            Some(albedo) => albedo.factor(wi, wo, active),
            None => [lit(1.0); 3],
        };
        let colour: [N::Real; 3] = array::from_fn(|c| colour[c] * factor * divisor[c]);
        let colour = match self.factors.gamut {
            Gamut::Keep => colour,
            Gamut::Desaturate => desaturated(colour),
        };
        colour.map(|channel| N::Real::select(active, channel, lit(0.0)))
    }
}

impl<N: Numbers> Lobe<N, LinearSrgb> for ColourLobe<N> {
    type Value = [N::Real; 3];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> [N::Real; 3] {
        self.value(wi, wo, active)
    }

    #[inline(always)]
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> N::Real {
        let active = active & are_above::<N>(wi, wo);
        mixture_density::<N, 1>([self.sampler.pdf(wi, wo, active)], active)
    }

    #[inline(always)]
    fn eval_pdf(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        carried: LinearSrgb,
        active: N::Mask,
    ) -> ([N::Real; 3], N::Real) {
        (self.eval(wi, wo, carried, active), self.pdf(wi, wo, carried, active))
    }

    #[inline(always)]
    fn sample(&self, wi: [N::Real; 3], _: LinearSrgb, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        sample_mixture::<N, 1>(wi, u, active, |_, u, active| self.sampler.sample(wi, [u[1], u[2]], active))
    }
}

/// A colour in linear sRGB mixed with grey of its luminance until no channel is negative.
#[inline(always)]
pub(crate) fn desaturated<R: Real>(colour: [R; 3]) -> [R; 3] {
    let zero = R::lit(0.0);
    let grey = luminance(colour).max(zero);
    let least = colour[0].min(colour[1]).min(colour[2]);
    let outside = least.lt(zero);
    let share = grey / (grey - least);
    // Rounding may leave a hair below zero.
    colour.map(|channel| R::select(outside, (channel - grey).fma(share, grey).max(zero), channel))
}

/// Luminance of a colour in linear sRGB, for renderers that carry one number: the second row of the matrix of IEC
/// 61966-2-1.
#[inline(always)]
pub fn luminance<R: Real>([r, g, b]: [R; 3]) -> R {
    r.fma(R::lit(0.212_672_9), g.fma(R::lit(0.715_152_2), b * R::lit(0.072_175)))
}
