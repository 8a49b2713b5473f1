//! Four single-precision numbers by value, one in each *lane* of a SIMD vector: the wavelengths of a ray, or
//! directions of an integral.
//!
//! The traits of mod.rs, which documents their functions, are implemented for the vector types of the crate `wide`.
//! Functions that these types lack are computed lane by lane. In the types `f32x4`, `f64x4` and `u32x4` the 4 is
//! [`LANES`].

use super::math::polynomial;
use super::{Index, Mask, Number, Numbers, Real, State, Values};
use bytemuck::cast;
use std::ffi::CStr;
use std::marker::PhantomData;
use wide::{CmpLe, CmpLt, f32x4, f64x4, i32x4, u32x4};

/// Number of lanes.
pub(super) const LANES: usize = 4;

/// Family of four single-precision numbers side by side, one in each lane. Table data lives for `'a`.
///
/// ```
/// use sunbeam::numeric::{Lanes, Real};
///
/// let lanes = Lanes::each([0.0, 1.0, 2.0, 3.0]);
/// assert_eq!(lanes.fma(Lanes::all(2.0), Lanes::all(1.0)).to_array(), [1.0, 3.0, 5.0, 7.0]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Lanes<'a>(PhantomData<&'a ()>);

/// Truth values of four lanes, one word each: all bits of a word are set for true, none for false.
#[derive(Clone, Copy, Debug)]
pub struct LaneMask(u32x4);

impl LaneMask {
    /// Whether the mask is true in any lane.
    fn any(self) -> bool {
        self.0.any()
    }

    /// The mask with the type of a comparison of `f32x4`: 32 equal bits per lane.
    #[inline(always)]
    fn to_single(self) -> f32x4 {
        cast(self.0)
    }

    /// Inverse of [`LaneMask::to_single`].
    #[inline(always)]
    fn from_single(mask: f32x4) -> Self {
        Self(cast(mask))
    }

    /// The mask with the type of a comparison of `f64x4`: 64 equal bits per lane.
    #[inline(always)]
    fn to_double(self) -> f64x4 {
        cast(self.0.to_array().map(|lane| u64::from(lane) | u64::from(lane) << 32))
    }

    /// Inverse of [`LaneMask::to_double`].
    #[inline(always)]
    fn from_double(mask: f64x4) -> Self {
        let lanes: [u64; LANES] = cast(mask);
        Self(lanes.map(|lane| lane as u32).into())
    }
}

impl std::ops::BitAnd for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl std::ops::BitOr for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl std::ops::Not for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0 ^ u32x4::splat(u32::MAX))
    }
}

impl Mask for LaneMask {}

/// Lanes are numbers by value: `COUNT` is 0, and `each` visits nothing, since they have no variables of Dr.Jit.
impl State for LaneMask {
    const COUNT: usize = 0;
    #[inline(always)]
    fn each(&mut self, _: &mut dyn FnMut(&mut u32)) {}
    #[inline(always)]
    fn keep_lanes(&mut self, old: Self, changed: LaneMask) {
        *self = (*self & changed) | (old & !changed);
    }
}

/// Implements [`State`] for vectors of numbers, with `COUNT` and `each` as for [`LaneMask`].
macro_rules! states {
    ($($t:ty)+) => {$(
        impl State for $t {
            const COUNT: usize = 0;
            #[inline(always)]
            fn each(&mut self, _: &mut dyn FnMut(&mut u32)) {}
            #[inline(always)]
            fn keep_lanes(&mut self, old: Self, changed: LaneMask) {
                *self = Self::select(changed, *self, old);
            }
        }
    )+};
}
states! { f32x4 f64x4 u32x4 }

/// Implements [`Number`] for a type of real numbers, with the conversions of its masks from and to [`LaneMask`].
macro_rules! real_numbers {
    ($($t:ident: $from:ident $to:ident;)+) => {$(
        impl Number for $t {
            type Mask = LaneMask;
            #[inline(always)]
            fn lt(self, other: Self) -> LaneMask {
                LaneMask::$from(self.cmp_lt(other))
            }
            #[inline(always)]
            fn le(self, other: Self) -> LaneMask {
                LaneMask::$from(self.cmp_le(other))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.fast_min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.fast_max(other)
            }
            #[inline(always)]
            fn select(mask: LaneMask, yes: Self, no: Self) -> Self {
                mask.$to().blend(yes, no)
            }
        }
    )+};
}
real_numbers! { f32x4: from_single to_single; f64x4: from_double to_double; }

impl Number for u32x4 {
    type Mask = LaneMask;
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask {
        LaneMask(self.cmp_lt(other))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask {
        !LaneMask(self.cmp_gt(other))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    #[inline(always)]
    fn select(mask: LaneMask, yes: Self, no: Self) -> Self {
        (yes & mask.0) | (no & (!mask).0)
    }
}

/// Coefficients of the Taylor series of 2ˣ, `(ln 2)ⁿ/n!` for n = 0 to 7. For x in [−0.5, 0.5] the remainder is below
/// half a unit in the last place of single precision.
const EXP2_TAYLOR: [f64; 8] = [
    1.0,
    std::f64::consts::LN_2,
    0.240_226_506_959_100_7,
    0.055_504_108_664_821_58,
    0.009_618_129_107_628_477,
    0.001_333_355_814_642_844_3,
    0.000_154_035_303_933_816_1,
    0.000_015_252_733_804_059_84,
];

/// Items of [`Real`] that are equal for `f32x4` and `f64x4`, with `$t` the type of one lane.
macro_rules! real_items {
    ($t:ident) => {
        #[inline(always)]
        fn lit(value: f64) -> Self {
            Self::splat(value as $t)
        }
        #[inline(always)]
        fn fma(self, b: Self, c: Self) -> Self {
            // Not fused: the product is rounded, too.
            self * b + c
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self::abs(self)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self::sqrt(self)
        }
        #[inline(always)]
        fn log2(self) -> Self {
            self.to_array().map($t::log2).into()
        }
    };
}

impl Real for f32x4 {
    real_items!(f32);
    #[inline(always)]
    fn floor(self) -> Self {
        let towards_zero = f32x4::from_i32x4(self.fast_trunc_int());
        // `&` with the mask's bits leaves 1.0 where the truncated number exceeds the number, else 0.
        let floor = towards_zero - (self.lt(towards_zero).to_single() & Self::splat(1.0));
        // All numbers from 1/EPSILON on are whole, and may exceed an integer of 32 bits.
        Self::select(f32x4::abs(self).lt(Self::splat(1.0 / f32::EPSILON)), floor, self)
    }
    #[inline(always)]
    fn ceil(self) -> Self {
        -Real::floor(-self)
    }
    /// Zero below −126, where results would be subnormal, and for NaN. Infinite from 127.5 on.
    #[inline(always)]
    fn exp2(self) -> Self {
        let is_normal = Self::splat(-126.0).le(self);
        let x = Number::min(Number::max(self, Self::splat(-126.0)), Self::splat(127.5));
        // 2ˣ = 2^whole · 2^(x − whole), with the nearest whole number. `mantissa` is the second factor, 0.7 to 1.4.
        let whole = Real::floor(x + Self::splat(0.5));
        let mantissa = polynomial(x - whole, &EXP2_TAYLOR);
        // 2^whole: the exponent bits of a single-precision number, above 23 bits of mantissa, hold `whole` plus 127.
        let power = (cast::<i32x4, u32x4>(whole.fast_trunc_int()) + u32x4::splat(127)) << 23_u32;
        Self::select(is_normal, mantissa * cast::<u32x4, f32x4>(power), Self::splat(0.0))
    }
}

impl Real for f64x4 {
    real_items!(f64);
    #[inline(always)]
    fn floor(self) -> Self {
        self.to_array().map(Real::floor).into()
    }
    #[inline(always)]
    fn ceil(self) -> Self {
        self.to_array().map(Real::ceil).into()
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        self.to_array().map(f64::exp2).into()
    }
}

impl Index for u32x4 {
    #[inline(always)]
    fn lit(value: u32) -> Self {
        Self::splat(value)
    }
}

impl Lanes<'_> {
    /// The number `x` in all lanes.
    #[inline(always)]
    pub fn all(x: f32) -> f32x4 {
        f32x4::splat(x)
    }

    /// The numbers `x[i]` in the lanes i.
    #[inline(always)]
    pub fn each(x: [f32; LANES]) -> f32x4 {
        x.into()
    }
}

impl<'a> Numbers for Lanes<'a> {
    type Real = f32x4;
    type Double = f64x4;
    /// Values that are converted from or to `Real` must stay below 2³¹: these conversions are those of signed integers.
    type Index = u32x4;
    type Mask = LaneMask;
    type Words = &'a [u32];

    #[inline(always)]
    fn mask(value: bool) -> LaneMask {
        LaneMask(u32x4::splat(if value { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn gather<const W: usize>(table: &'a [u32], at: u32x4, mask: LaneMask) -> [u32x4; W] {
        let (at, mask) = (at.to_array(), mask.0.to_array());
        let packets: [[u32; W]; LANES] = std::array::from_fn(|lane| {
            let start = W * at[lane] as usize;
            // The table is an array of packets of W words. The position of a lane whose mask is false may lie beyond
            // it.
            match table.get(start..start + W).and_then(|rest| rest.first_chunk()) {
                Some(words) if mask[lane] != 0 => *words,
                _ => [0; W],
            }
        });
        std::array::from_fn(|word| packets.map(|packet| packet[word]).into())
    }
    #[inline(always)]
    fn from_bits(bits: u32x4) -> f32x4 {
        cast(bits)
    }
    #[inline(always)]
    fn widen(x: f32x4) -> f64x4 {
        x.to_array().map(f64::from).into()
    }
    #[inline(always)]
    fn narrow(x: f64x4) -> f32x4 {
        x.to_array().map(|x| x as f32).into()
    }
    #[inline(always)]
    fn real(i: u32x4) -> f32x4 {
        f32x4::from_i32x4(cast(i))
    }
    #[inline(always)]
    fn index(x: f32x4) -> u32x4 {
        cast(x.fast_trunc_int())
    }
    #[inline(always)]
    fn index_of_double(x: f64x4) -> u32x4 {
        x.to_array().map(|x| x as u32).into()
    }
    #[inline(always)]
    fn while_loop<S: State>(
        _name: &'static CStr,
        mut state: S,
        go_on: impl Fn(S) -> LaneMask,
        step: impl Fn(S) -> S,
    ) -> S {
        loop {
            let more = go_on(state);
            if !more.any() {
                return state;
            }
            let old = state;
            state = step(old);
            state.keep_lanes(old, more);
        }
    }
    #[inline(always)]
    fn tabulated(count: u32, function: impl Fn(u32x4) -> f32x4) -> impl Fn(u32x4) -> f32x4 {
        let mut values = [f32x4::splat(0.0); super::TABULATED_MAX];
        for (i, value) in values.iter_mut().enumerate().take(count as usize) {
            *value = function(u32x4::splat(i as u32));
        }
        // By the contract of `Numbers::tabulated`, lanes that are still in the caller's loop have equal arguments.
        // Lanes that have left it have smaller ones, and discard their results. So the largest argument serves all.
        move |i| {
            let largest = i.to_array().into_iter().fold(0, Ord::max);
            values[largest as usize]
        }
    }
    #[inline(always)]
    fn map_each<const L: usize, const R: usize>(
        _name: &'static CStr,
        inputs: [f32x4; L],
        active: LaneMask,
        function: impl Fn(f32x4) -> [f32x4; R],
    ) -> [[f32x4; L]; R] {
        // Idle lanes are computed along with the active ones; their results are arbitrary.
        super::map_by_value(inputs, active.any(), function)
    }
}

impl Values for Lanes<'_> {
    const COUNT: usize = LANES;
    #[inline(always)]
    fn pack(lane: impl Fn(usize) -> f64) -> f32x4 {
        Self::each(std::array::from_fn(|i| lane(i) as f32))
    }
    #[inline(always)]
    fn lane(index: u32x4, lane: usize) -> usize {
        index.to_array()[lane] as usize
    }
    #[inline(always)]
    fn total(number: f32x4) -> f64 {
        number.to_array().into_iter().map(f64::from).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;

    /// Numbers of both signs over 80 binary orders of magnitude, with whole numbers and halves.
    fn numbers() -> Vec<f32> {
        let sizes = (-40..40).flat_map(|e| [1.0, 1.5, 1.999_999_9].map(|x: f32| x * 2f32.powi(e)));
        let all: Vec<f32> = sizes.chain([0.0, 0.5, 2.5, 100.25]).flat_map(|x| [x, -x]).collect();
        assert_eq!(all.len() % LANES, 0);
        all
    }

    #[test]
    fn lanes_match_scalar_functions() {
        for four in numbers().chunks_exact(LANES).map(|four| <[f32; LANES]>::try_from(four).unwrap()) {
            let lanes = Lanes::each(four);
            let check = |found: f32x4, scalar: &dyn Fn(f32) -> f32| {
                assert_eq!(found.to_array(), four.map(scalar), "{four:?}");
            };
            check(Real::floor(lanes), &f32::floor);
            check(Real::ceil(lanes), &f32::ceil);
            check(Real::abs(lanes), &f32::abs);
            check(Real::sqrt(Real::abs(lanes)), &|x| x.abs().sqrt());
            check(Number::max(lanes, Lanes::all(0.5)), &|x| if x > 0.5 { x } else { 0.5 });
            let positive = Lanes::all(0.0).lt(lanes);
            check(f32x4::select(positive, lanes, Lanes::all(7.0)), &|x| if x > 0.0 { x } else { 7.0 });
            for (found, x) in Real::exp2(lanes).to_array().into_iter().zip(four) {
                let exact = f64::from(x).exp2();
                // Two roundings, of the polynomial's last product and last sum, and the remainder of the series: up to
                // 6e-8 each. Below the normal numbers the result is 0.
                if (-126.0..127.0).contains(&x) {
                    assert!((f64::from(found) - exact).abs() <= 2e-7 * exact, "{x}: {found}");
                } else if x < 0.0 {
                    assert_eq!(found, 0.0);
                }
            }
        }
    }

    #[test]
    fn gather_reads_packets_and_zeros_where_masked() {
        let words: Vec<u32> = (10..22).collect();
        let at = u32x4::from([0, 2, 5, 1000]);
        let mask = Lanes::all(0.0).lt(Lanes::each([1.0, 1.0, -1.0, 1.0]));
        let found = Lanes::gather::<2>(&words, at, mask).map(u32x4::to_array);
        assert_eq!(found, [[10, 14, 0, 0], [11, 15, 0, 0]]);
        let [word] = Lanes::gather::<1>(&words, at, Lanes::mask(true));
        assert_eq!(word.to_array(), [10, 12, 15, 0]);
    }

    #[test]
    fn lanes_end_a_loop_separately() {
        let count = u32x4::from([0, 3, 1, 7]);
        let start = (u32x4::splat(0), Lanes::all(1.0));
        let step = |(i, x): (u32x4, f32x4)| (i + u32x4::splat(1), x + x);
        let (i, x) = Lanes::while_loop(c"doubling", start, |(i, _)| i.lt(count), step);
        assert_eq!((i.to_array(), x.to_array()), ([0, 3, 1, 7], [1.0, 8.0, 2.0, 128.0]));
        let (i, _) = Plain::<f32>::while_loop(c"doubling", (0, 1.0f32), |(i, _)| i < 7, |(i, x)| (i + 1, x + x));
        assert_eq!(i, 7);
    }
}
