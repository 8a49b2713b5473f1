//! Traced numbers: Dr.Jit records each operation on a [`Var`]. An evaluator that is generic over [`Numbers`] (a
//! family of numbers: reals, integers, masks, and the table data that they index) becomes part of a kernel when it is
//! called with the family [`Traced`].
//!
//! A [`Var`] is a handle that can be copied: the index of a Dr.Jit variable. The variable belongs to the open scope
//! (scope.rs), and the lifetime `'s` ties the handle to this scope. Each operator below calls the function of jit.rs
//! that records it. After an error the index is 0, and operations on it give 0 again. Nothing is differentiable.

use super::jit;
use super::scope::{self, Brand, Owned, Scope};
use std::ffi::CStr;
use std::marker::PhantomData;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Shl, Shr, Sub};
use std::panic::resume_unwind;
use sunbeam::numeric::{Index, Mask, Number, Numbers, Real, State};

/// Family of traced numbers in the scope `'s`. The [`Brand`], a marker without data, ties them to it.
#[derive(Clone, Copy)]
pub(crate) struct Traced<'s>(Brand<'s>);

/// A variable whose elements are of the type `T`: `f32`, `f64`, `u32` or `bool`. Its elements are the lanes of the
/// kernel.
pub(crate) struct Var<'s, T> {
    /// Index of the variable; 0 after an error, which [`scope::trace`] reports.
    index: u32,
    kind: PhantomData<T>,
    brand: Brand<'s>,
}

/// Handle of table data: the index of a Dr.Jit variable, an array of `u32` in the backend's memory.
#[derive(Clone, Copy)]
pub(crate) struct WordsVar<'s>(u32, Brand<'s>);

/// Element types of variables.
pub(crate) trait Element: Copy {
    /// Index of a new variable with one element, for a backend (a `JitBackend`).
    fn constant(backend: u32, value: Self) -> u32;
}

/// Implements [`Element`] for a type by a function of jit.rs.
macro_rules! elements {
    ($($element:ident => $constant:ident,)+) => {$(
        impl Element for $element {
            fn constant(backend: u32, value: Self) -> u32 {
                jit::$constant(backend, value)
            }
        }
    )+};
}
elements! {
    f32 => constant_f32,
    f64 => constant_f64,
    u32 => constant_u32,
    bool => constant_bool,
}

// Not derived: a derived implementation would require `T: Clone` and `T: Copy`.
impl<T> Clone for Var<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Var<'_, T> {}

impl<'s, T: Element> Var<'s, T> {
    /// Handle of a variable that the caller keeps alive until the scope ends. Its elements must be of the type `T`.
    /// Index 0, an empty array, is an error.
    pub(crate) fn borrowed(_: Scope<'s>, index: u32) -> Self {
        if index == 0 {
            jit::keep_error("an argument is an empty array");
        }
        Self { index, kind: PhantomData, brand: PhantomData }
    }

    /// A new reference, which outlives the scope.
    pub(crate) fn owned(self, scope: Scope<'s>) -> Owned {
        Owned::of(scope, self.index)
    }

    /// Handle of the result of an operation, whose reference the open scope takes over. Without an open scope its index
    /// is 0.
    fn own(index: u32) -> Self {
        Self { index: scope::own(index), kind: PhantomData, brand: PhantomData }
    }

    /// A constant for the open scope's backend.
    fn constant(value: T) -> Self {
        Self::own(scope::backend().map_or(0, |backend| T::constant(backend, value)))
    }
}

impl<'s> WordsVar<'s> {
    /// Handle of an array that the caller keeps alive until the scope ends. The index may be 0 if the array is never
    /// read.
    pub(crate) fn borrowed(_: Scope<'s>, index: u32) -> Self {
        Self(index, PhantomData)
    }
}

impl<T: Element> State for Var<'_, T> {
    const COUNT: usize = 1;

    fn each(&mut self, visit: &mut dyn FnMut(&mut u32)) {
        visit(&mut self.index);
    }
}

impl Mask for Var<'_, bool> {}

/// Implements a binary operator for some element types: `Trait::method => function of jit.rs, for types;`.
macro_rules! binary_operators {
    ($($trait:ident::$method:ident => $function:ident, for $($element:ident)+;)+) => {$($(
        impl $trait for Var<'_, $element> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self::own(jit::$function(self.index, other.index))
            }
        }
    )+)+};
}
binary_operators! {
    Add::add => add, for f32 f64 u32;
    Sub::sub => sub, for f32 f64 u32;
    Mul::mul => mul, for f32 f64 u32;
    Div::div => div, for f32 f64;
    BitAnd::bitand => bit_and, for u32 bool;
    BitOr::bitor => bit_or, for u32 bool;
}

impl Shl<u32> for Var<'_, u32> {
    type Output = Self;
    fn shl(self, by: u32) -> Self {
        Self::own(jit::shl(self.index, Self::constant(by).index))
    }
}

impl Shr<u32> for Var<'_, u32> {
    type Output = Self;
    fn shr(self, by: u32) -> Self {
        Self::own(jit::shr(self.index, Self::constant(by).index))
    }
}

impl Not for Var<'_, bool> {
    type Output = Self;
    fn not(self) -> Self {
        Self::own(jit::bit_not(self.index))
    }
}

impl<'s, T: Element> Number for Var<'s, T>
where
    Self: Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>,
{
    type Mask = Var<'s, bool>;

    fn lt(self, other: Self) -> Self::Mask {
        Var::own(jit::lt(self.index, other.index))
    }
    fn le(self, other: Self) -> Self::Mask {
        Var::own(jit::le(self.index, other.index))
    }
    fn min(self, other: Self) -> Self {
        Self::own(jit::min(self.index, other.index))
    }
    fn max(self, other: Self) -> Self {
        Self::own(jit::max(self.index, other.index))
    }
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self::own(jit::select(mask.index, yes.index, no.index))
    }
}

/// Defines methods without arguments by the functions of jit.rs with the same names.
macro_rules! unary_methods {
    ($($function:ident)+) => {$(
        fn $function(self) -> Self {
            Self::own(jit::$function(self.index))
        }
    )+};
}

/// Implements [`Real`] for variables of a type of floating-point numbers.
macro_rules! reals {
    ($($element:ident)+) => {$(
        impl Neg for Var<'_, $element> {
            type Output = Self;
            unary_methods! { neg }
        }

        impl Real for Var<'_, $element> {
            fn lit(value: f64) -> Self {
                Self::constant(value as $element)
            }
            fn fma(self, b: Self, c: Self) -> Self {
                Self::own(jit::fma(self.index, b.index, c.index))
            }
            unary_methods! { abs sqrt floor ceil exp2 log2 }
        }
    )+};
}
reals! { f32 f64 }

impl Index for Var<'_, u32> {
    fn lit(value: u32) -> Self {
        Self::constant(value)
    }
}

impl<'s> Numbers for Traced<'s> {
    type Real = Var<'s, f32>;
    type Double = Var<'s, f64>;
    type Index = Var<'s, u32>;
    type Mask = Var<'s, bool>;
    type Words = WordsVar<'s>;

    fn mask(value: bool) -> Self::Mask {
        Var::constant(value)
    }
    // Reads `W` words from word `W·at` of the table on, and zeros where the mask is false.
    fn gather<const W: usize>(table: WordsVar<'s>, at: Self::Index, mask: Self::Mask) -> [Self::Index; W] {
        let mut indices = [0; W];
        jit::gather(table.0, at.index, mask.index, &mut indices);
        indices.map(Var::own)
    }
    fn from_bits(bits: Self::Index) -> Self::Real {
        Var::own(jit::f32_from_bits(bits.index))
    }
    fn widen(x: Self::Real) -> Self::Double {
        Var::own(jit::to_f64(x.index))
    }
    fn narrow(x: Self::Double) -> Self::Real {
        Var::own(jit::to_f32(x.index))
    }
    fn real(i: Self::Index) -> Self::Real {
        Var::own(jit::to_f32(i.index))
    }
    fn index(x: Self::Real) -> Self::Index {
        Var::own(jit::to_u32(x.index))
    }
    fn index_of_double(x: Self::Double) -> Self::Index {
        Var::own(jit::to_u32(x.index))
    }

    // Applies `step` to the state while `go_on` is true, in each lane separately. `name` labels the loop in Dr.Jit.
    //
    // Dr.Jit calls back into `RecordedLoop` for the condition and for a step. For a symbolic loop it does so once, with
    // placeholder variables as state. For an evaluated loop it does so in each iteration. After an error the state's
    // indices are 0.
    fn while_loop<S: State>(
        name: &'static CStr,
        state: S,
        go_on: impl Fn(S) -> Self::Mask,
        step: impl Fn(S) -> S,
    ) -> S {
        let mut recorded = RecordedLoop { state, go_on, step, owned_before: scope::owned_count() };
        let mut callbacks = jit::Loop::new(&mut recorded);
        // SAFETY: the name is static and ends with a zero.
        let succeeded = unsafe { jit::run_loop(scope::backend().unwrap_or(0), name.as_ptr(), &mut callbacks) };
        if let Some(payload) = callbacks.panicked() {
            resume_unwind(payload);
        }
        if !succeeded {
            recorded.state.each(&mut |index| *index = 0);
        }
        recorded.state
    }

    // Families of plain numbers tabulate `function` over the integers below the ignored count. Here the kernel computes
    // it at each use.
    fn tabulated(_: u32, function: impl Fn(Self::Index) -> Self::Real) -> impl Fn(Self::Index) -> Self::Real {
        function
    }

    // Calls `function` on L inputs, L > 0. Records it once, in a loop over the inputs, instead of L times: kernels stay
    // small. One input needs no loop. `results[r][l]` is result r of input l, and zero in lanes that are not active.
    fn map_each<const L: usize, const R: usize>(
        name: &'static CStr,
        inputs: [Self::Real; L],
        active: Self::Mask,
        function: impl Fn(Self::Real) -> [Self::Real; R],
    ) -> [[Self::Real; L]; R] {
        let int = <Self::Index as Index>::lit;
        let zero = Self::Real::lit(0.0);
        if L == 1 {
            return function(inputs[0]).map(|value| [Self::Real::select(active, value, zero); L]);
        }
        // Equality, which the trait `Number` lacks.
        let equals = |k: Self::Index, i: usize| k.le(int(i as u32)) & int(i as u32).le(k);
        let (_, results) = Self::while_loop(
            name,
            (int(0), [[zero; L]; R]),
            |(k, _)| active & k.lt(int(L as u32)),
            |(k, mut results)| {
                // Reads and writes position k of arrays by selection, because k is a variable.
                let input = (1..L).fold(inputs[0], |input, i| Self::Real::select(equals(k, i), inputs[i], input));
                for (result, value) in results.iter_mut().zip(function(input)) {
                    for (i, entry) in result.iter_mut().enumerate() {
                        *entry = Self::Real::select(equals(k, i), value, *entry);
                    }
                }
                (k + int(1), results)
            },
        );
        results
    }
}

/// A loop that Dr.Jit is recording or running.
struct RecordedLoop<S, C, B> {
    state: S,
    /// Gives the mask of lanes that take another step.
    go_on: C,
    /// Gives the next state.
    step: B,
    /// Number of variables that the scope owned before the loop. Later variables belong to the latest step and are
    /// released when the state is replaced.
    owned_before: usize,
}

impl<'s, S: State, C: Fn(S) -> Var<'s, bool>, B: Fn(S) -> S> jit::LoopParts for RecordedLoop<S, C, B> {
    fn read(&self, visit: &mut dyn FnMut(u32)) {
        // A copy, because `each` takes a mutable reference.
        let mut state = self.state;
        state.each(&mut |index| visit(*index));
    }

    fn write(&mut self, indices: &[u32]) {
        let owned_by_step = self.owned_before..scope::owned_count();
        let mut new_indices = indices.iter();
        // Dr.Jit lends the new variables, so the scope takes a reference of its own.
        self.state.each(&mut |index| *index = new_indices.next().map_or(0, |&new| scope::own(jit::retain(new))));
        scope::release(owned_by_step);
    }

    fn condition(&mut self) -> u32 {
        (self.go_on)(self.state).index
    }

    fn body(&mut self) {
        self.state = (self.step)(self.state);
    }
}

#[cfg(test)]
mod tests;
