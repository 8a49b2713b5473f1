// Second stage of a picture (lib.rs), after raster.wgsl: finds for each pixel the point that its ray meets, the
// directions in the shading frame there, and the visibility of the sun (point.wgsl). The result is a query
// (query.wgsl), a record of the point and its directions, for which shade.wgsl computes the reflectance.
//
// *Skin* is the surface of the mesh, and n the number of pixels. A picture is the weighted mean of *samples* with one
// ray for each pixel. `frame` (frame.wgsl) is the uniform of a sample: camera, sun, ground and size of the picture.
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
// A film, a mesh whose `frame.film_eta` is not 0, is lit from both sides and lets light pass (sheet.wgsl). All of its
// pixels are in `rest`: rays find the sunlight behind other parts of the film, and the sunlit ground behind the film.
//
// Lengths are in cm. frame.wgsl, mesh.wgsl and trace.wgsl declare the bindings 0 to 3, point.wgsl 9 and 10.

// Lists of pixels; counterpart of `ListLengths` in target.rs, which has the members before `entries`. locate.rs sets
// these lengths to 0 before each sample. A pixel is a u32 with the column in the lower 16 bits and the row in the upper
// 16 bits; every texture has shorter sides.
struct Lists {
    // Number of entries of the buffer `chosen`, the queries that need an answer.
    chosen: atomic<u32>,
    // Number of pixels that need a ray through the tree.
    rest: atomic<u32>,
    // Number of pixels with a triangle of the rasteriser.
    skin: atomic<u32>,
    // Number of pixels without a triangle.
    bare: atomic<u32>,
    // Packed pixels of three lists: `skin` from entry 0 on, `bare` backwards from entry n - 1, `rest` from entry n on.
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

// Number of pixels or entries that an invocation processes, a *run*, with one bit of a u32 for each. One atomic
// operation reserves the list entries of a whole run. A test compares it with `RUN` in locate.rs.
const LOCATE_RUN: u32 = 32u;

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

// Radiance of the sunlit ground that the film lets pass along the ray of a pixel, times the weight of the sample.
fn locate_ground_behind(ray: vec3<f32>) -> vec3<f32> {
    var ground = point_ground(ray, TRACE_FAR);
    if ground.query.kind != QUERY_GROUND || frame.to_sun.z <= 0.0 {
        return vec3<f32>(0.0);
    }
    // Sunlit, since a film never hides the sun; `sun` has the fraction that is left.
    ground.query.lit = 1u;
    ground.query.sun = 1.0;
    if point_map_visibility(ground.p, ground.face) != POINT_SUN_VISIBLE {
        ground.query.sun = point_sun_fraction(ground);
    }
    return sheet_passed(frame.origin, ray, distance(ground.p, frame.origin)) * locate_ground_radiance(ground.query);
}

// Stores the query of a pixel and adds the radiance of the ground and the sample's weight to the picture. The first
// sample replaces the previous picture.
//
// The pixel is added to `rest` if `needs_ray` is true, or if the map does not decide the visibility of the sun. For
// such a pixel the radiance added here is 0: with `needs_ray` the query is not of the ground, and with an undecided sun
// it is not lit. locate_rest replaces the query and adds the radiance.
fn locate_store(pixel: vec2<u32>, found: Point, needs_ray: bool) {
    let index = locate_index(pixel);
    var query = found.query;
    let visibility = point_visibility(found);
    query.lit = u32(visibility == POINT_SUN_VISIBLE);
    query.sun = f32(query.lit);
    if needs_ray || visibility == POINT_SUN_UNDECIDED {
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
    let runs_per_row = (frame.width + LOCATE_RUN - 1u) / LOCATE_RUN;
    let row = number / runs_per_row;
    if row >= frame.height {
        return;
    }
    let column = LOCATE_RUN * (number - row * runs_per_row);
    let count = min(LOCATE_RUN, frame.width - column);
    // Bit i is set if pixel i of the run has a triangle.
    var skin = 0u;
    for (var i = 0u; i < count; i++) {
        skin |= u32(textureLoad(seen, vec2<u32>(column + i, row), 0).x != 0u) << i;
    }
    let skin_count = countOneBits(skin);
    // Entry for the next pixel with a triangle, and one past the entry for the next pixel without one.
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
    locate_store(pixel, point_ground(locate_ray(pixel), TRACE_FAR), false);
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
    // Zeros, which mean QUERY_NOTHING, until locate_rest replaces the query.
    var found: Point;
    if !missed {
        found = point_hit(ray, hit, c0, c1, c2);
    }
    locate_store(pixel, found, missed || (found.query.kind == QUERY_SKIN && point_is_film()));
}

// Intersection of a pixel's ray with the mesh: with the rasteriser's triangle, or with the nearest triangle if the ray
// misses that one. It is a miss for a pixel without a triangle, even if rounding lost a triangle at a silhouette.
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
    // For a miss, triangle 0 is read but not used, because indexing with TRACE_NONE would leave the buffer. point_hit
    // then returns the ground or QUERY_NOTHING.
    let triangle = select(hit.triangle, 0u, hit.triangle == TRACE_NONE);
    let found = point_hit(ray, hit, mesh_vertex(triangle, 0u), mesh_vertex(triangle, 1u), mesh_vertex(triangle, 2u));
    var visibility = point_visibility(found);
    // Fraction of the sunlight that passes films on the way to the point.
    var passed = 1.0;
    if visibility == POINT_SUN_UNDECIDED && point_is_film() {
        // A film weakens sunlight but never hides the sun.
        passed = point_sun_fraction(found);
        visibility = POINT_SUN_VISIBLE;
    } else if visibility == POINT_SUN_UNDECIDED {
        let start = point_offset(found.p, found.face, frame.to_sun);
        let occluder = trace(start, frame.to_sun, TRACE_FAR, true).triangle;
        visibility = select(POINT_SUN_HIDDEN, POINT_SUN_VISIBLE, occluder == TRACE_NONE);
    }
    var query = found.query;
    query.lit = u32(visibility == POINT_SUN_VISIBLE);
    query.sun = passed * f32(query.lit);
    let index = locate_index(pixel);
    queries[index] = query;
    var radiance = locate_ground_radiance(query);
    if query.kind == QUERY_SKIN && point_is_film() {
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
