//! Construction of a method ([`MethodKind`]) from a height field, with the checks that all methods share.
//!
//! Checks that only one method needs, such as the depth of the relief, are in its own file.

use super::film::FilmTable;
use super::flss::Flss;
use super::nmm::Nmm;
use super::options::{StamForm, check_window_and_tolerance};
use super::pq::Pq;
use super::stam::Stam;
use super::stam_gems::StamGems;
use super::table::ConservingTable;
use super::{Method, MethodError, MethodKind, MethodOptions};
use crate::colour_table::{ColourTable, ColourTableOptions};
use crate::energy::AlbedoTable;
use crate::height_field::HeightField;
use crate::scattering::Options;
use crate::table::{Model, Progress, Tiling};

/// Builds a method for the surface of a height field.
///
/// Where the method evaluates only the relief's factor of the reflectance ([`super::AnswerKind::Relief`]), the caller
/// multiplies it by the Fresnel factor, and by the obliquity and shadowing factors of `surface`. With energy
/// conservation the albedo table is built with these two, so it is valid for them only. A method of a film
/// ([`Options::body`]) evaluates the whole scattering function; only [`MethodKind::Table`] supports films. Callers
/// magnify `field` and the coherence length by the index of a film (docs/model.md#bodies-that-transmit). Numbers of
/// terms and orders that `options` do not give follow from the surface's `tolerance`, a relative error.
///
/// ```
/// use sunbeam::methods::{MethodKind, MethodOptions, build};
/// use sunbeam::{Model, Options, Preset};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
/// let method = build(MethodKind::Nmm, &field, &surface, &MethodOptions::default())?;
/// // Light along the normal; the viewer is at order −1 of green light (550 nm) from the period of 2.5 µm.
/// let green = method.answer_rgb([0.0, 0.0, 1.0], [-0.22, 0.0, 0.9755]);
/// assert!(green[1] > green[0] && green[1] > green[2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MethodError`]: a number out of range; a model, tiling or conservation of energy that the method does not support;
/// or a relief that is too deep or too large for it.
pub fn build(
    kind: MethodKind,
    field: &HeightField,
    surface: &Options,
    options: &MethodOptions,
) -> Result<Box<dyn Method>, MethodError> {
    build_watched(kind, field, surface, options, &Progress::none())
}

/// [`build`] that reports its progress.
///
/// # Errors
/// The errors of [`build`].
pub fn build_watched(
    kind: MethodKind,
    field: &HeightField,
    surface: &Options,
    options: &MethodOptions,
    progress: &Progress,
) -> Result<Box<dyn Method>, MethodError> {
    options.validate()?;
    let (coherence_length_um, tolerance) = (surface.coherence_length_um, surface.tolerance);
    check_window_and_tolerance(coherence_length_um, tolerance)?;
    let unsupported =
        |parameter, found, accepted| Err(MethodError::Unsupported { method: kind.name(), parameter, found, accepted });
    if surface.conserve_energy && (kind.is_patch_only() || surface.model == Model::Patch) {
        return unsupported("conserve_energy", "true", "false");
    }
    kind.accept(surface.body)?;
    if kind.is_patch_only() && surface.model != Model::Patch {
        return unsupported("model", "ensemble", "patch");
    }
    if kind.is_patch_only() && surface.tiling != Tiling::Periodic {
        return unsupported("tiling", "aperiodic", "periodic");
    }
    Ok(match kind {
        MethodKind::Flss => Box::new(Flss::new(field, coherence_length_um, tolerance, options, progress)?),
        MethodKind::Nmm => Box::new(Nmm::new(field, coherence_length_um, tolerance, options, progress)?),
        MethodKind::Pq => Box::new(Pq::new(field, coherence_length_um, tolerance, options, progress)?),
        MethodKind::Stam => match options.stam_form {
            StamForm::Spacing => Box::new(Stam::new(field, coherence_length_um, options)?),
            StamForm::Gems => Box::new(StamGems::new(field, options)?),
        },
        MethodKind::Table => build_table(field, surface, options.resolution, progress)?,
    })
}

/// Builds the colour table, with a table of albedos where energy is conserved. A body of the surface is a film, since
/// [`MethodKind::accept`] refuses the others. `resolution` is that of [`MethodOptions`].
fn build_table(
    field: &HeightField,
    surface: &Options,
    resolution: f64,
    progress: &Progress,
) -> Result<Box<dyn Method>, MethodError> {
    let &Options { coherence_length_um, model, tiling, tolerance, build_limit, conserve_energy, .. } = surface;
    let options = ColourTableOptions { coherence_length_um, model, tiling, tolerance, resolution, build_limit };
    // Without albedos the colour table takes the whole progress.
    let (table_progress, albedo_progress) =
        if conserve_energy { progress.halves() } else { (progress.part(0.0, 1.0), Progress::none()) };
    // Reflectance 1 at every wavelength and cosine: the interface's factor is applied outside the table. Albedos are
    // integrated from `spectral`, the spectral table behind the colours.
    let (table, spectral) = ColourTable::build_reflecting(field, &options, &|_, _| 1.0, &table_progress)?;
    if let Some(body) = surface.body {
        // Methods show the relief's own size only. The inner `None` of the result: no albedo exceeds 1.
        let sizes = None;
        let albedo = conserve_energy.then(|| AlbedoTable::build_of_body(&spectral, body, sizes, &albedo_progress));
        return Ok(Box::new(FilmTable { body, table, albedo: albedo.flatten() }));
    }
    let surface = Options { sizes: None, ..surface.clone() };
    let albedo = conserve_energy.then(|| AlbedoTable::build(&spectral, &surface, &albedo_progress));
    Ok(match albedo.flatten() {
        Some((albedo, _)) => Box::new(ConservingTable { table, albedo }),
        None => Box::new(table),
    })
}
