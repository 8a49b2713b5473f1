// Twin of bessel.rs for one argument. `count` is rounded up to a multiple of four.
//
// Loops are unrolled here and in orders.wgsl: the software adapter llvmpipe ends all loops of an invocation after 65535
// turns in total.

const TERMS_MAX: u32 = 256u;
const SMALL_ARGUMENT: f32 = 1e-3;

fn bessel_j(x: f32, count: u32, values: ptr<private, array<f32, TERMS_MAX>>) {
    if x < SMALL_ARGUMENT {
        for (var k = 3u; k < count; k++) {
            (*values)[k] = 0.0;
        }
        (*values)[0] = 1.0 - 0.25 * x * x;
        (*values)[1] = 0.5 * x;
        (*values)[2] = 0.125 * x * x;
        return;
    }
    let start = 2u * u32(0.5 * (x + 6.0 * pow(x, 1.0 / 3.0) + 2.0)) + 2u;
    for (var k = start + 1u; k < count; k++) {
        (*values)[k] = 0.0;
    }
    let step = 2.0 / x;
    var above = 0.0;
    var here = 1.0;
    var evens = 0.0;
    for (var k = start; k > 0u; k -= 2u) {
        if k < count {
            (*values)[k] = here;
        }
        evens += here;
        let odd = f32(k) * step * here - above;
        if k - 1u < count {
            (*values)[k - 1u] = odd;
        }
        let below = f32(k - 1u) * step * odd - here;
        above = odd;
        here = below;
    }
    (*values)[0] = here;
    let scale = 1.0 / (here + 2.0 * evens);
    for (var k = 0u; k < min(count, start + 1u); k += 4u) {
        (*values)[k] *= scale;
        (*values)[k + 1u] *= scale;
        (*values)[k + 2u] *= scale;
        (*values)[k + 3u] *= scale;
    }
}
