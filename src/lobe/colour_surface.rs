//! A surface in linear sRGB: its tables and their build.
//!
//! The Fresnel reflectance R of the material depends on the wavelength, so it belongs in the integral over wavelength:
//! the colour of a rainbow on gold is not the product of two colours. The table of colours therefore contains the
//! ratio R/R0, where R0 is the reflectance of one refractive index for all wavelengths, the *reference*. The lobe
//! multiplies by R0 of the pair of directions (`colour_lobe.rs`), without a table. The ratio is 1 for a constant
//! index, and smooth up to grazing incidence for other indices, so it is tabulated accurately.

use super::colour_lobe::{ColourFactors, ColourLobe};
use super::surface::albedos;
use super::{BandRatio, Gamut, LinearSrgb, Lobe, TransmissiveColourLobe};
use crate::clock::Instant;
use crate::colour_table::{ColourTable, ColourTableError, ColourTableOptions, ColourView};
use crate::energy::{AlbedoTable, AlbedoView};
use crate::height_field::HeightField;
use crate::numeric::{Numbers, Plain};
use crate::sampling::{ColourSampler, ColourSamplerView};
use crate::scattering::{
    ComplexIndex, Obliquity, Options, RelativeSize, SpectralIndex, Vec3, fresnel_of_family, fresnel_unpolarised,
};
use crate::table::Progress;
use serde::{Deserialize, Serialize};

/// Progress of a build, from 0 to 1, at the end of the colour table. Chosen: roughly the table's fraction of the build
/// time. It affects the display of progress only.
const TABLE_DONE: f64 = 0.8;
/// First and last wavelength in nm whose index may become the reference. Chosen: light is clearly visible in this
/// range. A wider range could take the reference from wavelengths that hardly affect colours.
const REFERENCE_NM: (u32, u32) = (400, 700);

/// A diffracting surface in linear sRGB, from tables.
///
/// ```
/// use sunbeam::lobe::ColourSurface;
/// use sunbeam::{Options, Preset};
///
/// let field = Preset::Blazed.build(None, None)?;
/// // A short coherence length and a coarse tolerance, for a quick build.
/// let options = Options { coherence_length_um: 5.0, conserve_energy: false, tolerance: 1e-2, ..Options::default() };
/// let surface = ColourSurface::new(&field, &options, None)?;
///
/// // Red leaves at a larger angle than blue: with a period of 2.5 µm at sines of 0.26 and 0.18.
/// let seen = |sine: f64| surface.eval([0.0, 0.0, 1.0], [-sine, 0.0, (1.0 - sine * sine).sqrt()]);
/// assert!(seen(0.26)[0] > seen(0.26)[2] && seen(0.18)[2] > seen(0.18)[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Serialize, Deserialize)]
pub struct ColourSurface {
    /// Options of the build.
    options: Options,
    /// Index of the reference; `None` leaves the interface's factor to the caller.
    reference: Option<ComplexIndex>,
    table: ColourTable,
    sampler: ColourSampler,
    /// Divisors of the reflectance; `None` where nothing is divided.
    albedo_table: Option<AlbedoTable>,
    /// Means of R/R0 over the bands of red, green and blue. They correct colours where the relief is resized
    /// ([`Options::sizes`]). `None` for one size, and if the ratio is 1.
    ratio: Option<BandRatio>,
    report: ColourSurfaceReport,
}

/// Size and build time of a colour surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSurfaceReport {
    /// Bytes of the colour table.
    pub table_bytes: usize,
    /// Bytes of the sampler.
    pub sampler_bytes: usize,
    /// Bytes of the albedos; zero where nothing is divided.
    pub albedo_bytes: usize,
    /// Coherence length of the table in µm; see [`crate::colour_table::ColourTableReport`].
    pub coherence_length_um: f64,
    /// Build time of the colour table in seconds, with the spectral table that it is integrated from.
    pub table_seconds: f64,
    /// Build time of the whole surface in seconds.
    pub build_seconds: f64,
}

impl ColourSurface {
    /// Builds the tables of `field`. Values include the interface's factor for the refractive index `index`: the
    /// Fresnel reflectance or the small-slope factor. `None` leaves it to the caller. A transparent body takes `None`,
    /// since its lobe has a factor of its own.
    ///
    /// # Errors
    /// The errors of [`ColourTable::build`].
    pub fn new(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
    ) -> Result<Self, ColourTableError> {
        Self::watched(field, options, index, &Progress::none())
    }

    /// [`ColourSurface::new`] with reports to `progress`.
    ///
    /// # Errors
    /// The errors of [`ColourTable::build`].
    pub fn watched(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
        progress: &Progress,
    ) -> Result<Self, ColourTableError> {
        let start = Instant::now();
        options.demand(field).check(options.build_limit)?;
        let reference = index.map(reference_index);
        let table_options = ColourTableOptions {
            coherence_length_um: options.coherence_length_um,
            model: options.model,
            tiling: options.tiling,
            tolerance: options.tolerance,
            // The default number of samples over the scattering vector.
            resolution: 1.0,
            build_limit: options.build_limit,
        };
        let ratio_at = |nm: f64, cos: f64| reflectance_ratio(index, reference, nm, cos);
        let (table, spectral) =
            ColourTable::build_reflecting(field, &table_options, &ratio_at, &progress.part(0.0, TABLE_DONE))?;
        let table_seconds = start.elapsed().as_secs_f64();
        let (albedo_progress, sampler_progress) = progress.part(TABLE_DONE, 1.0).halves();
        let (albedo_table, _) = albedos(field, &spectral, options, &albedo_progress)?;
        // Frees the memory before the sampler is built.
        drop(spectral);
        // For a resized relief the table is read at another half vector than that of the directions, which `BandRatio`
        // corrects. A constant index has the ratio 1, which needs no correction.
        let ratio = match (index, options.sizes) {
            (Some(SpectralIndex::Sampled(_)), Some(_)) => Some(BandRatio::new(&BandRatio::band_weights()?, ratio_at)),
            _ => None,
        };
        sampler_progress.report(0.0);
        let sampler = build_sampler(&table, options, reference);
        let report = ColourSurfaceReport {
            table_bytes: table.report().bytes,
            sampler_bytes: sampler.bytes(),
            albedo_bytes: albedo_table.as_ref().map_or(0, AlbedoTable::bytes),
            coherence_length_um: table.report().coherence_length_um,
            table_seconds,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        progress.report(1.0);
        let options = options.clone();
        Ok(Self { options, reference, table, sampler, albedo_table, ratio, report })
    }

    /// Options that the surface was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Index of the reference; `None` leaves the interface's factor to the caller.
    pub fn reference(&self) -> Option<ComplexIndex> {
        self.reference
    }

    /// Table of colours over the scattering vector, relative to the reference.
    pub fn table(&self) -> &ColourTable {
        &self.table
    }

    /// The sampler.
    pub fn sampler(&self) -> &ColourSampler {
        &self.sampler
    }

    /// Divisors of the reflectance; `None` where nothing is divided.
    pub fn albedo_table(&self) -> Option<&AlbedoTable> {
        self.albedo_table.as_ref()
    }

    /// Size and build time of the tables.
    pub fn report(&self) -> &ColourSurfaceReport {
        &self.report
    }

    /// Table data: colours, sampler, albedos. The last is empty where nothing is divided.
    pub fn words(&self) -> [&[u32]; 3] {
        let albedo = self.albedo_table.as_ref().map_or(&[] as &[u32], AlbedoTable::words);
        [self.table.words(), self.sampler.words(), albedo]
    }

    /// The lobe of the relief without a transparent body, over plain numbers in `f32` or `f64`.
    pub fn lobe<F>(&self) -> ColourLobe<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        self.lobe_over(self.words(), None)
    }

    /// The lobe over the numbers `N`; the first argument has the [`ColourSurface::words`] in the form of `N`. `size` is
    /// the size of the relief at the shaded point; `None` stands for that of the tables.
    pub fn lobe_over<N: Numbers>(
        &self,
        [table, sampler, albedo]: [N::Words; 3],
        size: Option<RelativeSize<N::Real>>,
    ) -> ColourLobe<N> {
        ColourLobe {
            factors: self.factors(),
            table: ColourView { layout: *self.table.layout(), words: table },
            sampler: ColourSamplerView { layout: self.sampler.layout(), words: sampler, size },
            albedo: self.albedo_table.as_ref().map(|table| AlbedoView { layout: *table.layout(), words: albedo }),
            size,
        }
    }

    /// [`ColourSurface::lobe_over`] of the transparent body; `None` without a body.
    pub fn transmissive_lobe_over<N: Numbers>(
        &self,
        words: [N::Words; 3],
        size: Option<RelativeSize<N::Real>>,
    ) -> Option<TransmissiveColourLobe<N>> {
        self.options.body.map(|body| TransmissiveColourLobe { body, relief: self.lobe_over(words, size) })
    }

    /// Factors of the lobe, which keeps negative channels.
    pub fn factors(&self) -> ColourFactors {
        let Options { obliquity, shadowing, .. } = self.options;
        ColourFactors { reference: self.reference, obliquity, shadowing, ratio: self.ratio, gamut: Gamut::Keep }
    }

    /// `f_r` in 1/sr as linear sRGB, divided by the albedo where energy is conserved, without the cosine. Includes the
    /// interface's factor if the surface was built with an index. Zero unless both directions lie above the surface;
    /// with a transparent body, either may lie below. Colours outside sRGB have negative channels.
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        match self.transmissive_lobe_over::<Plain<'_, f64>>(self.words(), None) {
            Some(lobe) => lobe.eval(wi, wo, LinearSrgb, true),
            None => self.lobe::<f64>().eval(wi, wo, LinearSrgb, true),
        }
    }
}

/// Builds the sampler. Directions are sampled in proportion to R0·F, the table's colour times the reference's
/// reflectance. With Stam's obliquity factor they are also sampled in proportion to `(|q|²/w)²`, its part that depends
/// on the scattering vector `q = wi + wo = (u, v, w)` alone (src/sampling/colour.rs). Samplers replace the small-slope
/// factor by Stam's factor or by 1 ([`Options::sampling_obliquity`]).
fn build_sampler(table: &ColourTable, options: &Options, reference: Option<ComplexIndex>) -> ColourSampler {
    let view = table.view::<f32>();
    let is_stam = options.sampling_obliquity() == Obliquity::Stam;
    ColourSampler::new(table.report().order_sigma_per_um, options.reach, |[u, v, w]| {
        let length_squared = u * u + v * v + w * w;
        // Half the length of q is the cosine between a direction and the half vector.
        let r0 = reference.map_or(1.0, |index| fresnel_of_family(0.5 * length_squared.sqrt(), index));
        let factor = if is_stam { r0 * (length_squared / w).powi(2) } else { r0 };
        view.relief_rgb(u, v, w, true).map(|channel| channel * factor)
    })
}

/// R/R0 of the index `index` and its reference, at a wavelength in nm and the cosine at the half vector; 1 without an
/// index and for a constant one.
fn reflectance_ratio(
    index: Option<&SpectralIndex>,
    reference: Option<ComplexIndex>,
    wavelength_nm: f64,
    cosine: f64,
) -> f64 {
    match (index, reference) {
        (Some(index @ SpectralIndex::Sampled(_)), Some(reference)) => {
            let r0 = fresnel_unpolarised(cosine, reference);
            // Where the reference reflects nothing, no wavelength of `REFERENCE_NM` reflects.
            if r0 > 0.0 { fresnel_unpolarised(cosine, index.at(wavelength_nm)) / r0 } else { 1.0 }
        }
        _ => 1.0,
    }
}

/// Reference of a spectral index: its value at the wavelength within [`REFERENCE_NM`] at which the reflectance at
/// normal incidence is largest. So R/R0 is at most 1 at normal incidence, at the wavelengths of that range.
fn reference_index(index: &SpectralIndex) -> ComplexIndex {
    let at_normal = |index: &ComplexIndex| fresnel_unpolarised(1.0, *index);
    let first = index.at(f64::from(REFERENCE_NM.0));
    (REFERENCE_NM.0..=REFERENCE_NM.1)
        .map(|nm| index.at(f64::from(nm)))
        .fold(first, |best, index| if at_normal(&index) > at_normal(&best) { index } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::scattering::TransparentBody;

    #[test]
    fn a_film_passes_light_to_its_other_side() {
        let (eta, coherence_length_um) = (1.5, 5.0);
        // Relief and coherence length are magnified by the film's index.
        let field = Preset::Blazed.build(None, None).unwrap().resized(eta, eta);
        let options = Options {
            body: Some(TransparentBody::new(eta, true, coherence_length_um)),
            coherence_length_um: coherence_length_um * eta,
            conserve_energy: false,
            tolerance: 1e-2,
            ..Options::default()
        };
        let surface = ColourSurface::new(&field, &options, None).unwrap();
        // Light that goes straight on.
        assert!(surface.eval([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])[1] > 0.0);
    }
}
