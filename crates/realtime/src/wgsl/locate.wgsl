// Turns the triangles of the rasteriser into queries: the point on the triangle, the shading frame there, the
// directions in the frame, and whether the sun is visible.
//
// Pixels are sorted into lists: `skin` has a triangle, `bare` has none, and `rest` needs a ray through the tree. Each
// list has a pass of its own, because adapters run several pixels in step and all of them wait for the slowest.
//
// The conventions are those of Mitsuba 3 for a mesh with normals and texture coordinates: pictures agree pixel by
// pixel.

// Lists of pixels. A pixel is a word with the column in the lower half and the row in the upper half.
struct Lists {
    // Number of entries of `chosen`, the queries that need an answer.
    chosen: atomic<u32>,
    // Number of pixels that need a ray through the tree.
    rest: atomic<u32>,
    // Number of pixels with a triangle of the rasteriser.
    skin: atomic<u32>,
    // Number of pixels without one.
    bare: atomic<u32>,
    // With n pixels in the picture: `skin` from entry 0 on, `bare` backwards from entry n - 1, `rest` from entry n on.
    entries: array<u32>,
}

// The rasteriser's triangle of each pixel plus 1; 0 for none.
@group(0) @binding(4) var seen: texture_2d<u32>;
@group(0) @binding(5) var<storage, read_write> queries: array<Query>;
// Indices of the queries that need an answer.
@group(0) @binding(6) var<storage, read_write> chosen: array<u32>;
@group(0) @binding(7) var<storage, read_write> lists: Lists;
// Radiance summed over the samples so far, rows from the top.
@group(0) @binding(8) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(9) var<uniform> sunlight: Sunlight;
// The depths of the sun's map, rows from the top.
@group(0) @binding(10) var<storage, read> sunlit: array<f32>;

// Half the side of the ground.
const LOCATE_GROUND: f32 = 200.0;
// Mitsuba's RayEpsilon: 1500 times half the machine epsilon of single precision.
const LOCATE_EPSILON: f32 = 8.940697e-5;

// A starting point off the surface, so that the ray does not meet the surface again.
fn locate_offset(p: vec3<f32>, n: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(p.x), max(abs(p.y), abs(p.z)));
    let distance = (1.0 + largest) * LOCATE_EPSILON;
    return p + n * select(-distance, distance, dot(n, direction) >= 0.0);
}

// A tangent for triangles with degenerate texture coordinates (Duff et al., Building an Orthonormal Basis, Revisited,
// JCGT 6(1), 2017).
fn locate_tangent(n: vec3<f32>) -> vec3<f32> {
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    return vec3<f32>(1.0 + side * n.x * n.x * a, side * n.x * n.y * a, -side * n.x);
}

// A direction of the shading frame in the grating's frame.
fn locate_to_grating(w: vec3<f32>) -> vec3<f32> {
    let r = frame.rotation;
    return vec3<f32>(r.x * w.x + r.y * w.y, r.x * w.y - r.y * w.x, w.z);
}

// Largest distance in texels of a curved surface from its tangent plane within a texel.
const LOCATE_SAME: f32 = 0.5;
// Distance in texels from the plane at which an occluder shadows the whole texel.
const LOCATE_APART: f32 = 2.0;
// Cosine of the sun's angle below which a texel covers too much of a plane.
const LOCATE_GRAZING: f32 = 0.1;

// Visibility of the sun: hidden, visible, or undecided by the map.
const LOCATE_DARK: u32 = 0u;
const LOCATE_LIT: u32 = 1u;
const LOCATE_UNSURE: u32 = 2u;

// Visibility of the sun from a point of a plane with the normal n. The sun is visible where the four depths around the
// point continue the plane, and hidden where all lie far in front of it. Otherwise only a ray can decide.
fn locate_light(p: vec3<f32>, n: vec3<f32>) -> u32 {
    let position = sunlight_position(sunlight, p);
    let texel = (0.5 * position.xy * vec2<f32>(1.0, -1.0) + 0.5) * sunlight.side - 0.5;
    if any(texel < vec2<f32>(0.0)) || any(texel >= vec2<f32>(sunlight.side - 1.0)) {
        // The map has a margin: the ray to the sun misses the mesh.
        return LOCATE_LIT;
    }
    let cosine = dot(n, sunlight.to_sun);
    if abs(cosine) < LOCATE_GRAZING {
        return LOCATE_UNSURE;
    }
    let size = 2.0 * vec2<f32>(sunlight.half_width, -sunlight.half_height) / sunlight.side;
    let slope = -vec2<f32>(dot(n, sunlight.right), dot(n, sunlight.up)) * size / cosine;
    let corner = floor(texel);
    let t = texel - corner;
    let side = u32(sunlight.side);
    let at = u32(corner.y) * side + u32(corner.x);
    let depths = vec4<f32>(sunlit[at], sunlit[at + 1u], sunlit[at + side], sunlit[at + side + 1u]);
    let plane = vec4<f32>(-t.x, 1.0 - t.x, -t.x, 1.0 - t.x) * slope.x
        + vec4<f32>(-t.y, -t.y, 1.0 - t.y, 1.0 - t.y) * slope.y;
    // Distances in texels of the depths in front of the plane. A depth of 0 is no mesh, which is behind everything; the
    // margin of the box keeps depths of the mesh above 0.
    let towards_sun = select(2.0 * depths - 1.0, vec4<f32>(-1e9), depths == vec4<f32>(0.0));
    let in_front = ((towards_sun - position.z) * sunlight.half_depth - plane) / size.x;
    if all(in_front <= vec4<f32>(LOCATE_SAME)) {
        return LOCATE_LIT;
    }
    return select(LOCATE_UNSURE, LOCATE_DARK, all(in_front >= vec4<f32>(LOCATE_APART)));
}

// A query with its point, and the normal of the triangle or ground there.
struct Seen {
    query: Query,
    p: vec3<f32>,
    face: vec3<f32>,
}

// The query at barycentric coordinates b of a triangle.
fn locate_skin(c0: Vertex, c1: Vertex, c2: Vertex, b: vec2<f32>, to_viewer: vec3<f32>) -> Seen {
    let b0 = 1.0 - b.x - b.y;
    let e1 = c1.position - c0.position;
    let e2 = c2.position - c0.position;
    let face = normalize(cross(e1, e2));

    let uv0 = vec2<f32>(c0.u, c0.v);
    let d1 = vec2<f32>(c1.u, c1.v) - uv0;
    let d2 = vec2<f32>(c2.u, c2.v) - uv0;
    let determinant = d1.x * d2.y - d1.y * d2.x;
    var dp_du = locate_tangent(face);
    if determinant != 0.0 {
        dp_du = (d2.y * e1 - d1.y * e2) / determinant;
    }
    let n = normalize(c0.normal * b0 + c1.normal * b.x + c2.normal * b.y);
    let s = normalize(dp_du - n * dot(n, dp_du));
    let t = cross(n, s);

    var wi = vec3<f32>(dot(frame.to_sun, s), dot(frame.to_sun, t), dot(frame.to_sun, n));
    var wo = vec3<f32>(dot(to_viewer, s), dot(to_viewer, t), dot(to_viewer, n));
    // The skin has two equal sides: seen from behind, z is flipped.
    if wo.z < 0.0 {
        wi.z = -wi.z;
        wo.z = -wo.z;
    }
    var found: Seen;
    found.query.wi = locate_to_grating(wi);
    found.query.wo = locate_to_grating(wo);
    found.query.kind = QUERY_SKIN;
    found.query.uv = uv0 * b0 + vec2<f32>(c1.u, c1.v) * b.x + vec2<f32>(c2.u, c2.v) * b.y;
    found.p = c0.position * b0 + c1.position * b.x + c2.position * b.y;
    found.face = face;
    return found;
}

// The query of a ray that meets no mesh nearer than `farthest`: the ground, or nothing.
fn locate_beyond(ray: vec3<f32>, farthest: f32) -> Seen {
    var found: Seen;
    let ground = -frame.origin.z / ray.z;
    let p = frame.origin + ground * ray;
    let in_front = frame.ground != 0u && ray.z < 0.0 && frame.origin.z > 0.0;
    if in_front && all(abs(p.xy) <= vec2<f32>(LOCATE_GROUND)) && ground < farthest {
        found.query.wi = frame.to_sun;
        found.query.wo = -ray;
        found.query.kind = QUERY_GROUND;
        found.p = vec3<f32>(p.xy, 0.0);
        found.face = vec3<f32>(0.0, 0.0, 1.0);
    }
    return found;
}

// The query of a ray with this hit, on a triangle with these corners.
fn locate_seen(ray: vec3<f32>, hit: Hit, c0: Vertex, c1: Vertex, c2: Vertex) -> Seen {
    var found = locate_beyond(ray, hit.distance);
    if found.query.kind == QUERY_NOTHING && hit.triangle != TRACE_NONE {
        found = locate_skin(c0, c1, c2, hit.b, -ray);
    }
    return found;
}

// The number of a pixel, rows from the top.
fn locate_index(pixel: vec2<u32>) -> u32 {
    return pixel.y * frame.width + pixel.x;
}

// A pixel as an entry of the lists.
fn locate_packed(pixel: vec2<u32>) -> u32 {
    return (pixel.y << 16u) | pixel.x;
}

// The pixel of an entry of the lists.
fn locate_unpacked(packed: u32) -> vec2<u32> {
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

// Number of pixels n; the entries of `rest` begin there.
fn locate_area() -> u32 {
    return frame.width * frame.height;
}

// The radiance that a sample adds before the method has answered: that of the ground.
fn locate_radiance(query: Query) -> vec3<f32> {
    let is_lit_ground = query.kind == QUERY_GROUND && query.lit != 0u;
    return select(vec3<f32>(0.0), frame.weight * frame.to_sun.z * frame.soil, is_lit_ground);
}

// Visibility of the sun from the point of a query.
fn locate_light_at(found: Seen) -> u32 {
    let query = found.query;
    if query.kind == QUERY_NOTHING || query.wi.z <= 0.0 || query.wo.z <= 0.0 {
        return LOCATE_DARK;
    }
    return locate_light(found.p, found.face);
}

// Stores the query of a pixel and adds its radiance to the picture; the first sample replaces the previous picture. A
// pixel whose ray missed its triangle, or with an undecided sun, goes to `rest`.
fn locate_store(pixel: vec2<u32>, found: Seen, missed: bool) {
    let index = locate_index(pixel);
    var query = found.query;
    let light = locate_light_at(found);
    query.lit = u32(light == LOCATE_LIT);
    if missed || light == LOCATE_UNSURE {
        lists.entries[locate_area() + atomicAdd(&lists.rest, 1u)] = locate_packed(pixel);
    }
    queries[index] = query;
    var sum = vec4<f32>(locate_radiance(query), frame.weight);
    if frame.first == 0u {
        sum += picture[index];
    }
    picture[index] = sum;
}

// Unit direction of the ray of a pixel.
fn locate_ray(pixel: vec2<u32>) -> vec3<f32> {
    let size = vec2<f32>(f32(frame.width), f32(frame.height));
    let position = 2.0 * (vec2<f32>(pixel) + frame.subpixel) / size - 1.0;
    return normalize(frame.forward + position.x * frame.right + position.y * frame.down);
}

// The number of an invocation in a dispatch over a list.
fn locate_number(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

// Pixels or entries that an invocation sorts, one bit each: one atomic operation then serves a whole run.
const LOCATE_RUN: u32 = 32u;

// Sorts runs of pixels along rows into `skin` and `bare`.
@compute @workgroup_size(64)
fn locate_sort(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    let columns = (frame.width + LOCATE_RUN - 1u) / LOCATE_RUN;
    let row = number / columns;
    if row >= frame.height {
        return;
    }
    let column = LOCATE_RUN * (number - row * columns);
    let count = min(LOCATE_RUN, frame.width - column);
    var skin = 0u;
    for (var i = 0u; i < count; i++) {
        skin |= u32(textureLoad(seen, vec2<u32>(column + i, row), 0).x != 0u) << i;
    }
    let skins = countOneBits(skin);
    var to_skin = atomicAdd(&lists.skin, skins);
    var to_bare = locate_area() - atomicAdd(&lists.bare, count - skins);
    for (var i = 0u; i < count; i++) {
        let is_skin = ((skin >> i) & 1u) != 0u;
        to_bare -= u32(!is_skin);
        lists.entries[select(to_bare, to_skin, is_skin)] = locate_packed(vec2<u32>(column + i, row));
        to_skin += u32(is_skin);
    }
}

// Queries of `bare`, without the tree.
@compute @workgroup_size(64)
fn locate_bare(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.bare) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_area() - 1u - number]);
    locate_store(pixel, locate_beyond(locate_ray(pixel), TRACE_FAR), false);
}

// Queries of `skin`, without the tree.
@compute @workgroup_size(64)
fn locate_found(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.skin) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[number]);
    let triangle = textureLoad(seen, pixel, 0).x - 1u;
    let c0 = mesh_vertex(triangle, 0u);
    let c1 = mesh_vertex(triangle, 1u);
    let c2 = mesh_vertex(triangle, 2u);
    let ray = locate_ray(pixel);
    let hit = trace_corners(frame.origin, ray, triangle, c0.position, c1.position, c2.position);
    // The rasteriser rounds corners to fractions of a pixel and sometimes names a neighbouring triangle.
    let missed = hit.triangle == TRACE_NONE;
    var found: Seen;
    if !missed {
        found = locate_seen(ray, hit, c0, c1, c2);
    }
    locate_store(pixel, found, missed);
}

// Queries of `rest`, with rays through the tree.
@compute @workgroup_size(64)
fn locate_rest(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.rest) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_area() + number]);
    let ray = locate_ray(pixel);
    // Without a triangle, triangle 0 is read and not used.
    let named = textureLoad(seen, pixel, 0).x;
    var triangle = max(named, 1u) - 1u;
    var hit = Hit(TRACE_NONE, TRACE_FAR, vec2<f32>(0.0));
    if named != 0u {
        hit = trace_triangle(frame.origin, ray, triangle);
        if hit.triangle == TRACE_NONE {
            hit = trace(frame.origin, ray, TRACE_FAR, false);
            triangle = select(hit.triangle, triangle, hit.triangle == TRACE_NONE);
        }
    }
    let found = locate_seen(ray, hit, mesh_vertex(triangle, 0u), mesh_vertex(triangle, 1u), mesh_vertex(triangle, 2u));
    var light = locate_light_at(found);
    if light == LOCATE_UNSURE {
        let start = locate_offset(found.p, found.face, frame.to_sun);
        let met = trace(start, frame.to_sun, TRACE_FAR, true).triangle;
        light = select(LOCATE_DARK, LOCATE_LIT, met == TRACE_NONE);
    }
    var query = found.query;
    query.lit = u32(light == LOCATE_LIT);
    let index = locate_index(pixel);
    queries[index] = query;
    picture[index] += vec4<f32>(locate_radiance(query), 0.0);
}

// Lists the lit queries of `skin` in `chosen`, by runs.
@compute @workgroup_size(64)
fn locate_choose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let first = LOCATE_RUN * locate_number(id, groups);
    let end = atomicLoad(&lists.skin);
    if first >= end {
        return;
    }
    let count = min(LOCATE_RUN, end - first);
    var lit = 0u;
    for (var i = 0u; i < count; i++) {
        let index = locate_index(locate_unpacked(lists.entries[first + i]));
        lit |= u32(queries[index].lit != 0u && queries[index].kind == QUERY_SKIN) << i;
    }
    var to = atomicAdd(&lists.chosen, countOneBits(lit));
    while lit != 0u {
        let entry = lists.entries[first + firstTrailingBit(lit)];
        chosen[to] = locate_index(locate_unpacked(entry));
        to += 1u;
        lit &= lit - 1u;
    }
}
