//! Single numbers by value, in single or double precision: the traits of mod.rs, which documents their functions, for
//! `f32`, `f64`, `u32` and `bool`.

use super::{Index, Mask, Number, Numbers, Real, State, Values};
use std::ffi::CStr;
use std::marker::PhantomData;

/// Family of single numbers of type `F`, `f32` or `f64`. Table data lives for `'a`.
///
/// ```
/// use sunbeam::numeric::{Numbers, Plain};
///
/// let words = [10, 11, 12, 13];
/// assert_eq!(Plain::<f64>::gather::<2>(&words, 1, true), [12, 13]);
/// assert_eq!(Plain::<f64>::gather::<2>(&words, 1, false), [0, 0]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Plain<'a, F>(PhantomData<(&'a (), F)>);

/// Implements [`State`] for numbers by value. They have no variables of Dr.Jit, so `COUNT` is 0 and `each` visits
/// nothing.
macro_rules! states {
    ($($t:ty)+) => {$(
        impl State for $t {
            const COUNT: usize = 0;
            #[inline(always)]
            fn each(&mut self, _: &mut dyn FnMut(&mut u32)) {}
        }
    )+};
}
states! { f32 f64 u32 bool }

impl Mask for bool {}

/// Items of [`Number`], equal for all types.
macro_rules! number_items {
    () => {
        type Mask = bool;
        #[inline(always)]
        fn lt(self, other: Self) -> bool {
            self < other
        }
        #[inline(always)]
        fn le(self, other: Self) -> bool {
            self <= other
        }
        // `f32::min` takes longer, since it treats NaN specially. Here results with NaN are unspecified.
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            if self < other { self } else { other }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            if self > other { self } else { other }
        }
        #[inline(always)]
        fn select(mask: bool, yes: Self, no: Self) -> Self {
            if mask { yes } else { no }
        }
    };
}

/// Implements [`Number`] and [`Real`] for the type `$t`, and [`Numbers`] for its family. `$whole` is the signed integer
/// type of equal size. It represents every whole number below `1/EPSILON`, the size from which on all floating-point
/// numbers are whole.
macro_rules! reals {
    ($($t:ident with $whole:ident)+) => {$(
        impl Number for $t {
            number_items!();
        }

        impl Real for $t {
            #[inline(always)]
            fn lit(value: f64) -> Self {
                value as $t
            }
            // `mul_add` is a library call where the build's target lacks the instruction.
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                if cfg!(target_feature = "fma") { self.mul_add(b, c) } else { self * b + c }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $t::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                // `floor` is a library call where the build's target lacks the instruction.
                if cfg!(all(target_arch = "x86_64", not(target_feature = "sse4.1"))) {
                    let towards_zero = self as $whole as $t;
                    let floor = if towards_zero > self { towards_zero - 1.0 } else { towards_zero };
                    // All numbers from 1/EPSILON on are whole, and may exceed the integer's range.
                    if $t::abs(self) < 1.0 / $t::EPSILON { floor } else { self }
                } else {
                    $t::floor(self)
                }
            }
            #[inline(always)]
            fn ceil(self) -> Self {
                -Real::floor(-self)
            }
            #[inline(always)]
            fn exp2(self) -> Self {
                $t::exp2(self)
            }
            #[inline(always)]
            fn log2(self) -> Self {
                $t::log2(self)
            }
        }

        impl<'a> Numbers for Plain<'a, $t> {
            type Real = $t;
            type Double = f64;
            type Index = u32;
            type Mask = bool;
            type Words = &'a [u32];

            #[inline(always)]
            fn mask(value: bool) -> bool {
                value
            }
            #[inline(always)]
            fn gather<const W: usize>(table: &'a [u32], at: u32, mask: bool) -> [u32; W] {
                // Only a position whose mask is false may lie beyond the table.
                match table.get(W * at as usize..).and_then(|rest| rest.first_chunk()) {
                    Some(words) if mask => *words,
                    _ => [0; W],
                }
            }
            #[inline(always)]
            fn from_bits(bits: u32) -> $t {
                f32::from_bits(bits) as $t
            }
            #[inline(always)]
            fn widen(x: $t) -> f64 {
                x as f64
            }
            #[inline(always)]
            fn narrow(x: f64) -> $t {
                x as $t
            }
            #[inline(always)]
            fn real(i: u32) -> $t {
                i as $t
            }
            #[inline(always)]
            fn index(x: $t) -> u32 {
                x as u32
            }
            #[inline(always)]
            fn index_of_double(x: f64) -> u32 {
                x as u32
            }
            #[inline(always)]
            fn while_loop<S: State>(
                _name: &'static CStr,
                mut state: S,
                go_on: impl Fn(S) -> bool,
                step: impl Fn(S) -> S,
            ) -> S {
                while go_on(state) {
                    state = step(state);
                }
                state
            }
            #[inline(always)]
            fn tabulated(count: u32, function: impl Fn(u32) -> $t) -> impl Fn(u32) -> $t {
                debug_assert!(count as usize <= super::TABULATED_MAX);
                let mut values = [0.0; super::TABULATED_MAX];
                for (i, value) in values.iter_mut().enumerate().take(count as usize) {
                    *value = function(i as u32);
                }
                move |i| values[i as usize]
            }
            #[inline(always)]
            fn map_each<const L: usize, const R: usize>(
                _name: &'static CStr,
                inputs: [$t; L],
                active: bool,
                function: impl Fn($t) -> [$t; R],
            ) -> [[$t; L]; R] {
                super::map_by_value(inputs, active, function)
            }
        }
    )+};
}
reals! { f32 with i32 f64 with i64 }

impl Values for Plain<'_, f64> {
    const COUNT: usize = 1;
    #[inline(always)]
    fn pack(lane: impl Fn(usize) -> f64) -> f64 {
        lane(0)
    }
    #[inline(always)]
    fn lane(index: u32, _: usize) -> usize {
        index as usize
    }
    #[inline(always)]
    fn total(number: f64) -> f64 {
        number
    }
}

impl Number for u32 {
    number_items!();
}

impl Index for u32 {
    #[inline(always)]
    fn lit(value: u32) -> Self {
        value
    }
}
