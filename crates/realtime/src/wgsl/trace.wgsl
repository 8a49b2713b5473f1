// Intersection of rays with the mesh, by the tree of bounding boxes that tree.rs builds.
//
// The nodes, at least one, are stored in depth-first order. If the ray hits the box of an inner node, the traversal
// goes on with the next element of the array, which is the node's first child. Otherwise, and after a leaf, it jumps to
// `next`. So it needs no stack.

// A node of the tree: a leaf with one triangle, or an inner node whose box bounds the triangles of its subtree.
// Counterpart of `Node` in layout.rs.
struct Node {
    // Lower corner of the box in cm. The box of a leaf is empty and not read: the inner node before the leaf has the
    // triangle's box. A mesh of one triangle is one leaf, without a box test.
    low: vec3<f32>,
    // Index of a leaf's triangle; TRACE_NONE for an inner node.
    triangle: u32,
    // Upper corner of the box in cm.
    high: vec3<f32>,
    // Index of the node that follows this node's subtree; the number of nodes if none follows.
    next: u32,
}

@group(0) @binding(3) var<storage, read> nodes: array<Node>;

// Index for no triangle.
const TRACE_NONE: u32 = 0xffffffffu;
// Distance beyond every triangle, near the largest finite f32.
const TRACE_FAR: f32 = 3e38;

// Intersection of a ray with a triangle.
struct Hit {
    // Index of the triangle; TRACE_NONE where the ray meets none.
    triangle: u32,
    // Distance from the ray's origin, in units of the length of its direction. Where the ray meets none, TRACE_FAR
    // from one triangle and `farthest` from `trace`.
    distance: f32,
    // Barycentric coordinates of the second and third corner; meaningless where the ray meets none.
    b: vec2<f32>,
}

// Intersection with the triangle of the index `triangle` and the corners p0, p1, p2 (Möller and Trumbore 1997). A ray
// may hit the triangle from either side.
fn trace_corners(
    origin: vec3<f32>,
    direction: vec3<f32>,
    triangle: u32,
    p0: vec3<f32>,
    p1: vec3<f32>,
    p2: vec3<f32>,
) -> Hit {
    let e1 = p1 - p0;
    let e2 = p2 - p0;
    let direction_e2 = cross(direction, e2);
    let determinant = dot(e1, direction_e2);
    // The ray is parallel to the triangle's plane.
    if determinant == 0.0 {
        return Hit(TRACE_NONE, TRACE_FAR, vec2<f32>(0.0));
    }
    let offset = origin - p0;
    let offset_e1 = cross(offset, e1);
    let b = vec2<f32>(dot(offset, direction_e2), dot(direction, offset_e1)) / determinant;
    let distance = dot(e2, offset_e1) / determinant;
    if b.x < 0.0 || b.y < 0.0 || b.x + b.y > 1.0 || distance <= 0.0 {
        return Hit(TRACE_NONE, TRACE_FAR, b);
    }
    return Hit(triangle, distance, b);
}

// Intersection with the triangle of the index `triangle`, whose corners `mesh_vertex` (mesh.wgsl) reads.
fn trace_triangle(origin: vec3<f32>, direction: vec3<f32>, triangle: u32) -> Hit {
    let p0 = mesh_vertex(triangle, 0u).position;
    let p1 = mesh_vertex(triangle, 1u).position;
    let p2 = mesh_vertex(triangle, 2u).position;
    return trace_corners(origin, direction, triangle, p0, p1, p2);
}

// Componentwise reciprocal of a direction. Components near zero are replaced by 1e-20: a product of 0 and an infinite
// reciprocal would be NaN, and the box test would fail.
fn trace_inverse(direction: vec3<f32>) -> vec3<f32> {
    let small = vec3<f32>(1e-20);
    return 1.0 / select(direction, small, abs(direction) < small);
}

// Whether a ray meets a box within the distance `farthest`. `inverse` is the result of `trace_inverse` for the ray's
// direction.
fn trace_box(origin: vec3<f32>, inverse: vec3<f32>, low: vec3<f32>, high: vec3<f32>, farthest: f32) -> bool {
    // Distances at which the ray crosses the planes of the box's sides, and the interval of distances inside the box.
    let a = (low - origin) * inverse;
    let b = (high - origin) * inverse;
    let enter = min(a, b);
    let leave = max(a, b);
    let first = max(max(enter.x, enter.y), max(enter.z, 0.0));
    // The factor, 1 + 3 · 2⁻²³ in single precision, covers the rounding errors of the interval (Ize, Robust BVH Ray
    // Traversal, JCGT 2(2), 2013).
    let last = min(min(leave.x, leave.y), min(leave.z, farthest)) * 1.0000004;
    return first <= last;
}

// Intersection with the nearest triangle within the distance `farthest`. With `accept_any`, it is that of the first
// triangle found, which suffices for shadows.
fn trace(origin: vec3<f32>, direction: vec3<f32>, farthest: f32, accept_any: bool) -> Hit {
    let inverse = trace_inverse(direction);
    var best = Hit(TRACE_NONE, farthest, vec2<f32>(0.0));
    let count = arrayLength(&nodes);
    var index = 0u;
    while index < count {
        let node = nodes[index];
        if node.triangle != TRACE_NONE {
            let hit = trace_triangle(origin, direction, node.triangle);
            if hit.triangle != TRACE_NONE && hit.distance < best.distance {
                best = hit;
                if accept_any {
                    return best;
                }
            }
            index = node.next;
        } else if trace_box(origin, inverse, node.low, node.high, best.distance) {
            index += 1u;
        } else {
            index = node.next;
        }
    }
    return best;
}
