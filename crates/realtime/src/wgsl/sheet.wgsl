// Light that passes films without being bent; compiled after trace.wgsl. Orders of a film leave its light in other
// directions, but here all of it goes straight on: for the radiance behind a film, and for the sunlight that reaches a
// point behind one. Both are exact where the light comes alike from all sides.

// Transmittance of a flat film for unpolarised light at a cosine with the normal; counterpart of
// `TransparentBody::transmittance` in src/scattering/transparent.rs.
fn sheet_transmittance(eta: f32, cosine: f32) -> f32 {
    let c = max(cosine, 1e-7);
    let eps = eta * eta;
    let inside = sqrt(c * c + (eta - 1.0) * (eta + 1.0));
    let sums = vec2<f32>(c + inside, eps * c + inside);
    // Of one side of the film, for the states s and p.
    let states = 4.0 * c * inside * vec2<f32>(1.0, eps) / (sums * sums);
    return 0.5 * dot(states, states);
}

// Fraction of light that passes all triangles of a film within the distance `farthest` along a ray of unit direction.
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
                let c0 = mesh_vertex(hit.triangle, 0u);
                let c1 = mesh_vertex(hit.triangle, 1u);
                let c2 = mesh_vertex(hit.triangle, 2u);
                let normal = c0.normal * (1.0 - hit.b.x - hit.b.y) + c1.normal * hit.b.x + c2.normal * hit.b.y;
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
