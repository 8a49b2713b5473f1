// From the triangles that the rasteriser found to queries: the place on the triangle, the shading frame there, the
// directions in it, and whether the sun is seen from there. Where that takes a ray through the tree, a pass of its own
// has it: adapters that run several pixels in step would otherwise make all of them wait for the few that need it.
//
// The conventions are those of Mitsuba 3 for a mesh with normals and texture coordinates, so that pictures can be
// compared pixel by pixel.

// Indices of pixels, and how many there are in each list.
struct Lists {
    // Of `chosen`.
    chosen: atomic<u32>,
    // Of `unsure`.
    unsure: atomic<u32>,
    // Of `missed`: the ray passes the triangle that the rasteriser found.
    missed_count: atomic<u32>,
    missed: array<u32>,
}

@group(0) @binding(4) var seen: texture_2d<u32>;
@group(0) @binding(5) var<storage, read_write> queries: array<Query>;
// The indices of the queries that need an answer.
@group(0) @binding(6) var<storage, read_write> chosen: array<u32>;
@group(0) @binding(7) var<storage, read_write> lists: Lists;
// Where rays to the sun start that decide whether it is seen, and the pixel's index as the bits of the last number.
@group(0) @binding(8) var<storage, read_write> unsure: array<vec4<f32>>;
// The sum over the samples so far, rows from the top.
@group(0) @binding(9) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(10) var<uniform> sunlight: Sunlight;
// Its depths, rows from the top.
@group(0) @binding(11) var<storage, read> sunlit: array<f32>;

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

// What is seen along a ray that meets the mesh as `hit` says, at a triangle with these corners.
fn locate_seen(ray: vec3<f32>, hit: Hit, c0: Vertex, c1: Vertex, c2: Vertex) -> Seen {
    var found = locate_skin(c0, c1, c2, hit.b, -ray);
    if hit.triangle == TRACE_NONE {
        found.query = Query();
    }
    let ground = -frame.origin.z / ray.z;
    let p = frame.origin + ground * ray;
    let in_front = frame.ground != 0u && ray.z < 0.0 && frame.origin.z > 0.0;
    if in_front && all(abs(p.xy) <= vec2<f32>(LOCATE_GROUND)) && ground < hit.distance {
        found.query = Query();
        found.query.wi = frame.to_sun;
        found.query.wo = -ray;
        found.query.kind = QUERY_GROUND;
        found.p = vec3<f32>(p.xy, 0.0);
        found.face = vec3<f32>(0.0, 0.0, 1.0);
    }
    return found;
}

// What a sample adds to its pixel as yet, where there is light: the ground's radiance is known, the skin's is the
// method's to answer.
fn locate_lit(index: u32, kind: u32) -> vec3<f32> {
    if kind == QUERY_SKIN {
        chosen[atomicAdd(&lists.chosen, 1u)] = index;
        return vec3<f32>(0.0);
    }
    return frame.weight * frame.to_sun.z * frame.soil;
}

// Stores what is seen at a pixel, and what is left to do about it; gives what the sample adds to the pixel as yet.
fn locate_store(index: u32, found: Seen) -> vec3<f32> {
    var query = found.query;
    var light = LOCATE_DARK;
    if query.kind != QUERY_NOTHING && query.wi.z > 0.0 && query.wo.z > 0.0 {
        light = locate_light(found.p, found.face);
    }
    query.lit = u32(light == LOCATE_LIT);
    queries[index] = query;
    if light == LOCATE_UNSURE {
        let start = locate_offset(found.p, found.face, frame.to_sun);
        unsure[atomicAdd(&lists.unsure, 1u)] = vec4<f32>(start, bitcast<f32>(index));
    }
    if light == LOCATE_LIT {
        return locate_lit(index, query.kind);
    }
    return vec3<f32>(0.0);
}

fn locate_ray(pixel: vec2<u32>) -> vec3<f32> {
    let size = vec2<f32>(f32(frame.width), f32(frame.height));
    let place = 2.0 * (vec2<f32>(pixel) + frame.place) / size - 1.0;
    return normalize(frame.forward + place.x * frame.across + place.y * frame.down);
}

// Every pixel, as far as it goes without the tree.
@compute @workgroup_size(8, 8)
fn locate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.width || id.y >= frame.height {
        return;
    }
    let index = id.y * frame.width + id.x;
    let number = textureLoad(seen, id.xy, 0).x;
    // Where there is no triangle, any will do: what it gives is not used.
    let triangle = max(number, 1u) - 1u;
    let c0 = mesh_vertex(triangle, 0u);
    let c1 = mesh_vertex(triangle, 1u);
    let c2 = mesh_vertex(triangle, 2u);
    let ray = locate_ray(id.xy);
    var hit = Hit(TRACE_NONE, TRACE_FAR, vec2<f32>(0.0));
    if number != 0u {
        hit = trace_corners(frame.origin, ray, triangle, c0.position, c1.position, c2.position);
    }
    var sum = vec4<f32>(0.0, 0.0, 0.0, frame.weight);
    if number != 0u && hit.triangle == TRACE_NONE {
        // The rasteriser rounds corners to fractions of a pixel, so it now and then names a neighbour.
        lists.missed[atomicAdd(&lists.missed_count, 1u)] = index;
    } else {
        sum += vec4<f32>(locate_store(index, locate_seen(ray, hit, c0, c1, c2)), 0.0);
    }
    if frame.first == 0u {
        sum += picture[index];
    }
    picture[index] = sum;
}

// The number of an invocation in a dispatch over a list.
fn locate_number(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

// The pixels of `missed`.
@compute @workgroup_size(64)
fn locate_missed(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.missed_count) {
        return;
    }
    let index = lists.missed[number];
    let ray = locate_ray(vec2<u32>(index % frame.width, index / frame.width));
    let hit = trace(frame.origin, ray, TRACE_FAR, false);
    let triangle = select(hit.triangle, 0u, hit.triangle == TRACE_NONE);
    let c0 = mesh_vertex(triangle, 0u);
    let c1 = mesh_vertex(triangle, 1u);
    let c2 = mesh_vertex(triangle, 2u);
    picture[index] += vec4<f32>(locate_store(index, locate_seen(ray, hit, c0, c1, c2)), 0.0);
}

// The rays of `unsure`.
@compute @workgroup_size(64)
fn locate_unsure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_number(id, groups);
    if number >= atomicLoad(&lists.unsure) {
        return;
    }
    let start = unsure[number];
    if trace(start.xyz, frame.to_sun, TRACE_FAR, true).triangle == TRACE_NONE {
        let index = bitcast<u32>(start.w);
        queries[index].lit = 1u;
        picture[index] += vec4<f32>(locate_lit(index, queries[index].kind), 0.0);
    }
}
