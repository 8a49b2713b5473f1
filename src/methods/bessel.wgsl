// Bessel functions of the first kind, J_0(x) to J_{count-1}(x); counterpart of bessel.rs for one argument.
//
// Miller's algorithm: the recurrence J_{k-1} = (2k/x)·J_k - J_{k+1} runs towards smaller k from an arbitrary value at
// an even k well above x. The identity J_0 + 2(J_2 + J_4 + …) = 1 then gives the scale.
//
// Loops are unrolled here and in orders.wgsl: the software adapter llvmpipe ends all loops of an invocation after 65535
// iterations in total.

// Length of the array of terms, and the largest `count`. A test compares the constants of bessel.rs and of this file.
const TERMS_MAX: u32 = 256u;

// Writes J_k(x) to values[k] for k below `count`, a multiple of 4 of at least 4. The argument is 0 to TERMS_MAX; x is
// the argument, but at least DIVISOR_MIN (common.wgsl), since the recurrence divides by it.
fn bessel_j(argument: f32, count: u32, values: ptr<private, array<f32, TERMS_MAX>>) {
    let x = max(argument, DIVISOR_MIN);
    // Even k at which the recurrence starts; bessel.rs gives the reason for its distance from x.
    let start = 2u * u32(0.5 * (x + 6.0 * pow(x, 1.0 / 3.0) + 2.0)) + 2u;
    // Beyond the start J_k is negligible.
    for (var k = start + 1u; k < count; k++) {
        (*values)[k] = 0.0;
    }
    let two_over_x = 2.0 / x;
    // J_{k+1} and J_k without the scale, and the sum of J_k over even k without J_0.
    var above = 0.0;
    var here = 1.0;
    var evens = 0.0;
    // Each iteration takes two steps, from J_k to J_{k-2}.
    for (var k = start; k > 0u; k -= 2u) {
        if k < count {
            (*values)[k] = here;
        }
        evens += here;
        // J_{k-1}.
        let odd = f32(k) * two_over_x * here - above;
        if k - 1u < count {
            (*values)[k - 1u] = odd;
        }
        here = f32(k - 1u) * two_over_x * odd - here;
        above = odd;
    }
    (*values)[0] = here;
    let scale = 1.0 / (here + 2.0 * evens);
    // The last iteration may also scale zeros beyond the start.
    for (var k = 0u; k < min(count, start + 1u); k += 4u) {
        (*values)[k] *= scale;
        (*values)[k + 1u] *= scale;
        (*values)[k + 2u] *= scale;
        (*values)[k + 3u] *= scale;
    }
}
