//! Number types over which evaluators are generic, so that each evaluator is written once. A family of types implements
//! [`Numbers`]:
//!
//! - [`Plain`]: single values,
//! - [`Lanes`]: four values side by side (SIMD), one in each *lane*,
//! - the *recorded* or *traced* variables of the Mitsuba plugin (`cpp_shim/src/traced.rs`). The tracing compiler Dr.Jit
//!   records operations on them as a kernel, a program that later computes many lanes. While it records, a variable has
//!   no value.
//!
//! Numbers of the first two families are *numbers by value*.
//!
//! A generic evaluator cannot branch on values, which differ between lanes. It computes both results and selects one of
//! them by a mask, masks its reads, and loops through [`Numbers::while_loop`]. Its tables are words of 32 bits, read by
//! [`Numbers::gather`]. [`math`] has functions on top of the traits, among them the decoding of packed words.
//!
//! ```
//! use sunbeam::numeric::{Lanes, Number, Numbers, Plain, Real};
//!
//! /// √x, and 0 for negative x.
//! fn clamped_root<N: Numbers>(x: N::Real) -> N::Real {
//!     let zero = N::Real::lit(0.0);
//!     N::Real::select(zero.lt(x), x.max(zero).sqrt(), zero)
//! }
//! assert_eq!(clamped_root::<Plain<f64>>(4.0), 2.0);
//! assert_eq!(clamped_root::<Lanes>(Lanes::each([4.0, -1.0, 9.0, 0.0])).to_array(), [2.0, 0.0, 3.0, 0.0]);
//! ```

mod lanes;
pub mod math;
mod plain;

pub use lanes::{LaneMask, Lanes};
pub use plain::Plain;

use std::ffi::CStr;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Shl, Shr, Sub};

/// Largest count of [`Numbers::tabulated`]. Chosen above the number of lattice nodes that a table's look-up reads along
/// one axis (`table/lattice.rs`). Every call reserves this many numbers, so a larger value costs time.
pub(crate) const TABULATED_MAX: usize = 40;

/// State of a loop ([`Numbers::while_loop`]): numbers, masks, and tuples and arrays of numbers and masks.
pub trait State: Copy {
    /// Number of recorded variables in the state, which [`State::each`] visits. Zero for numbers by value.
    const COUNT: usize;

    /// Calls `visit` with the index by which Dr.Jit identifies each recorded variable, in a fixed order.
    fn each(&mut self, visit: &mut dyn FnMut(&mut u32));

    /// Restores `old` in the lanes where `changed` is false, since the loop has ended there. Only [`Lanes`] needs
    /// this: a loop of single values ends as a whole, and Dr.Jit itself keeps the values of lanes whose loop has
    /// ended.
    #[inline(always)]
    fn keep_lanes(&mut self, _old: Self, _changed: LaneMask) {}
}

/// Truth values, one for each lane.
pub trait Mask: State + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {}

/// Operations common to real numbers and indices.
pub trait Number: State + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Result of a comparison.
    type Mask: Mask;
    /// `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self ≤ other`; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Smaller of two numbers; unspecified where either is NaN.
    fn min(self, other: Self) -> Self;
    /// Larger of two numbers; unspecified where either is NaN.
    fn max(self, other: Self) -> Self;
    /// `yes` where the mask is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// `self` clamped to `[low, high]`.
    #[inline(always)]
    fn clip(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

/// Real numbers of single or double precision.
pub trait Real: Number + Div<Output = Self> + Neg<Output = Self> {
    /// Constant in every lane, rounded to the type's precision.
    fn lit(value: f64) -> Self;
    /// `self·b + c`, in one operation with one rounding where the processor has a fast one.
    fn fma(self, b: Self, c: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root; NaN for negative numbers.
    fn sqrt(self) -> Self;
    /// Largest whole number that is at most `self`.
    fn floor(self) -> Self;
    /// Smallest whole number that is at least `self`.
    fn ceil(self) -> Self;
    /// Two to the power `self`.
    fn exp2(self) -> Self;
    /// Binary logarithm of a positive, normal number.
    fn log2(self) -> Self;
}

/// Unsigned integers of 32 bits. Evaluators avoid overflow, which families treat differently.
pub trait Index:
    Number + BitAnd<Output = Self> + BitOr<Output = Self> + Shl<u32, Output = Self> + Shr<u32, Output = Self>
{
    /// Constant in every lane.
    fn lit(value: u32) -> Self;
}

/// Family of number types that are used together.
pub trait Numbers: Copy {
    /// Real numbers of the family's working precision.
    type Real: Real<Mask = Self::Mask>;
    /// Real numbers of double precision, for frequencies: a diffraction order is much narrower than its distance from
    /// frequency 0.
    type Double: Real<Mask = Self::Mask>;
    /// Unsigned integers: positions in tables, and counts.
    type Index: Index<Mask = Self::Mask>;
    /// Truth values: results of comparisons.
    type Mask: Mask;
    /// Table data: words of 32 bits.
    type Words: Copy;

    /// Mask that is `value` in every lane.
    fn mask(value: bool) -> Self::Mask;
    /// Reads a packet of `W` words (1, 2 or 4), `table[W·at]` to `table[W·at + W − 1]`; zeros where the mask is false.
    /// The evaluator keeps `at` within the table where the mask is true.
    fn gather<const W: usize>(table: Self::Words, at: Self::Index, mask: Self::Mask) -> [Self::Index; W];
    /// Number whose single-precision bits are `bits`, in the family's working precision.
    fn from_bits(bits: Self::Index) -> Self::Real;
    /// Converts to [`Numbers::Double`].
    fn widen(x: Self::Real) -> Self::Double;
    /// Converts to [`Numbers::Real`].
    fn narrow(x: Self::Double) -> Self::Real;
    /// Converts an integer to a real number.
    fn real(i: Self::Index) -> Self::Real;
    /// Truncates a number in `[0, 2³¹)`. Elsewhere the result is arbitrary, and differs between families.
    fn index(x: Self::Real) -> Self::Index;
    /// [`Numbers::index`] of a double.
    fn index_of_double(x: Self::Double) -> Self::Index;

    /// Applies `step` to the state while `go_on` is true, in each lane separately, and returns the last state. `name`
    /// labels the loop in recorded kernels; numbers by value ignore it.
    fn while_loop<S: State>(name: &'static CStr, state: S, go_on: impl Fn(S) -> Self::Mask, step: impl Fn(S) -> S)
    -> S;

    /// Function equal to `function` on `0..count`, for `count` up to [`TABULATED_MAX`]; for loops that need the same
    /// values several times.
    ///
    /// - Numbers by value tabulate `function` once. In a loop, the argument must be equal in all lanes that are still
    ///   in the loop. Lanes that have left it may have a smaller argument, and get a wrong value, which is discarded.
    /// - Recorded kernels call `function` itself.
    fn tabulated(count: u32, function: impl Fn(Self::Index) -> Self::Real) -> impl Fn(Self::Index) -> Self::Real;

    /// Results `[result][input]` of `function` for each of the `L` inputs in turn. Zeros where `active` is false. In
    /// [`Lanes`], zeros only if it is false in all lanes; else results in lanes that are not active are arbitrary.
    ///
    /// Recorded kernels loop over the inputs, under the label `name`. Without a loop a kernel would have `L` copies of
    /// `function`, and take about `L` times longer to compile.
    fn map_each<const L: usize, const R: usize>(
        name: &'static CStr,
        inputs: [Self::Real; L],
        active: Self::Mask,
        function: impl Fn(Self::Real) -> [Self::Real; R],
    ) -> [[Self::Real; L]; R];
}

/// Families of numbers by value, with one or several lanes.
pub(crate) trait Values: Numbers {
    /// Number of lanes, at most [`VALUES_MAX`].
    const COUNT: usize;
    /// Number with the value `lane(i)` in each lane i, rounded to the family's precision.
    fn pack(lane: impl Fn(usize) -> f64) -> Self::Real;
    /// Value of an index in one lane.
    fn lane(index: Self::Index, lane: usize) -> usize;
    /// Sum over the lanes.
    fn total(number: Self::Real) -> f64;
}

/// Largest [`Values::COUNT`].
pub(crate) const VALUES_MAX: usize = lanes::LANES;

/// [`Numbers::map_each`] of numbers by value, for all lanes; zeros where none is active.
#[inline(always)]
fn map_by_value<T: Real, const L: usize, const R: usize>(
    inputs: [T; L],
    any_active: bool,
    function: impl Fn(T) -> [T; R],
) -> [[T; L]; R] {
    let mut results = [[T::lit(0.0); L]; R];
    if any_active {
        for (i, input) in inputs.into_iter().enumerate() {
            for (result, value) in results.iter_mut().zip(function(input)) {
                result[i] = value;
            }
        }
    }
    results
}

/// Implements [`State`] for tuples, which visit their elements in order. An argument lists the elements of one tuple,
/// each by a type parameter and its index.
macro_rules! tuples {
    ($($($t:ident $i:tt)+;)+) => {$(
        #[allow(non_snake_case, reason = "type parameters name the elements")]
        impl<$($t: State),+> State for ($($t,)+) {
            const COUNT: usize = 0 $(+ $t::COUNT)+;
            #[inline(always)]
            fn each(&mut self, visit: &mut dyn FnMut(&mut u32)) {
                let ($($t,)+) = self;
                $($t.each(visit);)+
            }
            #[inline(always)]
            fn keep_lanes(&mut self, old: Self, changed: LaneMask) {
                $(self.$i.keep_lanes(old.$i, changed);)+
            }
        }
    )+};
}
tuples! { A 0; A 0 B 1; A 0 B 1 C 2; A 0 B 1 C 2 D 3; A 0 B 1 C 2 D 3 E 4; A 0 B 1 C 2 D 3 E 4 F 5; }

impl<T: State, const N: usize> State for [T; N] {
    const COUNT: usize = N * T::COUNT;
    #[inline(always)]
    fn each(&mut self, visit: &mut dyn FnMut(&mut u32)) {
        self.iter_mut().for_each(|x| x.each(visit));
    }
    #[inline(always)]
    fn keep_lanes(&mut self, old: Self, changed: LaneMask) {
        self.iter_mut().zip(old).for_each(|(x, old)| x.keep_lanes(old, changed));
    }
}
