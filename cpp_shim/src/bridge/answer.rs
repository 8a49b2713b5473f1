//! Evaluation of a surface: value, density, samples and Mueller matrices, by value and traced with the same code.
//!
//! The code is generic over a family of numbers ([`Numbers`]): [`Plain`] for plain numbers, [`Lanes`] for four SIMD
//! lanes, [`Traced`] for variables of Dr.Jit (traced.rs). A surface has one of four kinds of tables, each with a lobe
//! that evaluates it.

use super::super::scope::Scope;
use super::super::traced::{Traced, Var, WordsVar};
use super::ffi::{Part, TracedQuery};
use super::surface::{Surface, Tables};
use std::array;
use sunbeam::grating::{GratingLobe, JonesTable};
use sunbeam::lobe::{Gamut, LinearSrgb, Lobe, SpectralLobe, luminance};
use sunbeam::numeric::{Lanes, Numbers, Plain, Real};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Arguments of an evaluation, by value or traced.
#[derive(Clone, Copy)]
pub(super) struct Query<N: Numbers> {
    /// Table data.
    pub(super) words: [N::Words; 3],
    pub(super) wi: [N::Real; 3],
    /// `wo`, or the three random numbers of a sample.
    pub(super) second: [N::Real; 3],
    /// Wavelengths in nm; surfaces in colours ignore them.
    pub(super) wavelengths_nm: [N::Real; 4],
    /// Lanes to compute; the others get zero.
    pub(super) active: N::Mask,
}

impl Surface {
    /// A query by value.
    pub(super) fn by_value(&self, wi: [f32; 3], second: [f32; 3], wavelengths_nm: [f32; 4]) -> Query<Plain<'_, f32>> {
        Query { words: self.all_words(), wi, second, wavelengths_nm, active: true }
    }

    /// A query by Dr.Jit variables; `second` are those of the call's second vector.
    pub(super) fn traced<'s>(&self, scope: Scope<'s>, query: &TracedQuery, second: [u32; 3]) -> Query<Traced<'s>> {
        let real = |index| Var::borrowed(scope, index);
        let wi = query.wi.map(real);
        let wavelengths_nm = match &self.tables {
            Tables::Spectral(_) | Tables::Grating(_) => query.wavelengths_nm.map(real),
            Tables::Colours(_) | Tables::GratingColours(_) => [wi[0]; 4],
        };
        let words = query.words.map(|index| WordsVar::borrowed(scope, index));
        Query { words, wi, second: second.map(real), wavelengths_nm, active: Var::borrowed(scope, query.active) }
    }

    /// Value and density by value. Spectral surfaces carry the four wavelengths in four SIMD lanes.
    #[inline(always)]
    pub(super) fn answer_by_value(&self, part: Part, wi: [f32; 3], wo: [f32; 3], wavelengths_nm: [f32; 4]) -> [f32; 5] {
        if let Tables::Spectral(tables) = &self.tables {
            let lobe = SpectralLobe::<Lanes> { layout: tables.0.layout(), words: self.all_words() };
            return in_lanes(&lobe, part, wi, wo, wavelengths_nm);
        }
        // Scalar variants of Mitsuba warn of every sample with a negative channel.
        self.answer(part, Gamut::Desaturate, self.by_value(wi, wo, wavelengths_nm))
    }

    /// Four values, then the density; zero in the part that is not computed.
    #[inline(always)]
    pub(super) fn answer<N: Numbers>(&self, part: Part, gamut: Gamut, query: Query<N>) -> [N::Real; 5] {
        let with_luminance = |[r, g, b]: [N::Real; 3]| [r, g, b, luminance([r, g, b])];
        match &self.tables {
            Tables::Spectral(tables) => {
                let lobe = SpectralLobe::<N> { layout: tables.0.layout(), words: query.words };
                evaluated(&lobe, part, query, query.wavelengths_nm.map(within_range), |values| values)
            }
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: query.words[0] };
                evaluated(&lobe, part, query, query.wavelengths_nm.map(within_range), |values| values)
            }
            Tables::Colours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>(query.words);
                lobe.factors.gamut = gamut;
                evaluated(&lobe, part, query, LinearSrgb, with_luminance)
            }
            Tables::GratingColours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>([query.words[0], query.words[1]]);
                lobe.gamut = gamut;
                evaluated(&lobe, part, query, LinearSrgb, with_luminance)
            }
        }
    }

    /// A direction from the three random numbers in `second`.
    #[inline(always)]
    pub(super) fn direction<N: Numbers>(&self, query: Query<N>) -> [N::Real; 3] {
        let Query { words, wi, second: u, active, .. } = query;
        let nm = query.wavelengths_nm.map(within_range);
        match &self.tables {
            Tables::Spectral(tables) => {
                SpectralLobe::<N> { layout: tables.0.layout(), words }.sample(wi, nm, u, active)
            }
            Tables::Grating(tables) => {
                GratingLobe::<N> { layout: tables.0.layout(), words: words[0] }.sample(wi, nm, u, active)
            }
            Tables::Colours(tables) => tables.0.lobe_over::<N>(words).sample(wi, LinearSrgb, u, active),
            Tables::GratingColours(tables) => {
                tables.0.lobe_over::<N>([words[0], words[1]]).sample(wi, LinearSrgb, u, active)
            }
        }
    }

    /// Mueller matrices of light from `wi` to `second`, as the bridge's `evaluate_matrix` arranges them.
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
            // `Surface::jones` has refused surfaces of scalar theory.
            Tables::Spectral(_) | Tables::Colours(_) => [[N::Real::lit(0.0); 4]; 16],
        };
        array::from_fn(|i| elements[i / 4][i % 4])
    }
}

/// Value and density of a lobe. `carried` are the wavelengths or the colour space, and `four` turns the lobe's value
/// into four numbers.
#[inline(always)]
fn evaluated<N: Numbers, C: Copy, T: Lobe<N, C>>(
    lobe: &T,
    part: Part,
    query: Query<N>,
    carried: C,
    four: impl Fn(T::Value) -> [N::Real; 4],
) -> [N::Real; 5] {
    let Query { wi, second: wo, active, .. } = query;
    let zero = N::Real::lit(0.0);
    let ([a, b, c, d], density) = match part {
        Part::Value => (four(lobe.eval(wi, wo, carried, active)), zero),
        Part::Density => ([zero; 4], lobe.pdf(wi, wo, carried, active)),
        _ => {
            let (value, density) = lobe.eval_pdf(wi, wo, carried, active);
            (four(value), density)
        }
    };
    [a, b, c, d, density]
}

/// Value and density with a wavelength in each of four lanes.
#[inline(always)]
fn in_lanes(lobe: &SpectralLobe<Lanes>, part: Part, wi: [f32; 3], wo: [f32; 3], wavelengths_nm: [f32; 4]) -> [f32; 5] {
    let (wi, wo) = (wi.map(Lanes::all), wo.map(Lanes::all));
    let nm = [within_range(Lanes::each(wavelengths_nm))];
    let active = Lanes::mask(true);
    let zero = Lanes::all(0.0);
    let ([values], densities) = match part {
        Part::Value => (lobe.eval(wi, wo, nm, active), zero),
        Part::Density => ([zero], lobe.pdf(wi, wo, nm, active)),
        _ => lobe.eval_pdf(wi, wo, nm, active),
    };
    let [a, b, c, d] = values.to_array();
    [a, b, c, d, 0.25 * densities.reduce_add()]
}

/// A wavelength in nm, clipped to the tables' range, since rounding in the renderer may exceed the range slightly.
fn within_range<R: Real>(nm: R) -> R {
    nm.clip(R::lit(WAVELENGTH_MIN_NM), R::lit(WAVELENGTH_MAX_NM))
}
