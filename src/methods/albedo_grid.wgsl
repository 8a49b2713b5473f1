// Grid of directions of the albedo tables, for albedo.wgsl and film.wgsl; compiled after common.wgsl (DIVISOR_MIN) and
// table.wgsl (table). Counterpart of src/energy/grid.rs, with the same arithmetic.
//
// The grid is square and uniform over the stretched direction
//     (x, y) = w.xy/√((1 + √cosθ)(1 + cosθ)), each in [-1, 1].
// This maps the hemisphere to the unit disc with dense nodes near the horizon, since x² + y² = 1 - √cosθ. A cell is the
// square between four nodes. Divisors A of the reflectance are tabulated over it as (A - 1)·cos²θ.

// Table data; albedo.wgsl and film.wgsl describe their arrangement.
@group(1) @binding(2) var<storage, read> albedos: array<u32>;

// Place of a direction in the grid.
struct GridPlace {
    // Index of its cell in one table of the grid, [row along y][column along x].
    cell: u32,
    // Position in the cell along x and y, 0 to 1.
    fraction: vec2<f32>,
    // 1/cos²θ, the factor that turns the tabulated (A - 1)·cos²θ, finite at the horizon, into A - 1.
    per_squared_cosine: f32,
}

// Place of a direction of unit length; a cosine w.z below DIVISOR_MIN, also a negative one, counts as DIVISOR_MIN.
fn place(w: vec3<f32>) -> GridPlace {
    let cosine = clamp(w.z, DIVISOR_MIN, 1.0);
    let scale = 1.0 / sqrt((1.0 + sqrt(cosine)) * (1.0 + cosine));
    let cells = f32(table.albedo_cells);
    let position = clamp((w.xy * scale + 1.0) * (0.5 * cells), vec2<f32>(0.0), vec2<f32>(cells));
    let cell = min(floor(position), vec2<f32>(cells - 1.0));
    return GridPlace(u32(cell.y) * table.albedo_cells + u32(cell.x), position - cell, 1.0 / (cosine * cosine));
}

// The two values of a word, that in the lower half first. Each is the upper half of a single-precision number.
fn albedo_pair(word: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(word << 16u), bitcast<f32>(word & 0xffff0000u));
}

// Value at a position in a cell, 0 to 1 along x and y, bilinear between the corners. The word `lower_y` has the two
// corners of the lower y, `upper_y` those of the upper y.
fn in_cell(lower_y: u32, upper_y: u32, fraction: vec2<f32>) -> f32 {
    let lower = albedo_pair(lower_y);
    let upper = albedo_pair(upper_y);
    return mix(mix(lower.x, lower.y, fraction.x), mix(upper.x, upper.y, fraction.x), fraction.y);
}
