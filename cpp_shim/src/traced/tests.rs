//! Traced operations, look-ups and loops against plain numbers, and the release of variables after failures.

use super::super::jit_tests as dr;
use super::*;
use crate::scope::{TraceError, trace};
use std::sync::{Mutex, MutexGuard};
use sunbeam::numeric::{Plain, math};

/// The LLVM backend, for one test at a time, since tests change Dr.Jit's flags and count its variables.
///
/// # Panics
/// If Dr.Jit cannot use a libLLVM, which `make setup` installs.
fn llvm() -> (u32, MutexGuard<'static, ()>) {
    static ONE: Mutex<()> = Mutex::new(());
    let one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let backend = dr::llvm_backend();
    assert_ne!(backend, 0, "there is no libLLVM that Dr.Jit can use; DRJIT_LIBLLVM_PATH names one");
    dr::set_symbolic_loops(true);
    (backend, one)
}

/// An array in Dr.Jit's memory.
struct Array(u32);

impl Array {
    fn words(backend: u32, words: &[u32]) -> Self {
        let index = dr::upload(backend, words);
        assert_ne!(index, 0);
        Self(index)
    }

    fn to_words(&self, count: usize) -> Vec<u32> {
        let mut words = vec![0; count];
        assert!(dr::download(self.0, &mut words));
        words
    }
}

impl Drop for Array {
    fn drop(&mut self) {
        jit::release(self.0);
    }
}

/// An array of words as single-precision numbers.
fn reals<'s>(scope: Scope<'s>, array: &Array) -> Var<'s, f32> {
    Traced::from_bits(Var::borrowed(scope, array.0))
}

/// Single-precision numbers as words.
fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Evaluates the variables that `trace` returned; each has `count` elements.
fn computed<const R: usize>(results: [Owned; R], count: usize) -> [Vec<f32>; R] {
    results.map(|owned| {
        let array = Array(owned.into_index());
        array.to_words(count).into_iter().map(f32::from_bits).collect()
    })
}

/// Number of nodes of the test's table, at the positions 0, 1, ….
const NODES: u32 = 64;
/// Number of words of a node, one for each knot. The table has the words of node 0, then those of node 1, and so on.
const WORDS: u32 = 16;
/// Standard deviation of the Gaussian weights of nodes, in distances of nodes.
const SIGMA: f64 = 0.6;

/// A look-up like that of a real table. The upper 16 bits of a word are a coefficient of its node's cubic spline. A
/// look-up is the mean of four nodes' splines with Gaussian weights.
struct Lookup<N: Numbers>(N::Words);

impl<N: Numbers> Lookup<N> {
    /// The base-two logarithm of the mean, and the sum of the weights, negated if it exceeds 0.5 to test a selection.
    /// `position` is in nodes, `knot` in knots.
    fn at(&self, position: N::Real, knot: N::Real, active: N::Mask) -> [N::Real; 2] {
        let (lit, int) = (N::Real::lit, N::Index::lit);
        // Exercises double precision: single precision would round this factor to 1.
        let position = N::widen(position) * N::Double::lit(1.0 + 1e-9);
        let first =
            (position - N::Double::lit(2.0)).ceil().clip(N::Double::lit(0.0), N::Double::lit(f64::from(NODES - 4)));
        let nodes_from_first = N::narrow(position - first);
        let first = N::index_of_double(first);
        // At most 11: the seven words read below, from word 8 on, then end within the node's 16.
        let knot = knot.clip(lit(0.0), lit(f64::from(WORDS - 5)));
        let low = N::index(knot.floor());
        let gaussian = N::tabulated(4, |i| {
            let d = nodes_from_first - N::real(i);
            (d * d * lit(-0.5 * std::f64::consts::LOG2_E / (SIGMA * SIGMA))).exp2()
        });
        let (_, sum, weight_sum) = N::while_loop(
            c"taps",
            (int(0), lit(0.0), lit(0.0)),
            |(i, ..)| active & i.lt(int(4)),
            |(i, sum, weight_sum)| {
                // Index of the packet of four words in which `low` lies.
                let packet = (first + i) * int(WORDS / 4) + (low >> 2);
                // Seven words, in packets of four, two and one, to test every size. The spline of a real table would
                // also read the word before them, and never the seventh.
                let words = {
                    let [a, b, c, d] = N::gather::<4>(self.0, packet, active);
                    let [e, f] = N::gather::<2>(self.0, packet * int(2) + int(2), active);
                    let [g] = N::gather::<1>(self.0, packet * int(4) + int(6), active);
                    [a, b, c, d, e, f, g]
                };
                let knots_from_first = knot - N::real((low >> 2) << 2);
                let mut value = lit(0.0);
                for (k, &word) in words.iter().enumerate() {
                    // The numbers in the lower and the upper 16 bits (bfloat16). The added bits are the exponent of 1,
                    // so coefficients, the upper numbers, are in [1, 2).
                    let [_, coefficient] = math::bf16_pair::<N>(word | int(0x3f80_0000));
                    value = math::cubic_b_spline(knots_from_first - lit(k as f64)).fma(coefficient, value);
                }
                let weight = gaussian(i);
                (i + int(1), weight.fma(value, sum), weight_sum + weight)
            },
        );
        let signed = N::Real::select(lit(0.5).lt(weight_sum), -weight_sum, weight_sum);
        [(sum / weight_sum.max(lit(1e-3))).max(lit(1e-6)).log2(), signed]
    }
}

/// Pseudorandom mantissas by Knuth's multiplicative hash; the bits of sign and exponent are 0.
fn table() -> Vec<u32> {
    (0..NODES * WORDS).map(|i| (i.wrapping_mul(2_654_435_761) >> 9) << 7 & 0x007f_ff80).collect()
}

/// Positions and knots spread over the table: multiples of the inverse golden ratio and of the inverse plastic number,
/// modulo 1, times the numbers of nodes and of knots.
fn queries(count: usize) -> [Vec<f32>; 2] {
    let fraction = |i: usize, step: f64| (i as f64 * step).fract();
    let column = |step: f64, scale: f64| (0..count).map(|i| (fraction(i, step) * scale) as f32).collect();
    [column(0.618_033_988_7, f64::from(NODES)), column(0.754_877_666_2, f64::from(WORDS))]
}

/// Tolerance: rounding of single precision (6e-8) through a dozen operations; the logarithm is of order one.
const SINGLE: f32 = 4e-6;

/// Compares the look-up, traced and by value, at many positions.
fn lookup_agrees(backend: u32) {
    const COUNT: usize = 1000;
    let table = table();
    let [positions, knots] = queries(COUNT);
    let by_value = Lookup::<Plain<f64>>(&table);
    let words = Array::words(backend, &table);
    let inputs = [&positions, &knots].map(|column| Array::words(backend, &bits(column)));
    let results = trace(backend, |scope| {
        let [position, knot] = [0, 1].map(|c| reals(scope, &inputs[c]));
        let lookup = Lookup::<Traced>(WordsVar::borrowed(scope, words.0));
        lookup.at(position, knot, Traced::mask(true)).map(|v| v.owned(scope))
    })
    .unwrap();
    let results = computed(results, COUNT);
    let mut spread = [f32::INFINITY, f32::NEG_INFINITY];
    for i in 0..COUNT {
        let wanted = by_value.at(f64::from(positions[i]), f64::from(knots[i]), true).map(|x| x as f32);
        for c in 0..2 {
            let got = results[c][i];
            assert!((got - wanted[c]).abs() < SINGLE * (1.0 + wanted[c].abs()), "{i} {c} {got} {wanted:?}");
        }
        spread = [spread[0].min(wanted[0]), spread[1].max(wanted[0])];
    }
    // The look-up depends on its input.
    assert!(spread[1] - spread[0] > 0.1, "{spread:?}");
}

#[test]
fn traced_lookups_match_plain() {
    let (backend, _one) = llvm();
    lookup_agrees(backend);
    dr::set_symbolic_loops(false);
    lookup_agrees(backend);
}

#[test]
fn traced_operations_match_plain() {
    let (backend, _one) = llvm();
    /// Results of each operation; those with a truth value are 1 or 2.
    fn all<N: Numbers>(a: N::Real, b: N::Real) -> [N::Real; 21] {
        let (lit, int) = (N::Real::lit, N::Index::lit);
        let truth = |mask: N::Mask| N::Real::select(mask, lit(1.0), lit(2.0));
        let (i, j) = (N::index(a.abs() * lit(100.0)), N::index(b.abs() * lit(50.0)) + int(1));
        let (p, q) = (N::widen(a), N::widen(b));
        [
            a + b,
            a - b,
            a * b,
            a / b,
            a.min(b),
            a.max(b),
            a.fma(b, lit(0.3)),
            -a.abs().sqrt(),
            a.floor() + b.ceil() * lit(10.0),
            a.exp2(),
            b.abs().log2(),
            truth(a.lt(b) & !b.le(lit(0.5))),
            truth(a.lt(b) | N::mask(false)),
            N::real(i + j) + N::real(i * j) * lit(0.001),
            N::real((i << 3) & int(0xff)) + N::real((i >> 2) | j),
            N::real(i.min(j)) + N::real(i.max(j)) * lit(0.01),
            truth(i.lt(j)) + truth(j.le(i)) * lit(4.0),
            N::narrow((p / q).abs().sqrt().floor() + q.ceil() - p.min(q) * p.max(q)),
            N::narrow(p.fma(q, -p).exp2()),
            N::narrow(q.abs().log2()) + N::real(N::index_of_double(p.abs())),
            math::normal_quantile(lit(0.5) + a * lit(0.1)),
        ]
    }
    // No argument of a floor, ceiling or truncation is near an integer, where rounding would decide.
    let a: Vec<f32> = (0..300).map(|i| -4.0 + 0.027_18 * i as f32 + 1e-3).collect();
    let b: Vec<f32> = (0..300).map(|i| 3.0 - 0.019_73 * i as f32 + 3e-3).collect();
    let inputs = [&a, &b].map(|column| Array::words(backend, &bits(column)));
    let results = trace(backend, |scope| {
        all::<Traced>(reals(scope, &inputs[0]), reals(scope, &inputs[1])).map(|v| v.owned(scope))
    })
    .unwrap();
    let results = computed(results, a.len());
    for k in 0..a.len() {
        let wanted = all::<Plain<f32>>(a[k], b[k]);
        for (c, column) in results.iter().enumerate() {
            let (got, wanted) = (column[k], wanted[c]);
            assert!(
                (got - wanted).abs() <= SINGLE * (1.0 + wanted.abs()),
                "operation {c} of {} {}: {got} {wanted}",
                a[k],
                b[k]
            );
        }
    }
}

#[test]
fn map_each_loops_and_is_zero_where_masked() {
    let (backend, _one) = llvm();
    let column = [0.25f32, 1.5, f32::NAN, 3.0];
    for symbolic in [true, false] {
        dr::set_symbolic_loops(symbolic);
        let input = Array::words(backend, &bits(&column));
        let results = trace(backend, |scope| {
            let x = reals(scope, &input);
            let lit = Var::<f32>::lit;
            // The mask `x ≤ x` is false for NaN.
            let lanes = Traced::map_each(c"lanes", [x, x + lit(1.0), x + lit(2.0)], x.le(x), |x| [x * x, -x]);
            let one = Traced::map_each(c"lanes", [x], x.le(x), |x| [x + x]);
            [lanes[0][0], lanes[0][2], lanes[1][1], one[0][0]].map(|v| v.owned(scope))
        })
        .unwrap();
        let wanted = |f: fn(f32) -> f32| column.map(|x| if x.is_nan() { 0.0 } else { f(x) }).to_vec();
        let wanted = [wanted(|x| x * x), wanted(|x| (x + 2.0) * (x + 2.0)), wanted(|x| -x - 1.0), wanted(|x| x + x)];
        assert_eq!(computed(results, 4), wanted, "symbolic {symbolic}");
    }
}

/// Traces a loop within a loop, whose inner step calls `fail`. The result is the input plus 4: the sum of i·j, which is
/// 3, and 1.
fn failing(backend: u32, input: u32, fail: &dyn Fn()) -> Result<Owned, TraceError> {
    trace(backend, |scope| {
        let int = Var::<u32>::lit;
        let given = Var::<u32>::borrowed(scope, input);
        let (_, sum) = Traced::while_loop(
            c"outer",
            (int(0), given),
            |(i, _)| i.lt(int(3)),
            |(i, sum)| {
                let (_, sum) = Traced::while_loop(
                    c"inner",
                    (int(0), sum),
                    |(j, _)| j.lt(int(2)),
                    |(j, sum)| {
                        fail();
                        (j + int(1), sum + i * j)
                    },
                );
                (i + int(1), sum)
            },
        );
        (sum + int(1)).owned(scope)
    })
}

#[test]
fn failures_are_reported_and_release_all_variables() {
    let (backend, _one) = llvm();
    let variables = || dr::all_variables().lines().count();
    let input = Array::words(backend, &[1, 2, 3]);
    let other = Array::words(backend, &[1, 2]);
    let (before, references) = (variables(), dr::references(input.0));
    for symbolic in [true, false] {
        dr::set_symbolic_loops(symbolic);
        // Dr.Jit refuses arrays of different sizes.
        let mismatch = || {
            Var::<u32>::own(jit::add(input.0, other.0));
        };
        let error = failing(backend, input.0, &mismatch).unwrap_err();
        assert!(matches!(&error, TraceError::Jit(message) if message.contains("size")), "{error}");
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            failing(backend, input.0, &|| panic!("on purpose")).map(drop)
        }));
        assert_eq!(panic.unwrap_err().downcast_ref(), Some(&"on purpose"));
        let empty = failing(backend, 0, &|| ()).unwrap_err();
        assert_eq!(empty, TraceError::Jit("an argument is an empty array".into()));
        let nested = trace(backend, |_| failing(backend, input.0, &|| ()).map(drop));
        assert_eq!(nested, Ok(Err(TraceError::Nested)));
        assert_eq!((variables(), dr::references(input.0)), (before, references), "symbolic {symbolic}");
        // The next call succeeds.
        let sum = Array(failing(backend, input.0, &|| ()).unwrap().into_index());
        assert_eq!(sum.to_words(3), [5, 6, 7], "symbolic {symbolic}");
    }
    assert_eq!((variables(), dr::references(input.0)), (before, references));
}

#[test]
fn variables_outside_a_scope_are_empty() {
    let (backend, _one) = llvm();
    let stray = Var::<'static, f32>::lit(1.0);
    assert_eq!(stray.index, 0);
    assert_eq!((stray + stray).index, 0);
    assert!(trace(backend, |_| ()).is_ok());
}
