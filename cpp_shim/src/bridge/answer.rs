//! Evaluation of a surface: values, densities, samples and Mueller matrices, by value and traced with the same code.
//!
//! The code is generic over a family of numbers `N` ([`Numbers`]): [`Plain`] for plain numbers, [`Lanes`] for four
//! SIMD lanes, [`Traced`] for variables of Dr.Jit (traced.rs). `N::Real` is one number of the family, and
//! `N::Real::lit` makes a constant. A surface has one of four kinds of tables ([`Tables`]), and each kind has a
//! [`Lobe`] that evaluates it. `tables.0` holds the tables; `tables.1`, unused here, says whether they were built or
//! cached. Directions and units are those of bridge.rs.

use super::super::scope::Scope;
use super::super::traced::{Traced, Var, WordsVar};
use super::ffi::{Part, TracedQuery};
use super::surface::{Surface, Tables};
use std::array;
use sunbeam::grating::{GratingLobe, JonesTable};
use sunbeam::lobe::{Gamut, LinearSrgb, Lobe, SpectralLobe, TransmissiveColourLobe, TransmissiveLobe, luminance};
use sunbeam::numeric::{Lanes, Numbers, Plain, Real};
use sunbeam::scattering::RelativeSize;
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Arguments of an evaluation, by value or traced.
#[derive(Clone, Copy)]
pub(super) struct Query<N: Numbers> {
    /// Table data, in the parts of [`Surface::all_words`]: spectrum (or colours), sampler and albedo of scalar theory;
    /// efficiencies, colours and Jones matrices of rigorous theory.
    pub(super) words: [N::Words; 3],
    /// The direction `wi`; `from` in a query of a matrix.
    pub(super) wi: [N::Real; 3],
    /// The direction `wo`, `to` in a query of a matrix, or the three random numbers of a sample.
    pub(super) second: [N::Real; 3],
    /// Wavelengths in nm; surfaces in colours ignore them.
    pub(super) wavelengths_nm: [N::Real; 4],
    /// Size at the point of the surface, relative to the relief; `None` for a surface of one size.
    pub(super) size: Option<RelativeSize<N::Real>>,
    /// Rays to compute; the others get zero.
    pub(super) active: N::Mask,
}

impl Surface {
    /// A query by value. `size` has the scale and the depth, which surfaces of one size ignore.
    pub(super) fn plain_query(
        &self,
        wi: [f32; 3],
        second: [f32; 3],
        wavelengths_nm: [f32; 4],
        [scale, depth]: [f32; 2],
    ) -> Query<Plain<'_, f32>> {
        let size = self.recipe.config.sizes.map(|_| RelativeSize { scale, depth }.clipped());
        Query { words: self.all_words(), wi, second, wavelengths_nm, size, active: true }
    }

    /// A query with Dr.Jit variables, which the caller keeps until the scope ends. `second` has the indices of
    /// [`Query::second`].
    pub(super) fn traced_query<'s>(
        &self,
        scope: Scope<'s>,
        query: &TracedQuery,
        second: [u32; 3],
    ) -> Query<Traced<'s>> {
        let real = |index| Var::borrowed(scope, index);
        let wi = query.wi.map(real);
        let wavelengths_nm = match &self.tables {
            Tables::Spectral(_) | Tables::Grating(_) => query.wavelengths_nm.map(real),
            // Not read; any variable serves.
            Tables::Colours(_) | Tables::GratingColours(_) => [wi[0]; 4],
        };
        let words = query.words.map(|index| WordsVar::borrowed(scope, index));
        let size = self.recipe.config.sizes.map(|_| {
            let [scale, depth] = query.size.map(real);
            RelativeSize { scale, depth }.clipped()
        });
        let active = Var::borrowed(scope, query.active);
        Query { words, wi, second: second.map(real), wavelengths_nm, size, active }
    }

    /// [`Surface::answer`] by value. Spectral surfaces of scalar theory evaluate the four wavelengths in four SIMD
    /// lanes.
    #[inline(always)]
    pub(super) fn answer_by_value(&self, part: Part, query: Query<Plain<'_, f32>>) -> [f32; 5] {
        if let Tables::Spectral(tables) = &self.tables {
            let size = query.size.map(|RelativeSize { scale, depth }| RelativeSize {
                scale: Lanes::all(scale),
                depth: Lanes::all(depth),
            });
            let relief = SpectralLobe::<Lanes> { layout: tables.0.layout(), words: self.all_words(), size };
            if let Some(body) = tables.0.options().body {
                let lobe = TransmissiveLobe { body, relief };
                return evaluated_in_lanes(&lobe, part, query.wi, query.second, query.wavelengths_nm);
            }
            return evaluated_in_lanes(&relief, part, query.wi, query.second, query.wavelengths_nm);
        }
        // Desaturated, because scalar variants of Mitsuba warn about every sample with a negative channel.
        self.answer(part, Gamut::Desaturate, query)
    }

    /// The value at four wavelengths, or as red, green, blue and luminance; then the density. Zero where `part`
    /// excludes it. `gamut` says whether surfaces in colours keep negative channels or desaturate such colours.
    #[inline(always)]
    pub(super) fn answer<N: Numbers>(&self, part: Part, gamut: Gamut, query: Query<N>) -> [N::Real; 5] {
        let with_luminance = |[r, g, b]: [N::Real; 3]| [r, g, b, luminance([r, g, b])];
        match &self.tables {
            Tables::Spectral(tables) => {
                let relief = SpectralLobe::<N> { layout: tables.0.layout(), words: query.words, size: query.size };
                let nm = query.wavelengths_nm.map(within_range);
                match tables.0.options().body {
                    Some(body) => evaluated(&TransmissiveLobe { body, relief }, part, query, nm, |values| values),
                    None => evaluated(&relief, part, query, nm, |values| values),
                }
            }
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: query.words[0] };
                evaluated(&lobe, part, query, query.wavelengths_nm.map(within_range), |values| values)
            }
            Tables::Colours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>(query.words, query.size);
                lobe.factors.gamut = gamut;
                match tables.0.options().body {
                    Some(body) => {
                        let lobe = TransmissiveColourLobe { body, relief: lobe };
                        evaluated(&lobe, part, query, LinearSrgb, with_luminance)
                    }
                    None => evaluated(&lobe, part, query, LinearSrgb, with_luminance),
                }
            }
            Tables::GratingColours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>([query.words[0], query.words[1]]);
                lobe.gamut = gamut;
                evaluated(&lobe, part, query, LinearSrgb, with_luminance)
            }
        }
    }

    /// The direction `wo` for the three random numbers in `second`.
    #[inline(always)]
    pub(super) fn direction<N: Numbers>(&self, query: Query<N>) -> [N::Real; 3] {
        let Query { words, wi, second: u, size, active, .. } = query;
        let wavelengths_nm = query.wavelengths_nm.map(within_range);
        match &self.tables {
            Tables::Spectral(tables) => {
                let relief = SpectralLobe::<N> { layout: tables.0.layout(), words, size };
                match tables.0.options().body {
                    Some(body) => TransmissiveLobe { body, relief }.sample(wi, wavelengths_nm, u, active),
                    None => relief.sample(wi, wavelengths_nm, u, active),
                }
            }
            Tables::Grating(tables) => {
                GratingLobe::<N> { layout: tables.0.layout(), words: words[0] }.sample(wi, wavelengths_nm, u, active)
            }
            Tables::Colours(tables) => {
                let relief = tables.0.lobe_over::<N>(words, size);
                match tables.0.options().body {
                    Some(body) => TransmissiveColourLobe { body, relief }.sample(wi, LinearSrgb, u, active),
                    None => relief.sample(wi, LinearSrgb, u, active),
                }
            }
            Tables::GratingColours(tables) => {
                tables.0.lobe_over::<N>([words[0], words[1]]).sample(wi, LinearSrgb, u, active)
            }
        }
    }

    /// Mueller matrices of light from `wi` to `second`, in the order of the bridge's `evaluate_matrix`.
    #[inline(always)]
    pub(super) fn matrix<N: Numbers>(&self, jones: &JonesTable, query: Query<N>) -> [N::Real; 64] {
        let Query { words, wi: from, second: to, active, .. } = query;
        let view = jones.view::<N>(words[2]);
        let elements = match &self.tables {
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: words[0] };
                lobe.matrix(&view, from, to, query.wavelengths_nm.map(within_range), active)
            }
            Tables::GratingColours(tables) => {
                let lobe = tables.0.lobe_over::<N>([words[0], words[1]]);
                lobe.matrix(&view, from, to, active).map(|element| [element; 4])
            }
            // Never reached: surfaces of scalar theory have no Jones matrices.
            Tables::Spectral(_) | Tables::Colours(_) => [[N::Real::lit(0.0); 4]; 16],
        };
        // `elements` is `[4·row + column][wavelength]`.
        array::from_fn(|i| elements[i / 4][i % 4])
    }
}

/// The four numbers of a lobe's value, then its density. `carried` is what the variant's rays carry: four wavelengths
/// in nm, or the colour space. `four_numbers` converts the lobe's value to four numbers.
#[inline(always)]
fn evaluated<N: Numbers, C: Copy, T: Lobe<N, C>>(
    lobe: &T,
    part: Part,
    query: Query<N>,
    carried: C,
    four_numbers: impl Fn(T::Value) -> [N::Real; 4],
) -> [N::Real; 5] {
    let Query { wi, second: wo, active, .. } = query;
    let zero = N::Real::lit(0.0);
    let ([a, b, c, d], density) = match part {
        Part::Value => (four_numbers(lobe.eval(wi, wo, carried, active)), zero),
        Part::Density => ([zero; 4], lobe.pdf(wi, wo, carried, active)),
        // `ValueAndDensity`. The enumerations of cxx need a catch-all arm.
        _ => {
            let (value, density) = lobe.eval_pdf(wi, wo, carried, active);
            (four_numbers(value), density)
        }
    };
    [a, b, c, d, density]
}

/// A number in each of four lanes.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// [`evaluated`] with a wavelength in each of four lanes.
#[inline(always)]
fn evaluated_in_lanes<'a>(
    lobe: &impl Lobe<Lanes<'a>, [Real4; 1], Value = [Real4; 1]>,
    part: Part,
    wi: [f32; 3],
    wo: [f32; 3],
    wavelengths_nm: [f32; 4],
) -> [f32; 5] {
    let (wi, wo) = (wi.map(Lanes::all), wo.map(Lanes::all));
    let nm = [within_range(Lanes::each(wavelengths_nm))];
    // Queries by value are always active (`Surface::plain_query`).
    let active = Lanes::mask(true);
    let zero = Lanes::all(0.0);
    let ([values], densities) = match part {
        Part::Value => (lobe.eval(wi, wo, nm, active), zero),
        Part::Density => ([zero], lobe.pdf(wi, wo, nm, active)),
        // `ValueAndDensity`.
        _ => lobe.eval_pdf(wi, wo, nm, active),
    };
    let [a, b, c, d] = values.to_array();
    // The density of a ray is the mean over its wavelengths.
    [a, b, c, d, 0.25 * densities.reduce_add()]
}

/// A wavelength in nm, clipped to the tables' range: rounding in the renderer may exceed the range slightly.
fn within_range<R: Real>(nm: R) -> R {
    nm.clip(R::lit(WAVELENGTH_MIN_NM), R::lit(WAVELENGTH_MAX_NM))
}
