// Second stage of a picture (lib.rs), after raster.wgsl: for each pixel, finds the point that its ray meets, the
// directions in the shading frame there, and the visibility of the sun. The result is a query (query.wgsl), a record of
// the point and its directions, for which shade.wgsl computes the reflectance.
//
// The rasteriser has written the triangle of each pixel into the texture `seen`. Entry points, in this order:
//
// 1. locate_sort: sorts pixels into the lists `skin` (with a triangle) and `bare` (without one);
// 2. locate_bare, locate_skin: write the queries of the pixels in `bare` and `skin`. A pixel is added to the list
//    `rest` if its ray misses the rasteriser's triangle, or if the sun's depth map does not decide the visibility;
// 3. locate_rest: writes the queries of the pixels in `rest` by rays through the tree of boxes (trace.wgsl);
// 4. locate_choose: lists the queries of sunlit skin in `chosen`.
//
// Each list has an entry point of its own, because adapters run several pixels in lockstep, and all wait for the
// slowest one.
//
// *Skin* is the surface of the mesh. Symbols: p a point; n, s, t the shading frame (normal, tangent along u,
// bitangent); wi and wo unit vectors to the sun and to the viewer. `frame` (frame.wgsl) is the uniform of the sample:
// camera, sun and ground. The shading frame has Mitsuba 3's conventions for a mesh with normals and texture
// coordinates, so pictures agree pixel by pixel.
//
// A film (`frame.film_eta`) is lit from both sides and lets light pass (sheet.wgsl). Its pixels are all in `rest`: rays
// find the sunlight behind other parts of the film, and the sunlit ground behind it.
//
// Lengths are in cm. frame.wgsl, mesh.wgsl and trace.wgsl declare the bindings 0 to 3.

// Lists of pixels; counterpart of `ListLengths` in target.rs, which has the members before `entries`. locate.rs sets
// these lengths to 0 before each sample. A pixel is a u32 with the column in the lower 16 bits and the row in the upper
// 16.
struct Lists {
    // Number of entries of the buffer `chosen`, the queries that need an answer.
    chosen: atomic<u32>,
    // Number of pixels that need a ray through the tree.
    rest: atomic<u32>,
    // Number of pixels with a triangle of the rasteriser.
    skin: atomic<u32>,
    // Number of pixels without a triangle.
    bare: atomic<u32>,
    // Entries of three lists, for n pixels: `skin` from entry 0 on, `bare` backwards from entry n - 1, `rest` from
    // entry n on.
    entries: array<u32>,
}

// Index of the rasteriser's triangle of each pixel, plus 1; 0 for none.
@group(0) @binding(4) var seen: texture_2d<u32>;
// Query of each pixel, rows from the top.
@group(0) @binding(5) var<storage, read_write> queries: array<Query>;
// Indices of the queries that need an answer.
@group(0) @binding(6) var<storage, read_write> chosen: array<u32>;
@group(0) @binding(7) var<storage, read_write> lists: Lists;
// Weighted sum of the radiance over the samples of each pixel so far (rgb), and the sum of their weights (a); rows from
// the top.
@group(0) @binding(8) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(9) var<uniform> sunlight: Sunlight;
// Depths of the sun's map (sunlight.wgsl), rows from the top: 1 at the side of the map's box that faces the sun, 0
// where there is no mesh. A depth d is the coordinate 2d - 1 of `sunlight_position` along the direction to the sun.
@group(0) @binding(10) var<storage, read> sun_depths: array<f32>;

// Half the side of the square ground in cm, as in the Mitsuba scene that pictures are compared with (view.rs).
const LOCATE_GROUND_HALF_SIDE_CM: f32 = 200.0;
// Mitsuba's RayEpsilon: 1500 times half the machine epsilon of single precision. Smaller values let rays meet the
// surface that they start from; larger ones miss near occluders.
const LOCATE_EPSILON: f32 = 8.940697e-5;
// Largest height above the plane of a surface point, in widths of a texel, at which a depth counts as the surface
// itself. A curved surface leaves its tangent plane by less within a texel. Larger values overlook near occluders;
// smaller ones need more rays.
const LOCATE_SURFACE_MAX: f32 = 0.5;
// Smallest height above the plane, in widths of a texel, at which a depth counts as an occluder that shadows the whole
// texel. Smaller values darken points beside occluders; larger ones need more rays.
const LOCATE_OCCLUDER_MIN: f32 = 2.0;
// Smallest cosine between the normal and the sun at which the map decides. At smaller cosines one texel covers a part
// of the plane that is more than ten texels long. Larger bounds need more rays; smaller ones leave errors of shadows.
const LOCATE_COSINE_MIN: f32 = 0.1;
// Number of pixels or entries that an invocation processes, a *run*, with one bit of a u32 for each. One atomic
// operation reserves the list entries of a whole run. A test compares it with `RUN` in locate.rs.
const LOCATE_RUN: u32 = 32u;

// Visibility of the sun: hidden by the mesh, or behind the surface itself.
const LOCATE_SUN_HIDDEN: u32 = 0u;
// Visibility of the sun: visible.
const LOCATE_SUN_VISIBLE: u32 = 1u;
// Visibility of the sun: the depth map cannot tell, so a ray must.
const LOCATE_SUN_UNDECIDED: u32 = 2u;

// Start of a ray from the point p of a surface with the normal n. The start is moved off the surface, so that the ray
// does not meet the surface again (Mitsuba's `offset_p`). The distance grows with the coordinates, as their rounding
// errors do; the summand 1 keeps it above 0 at the origin.
fn locate_offset(p: vec3<f32>, n: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(p.x), max(abs(p.y), abs(p.z)));
    let distance = (1.0 + largest) * LOCATE_EPSILON;
    return p + n * select(-distance, distance, dot(n, direction) >= 0.0);
}

// A unit vector orthogonal to n, the tangent of triangles with degenerate texture coordinates (Duff et al., Building an
// Orthonormal Basis, Revisited, JCGT 6(1), 2017).
fn locate_tangent(n: vec3<f32>) -> vec3<f32> {
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    return vec3<f32>(1.0 + side * n.x * n.x * a, side * n.x * n.y * a, -side * n.x);
}

// The direction w of the shading frame in the grating's frame, which is rotated about the normal.
fn locate_to_grating(w: vec3<f32>) -> vec3<f32> {
    let cos_angle = frame.rotation.x;
    let sin_angle = frame.rotation.y;
    return vec3<f32>(cos_angle * w.x + sin_angle * w.y, cos_angle * w.y - sin_angle * w.x, w.z);
}

// Visibility of the sun (LOCATE_SUN_*) from the point p of a plane with the unit normal n, by the sun's depth map. The
// sun is visible where the four depths around the point continue the plane, and hidden where all four lie far in front
// of the plane. Otherwise only a ray can decide.
fn locate_map_visibility(p: vec3<f32>, n: vec3<f32>) -> u32 {
    // Coordinates along `right`, `up` and `to_sun`, -1 to 1 inside the map's box.
    let position = sunlight_position(sunlight, p);
    // Position as column and row in texels, rows from the top; whole numbers are the centres of texels.
    let texel = (0.5 * position.xy * vec2<f32>(1.0, -1.0) + 0.5) * sunlight.side - 0.5;
    if any(texel < vec2<f32>(0.0)) || any(texel >= vec2<f32>(sunlight.side - 1.0)) {
        // The four texels around the point do not all exist. The map has a margin around the mesh, so a ray to the sun
        // misses the mesh there.
        return LOCATE_SUN_VISIBLE;
    }
    let cosine = dot(n, sunlight.to_sun);
    if abs(cosine) < LOCATE_COSINE_MIN {
        return LOCATE_SUN_UNDECIDED;
    }
    // Distances in cm from a texel to the next column along the map's axis `right`, and to the next row along `up`.
    // Rows run downwards, so the second distance is negative.
    let texel_step = 2.0 * vec2<f32>(sunlight.half_width, -sunlight.half_height) / sunlight.side;
    // Rises of the plane towards the sun in cm for a step to the next column and to the next row. A vector
    // axis + rise·to_sun lies in the plane if its product with n is 0, so rise = -dot(n, axis)/cosine.
    let slope = -vec2<f32>(dot(n, sunlight.right), dot(n, sunlight.up)) * texel_step / cosine;
    // The four texels around the point, in the order of the following vectors: the upper left one, its right neighbour,
    // and the two below. `offset` is the position of the point between them, 0 to 1.
    let corner = floor(texel);
    let offset = texel - corner;
    let side = u32(sunlight.side);
    let above = u32(corner.y) * side + u32(corner.x);
    let below = above + side;
    let depths = vec4<f32>(sun_depths[above], sun_depths[above + 1u], sun_depths[below], sun_depths[below + 1u]);
    // Heights of the plane at the four texels, in cm towards the sun from the point p.
    let plane = vec4<f32>(-offset.x, 1.0 - offset.x, -offset.x, 1.0 - offset.x) * slope.x
        + vec4<f32>(-offset.y, -offset.y, 1.0 - offset.y, 1.0 - offset.y) * slope.y;
    // Coordinates of the depths along the direction to the sun, from -1 to 1 over the depth of the box. A depth of 0,
    // where there is no mesh, is moved far away from the sun, so that it counts as no occluder. The margin of the box
    // keeps depths of the mesh above 0.
    let towards_sun = select(2.0 * depths - 1.0, vec4<f32>(-1e9), depths == vec4<f32>(0.0));
    // Heights of the depths above the plane, in widths of a texel.
    let in_front = ((towards_sun - position.z) * sunlight.half_depth - plane) / texel_step.x;
    if all(in_front <= vec4<f32>(LOCATE_SURFACE_MAX)) {
        return LOCATE_SUN_VISIBLE;
    }
    return select(LOCATE_SUN_UNDECIDED, LOCATE_SUN_HIDDEN, all(in_front >= vec4<f32>(LOCATE_OCCLUDER_MIN)));
}

// A query with the point that the ray of a pixel meets. WGSL initialises variables to zeros, which is a query of
// QUERY_NOTHING.
struct Located {
    query: Query,
    // Point that the ray meets.
    p: vec3<f32>,
    // Unit normal of the triangle or of the ground at p.
    face: vec3<f32>,
}

// Whether the mesh is a film.
fn locate_is_film() -> bool {
    return frame.film_eta != 0.0;
}

// The query of a point of the mesh, with `lit` and `sun` still 0. The point has the barycentric coordinates b (of c1
// and c2) in the triangle with the corners c0, c1, c2. `to_viewer` is a unit vector.
fn locate_mesh(c0: Vertex, c1: Vertex, c2: Vertex, b: vec2<f32>, to_viewer: vec3<f32>) -> Located {
    let b0 = 1.0 - b.x - b.y;
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
    var dp_du = locate_tangent(face);
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
    if wo.z < 0.0 && !locate_is_film() {
        wi.z = -wi.z;
        wo.z = -wo.z;
    }
    var found: Located;
    found.query.wi = locate_to_grating(wi);
    found.query.wo = locate_to_grating(wo);
    found.query.kind = QUERY_SKIN;
    found.query.uv = uv0 * b0 + vec2<f32>(c1.u, c1.v) * b.x + vec2<f32>(c2.u, c2.v) * b.y;
    found.p = c0.position * b0 + c1.position * b.x + c2.position * b.y;
    found.face = face;
    return found;
}

// The query of a ray from the camera that meets no mesh nearer than the distance `farthest`: of the ground, or of
// QUERY_NOTHING. `ray` is a unit vector.
fn locate_ground(ray: vec3<f32>, farthest: f32) -> Located {
    var found: Located;
    let distance = -frame.origin.z / ray.z;
    // Not read unless `meets_plane`: it is infinite for a horizontal ray and behind the camera for a rising one.
    let p = frame.origin + distance * ray;
    let meets_plane = frame.has_ground != 0u && ray.z < 0.0 && frame.origin.z > 0.0;
    if meets_plane && all(abs(p.xy) <= vec2<f32>(LOCATE_GROUND_HALF_SIDE_CM)) && distance < farthest {
        found.query.wi = frame.to_sun;
        found.query.wo = -ray;
        found.query.kind = QUERY_GROUND;
        found.p = vec3<f32>(p.xy, 0.0);
        found.face = vec3<f32>(0.0, 0.0, 1.0);
    }
    return found;
}

// The query of a ray from the camera, for the nearer one of the ground and the triangle of `hit`, whose corners are c0,
// c1, c2. `hit` may be a miss, at the distance TRACE_FAR.
fn locate_hit(ray: vec3<f32>, hit: Hit, c0: Vertex, c1: Vertex, c2: Vertex) -> Located {
    var found = locate_ground(ray, hit.distance);
    if found.query.kind == QUERY_NOTHING && hit.triangle != TRACE_NONE {
        found = locate_mesh(c0, c1, c2, hit.b, -ray);
    }
    return found;
}

// Index of a pixel in the buffers of queries and of the picture, rows from the top.
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

// Number of pixels n; the list `rest` begins at this entry.
fn locate_pixel_count() -> u32 {
    return frame.width * frame.height;
}

// Radiance of sunlit ground, times the weight of the sample; 0 for other queries. A diffuse ground with the reflectance
// `soil` has the radiance soil·cosθi, since the sun's irradiance is π. resolve.wgsl adds the radiance of the skin.
fn locate_ground_radiance(query: Query) -> vec3<f32> {
    let is_lit_ground = query.kind == QUERY_GROUND && query.lit != 0u;
    return select(vec3<f32>(0.0), query.sun * frame.weight * frame.to_sun.z * frame.soil, is_lit_ground);
}

// Fraction of the sunlight that arrives at a point through all parts of the film, 0 to 1.
fn locate_sun_fraction(found: Located) -> f32 {
    return sheet_passed(locate_offset(found.p, found.face, frame.to_sun), frame.to_sun, TRACE_FAR);
}

// Radiance of the sunlit ground behind the film, along the ray of a pixel, times the weight of the sample.
fn locate_ground_behind(ray: vec3<f32>) -> vec3<f32> {
    var ground = locate_ground(ray, TRACE_FAR);
    if ground.query.kind != QUERY_GROUND || frame.to_sun.z <= 0.0 {
        return vec3<f32>(0.0);
    }
    ground.query.lit = 1u;
    ground.query.sun = 1.0;
    if locate_map_visibility(ground.p, ground.face) != LOCATE_SUN_VISIBLE {
        ground.query.sun = locate_sun_fraction(ground);
    }
    return sheet_passed(frame.origin, ray, distance(ground.p, frame.origin)) * locate_ground_radiance(ground.query);
}

// Visibility of the sun (LOCATE_SUN_*) from the point of a query, by the first case that applies:
//
// - hidden where the pixel's ray meets nothing;
// - hidden where an opaque surface, the ground or a mesh that is no film, faces away from the sun or the viewer;
// - hidden where the surface is parallel to the direction of the sun or the viewer;
// - undecided where the map says hidden but the mesh is a film, which lets light pass;
// - else the result of the map.
fn locate_visibility(found: Located) -> u32 {
    let query = found.query;
    let is_film = query.kind == QUERY_SKIN && locate_is_film();
    let faces_away = min(query.wi.z, query.wo.z) <= 0.0;
    if query.kind == QUERY_NOTHING || (faces_away && !is_film) || query.wi.z * query.wo.z == 0.0 {
        return LOCATE_SUN_HIDDEN;
    }
    let visibility = locate_map_visibility(found.p, found.face);
    return select(visibility, LOCATE_SUN_UNDECIDED, visibility == LOCATE_SUN_HIDDEN && locate_is_film());
}

// Stores the query of a pixel and adds the radiance of the ground and the sample's weight to the picture. The first
// sample replaces the previous picture. The pixel is added to `rest` if `needs_ray` is true, or if the map does not
// decide the visibility of the sun. For such a pixel locate_rest replaces the query. No radiance is added here, since
// its query is no ground or is not lit.
fn locate_store(pixel: vec2<u32>, found: Located, needs_ray: bool) {
    let index = locate_index(pixel);
    var query = found.query;
    let visibility = locate_visibility(found);
    query.lit = u32(visibility == LOCATE_SUN_VISIBLE);
    query.sun = f32(query.lit);
    if needs_ray || visibility == LOCATE_SUN_UNDECIDED {
        lists.entries[locate_pixel_count() + atomicAdd(&lists.rest, 1u)] = locate_packed(pixel);
    }
    queries[index] = query;
    var sum = vec4<f32>(locate_ground_radiance(query), frame.weight);
    if frame.is_first == 0u {
        sum += picture[index];
    }
    picture[index] = sum;
}

// Unit direction of this sample's ray through a pixel, from the camera.
fn locate_ray(pixel: vec2<u32>) -> vec3<f32> {
    let size = vec2<f32>(f32(frame.width), f32(frame.height));
    // Position in the picture, -1 to 1 from the left and from the top.
    let position = 2.0 * (vec2<f32>(pixel) + frame.subpixel) / size - 1.0;
    return normalize(frame.forward + position.x * frame.right + position.y * frame.down);
}

// Linear index of an invocation in a dispatch over a list. The workgroups, of 64 invocations along x, form a grid
// (`dispatch_over` in pipeline.rs).
fn locate_linear_index(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

// Sorts runs of pixels along rows into `skin` and `bare`. `skin` grows from entry 0, `bare` down from entry n - 1.
@compute @workgroup_size(64)
fn locate_sort(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_linear_index(id, groups);
    let columns = (frame.width + LOCATE_RUN - 1u) / LOCATE_RUN;
    let row = number / columns;
    if row >= frame.height {
        return;
    }
    let column = LOCATE_RUN * (number - row * columns);
    let count = min(LOCATE_RUN, frame.width - column);
    // Bit i is set if pixel i of the run has a triangle.
    var skin = 0u;
    for (var i = 0u; i < count; i++) {
        skin |= u32(textureLoad(seen, vec2<u32>(column + i, row), 0).x != 0u) << i;
    }
    let skin_count = countOneBits(skin);
    // Entry for the next pixel with a triangle, and the entry after that for the next one without.
    var next_skin = atomicAdd(&lists.skin, skin_count);
    var after_bare = locate_pixel_count() - atomicAdd(&lists.bare, count - skin_count);
    for (var i = 0u; i < count; i++) {
        let packed = locate_packed(vec2<u32>(column + i, row));
        if ((skin >> i) & 1u) != 0u {
            lists.entries[next_skin] = packed;
            next_skin += 1u;
        } else {
            after_bare -= 1u;
            lists.entries[after_bare] = packed;
        }
    }
}

// Writes the queries of `bare`: of the ground, or of QUERY_NOTHING.
@compute @workgroup_size(64)
fn locate_bare(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_linear_index(id, groups);
    if number >= atomicLoad(&lists.bare) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_pixel_count() - 1u - number]);
    locate_store(pixel, locate_ground(locate_ray(pixel), TRACE_FAR), false);
}

// Writes the queries of `skin` by intersection with the rasteriser's triangle alone. Pixels whose ray misses the
// triangle, and pixels of a film, need rays through the tree.
@compute @workgroup_size(64)
fn locate_skin(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_linear_index(id, groups);
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
    // The rasteriser rounds corners to fractions of a pixel, so it sometimes picks a neighbouring triangle, which the
    // ray misses.
    let missed = hit.triangle == TRACE_NONE;
    var found: Located;
    if !missed {
        found = locate_hit(ray, hit, c0, c1, c2);
    }
    locate_store(pixel, found, missed || (found.query.kind == QUERY_SKIN && locate_is_film()));
}

// Intersection of a pixel's ray with the mesh: with the rasteriser's triangle, or with the nearest triangle if the ray
// misses that one. Pixels without a triangle of the rasteriser have none.
fn locate_intersection(pixel: vec2<u32>, ray: vec3<f32>) -> Hit {
    // The texture holds the triangle plus 1.
    let seen_triangle = textureLoad(seen, pixel, 0).x;
    var hit = Hit(TRACE_NONE, TRACE_FAR, vec2<f32>(0.0));
    if seen_triangle != 0u {
        hit = trace_triangle(frame.origin, ray, seen_triangle - 1u);
        if hit.triangle == TRACE_NONE {
            hit = trace(frame.origin, ray, TRACE_FAR, false);
        }
    }
    return hit;
}

// Writes the queries of `rest` by rays through the tree. For these pixels locate_store has added the weight of the
// sample to the picture, but no radiance, so the weight added here is 0.
@compute @workgroup_size(64)
fn locate_rest(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = locate_linear_index(id, groups);
    if number >= atomicLoad(&lists.rest) {
        return;
    }
    let pixel = locate_unpacked(lists.entries[locate_pixel_count() + number]);
    let ray = locate_ray(pixel);
    let hit = locate_intersection(pixel, ray);
    // For a miss, triangle 0 is read but not used, because indexing with TRACE_NONE would leave the buffer.
    let triangle = select(hit.triangle, 0u, hit.triangle == TRACE_NONE);
    let found = locate_hit(ray, hit, mesh_vertex(triangle, 0u), mesh_vertex(triangle, 1u), mesh_vertex(triangle, 2u));
    var visibility = locate_visibility(found);
    // Fraction of the sunlight that passes films on the way to the point.
    var passed = 1.0;
    if visibility == LOCATE_SUN_UNDECIDED && locate_is_film() {
        passed = locate_sun_fraction(found);
        visibility = LOCATE_SUN_VISIBLE;
    } else if visibility == LOCATE_SUN_UNDECIDED {
        let start = locate_offset(found.p, found.face, frame.to_sun);
        let occluder = trace(start, frame.to_sun, TRACE_FAR, true).triangle;
        visibility = select(LOCATE_SUN_HIDDEN, LOCATE_SUN_VISIBLE, occluder == TRACE_NONE);
    }
    var query = found.query;
    query.lit = u32(visibility == LOCATE_SUN_VISIBLE);
    query.sun = passed * f32(query.lit);
    let index = locate_index(pixel);
    queries[index] = query;
    var radiance = locate_ground_radiance(query);
    if query.kind == QUERY_SKIN && locate_is_film() {
        radiance += locate_ground_behind(ray);
    }
    picture[index] += vec4<f32>(radiance, 0.0);
}

// Lists the queries of sunlit skin in `chosen`. An invocation reads a run of the list `skin`.
@compute @workgroup_size(64)
fn locate_choose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let first = LOCATE_RUN * locate_linear_index(id, groups);
    let end = atomicLoad(&lists.skin);
    if first >= end {
        return;
    }
    let count = min(LOCATE_RUN, end - first);
    // Bit i is set if entry i of the run is sunlit skin. The kind is tested, too: the ground may hide a mesh below it.
    var lit = 0u;
    for (var i = 0u; i < count; i++) {
        let index = locate_index(locate_unpacked(lists.entries[first + i]));
        lit |= u32(queries[index].lit != 0u && queries[index].kind == QUERY_SKIN) << i;
    }
    var next = atomicAdd(&lists.chosen, countOneBits(lit));
    while lit != 0u {
        let entry = lists.entries[first + firstTrailingBit(lit)];
        chosen[next] = locate_index(locate_unpacked(entry));
        next += 1u;
        // Clears the lowest bit.
        lit &= lit - 1u;
    }
}
