//! Answers of a surface, by value and traced: one code for both.

use super::super::scope::Scope;
use super::super::traced::{Var, WordsVar};
use super::ffi::{self, Question};
use super::surface::{Surface, Tables};
use std::array;
use sunbeam::grating::{GratingLobe, JonesTable};
use sunbeam::lobe::{Gamut, SpectralLobe, luminance};
use sunbeam::numeric::{Lanes, Numbers, Plain, Real};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Handles of what C++ asks with.
pub(super) struct Arguments<'s> {
    pub(super) words: [WordsVar<'s>; 3],
    /// The second are three random numbers where a direction is asked for.
    pub(super) directions: [[Var<'s, f32>; 3]; 2],
    pub(super) nm: [Var<'s, f32>; 4],
    pub(super) active: Var<'s, bool>,
}

impl Surface {
    /// [`Surface::by_value`] compiled for the instructions of AVX2, in which rounding is no call.
    ///
    /// # Safety
    /// Only on processors that have them.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn by_value_avx2(
        &self,
        question: Question,
        directions: [[f32; 3]; 2],
        wavelengths_nm: [f32; 4],
    ) -> [f32; 5] {
        self.by_value(question, directions, wavelengths_nm)
    }

    #[inline(always)]
    pub(super) fn by_value(&self, question: Question, directions: [[f32; 3]; 2], wavelengths_nm: [f32; 4]) -> [f32; 5] {
        let words = self.all_words();
        if let (Tables::Spectral(tables), true) = (&self.tables, question != Question::Direction) {
            let lobe = SpectralLobe::<Lanes> { layout: tables.0.layout(), words };
            return side_by_side(&lobe, question, directions, wavelengths_nm);
        }
        // Scalar variants of Mitsuba warn of every sample with a negative channel.
        self.answer::<Plain<f32>>(words, Gamut::Desaturate, question, directions, wavelengths_nm, true)
    }

    /// Handles of what C++ asks with.
    pub(super) fn arguments<'s>(&self, scope: Scope<'s>, arguments: &ffi::Traced) -> Arguments<'s> {
        let real = |index| Var::borrowed(scope, index);
        let directions = [arguments.wi.map(real), arguments.other.map(real)];
        let nm = match &self.tables {
            Tables::Spectral(_) | Tables::Grating(_) => arguments.wavelengths_nm.map(real),
            Tables::Colours(_) | Tables::GratingColours(_) => [directions[0][0]; 4],
        };
        let words = arguments.words.map(|index| WordsVar::borrowed(scope, index));
        Arguments { words, directions, nm, active: Var::borrowed(scope, arguments.active) }
    }

    /// Asks the lobe for matrices, as `ask_matrix` says.
    #[inline(always)]
    pub(super) fn matrix<N: Numbers>(
        &self,
        jones: &JonesTable,
        words: [N::Words; 3],
        [from, to]: [[N::Real; 3]; 2],
        wavelengths_nm: [N::Real; 4],
        active: N::Mask,
    ) -> [N::Real; 64] {
        let view = jones.view::<N>(words[2]);
        let rows = match &self.tables {
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: words[0] };
                lobe.matrix(&view, from, to, wavelengths_nm.map(within_range), active)
            }
            Tables::GratingColours(tables) => {
                let lobe = tables.0.lobe_over::<N>([words[0], words[1]]);
                lobe.matrix(&view, from, to, active).map(|element| [element; 4])
            }
            // These have no such table.
            Tables::Spectral(_) | Tables::Colours(_) => [[N::Real::lit(0.0); 4]; 16],
        };
        array::from_fn(|i| rows[i / 4][i % 4])
    }

    /// Asks the lobe.
    #[inline(always)]
    pub(super) fn answer<N: Numbers>(
        &self,
        words: [N::Words; 3],
        gamut: Gamut,
        question: Question,
        [wi, other]: [[N::Real; 3]; 2],
        wavelengths_nm: [N::Real; 4],
        active: N::Mask,
    ) -> [N::Real; 5] {
        let four = |[r, g, b]: [N::Real; 3]| [r, g, b, luminance([r, g, b])];
        let (values, density) = match &self.tables {
            Tables::Spectral(tables) => {
                let lobe = SpectralLobe::<N> { layout: tables.0.layout(), words };
                let nm = wavelengths_nm.map(within_range);
                answered(
                    question,
                    || lobe.eval(wi, other, nm, active),
                    || lobe.pdf(wi, other, nm, active),
                    || lobe.sample(wi, nm, other, active),
                    || lobe.eval_pdf(wi, other, nm, active),
                )
            }
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: words[0] };
                let nm = wavelengths_nm.map(within_range);
                answered(
                    question,
                    || lobe.eval(wi, other, nm, active),
                    || lobe.pdf(wi, other, nm, active),
                    || lobe.sample(wi, nm, other, active),
                    || lobe.eval_pdf(wi, other, nm, active),
                )
            }
            Tables::GratingColours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>([words[0], words[1]]);
                lobe.gamut = gamut;
                answered(
                    question,
                    || four(lobe.eval(wi, other, active)),
                    || lobe.pdf(wi, other, active),
                    || lobe.sample(wi, other, active),
                    || {
                        let (colour, density) = lobe.eval_pdf(wi, other, active);
                        (four(colour), density)
                    },
                )
            }
            Tables::Colours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>(words);
                lobe.factors.gamut = gamut;
                answered(
                    question,
                    || four(lobe.eval(wi, other, active)),
                    || lobe.pdf(wi, other, active),
                    || lobe.sample(wi, other, active),
                    || {
                        let (colour, density) = lobe.eval_pdf(wi, other, active);
                        (four(colour), density)
                    },
                )
            }
        };
        let [a, b, c, d] = values;
        [a, b, c, d, density]
    }
}

/// The four wavelengths in the four lanes.
#[inline(always)]
fn side_by_side(
    lobe: &SpectralLobe<Lanes>,
    question: Question,
    directions: [[f32; 3]; 2],
    wavelengths_nm: [f32; 4],
) -> [f32; 5] {
    let [wi, wo] = directions.map(|w| w.map(Lanes::all));
    let nm = [within_range(Lanes::each(wavelengths_nm))];
    let active = Lanes::mask(true);
    let zero = Lanes::all(0.0);
    let ([values], densities) = match question {
        Question::Value => (lobe.eval(wi, wo, nm, active), zero),
        Question::Density => ([zero], lobe.pdf(wi, wo, nm, active)),
        _ => lobe.eval_pdf(wi, wo, nm, active),
    };
    let [a, b, c, d] = values.to_array();
    [a, b, c, d, 0.25 * densities.reduce_add()]
}

/// Renderers may round a wavelength to just outside the range.
fn within_range<R: Real>(nm: R) -> R {
    nm.clip(R::lit(WAVELENGTH_MIN_NM), R::lit(WAVELENGTH_MAX_NM))
}

/// What the question asks for, of a lobe's four answers: values, with zeros or a direction in their place, and the density.
#[inline(always)]
fn answered<R: Real>(
    question: Question,
    eval: impl FnOnce() -> [R; 4],
    pdf: impl FnOnce() -> R,
    sample: impl FnOnce() -> [R; 3],
    eval_pdf: impl FnOnce() -> ([R; 4], R),
) -> ([R; 4], R) {
    let zero = R::lit(0.0);
    match question {
        Question::Value => (eval(), zero),
        Question::Density => ([zero; 4], pdf()),
        Question::Direction => {
            let [x, y, z] = sample();
            ([x, y, z, zero], zero)
        }
        _ => eval_pdf(),
    }
}
