// Light that passes films in a straight line; compiled after frame.wgsl, mesh.wgsl and trace.wgsl.
//
// A film spreads the light that it transmits over diffraction orders. Light that passes a film on its way to the camera
// or to another surface is approximated: the film is a flat *sheet*, which weakens the light but does not deflect it.
// The approximation is good for weak reliefs, which deflect little light.

// Lower bound of a cosine, about the rounding error of a cosine in single precision. A cosine of 0 would give 0/0 for
// eta = 1.
const SHEET_COSINE_MIN: f32 = 1e-7;

// Transmittance in [0, 1] of a flat film of index eta ≥ 1 for unpolarised light, without reflections inside the film.
// `cosine` in [0, 1] belongs to the angle in air between light and normal. Counterpart of
// `TransparentBody::transmittance` in src/scattering/transparent.rs.
fn sheet_transmittance(eta: f32, cosine: f32) -> f32 {
    let c = max(cosine, SHEET_COSINE_MIN);
    // Permittivity of the film.
    let eps = eta * eta;
    // Normal component √(eta² − sin²θ) of the transmitted wave vector, in units of the wave number in air.
    let inside = sqrt(c * c + (eta - 1.0) * (eta + 1.0));
    // Denominators of the Fresnel coefficients of the polarisations s and p.
    let sums = vec2<f32>(c + inside, eps * c + inside);
    // Transmittances of one of the film's two sides for s and p.
    let one_side = 4.0 * c * inside * vec2<f32>(1.0, eps) / (sums * sums);
    // Mean over s and p of the squares, since light passes two sides.
    return 0.5 * dot(one_side, one_side);
}

// Fraction of light that passes the mesh along a ray of unit direction, within the distance `farthest` in cm. The mesh
// is a film, with the index `frame.film_eta`. A ray from the mesh or the ground begins off that surface
// (`point_offset`). The traversal of the tree is that of `trace`, but it visits every triangle on the ray. A ray
// through a common edge, which is rare, is weakened by both triangles.
fn sheet_passed(origin: vec3<f32>, direction: vec3<f32>, farthest: f32) -> f32 {
    let inverse = trace_inverse(direction);
    let count = arrayLength(&nodes);
    var passed = 1.0;
    var index = 0u;
    while index < count {
        let node = nodes[index];
        if node.triangle != TRACE_NONE {
            let hit = trace_triangle(origin, direction, node.triangle);
            if hit.triangle != TRACE_NONE && hit.distance < farthest {
                let v0 = mesh_vertex(hit.triangle, 0u);
                let v1 = mesh_vertex(hit.triangle, 1u);
                let v2 = mesh_vertex(hit.triangle, 2u);
                // The normal interpolated between the corners; its side does not matter.
                let normal = v0.normal * (1.0 - hit.b.x - hit.b.y) + v1.normal * hit.b.x + v2.normal * hit.b.y;
                passed *= sheet_transmittance(frame.film_eta, abs(dot(normalize(normal), direction)));
            }
            index = node.next;
        } else if trace_box(origin, inverse, node.low, node.high, farthest) {
            index += 1u;
        } else {
            index = node.next;
        }
    }
    return passed;
}
