//! Traced numbers: arithmetic on [`Var`] is recorded by Dr.Jit, so evaluators generic over [`Numbers`] become part of a
//! kernel.
//!
//! A [`Var`] is the index of a Dr.Jit variable and can be copied; the [`Scope`] that created the variable owns it
//! (scope.rs). The lifetime `'s` ties a handle to its scope. The functions of jit.rs record one operation each. Nothing
//! is differentiable.

use super::jit;
use super::scope::{self, Brand, Owned, Scope};
use std::ffi::CStr;
use std::marker::PhantomData;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Shl, Shr, Sub};
use std::panic::resume_unwind;
use sunbeam::numeric::{Index, Mask, Number, Numbers, Real, State};

/// The family of traced numbers of one scope.
#[derive(Clone, Copy)]
pub(crate) struct Traced<'s>(Brand<'s>);

/// A variable whose elements are `T`: `f32`, `f64`, `u32` or `bool`.
pub(crate) struct Var<'s, T> {
    /// Index of the variable; 0 after an error, which the scope reports at its end.
    index: u32,
    kind: PhantomData<T>,
    brand: Brand<'s>,
}

/// An array of 32-bit table data in the backend's memory.
#[derive(Clone, Copy)]
pub(crate) struct WordsVar<'s>(u32, Brand<'s>);

/// Element types of variables.
pub(crate) trait Element: Copy {
    /// A new variable with one value.
    fn constant(backend: u32, value: Self) -> u32;
}

macro_rules! elements {
    ($($t:ident $constant:ident)+) => {$(
        impl Element for $t {
            fn constant(backend: u32, value: Self) -> u32 {
                jit::$constant(backend, value)
            }
        }
    )+};
}
elements! { f32 constant_f32 f64 constant_f64 u32 constant_u32 bool constant_bool }

impl<T> Clone for Var<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Var<'_, T> {}

impl<'s, T: Element> Var<'s, T> {
    /// A variable of elements `T` that the caller keeps alive until the scope ends. Index 0 becomes the scope's error.
    pub(crate) fn borrowed(_: Scope<'s>, index: u32) -> Self {
        if index == 0 {
            jit::keep_error("an argument is an empty array");
        }
        Self { index, kind: PhantomData, brand: PhantomData }
    }

    /// A reference that survives the scope.
    pub(crate) fn owned(self, scope: Scope<'s>) -> Owned {
        Owned::of(scope, self.index)
    }

    /// The handle of a new variable, which the open scope takes over.
    fn own(index: u32) -> Self {
        Self { index: scope::own(index), kind: PhantomData, brand: PhantomData }
    }

    /// A constant for the backend of the open scope.
    fn constant(value: T) -> Self {
        Self::own(scope::backend().map_or(0, |backend| T::constant(backend, value)))
    }
}

impl<'s> WordsVar<'s> {
    /// An array of `u32` that the caller keeps alive until the scope ends. An array that is never read may be 0.
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

macro_rules! binary {
    ($($t:ident: $trait:ident $method:ident $function:ident;)+) => {$(
        impl $trait for Var<'_, $t> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self::own(jit::$function(self.index, other.index))
            }
        }
    )+};
}
binary! {
    f32: Add add add; f32: Sub sub sub; f32: Mul mul mul; f32: Div div div;
    f64: Add add add; f64: Sub sub sub; f64: Mul mul mul; f64: Div div div;
    u32: Add add add; u32: Sub sub sub; u32: Mul mul mul;
    u32: BitAnd bitand bit_and; u32: BitOr bitor bit_or;
    bool: BitAnd bitand bit_and; bool: BitOr bitor bit_or;
}

macro_rules! shifts {
    ($($trait:ident $method:ident $function:ident)+) => {$(
        impl $trait<u32> for Var<'_, u32> {
            type Output = Self;
            fn $method(self, by: u32) -> Self {
                Self::own(jit::$function(self.index, Self::constant(by).index))
            }
        }
    )+};
}
shifts! { Shl shl shl Shr shr shr }

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

macro_rules! reals {
    ($($t:ident)+) => {$(
        impl Neg for Var<'_, $t> {
            type Output = Self;
            fn neg(self) -> Self {
                Self::own(jit::neg(self.index))
            }
        }

        impl Real for Var<'_, $t> {
            fn lit(value: f64) -> Self {
                Self::constant(value as $t)
            }
            fn fma(self, b: Self, c: Self) -> Self {
                Self::own(jit::fma(self.index, b.index, c.index))
            }
            reals! { @unary abs sqrt floor ceil exp2 log2 }
        }
    )+};
    (@unary $($function:ident)+) => {$(
        fn $function(self) -> Self {
            Self::own(jit::$function(self.index))
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

    // C++ records the loop once. It calls back into `Run` for the condition and one step, on placeholder variables.
    fn while_loop<S: State>(
        name: &'static CStr,
        state: S,
        go_on: impl Fn(S) -> Self::Mask,
        step: impl Fn(S) -> S,
    ) -> S {
        let mut run = Run { state, go_on, step, first: scope::owned() };
        let mut steps = jit::Loop::new(&mut run);
        // SAFETY: the name is static and ends with a zero.
        let done = unsafe { jit::run_loop(scope::backend().unwrap_or(0), name.as_ptr(), &mut steps) };
        if let Some(payload) = steps.panicked() {
            resume_unwind(payload);
        }
        if !done {
            run.state.each(&mut |index| *index = 0);
        }
        run.state
    }

    fn tabulated(_: u32, function: impl Fn(Self::Index) -> Self::Real) -> impl Fn(Self::Index) -> Self::Real {
        function
    }

    // Records `function` once, in a loop over the inputs, instead of L times: kernels stay small.
    fn map_each<const L: usize, const R: usize>(
        name: &'static CStr,
        inputs: [Self::Real; L],
        active: Self::Mask,
        function: impl Fn(Self::Real) -> [Self::Real; R],
    ) -> [[Self::Real; L]; R] {
        let index = <Self::Index as Index>::lit;
        if L == 1 {
            let zero = Self::Real::lit(0.0);
            return function(inputs[0]).map(|value| [Self::Real::select(active, value, zero); L]);
        }
        // Equality of unsigned integers.
        let equals = |k: Self::Index, i: usize| k.le(index(i as u32)) & index(i as u32).le(k);
        let zeros = [[Self::Real::lit(0.0); L]; R];
        let (_, results) = Self::while_loop(
            name,
            (index(0), zeros),
            |(k, _)| active & k.lt(index(L as u32)),
            |(k, mut results)| {
                let input = (1..L).fold(inputs[0], |input, i| Self::Real::select(equals(k, i), inputs[i], input));
                for (result, value) in results.iter_mut().zip(function(input)) {
                    for (i, entry) in result.iter_mut().enumerate() {
                        *entry = Self::Real::select(equals(k, i), value, *entry);
                    }
                }
                (k + index(1), results)
            },
        );
        results
    }
}

/// A loop that is being recorded.
struct Run<S, C, B> {
    state: S,
    /// The mask of lanes that take another step.
    go_on: C,
    /// The next state.
    step: B,
    /// Number of variables that the scope owned before the loop. Later ones belong to the last step and are released
    /// when the state is replaced.
    first: usize,
}

impl<'s, S: State, C: Fn(S) -> Var<'s, bool>, B: Fn(S) -> S> jit::Steps for Run<S, C, B> {
    fn read(&self, visit: &mut dyn FnMut(u32)) {
        let mut state = self.state;
        state.each(&mut |index| visit(*index));
    }

    fn write(&mut self, indices: &[u32]) {
        let last = scope::owned();
        let mut new = indices.iter();
        self.state.each(&mut |index| *index = new.next().map_or(0, |&i| scope::own(jit::retain(i))));
        scope::release(self.first..last);
    }

    fn condition(&mut self) -> u32 {
        (self.go_on)(self.state).index
    }

    fn step(&mut self) {
        self.state = (self.step)(self.state);
    }
}

#[cfg(test)]
mod tests;
