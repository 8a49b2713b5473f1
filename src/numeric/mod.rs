//! What an evaluator may do with numbers, so that it is written once: by value at once ([`Plain`]), four values at once
//! ([`Lanes`]), or recorded as a kernel by a tracing compiler (the Mitsuba plugin's variables).
//!
//! An evaluator is generic over [`Numbers`], a family of types that belong together. It may not branch on values: it selects,
//! masks its reads, and loops through [`Numbers::while_loop`]. What its tables hold are words of 32 bits, read by
//! [`Numbers::gather`]; [`math`] turns words into numbers, and has what the traits do not.

mod lanes;
pub mod math;
mod plain;

pub use lanes::{LaneMask, Lanes};
pub use plain::Plain;

use std::ffi::CStr;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Shl, Shr, Sub};

/// Most values that [`Numbers::tabulated`] holds.
pub(crate) const TABULATED_MAX: usize = 40;

/// Variables that a loop carries. Tuples and arrays of them are such variables too.
pub trait State: Copy {
    /// Number of handles that [`State::each`] visits.
    const COUNT: usize;

    /// Visits the handles of recorded variables, in a fixed order; numbers by value have none.
    fn each(&mut self, visit: &mut dyn FnMut(&mut u32));

    /// Takes back what a step made of the lanes that had ended before. Other numbers by value end all at once, and recorded
    /// loops see to that themselves.
    #[inline(always)]
    fn keep_lanes(&mut self, _old: Self, _changed: LaneMask) {}
}

/// Truth values.
pub trait Mask: State + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {}

/// What reals and indices share.
pub trait Number: State + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// What a comparison gives.
    type Mask: Mask;
    /// `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self ≤ other`; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// The lesser of each pair.
    fn min(self, other: Self) -> Self;
    /// The greater of each pair.
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
    /// NaN below zero.
    fn sqrt(self) -> Self;
    /// The greatest whole number that is not above it.
    fn floor(self) -> Self;
    /// The least whole number that is not below it.
    fn ceil(self) -> Self;
    /// Two to this power.
    fn exp2(self) -> Self;
    /// Of a positive, normal number.
    fn log2(self) -> Self;
}

/// Unsigned integers of 32 bits. Overflow is not allowed.
pub trait Index:
    Number + BitAnd<Output = Self> + BitOr<Output = Self> + Shl<u32, Output = Self> + Shr<u32, Output = Self>
{
    /// A constant.
    fn lit(value: u32) -> Self;
}

/// A family of numbers that belong together.
pub trait Numbers: Copy {
    /// What is computed with.
    type Real: Real<Mask = Self::Mask>;
    /// Double precision, for places on a lattice: a narrow order is a small part of the distance from the origin.
    type Double: Real<Mask = Self::Mask>;
    /// Whole numbers from zero on: places in arrays.
    type Index: Index<Mask = Self::Mask>;
    /// What a comparison gives.
    type Mask: Mask;
    /// A table of words of 32 bits.
    type Words: Copy;

    /// A mask that holds everywhere, or nowhere.
    fn mask(value: bool) -> Self::Mask;
    /// The `W` words of `table` from `W·at` on (`W` is 1, 2 or 4); zeros where the mask is false. The evaluator sees to it
    /// that they are there.
    fn gather<const W: usize>(table: Self::Words, at: Self::Index, mask: Self::Mask) -> [Self::Index; W];
    /// The number of single precision whose bits these are.
    fn from_bits(bits: Self::Index) -> Self::Real;
    /// In the precision of [`Numbers::Double`].
    fn widen(x: Self::Real) -> Self::Double;
    /// In the precision of [`Numbers::Real`].
    fn narrow(x: Self::Double) -> Self::Real;
    /// A whole number as a real one.
    fn real(i: Self::Index) -> Self::Real;
    /// Towards zero, of a number in `[0, 2³²)`. Elsewhere the answer is any number, and differs between families.
    fn index(x: Self::Real) -> Self::Index;
    /// As [`Numbers::index`].
    fn index_of_double(x: Self::Double) -> Self::Index;

    /// Steps while `go_on` holds.
    fn while_loop<S: State>(name: &'static CStr, state: S, go_on: impl Fn(S) -> Self::Mask, step: impl Fn(S) -> S)
    -> S;

    /// A function of `0..count` (at most 40), worked out beforehand where numbers are values.
    fn tabulated(count: u32, function: impl Fn(Self::Index) -> Self::Real) -> impl Fn(Self::Index) -> Self::Real;

    /// `function` of each of the lanes, one after the other: side by side they would make a kernel as many times as long,
    /// which takes as many times longer to compile. `[result][lane]`.
    fn each_lane<const L: usize, const R: usize>(
        name: &'static CStr,
        lanes: [Self::Real; L],
        active: Self::Mask,
        function: impl Fn(Self::Real) -> [Self::Real; R],
    ) -> [[Self::Real; L]; R];
}

/// Numbers by value, one or several side by side.
pub(crate) trait Values: Numbers {
    /// How many.
    const COUNT: usize;
    /// Each from its place, in double precision.
    fn pack(of: impl Fn(usize) -> f64) -> Self::Real;
    /// One of several indices.
    fn lane(of: Self::Index, lane: usize) -> usize;
    /// The sum of all.
    fn total(of: Self::Real) -> f64;
}

/// Most that [`Values`] have side by side.
pub(crate) const VALUES_MAX: usize = 4;

/// [`Numbers::each_lane`] of numbers by value; zeros unless any is active.
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
