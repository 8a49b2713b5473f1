// Divisors A of the reflectance, for conserving_table.wgsl and film.wgsl; compiled after common.wgsl (DIVISOR_MIN) and
// table.wgsl (table). Counterpart of `AlbedoView` in src/energy, with the same arithmetic.
//
// A belongs to a direction, at the angle θ from the normal, and a wavelength. It is 1 or more: about the albedo where
// that exceeds 1, and less near the horizon, where less suffices (src/energy/mod.rs). A colour channel takes the mean
// of A over wavelength by the channel's weights, computed from A at three wavelengths.
//
// (A - 1)·cos²θ is tabulated on a square grid, uniform over the stretched direction
//     (x, y) = w.xy/√((1 + √cosθ)(1 + cosθ)), each in [-1, 1].
// This maps the hemisphere to the unit disc with dense nodes near the horizon, since x² + y² = 1 - √cosθ. A cell is the
// square between four nodes. The grid of one wavelength is a *plane*. A *gap* is the interval of wavelengths between
// two neighbouring planes.

// Four words for each [side][gap][cell]. A film has two sides (film.wgsl), any other surface one. A word has the values
// at two corners of the cell, that of the lower x in its lower half. The words are: lower y and upper y on the lower
// plane, lower y and upper y on the upper plane.
@group(1) @binding(2) var<storage, read> albedos: array<u32>;

// Place of a direction in the grid.
struct GridPlace {
    // Index of the cell in the lowest gap, [row along y][column along x]. film.wgsl adds the cells of a side to it for
    // directions below.
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

// A - 1 at a place and a wavelength in nm, linear between planes.
fn excess(at: GridPlace, nm: f32) -> f32 {
    let last = f32(table.albedo_planes - 1u);
    let position = clamp((nm - table.albedo_min_nm) * table.albedo_planes_per_nm, 0.0, last);
    let plane = min(floor(position), last - 1.0);
    let first = 4u * (u32(plane) * table.albedo_cells * table.albedo_cells + at.cell);
    let lower = in_cell(albedos[first], albedos[first + 1u], at.fraction);
    let upper = in_cell(albedos[first + 2u], albedos[first + 3u], at.fraction);
    return mix(lower, upper, position - plane) * at.per_squared_cosine;
}

// A - 1 of red, green and blue at a place: the mean over the channel's band, with BAND_NODES_NM and BAND_NODE_WEIGHTS
// of src/energy/bands.rs. Tests of films on the GPU compare both.
fn band_excess(at: GridPlace) -> vec3<f32> {
    return vec3<f32>(0.0486, 0.1456, 0.9317) * excess(at, 460.0)
        + vec3<f32>(0.2074, 0.7197, 0.0683) * excess(at, 540.0)
        + vec3<f32>(0.7440, 0.1348, 0.0) * excess(at, 620.0);
}
