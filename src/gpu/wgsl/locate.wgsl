// From the triangles that the rasteriser found to queries: the place on the triangle, the shading frame there, the
// directions in it, and whether the sun is seen from there.
//
// The conventions are those of Mitsuba 3 for a mesh with normals and texture coordinates, so that pictures can be
// compared pixel by pixel.

@group(0) @binding(4) var seen: texture_2d<u32>;
@group(0) @binding(5) var<storage, read_write> queries: array<Query>;
// The indices of the queries that need an answer, and how many there are.
@group(0) @binding(6) var<storage, read_write> chosen: array<u32>;
@group(0) @binding(7) var<storage, read_write> chosen_count: atomic<u32>;
@group(0) @binding(8) var<uniform> sunlight: Sunlight;
// Its depths, rows from the top.
@group(0) @binding(9) var<storage, read> sunlit: array<f32>;

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

// Whether the sun is seen from a place on a plane with this normal. The depths around it either continue the plane, or
// lie far in front of it, or it takes a ray to tell.
fn locate_is_lit(p: vec3<f32>, n: vec3<f32>) -> bool {
    let place = sunlight_place(sunlight, p);
    let texel = (0.5 * place.xy * vec2<f32>(1.0, -1.0) + 0.5) * sunlight.side - 0.5;
    if any(texel < vec2<f32>(0.0)) || any(texel >= vec2<f32>(sunlight.side - 1.0)) {
        // The box has a margin, so the ray passes the mesh.
        return true;
    }
    let cosine = dot(n, sunlight.to_sun);
    if abs(cosine) >= LOCATE_GRAZING {
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
            return true;
        }
        if all(in_front >= vec4<f32>(LOCATE_APART)) {
            return false;
        }
    }
    return trace(locate_offset(p, n, frame.to_sun), frame.to_sun, TRACE_FAR, true).triangle == TRACE_NONE;
}

fn locate_skin(hit: Hit, to_viewer: vec3<f32>) -> Query {
    let c0 = mesh_vertex(hit.triangle, 0u);
    let c1 = mesh_vertex(hit.triangle, 1u);
    let c2 = mesh_vertex(hit.triangle, 2u);
    let b0 = 1.0 - hit.b.x - hit.b.y;
    let p = c0.position * b0 + c1.position * hit.b.x + c2.position * hit.b.y;
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
    let n = normalize(c0.normal * b0 + c1.normal * hit.b.x + c2.normal * hit.b.y);
    let s = normalize(dp_du - n * dot(n, dp_du));
    let t = cross(n, s);

    var wi = vec3<f32>(dot(frame.to_sun, s), dot(frame.to_sun, t), dot(frame.to_sun, n));
    var wo = vec3<f32>(dot(to_viewer, s), dot(to_viewer, t), dot(to_viewer, n));
    // The same skin on both sides: seen from behind, behind is in front.
    if wo.z < 0.0 {
        wi.z = -wi.z;
        wo.z = -wo.z;
    }
    var query: Query;
    query.wi = locate_to_grating(wi);
    query.wo = locate_to_grating(wo);
    query.kind = QUERY_SKIN;
    query.uv = uv0 * b0 + vec2<f32>(c1.u, c1.v) * hit.b.x + vec2<f32>(c2.u, c2.v) * hit.b.y;
    query.lit = u32(wi.z > 0.0 && wo.z > 0.0 && locate_is_lit(p, face));
    return query;
}

fn locate_ground(p: vec3<f32>, to_viewer: vec3<f32>) -> Query {
    let up = vec3<f32>(0.0, 0.0, 1.0);
    var query: Query;
    query.wi = frame.to_sun;
    query.wo = to_viewer;
    query.kind = QUERY_GROUND;
    query.lit = u32(frame.to_sun.z > 0.0 && locate_is_lit(p, up));
    return query;
}

@compute @workgroup_size(8, 8)
fn locate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.width || id.y >= frame.height {
        return;
    }
    let size = vec2<f32>(f32(frame.width), f32(frame.height));
    let place = 2.0 * (vec2<f32>(id.xy) + frame.place) / size - 1.0;
    let ray = normalize(frame.forward + place.x * frame.across + place.y * frame.down);

    var skin = Hit(TRACE_NONE, TRACE_FAR, vec2<f32>(0.0));
    let number = textureLoad(seen, id.xy, 0).x;
    if number != 0u {
        skin = trace_triangle(frame.origin, ray, number - 1u);
        if skin.triangle == TRACE_NONE {
            // The rasteriser rounds corners to fractions of a pixel, so it now and then names a neighbour.
            skin = trace(frame.origin, ray, TRACE_FAR, false);
        }
    }
    var query: Query;
    let ground = -frame.origin.z / ray.z;
    let p = frame.origin + ground * ray;
    let in_front = frame.ground != 0u && ray.z < 0.0 && frame.origin.z > 0.0;
    if in_front && all(abs(p.xy) <= vec2<f32>(LOCATE_GROUND)) && ground < skin.distance {
        query = locate_ground(vec3<f32>(p.xy, 0.0), -ray);
    } else if skin.triangle != TRACE_NONE {
        query = locate_skin(skin, -ray);
    }
    let index = id.y * frame.width + id.x;
    queries[index] = query;
    if query.kind == QUERY_SKIN && query.lit != 0u {
        chosen[atomicAdd(&chosen_count, 1u)] = index;
    }
}
