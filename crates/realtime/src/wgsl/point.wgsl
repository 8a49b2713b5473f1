// Turns the point that a ray from the camera meets into a query, the input of the BRDF's evaluation (query.wgsl). Also
// finds whether the sun is visible from the point. locate.wgsl calls these functions for each pixel. Compiled after
// frame.wgsl, mesh.wgsl, trace.wgsl, sheet.wgsl, sunlight.wgsl and query.wgsl.
//
// Symbols:
//
// - p: a point in the scene's frame, in cm;
// - c0, c1, c2: corners of a triangle; b: weights of c1 and c2 at p, where c0 has the weight 1 - b.x - b.y;
// - n, s, t: unit vectors of the shading frame at p. n is the shading normal, interpolated between corners, s the
//   tangent along the texture coordinate u, and t the bitangent n × s;
// - `face`: unit normal of the flat triangle;
// - wi, wo: unit vectors to the sun and to the viewer. A query of the mesh has them in the grating's frame
//   (`point_to_grating`), a query of the ground in the scene's frame.
//
// The shading frame has the conventions of Mitsuba 3 for a mesh with normals and texture coordinates, so pictures agree
// with Mitsuba's pixel by pixel. `frame` (frame.wgsl) has the camera, the sun, the ground, the grating's rotation and
// the film's index. Lengths are in cm.

// Box and axes of the sun's depth map, in cm; `side` is the number of texels along each side.
@group(0) @binding(9) var<uniform> sunlight: Sunlight;
// Depths of the sun's map (sunlight.wgsl), rows from the top, columns from the left: 1 at the side of the map's box
// that faces the sun, 0 where there is no mesh. A depth d is the coordinate 2d - 1 of `sunlight_position` along the
// direction to the sun.
@group(0) @binding(10) var<storage, read> sun_depths: array<f32>;

// Half the side of the square ground in cm, as in the Mitsuba scene that pictures are compared with (view.rs).
const POINT_GROUND_HALF_SIDE_CM: f32 = 200.0;
// Mitsuba's RayEpsilon: 1500 times half the machine epsilon of single precision. `point_offset` multiplies it by 1 cm
// plus the largest coordinate. Smaller values let rays meet the surface that they start from; larger ones miss near
// occluders.
const POINT_EPSILON: f32 = 8.940697e-5;

// Start of a ray along `direction` from the point p of a surface with the unit normal n. `direction` may be on either
// side of the surface. The start is moved off it, so that the ray does not meet the surface again (Mitsuba's
// `offset_p`). The distance grows with the coordinates, as their rounding errors do; the summand 1 cm keeps it above 0
// at the origin.
fn point_offset(p: vec3<f32>, n: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(p.x), max(abs(p.y), abs(p.z)));
    let distance = (1.0 + largest) * POINT_EPSILON;
    return p + n * select(-distance, distance, dot(n, direction) >= 0.0);
}

// A unit vector orthogonal to n, the tangent of triangles with degenerate texture coordinates (Duff et al., Building an
// Orthonormal Basis, Revisited, JCGT 6(1), 2017).
fn point_tangent(n: vec3<f32>) -> vec3<f32> {
    let sign_z = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign_z + n.z);
    return vec3<f32>(1.0 + sign_z * n.x * n.x * a, sign_z * n.x * n.y * a, -sign_z * n.x);
}

// The direction w of the shading frame in the grating's frame. The latter is rotated about the normal, from s towards
// t, by the angle with the cosine and sine `frame.rotation`.
fn point_to_grating(w: vec3<f32>) -> vec3<f32> {
    let cos_angle = frame.rotation.x;
    let sin_angle = frame.rotation.y;
    return vec3<f32>(cos_angle * w.x + sin_angle * w.y, cos_angle * w.y - sin_angle * w.x, w.z);
}

// A query with the point that the ray of a pixel meets. WGSL initialises variables to zeros, which is a query of
// QUERY_NOTHING.
struct Point {
    query: Query,
    // Point that the ray meets.
    p: vec3<f32>,
    // Unit normal of the triangle or of the ground at p.
    face: vec3<f32>,
}

// Whether the mesh is a film; `film_eta` is 0 for an opaque mesh.
fn point_is_film() -> bool {
    return frame.film_eta != 0.0;
}

// The point of a triangle of the mesh, with its query. locate.wgsl adds the sunlight; `lit` and `sun` are 0 here.
// `to_viewer` is a unit vector in the scene's frame.
fn point_mesh(c0: Vertex, c1: Vertex, c2: Vertex, b: vec2<f32>, to_viewer: vec3<f32>) -> Point {
    let b0 = 1.0 - b.x - b.y;
    // Edges in cm.
    let e1 = c1.position - c0.position;
    let e2 = c2.position - c0.position;
    let face = normalize(cross(e1, e2));

    // Partial derivative of the position by u, from two edges and their differences of texture coordinates (Pharr et
    // al., Physically Based Rendering, section on triangle meshes). With a determinant of 0 the texture coordinates
    // define no tangent.
    let uv0 = vec2<f32>(c0.u, c0.v);
    let d1 = vec2<f32>(c1.u, c1.v) - uv0;
    let d2 = vec2<f32>(c2.u, c2.v) - uv0;
    let determinant = d1.x * d2.y - d1.y * d2.x;
    var dp_du = point_tangent(face);
    if determinant != 0.0 {
        dp_du = (d2.y * e1 - d1.y * e2) / determinant;
    }
    let n = normalize(c0.normal * b0 + c1.normal * b.x + c2.normal * b.y);
    let s = normalize(dp_du - n * dot(n, dp_du));
    let t = cross(n, s);

    var wi = vec3<f32>(dot(frame.to_sun, s), dot(frame.to_sun, t), dot(frame.to_sun, n));
    var wo = vec3<f32>(dot(to_viewer, s), dot(to_viewer, t), dot(to_viewer, n));
    // An opaque mesh looks alike from both sides: for a viewer behind it the normal is reversed, as by Mitsuba's plugin
    // `twosided`. A film keeps its normal, because its two sides scatter differently.
    if wo.z < 0.0 && !point_is_film() {
        wi.z = -wi.z;
        wo.z = -wo.z;
    }
    var found: Point;
    found.query.wi = point_to_grating(wi);
    found.query.wo = point_to_grating(wo);
    found.query.kind = QUERY_SKIN;
    found.query.uv = uv0 * b0 + vec2<f32>(c1.u, c1.v) * b.x + vec2<f32>(c2.u, c2.v) * b.y;
    found.p = c0.position * b0 + c1.position * b.x + c2.position * b.y;
    found.face = face;
    return found;
}

// The point where a ray from the camera meets the ground nearer than the distance `farthest` in cm; else QUERY_NOTHING.
// The ground is seen from above only. `ray` is a unit vector.
fn point_ground(ray: vec3<f32>, farthest: f32) -> Point {
    var found: Point;
    let distance = -frame.origin.z / ray.z;
    // Not read unless `meets_plane`: it may be any value for a horizontal ray, and lies behind the camera for a rising
    // one.
    let p = frame.origin + distance * ray;
    let meets_plane = frame.has_ground != 0u && ray.z < 0.0 && frame.origin.z > 0.0;
    if meets_plane && all(abs(p.xy) <= vec2<f32>(POINT_GROUND_HALF_SIDE_CM)) && distance < farthest {
        found.query.wi = frame.to_sun;
        found.query.wo = -ray;
        found.query.kind = QUERY_GROUND;
        found.p = vec3<f32>(p.xy, 0.0);
        found.face = vec3<f32>(0.0, 0.0, 1.0);
    }
    return found;
}

// The query of a ray from the camera, for the nearer one of the ground and the triangle of `hit`. `hit` may be a miss,
// at the distance TRACE_FAR.
fn point_hit(ray: vec3<f32>, hit: Hit, c0: Vertex, c1: Vertex, c2: Vertex) -> Point {
    var found = point_ground(ray, hit.distance);
    if found.query.kind == QUERY_NOTHING && hit.triangle != TRACE_NONE {
        found = point_mesh(c0, c1, c2, hit.b, -ray);
    }
    return found;
}

// Largest height of a depth above the plane through the surface point, in widths of a texel, at which the depth counts
// as the surface itself. A surface with a radius of curvature of one texel rises about as high within a texel. Chosen:
// larger values overlook near occluders; smaller ones need more rays.
const POINT_SURFACE_MAX: f32 = 0.5;
// Smallest height above the plane, in widths of a texel, at which a depth counts as an occluder that shadows the whole
// texel. Chosen: smaller values darken points beside occluders; larger ones need more rays.
const POINT_OCCLUDER_MIN: f32 = 2.0;
// Smallest cosine between the normal and the sun at which the map decides. At smaller cosines one texel covers a part
// of the plane that is more than ten texels long. Chosen: larger values need more rays; smaller ones leave wrong
// shadows.
const POINT_COSINE_MIN: f32 = 0.1;

// Visibility of the sun: hidden by the mesh or the surface itself, or not needed since the pixel's ray meets nothing.
const POINT_SUN_HIDDEN: u32 = 0u;
// Visibility of the sun: visible.
const POINT_SUN_VISIBLE: u32 = 1u;
// Visibility of the sun: the depth map cannot tell, so a ray must.
const POINT_SUN_UNDECIDED: u32 = 2u;

// Visibility of the sun (POINT_SUN_*) from the point p of a plane with the unit normal n, by the sun's depth map. The
// sun is visible where the four depths around the point are at most POINT_SURFACE_MAX in front of the plane. It is
// hidden where all four are at least POINT_OCCLUDER_MIN in front of the plane. Otherwise only a ray can decide.
fn point_map_visibility(p: vec3<f32>, n: vec3<f32>) -> u32 {
    // Coordinates along `right`, `up` and `to_sun`, -1 to 1 inside the map's box.
    let position = sunlight_position(sunlight, p);
    // Position as column and row in texels, rows from the top; whole numbers are the centres of texels.
    let texel = (0.5 * position.xy * vec2<f32>(1.0, -1.0) + 0.5) * sunlight.side - 0.5;
    if any(texel < vec2<f32>(0.0)) || any(texel >= vec2<f32>(sunlight.side - 1.0)) {
        // The four texels around the point do not all exist. The map has a margin around the mesh, so a ray to the sun
        // misses the mesh there.
        return POINT_SUN_VISIBLE;
    }
    // Negative on a side that faces away from the sun; the heights below hold there, too.
    let cosine = dot(n, sunlight.to_sun);
    if abs(cosine) < POINT_COSINE_MIN {
        return POINT_SUN_UNDECIDED;
    }
    // Distances in cm from a texel to the next column along the map's axis `right`, and to the next row along `up`.
    // Rows run downwards, so the second distance is negative.
    let texel_step = 2.0 * vec2<f32>(sunlight.half_width, -sunlight.half_height) / sunlight.side;
    // Rises of the plane towards the sun in cm for a step to the next column and to the next row. A vector
    // axis + r·to_sun lies in the plane if its product with n is 0, so r = -dot(n, axis)/cosine.
    let rise = -vec2<f32>(dot(n, sunlight.right), dot(n, sunlight.up)) * texel_step / cosine;
    // The four texels around the point, in the order of the following vectors: the upper left one, its right neighbour,
    // and the two below. `offset` is the position of the point between them, 0 to 1.
    let corner = floor(texel);
    let offset = texel - corner;
    let side = u32(sunlight.side);
    let above = u32(corner.y) * side + u32(corner.x);
    let below = above + side;
    let depths = vec4<f32>(sun_depths[above], sun_depths[above + 1u], sun_depths[below], sun_depths[below + 1u]);
    // Heights of the plane at the four texels, in cm towards the sun from the point p.
    let plane = vec4<f32>(-offset.x, 1.0 - offset.x, -offset.x, 1.0 - offset.x) * rise.x
        + vec4<f32>(-offset.y, -offset.y, 1.0 - offset.y, 1.0 - offset.y) * rise.y;
    // Coordinates of the depths along the direction to the sun, from -1 to 1 over the depth of the box. A depth of 0,
    // where there is no mesh, is moved far away from the sun, so that it counts as no occluder. The margin of the box
    // keeps depths of the mesh above 0.
    let towards_sun = select(2.0 * depths - 1.0, vec4<f32>(-1e9), depths == vec4<f32>(0.0));
    // Heights of the depths above the plane, in widths of a texel along `right`.
    let in_front = ((towards_sun - position.z) * sunlight.half_depth - plane) / texel_step.x;
    if all(in_front <= vec4<f32>(POINT_SURFACE_MAX)) {
        return POINT_SUN_VISIBLE;
    }
    return select(POINT_SUN_UNDECIDED, POINT_SUN_HIDDEN, all(in_front >= vec4<f32>(POINT_OCCLUDER_MIN)));
}

// Visibility of the sun (POINT_SUN_*) from the point of a query, by the first case that applies:
//
// - hidden where the pixel's ray meets nothing;
// - hidden where an opaque surface, the ground or a mesh that is no film, faces away from the sun or the viewer;
// - hidden where the surface is parallel to the direction of the sun or the viewer;
// - undecided where the map says hidden but the mesh is a film, which lets light pass;
// - else the result of the map.
fn point_visibility(found: Point) -> u32 {
    let query = found.query;
    let is_film = query.kind == QUERY_SKIN && point_is_film();
    let faces_away = min(query.wi.z, query.wo.z) <= 0.0;
    if query.kind == QUERY_NOTHING || (faces_away && !is_film) || query.wi.z * query.wo.z == 0.0 {
        return POINT_SUN_HIDDEN;
    }
    let visibility = point_map_visibility(found.p, found.face);
    return select(visibility, POINT_SUN_UNDECIDED, visibility == POINT_SUN_HIDDEN && point_is_film());
}

// Fraction of the sunlight that is left at a point after every crossing of the film on its way, 0 to 1.
fn point_sun_fraction(found: Point) -> f32 {
    return sheet_passed(point_offset(found.p, found.face, frame.to_sun), frame.to_sun, TRACE_FAR);
}
