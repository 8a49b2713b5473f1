// Scattering function of a film of the refractive index n: the colour table of the relief magnified n times, times the
// factor of transparent.wgsl, divided by A where energy is conserved. Compiled after transparent.wgsl and
// albedo_grid.wgsl. Counterpart of `TransmissiveColourLobe` in src/lobe/transmissive.rs, with the same arithmetic.
//
// Let A be the larger of 1 and the albedo for a direction at the angle θ from the normal and a wavelength. The albedo
// of a film is the fraction of the light that it reflects or transmits. A colour channel takes the mean of A over
// wavelength by the channel's weights, computed from A at three wavelengths.
//
// `albedos` holds (A - 1)·cos²θ on the grid of albedo_grid.wgsl, in planes of wavelength. It has four words for each
// [side of the film][gap between planes][cell], with two corners of the cell in each word: those of the lower y and of
// the upper y on the lower plane, then those on the upper plane (`in_cell`). Directions of the second side are those of
// the wave in the film's medium. table.wgsl declares the uniform struct `table`.

// Place of a direction in the table, on the lowest gap. The first side is that of directions above the relief, the
// second that of directions below.
fn place_at_body(w: vec3<f32>) -> GridPlace {
    let n = table.body_eta;
    let cells = table.albedo_cells;
    let is_below = w.z < 0.0;
    // The direction within the medium on its side, pointing upwards: air above, the film below (Snell's law).
    let below = vec3<f32>(w.xy / n, sqrt(w.z * w.z + (n - 1.0) * (n + 1.0)) / n);
    var at = place(select(w, below, is_below));
    at.cell += select(0u, (table.albedo_planes - 1u) * cells * cells, is_below);
    return at;
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
// of src/energy/colour.rs. Tests of films on the GPU compare both.
fn band_excess(at: GridPlace) -> vec3<f32> {
    return vec3<f32>(0.0486, 0.1456, 0.9317) * excess(at, 460.0)
        + vec3<f32>(0.2074, 0.7197, 0.0683) * excess(at, 540.0)
        + vec3<f32>(0.7440, 0.1348, 0.0) * excess(at, 620.0);
}

// The scattering function of light from wi to wo, linear sRGB in 1/sr. Like `relief_rgb`, it is zero unless
// `answer_part` is 0 (common.wgsl).
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let pair = pair_at_body(wave_at_body(wi), wave_at_body(wo));
    let undivided = pair.factor * relief_rgb(pair.q);
    if table.albedo_cells == 0u {
        return undivided;
    }
    return undivided / (1.0 + max(band_excess(place_at_body(wi)), band_excess(place_at_body(wo))));
}
