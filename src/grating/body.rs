//! The body that carries a grating.

use crate::scattering::SpectralIndex;

/// The body below a grating's relief.
///
/// ```
/// use sunbeam::grating::{GratingBody, GratingSurface, Profile};
/// use sunbeam::table::Progress;
///
/// // A sinusoid of 0.5 µm on a film of index 1.5: at normal incidence all light is reflected or transmitted.
/// let profile = Profile::sinusoid(0.5, 0.05)?;
/// let film = GratingSurface::of_body(&profile, GratingBody::Film(1.5), 20.0, 1.0, &Progress::none())?;
/// assert!(film.transmits());
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub enum GratingBody<'a> {
    /// A medium of this index by wavelength, or a perfect conductor (`None`). Light that enters it is lost.
    Reflector(Option<&'a SpectralIndex>),
    /// A film of this index, without dispersion or absorption. Its lower side is flat and has air below it.
    Film(f64),
    /// A medium of this index, without dispersion or absorption, in which light goes on.
    Interface(f64),
}

impl GratingBody<'_> {
    /// Sides of the relief that light arrives at and leaves on: 1 or 2.
    pub(super) fn sides(self) -> u32 {
        match self {
            Self::Reflector(_) => 1,
            Self::Film(_) | Self::Interface(_) => 2,
        }
    }
}
