// Third stage of a picture (lib.rs), after locate.wgsl: computes the reflectance f_r of the queries listed in `chosen`,
// linear sRGB in 1/sr. The file is compiled after the WGSL of a method (src/methods). The method defines `answer_rgb`,
// and optics.wgsl the factors around its answer.
//
// A dispatch processes a range of `chosen` that is short enough to keep the device responsive. If the adapter ends long
// loops early, each answer is also divided into `parts` (src/methods/common.wgsl), which successive dispatches compute
// and sum in `reflectances`.

// The work of one dispatch; counterpart of `RangeUniform` in layout.rs.
struct Range {
    // First entry of `chosen`.
    first: u32,
    // Number of entries of `chosen`.
    count: u32,
    // Index of the part of each answer that the dispatch computes, from 0.
    part: u32,
    // Number of parts of each answer.
    parts: u32,
    // Always 2. Since the compiler does not know the value, it cannot remove the loop of `loops_are_cut_short`.
    two: u32,
}

@group(0) @binding(0) var<uniform> range: Range;
@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
// Indices of the queries to answer.
@group(0) @binding(3) var<storage, read> chosen: array<u32>;
// Sums over the parts so far, one entry for each query; the fourth component is unused.
@group(0) @binding(4) var<storage, read_write> reflectances: array<vec4<f32>>;
// Number of answers that are wrong because the adapter ended loops early. If it is not 0, the CPU repeats the range
// with more parts (shader.rs).
@group(0) @binding(5) var<storage, read_write> cut_short: atomic<u32>;

// Whether the adapter has ended a loop of this invocation early. Mesa's llvmpipe allows an invocation 65 535 iterations
// of all its loops in total. Afterwards it leaves every loop at once, including this loop of two iterations.
fn loops_are_cut_short() -> bool {
    var iterations = 0u;
    while iterations < range.two {
        iterations++;
    }
    return iterations != range.two;
}

// Whether a query has two finite directions that the method accepts: above the surface, or for a film on either side
// but not in its plane.
fn has_answer(query: Query) -> bool {
    if optics.answer_kind == OPTICS_ANSWER_FILM {
        return pair_is_finite(query.wi) && pair_is_finite(query.wo) && query.wi.z != 0.0 && query.wo.z != 0.0;
    }
    return pair_new(query.wi, query.wo).valid;
}

// Answers one query of the range and adds the answer to the sum over the parts.
@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= range.count {
        return;
    }
    let index = chosen[range.first + id.x];
    let query = queries[index];
    var reflectance = vec3<f32>(0.0);
    if has_answer(query) {
        // Private variables that `answer_rgb` reads (src/methods/common.wgsl).
        answer_part = range.part;
        answer_parts = range.parts;
        let wi = optics_inside(optics, query.wi);
        let wo = optics_inside(optics, query.wo);
        // Both factors are 1 for a film, which has no cover and whose answer is complete. Its pair is not read, and not
        // valid where a direction lies below.
        let factor = optics_cover_factor(optics, query.wi, query.wo) * optics_factor(optics, pair_new(wi, wo));
        reflectance = factor * answer_rgb(wi, wo);
        if loops_are_cut_short() {
            atomicAdd(&cut_short, 1u);
        }
    }
    // Part 0 replaces the answer of an earlier sample.
    if range.part != 0u {
        reflectance += reflectances[index].rgb;
    }
    reflectances[index] = vec4<f32>(reflectance, 1.0);
}
