// Look-up in the colour table: the relief's factor in linear sRGB over q = wi + wo = (u, v, w); counterpart of
// src/colour_table/lookup.rs, with the same formulas.
//
// The relief's factor is the reflectance without Fresnel factor, obliquity and shadowing. u, v and w are sums of
// direction cosines, w = cosθi + cosθo.
//
// The table consists of rings about (u, v) = (0, 0) whose spacing grows with the radius: ring i has the radius
// inner_spacing/growth·sinh(growth·(i + 1/2)). On a ring the colour is a cubic B-spline over the direction in turns and
// over w. Between rings it is the cubic polynomial through four rings (`lagrange_weights`).
//
// A ring's spline has `directions` × `w_count` coefficients [direction][w]. Coefficient 0 over w belongs to the knot
// -1; knot 0 is at w = 0. The value w lies at the position knots_per_w·w + knots_per_efold·ln(1 + w/w_log) in knots.

// Record of one ring; counterpart of `Ring` in src/colour_table/mod.rs.
struct Ring {
    // Index of the ring's first coefficient in `coefficients`.
    offset: u32,
    // Number of coefficients along the direction, uniformly spaced over a full turn from +u towards +v.
    directions: u32,
    // Number of coefficients over w.
    w_count: u32,
    // Uniform part of the density of knots: knots per unit of w.
    knots_per_w: f32,
    // Logarithmic part of the density of knots: knots per e-fold of 1 + w/w_log.
    knots_per_efold: f32,
    // The colour is the spline's value times (w² + zero_squared)/(w² + knee_squared): below the knee it falls as w²,
    // down to a constant where w² < zero_squared (src/colour_table/fit.rs).
    knee_squared: f32,
    zero_squared: f32,
    _pad: u32,
}

// Layout of the table; counterpart of `TableUniform` in table.rs. The members from `albedo_cells` to `body_normal_min`
// are read by other files of this folder.
struct Table {
    // Spacing of the rings near the centre, in u and v.
    inner_spacing: f32,
    // Spacing of the outer rings over their radius.
    growth: f32,
    // Scale of w above which the knots of `knots_per_efold` are spaced logarithmically.
    w_log: f32,
    // Addend that makes the stored exponent of a coefficient the biased exponent of a single-precision number.
    exponent_offset: u32,
    // Index of the outermost ring.
    last_ring: u32,
    // Cells along each side of the grid of directions in albedo.wgsl; 0 where nothing is divided by an albedo.
    albedo_cells: u32,
    // Number of wavelengths at which the albedo is tabulated, one grid (plane) each.
    albedo_planes: u32,
    // Wavelength of the first plane in nm.
    albedo_min_nm: f32,
    // Planes per nm of wavelength.
    albedo_planes_per_nm: f32,
    // Refractive index of the film of film.wgsl; 0 for a surface that only reflects.
    body_eta: f32,
    // Smallest normal component of the scattering vector of a film, in units of the wave number in the film.
    body_normal_min: f32,
    _pad1: u32,
    // Rings from the centre outwards, then zeros. They are in the uniform struct, because software adapters read
    // storage buffers word by word and pixel by pixel. A test compares their number with that in Rust.
    rings: array<Ring, 1024>,
}

@group(1) @binding(0) var<uniform> table: Table;
// Spline coefficients of all rings, one word for the three channels.
@group(1) @binding(1) var<storage, read> coefficients: array<u32>;

// Red, green and blue of a packed coefficient, (m - 256)·2^e each: three stored mantissas m of nine bits and a common
// exponent of five bits (src/colour_table/pack.rs).
fn unpack(word: u32) -> vec3<f32> {
    let scale = bitcast<f32>(((word >> 27u) + table.exponent_offset) << 23u);
    let mantissas = vec3<u32>(word, word >> 9u, word >> 18u) & vec3<u32>(0x1ffu);
    return (vec3<f32>(mantissas) - 256.0) * scale;
}

// Direction of (u, v) in turns from +u towards +v, -1/2 to 1/2; 0 at the origin. It is computed by a polynomial fitted
// to atan(a)/(2πa), with a the smaller over the larger component, because the precision of the built-in atan2 differs
// between drivers.
fn turns(q: vec2<f32>) -> f32 {
    let size = abs(q);
    let largest = max(size.x, size.y);
    if largest == 0.0 {
        return 0.0;
    }
    let ratio = min(size.x, size.y) / largest;
    // Horner's rule in the square of the ratio.
    let square = ratio * ratio;
    var sum = -0.00064530366;
    sum = sum * square + 0.003479595;
    sum = sum * square - 0.008898719;
    sum = sum * square + 0.01534603;
    sum = sum * square - 0.02213627;
    sum = sum * square + 0.031745945;
    sum = sum * square - 0.05304612;
    sum = sum * square + 0.15915484;
    let octant = ratio * sum;
    let quadrant = select(octant, 0.25 - octant, size.y > size.x);
    let half = select(quadrant, 0.5 - quadrant, q.x < 0.0);
    return select(half, -half, q.y < 0.0);
}

// Weights of the coefficients of the knots -1, 0, 1, 2 in a uniform cubic B-spline at t in [0, 1].
fn cubic_b_spline_weights(t: f32) -> vec4<f32> {
    let s = 1.0 - t;
    return vec4<f32>(
        s * s * s,
        4.0 - 6.0 * t * t + 3.0 * t * t * t,
        4.0 - 6.0 * s * s + 3.0 * s * s * s,
        t * t * t,
    ) / 6.0;
}

// Weights of the values at -1, 0, 1, 2 in the cubic polynomial through them, at t in [0, 1].
fn lagrange_weights(t: f32) -> vec4<f32> {
    let a = t + 1.0;
    let b = t - 1.0;
    let c = t - 2.0;
    return vec4<f32>(-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0);
}

// Colour on the ring of index `ring_index` at a direction in turns, -1/2 to 1/2, and w.
//
// The line through the centre continues to ring 0 on the opposite side. Index -1 is therefore ring 0 half a turn away,
// and index -2 ring 1. Indices beyond the last ring read the last ring.
fn on_ring(ring_index: i32, turn: f32, w: f32) -> vec3<f32> {
    let opposite = ring_index < 0;
    let ring = table.rings[min(u32(select(ring_index, -1 - ring_index, opposite)), table.last_ring)];
    // Positions in knots, along the ring and over w. The row is limited so that four coefficients follow.
    let x = (turn + select(0.0, 0.5, opposite)) * f32(ring.directions);
    let y = w * ring.knots_per_w + ring.knots_per_efold * log(1.0 + w / table.w_log);
    let column = floor(x);
    let row = min(floor(y), f32(ring.w_count) - 4.0);
    let direction_weights = cubic_b_spline_weights(x - column);
    let w_weights = cubic_b_spline_weights(y - row);
    // The four directions read are column - 1 to column + 2, modulo the number of directions. The turn lies in [-1/2,
    // 1], so one addition and at most one subtraction bring the first into range. A remainder would take software
    // adapters longer than the rest of the function.
    let wrapped = u32(i32(column) + i32(ring.directions) - 1);
    var direction = select(wrapped, wrapped - ring.directions, wrapped >= ring.directions);
    var sum = vec3<f32>();
    for (var a = 0u; a < 4u; a++) {
        // Coefficients of the knots row - 1 to row + 2 over w.
        let first = ring.offset + direction * ring.w_count + u32(row);
        let value = w_weights.x * unpack(coefficients[first]) + w_weights.y * unpack(coefficients[first + 1u])
            + w_weights.z * unpack(coefficients[first + 2u]) + w_weights.w * unpack(coefficients[first + 3u]);
        sum += direction_weights[a] * value;
        direction = select(direction + 1u, 0u, direction + 1u == ring.directions);
    }
    return sum * ((w * w + ring.zero_squared) / (w * w + ring.knee_squared));
}

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr. Zero unless q can be the sum of two unit
// vectors above the surface (is_query). Callers add up `answer_parts` parts of the answer (common.wgsl). Here part 0 is
// the whole answer, and the other parts are zero.
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) || answer_part != 0u {
        return vec3<f32>();
    }
    let radius = length(q.xy);
    let turn = turns(q.xy);
    // Position among the rings, asinh(growth·radius/inner_spacing)/growth - 1/2: ring k lies at k. The divisions are
    // not simplified, since they must match those of lookup.rs: beside a bright order another rounding would be
    // visible.
    let stretched = radius * table.growth / table.inner_spacing;
    let position = log(stretched + sqrt(stretched * stretched + 1.0)) / table.growth - 0.5;
    let inner = floor(position);
    let weights = lagrange_weights(position - inner);
    // Not a loop: the compiler then computes terms of w alone once, and llvmpipe counts no iterations (bessel.wgsl).
    let ring = i32(inner);
    return weights.x * on_ring(ring - 1, turn, q.z) + weights.y * on_ring(ring, turn, q.z)
        + weights.z * on_ring(ring + 1, turn, q.z) + weights.w * on_ring(ring + 2, turn, q.z);
}
