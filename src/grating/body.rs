//! The body that carries a grating: the medium below its relief, and whether light passes through.

use crate::scattering::SpectralIndex;

/// The body below a grating's relief.
///
/// ```
/// use sunbeam::grating::{GratingBody, GratingSurface, Profile};
/// use sunbeam::table::Progress;
///
/// // A sinusoid of period 0.5 µm and height 0.05 µm on a film of index 1.5.
/// let profile = Profile::sinusoid(0.5, 0.05)?;
/// // The tables may take the default limits of memory and time, times 1.
/// let (coherence_length_um, build_limit) = (20.0, 1.0);
/// let body = GratingBody::Film(1.5);
/// let film = GratingSurface::of_body(&profile, body, coherence_length_um, build_limit, &Progress::none())?;
/// assert!(film.transmits());
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub enum GratingBody<'a> {
    /// A medium of this refractive index by wavelength, or a perfect conductor (`None`). Light that enters it, also a
    /// dielectric, is lost.
    Reflector(Option<&'a SpectralIndex>),
    /// A film of this refractive index, without dispersion or absorption. Its lower side is flat and has air below it.
    Film(f64),
    /// A half-space of this refractive index, without dispersion or absorption, in which transmitted light propagates.
    Interface(f64),
}

impl GratingBody<'_> {
    /// Whether the medium below the relief is a dielectric. Its orders' efficiencies vary more smoothly than those of a
    /// metal, but one solution takes longer (`plan.rs`).
    pub(super) fn is_dielectric(self) -> bool {
        match self {
            Self::Reflector(index) => index.is_some_and(SpectralIndex::is_dielectric),
            Self::Film(_) | Self::Interface(_) => true,
        }
    }

    /// Number of sides of the relief on which light arrives and leaves: 1 or 2.
    pub(super) fn sides(self) -> u32 {
        match self {
            Self::Reflector(_) => 1,
            Self::Film(_) | Self::Interface(_) => 2,
        }
    }
}
