// Scattering function of a film of the refractive index n. It is the colour table of the relief magnified n times,
// multiplied by the factor of transparent.wgsl. Where energy is conserved, it is divided by max(A(wi), A(wo)). Compiled
// after transparent.wgsl and albedo.wgsl. Counterpart of `TransmissiveColourLobe` in src/lobe/transmissive.rs, with the
// same arithmetic.
//
// A of a direction is about its albedo, but at least 1 (albedo.wgsl). The albedo of a film is the fraction of the light
// that it reflects or transmits. The table of albedos has a second side, for directions below the film: those of the
// wave in the film's medium. table.wgsl declares the uniform struct `table`.

// Place of a direction in the table, in the lowest gap of its side (albedo.wgsl). The first side is that of directions
// above the relief, the second that of directions below.
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
