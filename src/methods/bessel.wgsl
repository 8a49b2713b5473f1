// Twin of bessel.rs.

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
    let start = 2u * u32(ceil(0.5 * (x + 8.0 * pow(x, 1.0 / 3.0) + 4.0)));
    for (var k = start + 1u; k < count; k++) {
        (*values)[k] = 0.0;
    }
    let step = 2.0 / x;
    var above = 0.0;
    var here = 1.0;
    var evens = 0.0;
    for (var k = start; k > 0u; k--) {
        if k < count {
            (*values)[k] = here;
        }
        if k % 2u == 0u {
            evens += here;
        }
        let below = f32(k) * step * here - above;
        above = here;
        here = below;
    }
    (*values)[0] = here;
    let scale = 1.0 / (here + 2.0 * evens);
    for (var k = 0u; k < min(count, start + 1u); k++) {
        (*values)[k] *= scale;
    }
}
