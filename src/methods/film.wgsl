// Scattering function of a film of the refractive index n. It is the colour table (`relief_rgb` in table.wgsl) times
// the factor of transparent.wgsl. The table is that of the relief magnified n times, since wavelengths in the film are
// 1/n of those in air. Where energy is conserved, the product is divided by max(A(wi), A(wo)). Compiled after
// table.wgsl, transparent.wgsl and albedo.wgsl. Counterpart of `TransmissiveColourLobe` in src/lobe/transmissive.rs,
// with the same arithmetic.
//
// A of a direction is about its albedo, but at least 1 (albedo.wgsl). The albedo of a film is the fraction of the light
// that it reflects or transmits. The table of albedos has two sides: first directions above the relief, then directions
// below the film. The latter are looked up by the direction that the wave has within the film.

// Place of a direction in the table of albedos, in the lowest gap of its side (albedo.wgsl).
fn place_at_body(w: vec3<f32>) -> GridPlace {
    let n = table.body_eta;
    let cells = table.albedo_cells;
    let is_below = w.z < 0.0;
    // The direction within the film by Snell's law, pointing upwards; used for directions below only.
    let below = vec3<f32>(w.xy / n, sqrt(w.z * w.z + (n - 1.0) * (n + 1.0)) / n);
    var at = place(select(w, below, is_below));
    // A side has one grid of cells for each gap between neighbouring planes.
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
