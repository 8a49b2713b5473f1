// From the triangles that the rasteriser found to queries: the place on the triangle, the shading frame there, the
// directions in it, and whether the sun is seen from there. Pixels are listed first, those with a triangle and the others,
// and then those that take a ray through the tree, and each list has a pass of its own: adapters that run several pixels in
// step would otherwise make all of them wait for those that need more.
//
// The conventions are those of Mitsuba 3 for a mesh with normals and texture coordinates, so that pictures can be
// compared pixel by pixel.

// Lists of pixels, and how many there are in each. A pixel is a word: its column, and its row in the upper half.
struct Lists {
    // Of `chosen`.
    chosen: atomic<u32>,
    // Those that take a ray through the tree.
    rest: atomic<u32>,
    // Those where the rasteriser found a triangle.
    skin: atomic<u32>,
    // The others.
    bare: atomic<u32>,
    // The skin from the first entry on, the bare backwards from the last of so many entries as there are pixels, and the
    // rest after that.
    entries: array<u32>,
}

@group(0) @binding(4) var seen: texture_2d<u32>;
@group(0) @binding(5) var<storage, read_write> queries: array<Query>;
// The indices of the queries that need an answer.
@group(0) @binding(6) var<storage, read_write> chosen: array<u32>;
@group(0) @binding(7) var<storage, read_write> lists: Lists;
// The sum over the samples so far, rows from the top.
@group(0) @binding(8) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(9) var<uniform> sunlight: Sunlight;
// Its depths, rows from the top.
@group(0) @binding(10) var<storage, read> sunlit: array<f32>;

// Half the edge of the ground.
const LOCATE_GROUND: f32 = 200.0;
// Mitsuba's RayEpsilon: 1500 times the spacing of single precision.
const LOCATE_EPSILON: f32 = 8.940697e-5;

// Starts a ray so far off the surface that it does not meet it again.
fn locate_offset(p: vec3<f32>, n: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(p.x), max(abs(p.y), abs(p.z)));
    let distance = (1.0 + largest) * LOCATE_EPSILON;
    return p + n * select(-distance, distance, dot(n, direction) >= 0.0);
}

// Some tangent, for triangles without texture coordinates of their own (Duff et al., Building an Orthonormal Basis,
// Revisited, JCGT 6(1), 2017).
fn locate_tangent(n: vec3<f32>) -> vec3<f32> {
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    return vec3<f32>(1.0 + side * n.x * n.x * a, side * n.x * n.y * a, -side * n.x);
}

fn locate_to_grating(w: vec3<f32>) -> vec3<f32> {
    let r = frame.rotation;
    return vec3<f32>(r.x * w.x + r.y * w.y, r.x * w.y - r.y * w.x, w.z);
}

// How far a curved surface may leave its tangent plane within a texel, and how far from the plane what throws a shadow on
// all of a texel has to be; in texels.
const LOCATE_SAME: f32 = 0.5;
const LOCATE_APART: f32 = 2.0;
// Less of the sun's light than this share falls on a plane of which a texel shows too much.
const LOCATE_GRAZING: f32 = 0.1;

// Whether the sun is seen from a place: LOCATE_DARK, LOCATE_LIT, LOCATE_UNSURE.
const LOCATE_DARK: u32 = 0u;
const LOCATE_LIT: u32 = 1u;
const LOCATE_UNSURE: u32 = 2u;

// Whether the sun is seen from a place on a plane with this normal. The depths around it either continue the plane, or
// lie far in front of it, or it takes a ray to tell.
fn locate_light(p: vec3<f32>, n: vec3<f32>) -> u32 {
    let place = sunlight_place(sunlight, p);
    let texel = (0.5 * place.xy * vec2<f32>(1.0, -1.0) + 0.5) * sunlight.side - 0.5;
    if any(texel < vec2<f32>(0.0)) || any(texel >= vec2<f32>(sunlight.side - 1.0)) {
        // The box has a margin, so the ray passes the mesh.
        return LOCATE_LIT;
    }
    let cosine = dot(n, sunlight.to_sun);
    if abs(cosine) < LOCATE_GRAZING {
        return LOCATE_UNSURE;
    }
    let size = 2.0 * vec2<f32>(sunlight.half_width, -sunlight.half_height) / sunlight.side;
    let slope = -vec2<f32>(dot(n, sunlight.across), dot(n, sunlight.up)) * size / cosine;
    let corner = floor(texel);
    let t = texel - corner;
    let side = u32(sunlight.side);
    let at = u32(corner.y) * side + u32(corner.x);
    let depths = vec4<f32>(sunlit[at], sunlit[at + 1u], sunlit[at + side], sunlit[at + side + 1u]);
    let plane = vec4<f32>(-t.x, 1.0 - t.x, -t.x, 1.0 - t.x) * slope.x + vec4<f32>(-t.y, -t.y, 1.0 - t.y, 1.0 - t.y) * slope.y;
    // How far what the sun sees is in front of the plane, in texels. Where it sees no mesh, nothing is in front of
    // anything; the margin of the box keeps the depths of the mesh above 0.
    let along = select(2.0 * depths - 1.0, vec4<f32>(-1e9), depths == vec4<f32>(0.0));
    let in_front = ((along - place.z) * sunlight.half_depth - plane) / size.x;
    if all(in_front <= vec4<f32>(LOCATE_SAME)) {
        return LOCATE_LIT;
    }
    return select(LOCATE_UNSURE, LOCATE_DARK, all(in_front >= vec4<f32>(LOCATE_APART)));
}

// A query, and where it is asked: the place, and the normal of the plane there.
struct Seen {
    query: Query,
    p: vec3<f32>,
    face: vec3<f32>,
}

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
    // The same skin on both sides: seen from behind, behind is in front.
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

// What is seen along a ray where it meets no mesh nearer than `farthest`: the ground, or nothing.
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

// What is seen along a ray that meets the mesh as `hit` says, at a triangle with these corners.
fn locate_seen(ray: vec3<f32>, hit: Hit, c0: Vertex, c1: Vertex, c2: Vertex) -> Seen {
    var found = locate_beyond(ray, hit.distance);
    if found.query.kind == QUERY_NOTHING && hit.triangle != TRACE_NONE {
        found = locate_skin(c0, c1, c2, hit.b, -ray);
    }
    return found;
}

fn locate_index(pixel: vec2<u32>) -> u32 {
    return pixel.y * frame.width + pixel.x;
}

fn locate_packed(pixel: vec2<u32>) -> u32 {
    return (pixel.y << 16u) | pixel.x;
}

fn locate_unpacked(packed: u32) -> vec2<u32> {
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

// How many pixels there are, which is also where the entries of the rest begin.
fn locate_area() -> u32 {
    return frame.width * frame.height;
}

// What a sample adds to its pixel as yet: the ground's radiance is known, the skin's is the method's to answer.
fn locate_radiance(query: Query) -> vec3<f32> {
    return select(vec3<f32>(0.0), frame.weight * frame.to_sun.z * frame.soil, query.kind == QUERY_GROUND && query.lit != 0u);
}

// Whether the sun is seen from what is seen at a pixel.
fn locate_light_at(found: Seen) -> u32 {
    let query = found.query;
    if query.kind == QUERY_NOTHING || query.wi.z <= 0.0 || query.wo.z <= 0.0 {
        return LOCATE_DARK;
    }
    return locate_light(found.p, found.face);
}

// Stores what is seen at a pixel, or with `missed` that it takes a ray to tell, and what that adds to the pixel as yet. The
// first sample replaces the previous picture.
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

fn locate_ray(pixel: vec2<u32>) -> vec3<f32> {
    let size = vec2<f32>(f32(frame.width), f32(frame.height));
    let place = 2.0 * (vec2<f32>(pixel) + frame.place) / size - 1.0;
    return normalize(frame.forward + place.x * frame.across + place.y * frame.down);
}

// The number of an invocation in a dispatch over a list.
fn locate_number(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

// Pixels or entries that an invocation sorts, one bit for each, so that invocations seldom have to wait for each other.
const LOCATE_RUN: u32 = 32u;

// Sorts runs of pixels along rows.
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

// The bare, as far as it goes without the tree.
@compute @workgroup_size(64)
fn locate_bare(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.bare) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_area() - 1u - number]);
    locate_store(pixel, locate_beyond(locate_ray(pixel), TRACE_FAR), false);
}

// The skin, likewise.
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
    // The rasteriser rounds corners to fractions of a pixel, so it now and then names a neighbour.
    let missed = hit.triangle == TRACE_NONE;
    var found: Seen;
    if !missed {
        found = locate_seen(ray, hit, c0, c1, c2);
    }
    locate_store(pixel, found, missed);
}

// The rest.
@compute @workgroup_size(64)
fn locate_rest(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.rest) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_area() + number]);
    let ray = locate_ray(pixel);
    // Where there is no triangle, any will do: what it gives is not used.
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

// Chooses among runs of the skin.
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
