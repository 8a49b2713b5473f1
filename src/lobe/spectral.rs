//! The lobe of scalar theory at wavelengths: `O·M·S(f; κ)/λ²`, divided by the albedo (the reflected fraction of the
//! light) where energy is conserved. O is the obliquity factor, M the factor of shadowing by V-shaped grooves, and λ
//! the wavelength. S is the relief's power spectrum in µm² at the frequency f in cycles/µm and the phase rate κ in rad
//! per µm of height (docs/model.md#the-reflectance). The lobe leaves the interface's factor to the caller: the Fresnel
//! reflectance R, or the small-slope factor Q.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable.

use super::{PerWavelength, Sides};
use crate::energy::{AlbedoLayout, AlbedoView, GridPlace};
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::{SamplerLayout, SamplerView};
use crate::scattering::{Obliquity, Reading, RelativeSize, Scattering};
use crate::table::{InterpolationKernel, PackedLayout, TableView};
use serde::{Deserialize, Serialize};

/// Layout of a surface's tables and the factors that multiply them: everything of the lobe but the table data.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SpectralLayout {
    /// Layout of the power spectrum `S(f; κ)`.
    pub table: PackedLayout,
    /// Layout of the sampler.
    pub sampler: SamplerLayout,
    /// Layout of the albedos; `None` where nothing is divided.
    pub albedo: Option<AlbedoLayout>,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// Whether the factor M of shadowing applies.
    pub shadowing: bool,
}

impl SpectralLayout {
    /// Whether the coherence window keeps its width where the relief is resized, as coherence of real light does.
    /// Sampler and table can narrow orders accordingly ([`Reading::order_width_factor`]) only if both treat each order
    /// as a Gaussian of its own. Elsewhere the window is resized with the pattern.
    pub fn keeps_window(&self) -> bool {
        let is_order = |kernel| matches!(kernel, InterpolationKernel::Gaussian { .. });
        matches!(self.sampler, SamplerLayout::Orders(_)) && self.table.kernel.into_iter().all(is_order)
    }
}

/// The lobe of a [`Surface`](super::Surface) over its table data, for any number of wavelengths (see
/// [`Lobe`](super::Lobe)).
#[derive(Clone, Copy)]
pub struct SpectralLobe<'a, N: Numbers> {
    /// Layout of the table data, and the factors.
    pub layout: &'a SpectralLayout,
    /// Table data: power spectrum, sampler, albedos.
    pub words: [N::Words; 3],
    /// Size of the relief at the shaded point; `None` for that of the tables.
    pub size: Option<RelativeSize<N::Real>>,
}

/// Quantities of a pair of directions that all wavelengths share.
pub(crate) struct Directions<N: Numbers> {
    wi: [N::Real; 3],
    wo: [N::Real; 3],
    /// Scattering vector, and the factor O·M.
    scattering: Scattering<N>,
    /// The albedo table, and the places of `wi` and `wo` in its grid of directions.
    albedo: Option<(AlbedoView<N>, [GridPlace<N>; 2])>,
}

impl<N: Numbers> SpectralLobe<'_, N> {
    /// The sampler.
    #[inline(always)]
    pub(super) fn sampler(&self) -> SamplerView<N> {
        SamplerView { layout: self.layout.sampler, words: self.words[1] }
    }

    /// Table of the power spectrum.
    #[inline(always)]
    pub(super) fn table(&self) -> TableView<N> {
        TableView { layout: self.layout.table, words: self.words[0] }
    }

    /// Albedos; `None` where nothing is divided.
    #[inline(always)]
    pub(super) fn albedo(&self) -> Option<AlbedoView<N>> {
        self.layout.albedo.map(|layout| AlbedoView { layout, words: self.words[2] })
    }

    /// Wavelengths and width of orders with which the tables are read, for the relief's size and light of a wavelength
    /// in nm.
    #[inline(always)]
    pub(super) fn reading(&self, nm: N::Real) -> Reading<N> {
        Reading::resized(nm, self.size, self.layout.keeps_window())
    }
}

/// The provided methods are those of a lobe that reflects light from above and never transmits.
impl<N: Numbers> Sides<N> for SpectralLobe<'_, N> {}

impl<N: Numbers> PerWavelength<N> for SpectralLobe<'_, N> {
    type Pair = Directions<N>;

    #[inline(always)]
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Directions<N> {
        Directions {
            wi,
            wo,
            scattering: Scattering::reflection(wi, wo, self.layout.obliquity, self.layout.shadowing),
            albedo: self.albedo().map(|view| (view, [view.place(wi), view.place(wo)])),
        }
    }

    #[inline(always)]
    fn value(&self, pair: &Directions<N>, nm: N::Real, active: N::Mask) -> N::Real {
        let reading = self.reading(nm);
        let (frequency, kappa) = pair.scattering.at(&reading);
        let power_um2 = self.table().density_of(frequency, kappa, reading.order_width_factor, active);
        // O·M·S/λ²; the divisor also accounts for the size of a resized relief.
        let undivided = pair.scattering.factor * power_um2 / reading.divisor_um2();
        let value = match &pair.albedo {
            None => undivided,
            Some((albedo, [at_wi, at_wo])) => undivided * albedo.factor_at(at_wi, at_wo, &reading, active),
        };
        N::Real::select(active, value, N::Real::lit(0.0))
    }

    #[inline(always)]
    fn density(&self, pair: &Directions<N>, nm: N::Real, active: N::Mask) -> N::Real {
        self.sampler().pdf(pair.wi, pair.wo, &self.reading(nm), active)
    }

    #[inline(always)]
    fn draw(
        &self,
        wi: [N::Real; 3],
        _to_below: N::Mask,
        nm: N::Real,
        u: [N::Real; 3],
        active: N::Mask,
    ) -> [N::Real; 3] {
        // `_to_below` is false, since the provided `Sides::choose` never takes the side below. The sampler needs two
        // random numbers; u[0] is left over from the choice of the wavelength (mixture.rs).
        self.sampler().sample(wi, &self.reading(nm), [u[1], u[2]], active)
    }
}
