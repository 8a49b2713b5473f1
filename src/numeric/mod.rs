//! Families of numbers for evaluators, so that each is written once: single values ([`Plain`]), four values side by
//! side ([`Lanes`]), or variables of a tracing compiler that records a kernel (the Mitsuba plugin's).
//!
//! An evaluator is generic over [`Numbers`], a family of types that belong together. It may not branch on values. It
//! selects with masks, masks its reads, and loops through [`Numbers::while_loop`]. Its tables are words of 32 bits,
//! read by [`Numbers::gather`]. [`math`] has functions on top of the traits, among them the decoding of packed words.
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

/// Largest count of [`Numbers::tabulated`]. Chosen: more than the taps of a table's look-up (table/lattice.rs).
pub(crate) const TABULATED_MAX: usize = 40;

/// State carried by a loop: numbers, masks, and tuples and arrays of them.
pub trait State: Copy {
    /// Number of handles that [`State::each`] visits.
    const COUNT: usize;

    /// Visits the handles of recorded variables, in a fixed order. Numbers by value have none.
    fn each(&mut self, visit: &mut dyn FnMut(&mut u32));

    /// Restores `old` in the lanes where `changed` is false: a loop has ended there. Needed by [`Lanes`] only; single
    /// values end at once, and recorded loops keep ended lanes themselves.
    #[inline(always)]
    fn keep_lanes(&mut self, _old: Self, _changed: LaneMask) {}
}

/// Truth values, one for each lane.
pub trait Mask: State + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {}

/// Operations common to reals and indices.
pub trait Number: State + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Result of a comparison.
    type Mask: Mask;
    /// `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self ≤ other`; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Lesser of two numbers; unspecified where either is NaN.
    fn min(self, other: Self) -> Self;
    /// Greater of two numbers; unspecified where either is NaN.
    fn max(self, other: Self) -> Self;
    /// `yes` where the mask holds, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// `self` brought into `[low, high]`.
    #[inline(always)]
    fn clip(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

/// Reals of single or double precision.
pub trait Real: Number + Div<Output = Self> + Neg<Output = Self> {
    /// A constant.
    fn lit(value: f64) -> Self;
    /// `self·b + c`, fused where that is fast.
    fn fma(self, b: Self, c: Self) -> Self;
    /// The absolute value.
    fn abs(self) -> Self;
    /// Square root; NaN for negative numbers.
    fn sqrt(self) -> Self;
    /// Greatest whole number at most `self`.
    fn floor(self) -> Self;
    /// Least whole number at least `self`.
    fn ceil(self) -> Self;
    /// Two to the power `self`.
    fn exp2(self) -> Self;
    /// Binary logarithm of a positive, normal number.
    fn log2(self) -> Self;
}

/// Unsigned integers of 32 bits. An operation must not overflow.
pub trait Index:
    Number + BitAnd<Output = Self> + BitOr<Output = Self> + Shl<u32, Output = Self> + Shr<u32, Output = Self>
{
    /// A constant.
    fn lit(value: u32) -> Self;
}

/// A family of number types that belong together.
pub trait Numbers: Copy {
    /// Reals of the family's working precision.
    type Real: Real<Mask = Self::Mask>;
    /// Reals of double precision, for positions on a lattice: an order is much narrower than its distance from the
    /// origin.
    type Double: Real<Mask = Self::Mask>;
    /// Unsigned integers: positions in tables, and counts.
    type Index: Index<Mask = Self::Mask>;
    /// Result of a comparison.
    type Mask: Mask;
    /// Table data: words of 32 bits.
    type Words: Copy;

    /// A mask that is true, or false, in every lane.
    fn mask(value: bool) -> Self::Mask;
    /// Reads the `W` words of `table` from `W·at` on, `W` being 1, 2 or 4; zeros where the mask is false. The evaluator
    /// keeps `at` within the table.
    fn gather<const W: usize>(table: Self::Words, at: Self::Index, mask: Self::Mask) -> [Self::Index; W];
    /// Number whose single-precision bits are `bits`.
    fn from_bits(bits: Self::Index) -> Self::Real;
    /// Converts to [`Numbers::Double`].
    fn widen(x: Self::Real) -> Self::Double;
    /// Converts to [`Numbers::Real`].
    fn narrow(x: Self::Double) -> Self::Real;
    /// Converts an integer to a real number.
    fn real(i: Self::Index) -> Self::Real;
    /// Truncates a number in `[0, 2³²)`. Elsewhere the result is arbitrary, and differs between families.
    fn index(x: Self::Real) -> Self::Index;
    /// [`Numbers::index`] of a double.
    fn index_of_double(x: Self::Double) -> Self::Index;

    /// Applies `step` while `go_on` is true, in each lane on its own. `name` labels a recorded loop.
    fn while_loop<S: State>(name: &'static CStr, state: S, go_on: impl Fn(S) -> Self::Mask, step: impl Fn(S) -> S)
    -> S;

    /// `function` over `0..count` (at most 40), tabulated beforehand where numbers are values.
    fn tabulated(count: u32, function: impl Fn(Self::Index) -> Self::Real) -> impl Fn(Self::Index) -> Self::Real;

    /// `function` of each of `L` numbers in turn, as `[result][lane]`. Recorded kernels loop over the lanes: written
    /// out, they would be `L` times longer and take as much longer to compile.
    fn each_lane<const L: usize, const R: usize>(
        name: &'static CStr,
        lanes: [Self::Real; L],
        active: Self::Mask,
        function: impl Fn(Self::Real) -> [Self::Real; R],
    ) -> [[Self::Real; L]; R];
}

/// Numbers by value, one or several side by side.
pub(crate) trait Values: Numbers {
    /// Number of lanes, at most [`VALUES_MAX`].
    const COUNT: usize;
    /// Number whose lane i is `of(i)`, rounded to the family's precision.
    fn pack(of: impl Fn(usize) -> f64) -> Self::Real;
    /// Lane of an index.
    fn lane(of: Self::Index, lane: usize) -> usize;
    /// Sum over the lanes.
    fn total(of: Self::Real) -> f64;
}

/// Largest [`Values::COUNT`].
pub(crate) const VALUES_MAX: usize = lanes::LANES;

/// [`Numbers::each_lane`] of numbers by value; zeros unless `active`.
#[inline(always)]
fn one_by_one<T: Real, const L: usize, const R: usize>(
    lanes: [T; L],
    active: bool,
    function: impl Fn(T) -> [T; R],
) -> [[T; L]; R] {
    let mut results = [[T::lit(0.0); L]; R];
    if active {
        for (k, lane) in lanes.into_iter().enumerate() {
            for (result, value) in results.iter_mut().zip(function(lane)) {
                result[k] = value;
            }
        }
    }
    results
}

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
