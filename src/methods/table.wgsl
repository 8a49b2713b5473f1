// Look-up in the colour table: the relief's factor in linear sRGB over q = wi + wo = (u, v, w); counterpart of
// src/colour_table/lookup.rs, with the same arithmetic.
//
// The table consists of rings about (u, v) = (0, 0) whose spacing grows with the radius: ring i has the radius
// inner_spacing·sinh(growth·(i + 1/2))/growth. A ring holds `directions` × `w_count` samples, cubic B-splines over the
// direction in turns and over w. Across rings the interpolation is the cubic Lagrange polynomial through four rings.

// A ring of samples; counterpart of `Ring` in src/colour_table/rings.rs, which derives the numbers.
struct Ring {
    // Index of the ring's first sample in `words`.
    offset: u32,
    // Number of samples along the direction.
    directions: u32,
    // Number of samples along w.
    w_count: u32,
    // The position along w, in samples, is knots_per_w·w + knots_per_efold·ln(1 + w/w_log).
    knots_per_w: f32,
    // Factor of the logarithm in this position.
    knots_per_efold: f32,
    // The interpolated value is multiplied by (w² + zero_squared)/(w² + knee_squared), which models its fall near w =
    // 0.
    knee_squared: f32,
    // Numerator's constant of this factor.
    zero_squared: f32,
    _pad: u32,
}

// Layout of the table; counterpart of `ColourLayout` in src/colour_table.
struct Table {
    // Spacing of the rings near the centre.
    inner_spacing: f32,
    // Relative spacing of the rings far from the centre.
    growth: f32,
    // Scale of the logarithm of a ring's position along w.
    w_log: f32,
    // Added to a sample's exponent to give that of a single-precision number.
    exponent_offset: u32,
    // Index of the outermost ring.
    last_ring: u32,
    // Cells along each side of the grid of albedo.wgsl; 0 without an albedo.
    albedo_cells: u32,
    _pad1: u32,
    _pad2: u32,
    // In the uniform struct, because software adapters read storage buffers word by word and pixel by pixel.
    rings: array<Ring, 1024>,
}

@group(1) @binding(0) var<uniform> table: Table;
// Samples of all rings, each packed in a u32.
@group(1) @binding(1) var<storage, read> words: array<u32>;

// Red, green and blue of a packed sample: three mantissas of nine bits, offset by 256, and a common exponent of five
// bits.
fn unpack(word: u32) -> vec3<f32> {
    let scale = bitcast<f32>(((word >> 27u) + table.exponent_offset) << 23u);
    let mantissas = vec3<u32>(word, word >> 9u, word >> 18u) & vec3<u32>(0x1ffu);
    return (vec3<f32>(mantissas) - 256.0) * scale;
}

// The direction of q in turns from +u towards +v, -1/2 to 1/2. It is computed by a fitted odd polynomial of the smaller
// over the larger component, because the precision of the built-in atan2 differs between drivers.
fn turns(q: vec2<f32>) -> f32 {
    let size = abs(q);
    let largest = max(size.x, size.y);
    if largest == 0.0 {
        return 0.0;
    }
    let ratio = min(size.x, size.y) / largest;
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

// Weights of four samples of a cubic B-spline, at a fraction t of the way from the second to the third.
fn cubic_b_spline_weights(t: f32) -> vec4<f32> {
    let s = 1.0 - t;
    return vec4<f32>(
        s * s * s,
        4.0 - 6.0 * t * t + 3.0 * t * t * t,
        4.0 - 6.0 * s * s + 3.0 * s * s * s,
        t * t * t,
    ) / 6.0;
}

// Weights of four samples of the cubic Lagrange polynomial, at a fraction t of the way from the second to the third.
fn lagrange_weights(t: f32) -> vec4<f32> {
    let a = t + 1.0;
    let b = t - 1.0;
    let c = t - 2.0;
    return vec4<f32>(-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0);
}

// The value on a ring at a direction in turns and w.
fn on_ring(ring: Ring, turn: f32, w: f32) -> vec3<f32> {
    let x = turn * f32(ring.directions);
    let y = w * ring.knots_per_w + ring.knots_per_efold * log(1.0 + w / table.w_log);
    let column = floor(x);
    let row = min(floor(y), f32(ring.w_count) - 4.0);
    let direction_weights = cubic_b_spline_weights(x - column);
    let height_weights = cubic_b_spline_weights(y - row);
    // A turn lies in [-0.5, 1]. One addition makes the number of the direction positive and one subtraction brings it
    // into range. A remainder would take software adapters longer than the rest of the function.
    let beyond = u32(i32(column) + i32(ring.directions) - 1);
    var direction = select(beyond, beyond - ring.directions, beyond >= ring.directions);
    var sum = vec3<f32>();
    for (var a = 0u; a < 4u; a++) {
        let first = ring.offset + direction * ring.w_count + u32(row);
        let value = height_weights.x * unpack(words[first]) + height_weights.y * unpack(words[first + 1u])
            + height_weights.z * unpack(words[first + 2u]) + height_weights.w * unpack(words[first + 3u]);
        sum += direction_weights[a] * value;
        direction = select(direction + 1u, 0u, direction + 1u == ring.directions);
    }
    return sum * ((w * w + ring.zero_squared) / (w * w + ring.knee_squared));
}

// The value on the ring of this number. A negative number is a ring beyond the centre, on the opposite side.
fn on_ring_number(number: i32, turn: f32, w: f32) -> vec3<f32> {
    let mirrored = number < 0;
    let index = min(u32(select(number, -1 - number, mirrored)), table.last_ring);
    return on_ring(table.rings[index], turn + select(0.0, 0.5, mirrored), w);
}

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr.
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    let radius = length(q.xy);
    if !is_query(q) || answer_part != 0u {
        return vec3<f32>();
    }
    let turn = turns(q.xy);
    // Position among the rings, in rings: asinh(growth·radius/inner_spacing)/growth - 1/2.
    let stretched = radius * table.growth / table.inner_spacing;
    let position = log(stretched + sqrt(stretched * stretched + 1.0)) / table.growth - 0.5;
    let first = floor(position);
    let weights = lagrange_weights(position - first);
    // Not a loop: the compiler then computes terms of w alone once, and llvmpipe counts no turns (bessel.wgsl).
    let number = i32(first);
    return weights.x * on_ring_number(number - 1, turn, q.z) + weights.y * on_ring_number(number, turn, q.z)
        + weights.z * on_ring_number(number + 1, turn, q.z) + weights.w * on_ring_number(number + 2, turn, q.z);
}
