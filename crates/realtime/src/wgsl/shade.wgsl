// Reflectances of an array of queries, linear sRGB in 1/sr. Compiled after a method, which defines `answer_rgb`.

// The part of the work that one submission does; twin of `RangeUniform` in layout.rs.
struct Range {
    // First entry of `chosen`, and number of entries.
    first: u32,
    count: u32,
    // Part of each answer, and number of parts.
    part: u32,
    parts: u32,
    // 2: a value that the compiler does not know.
    two: u32,
}

@group(0) @binding(0) var<uniform> range: Range;
@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
// Indices of the queries to answer.
@group(0) @binding(3) var<storage, read> chosen: array<u32>;
@group(0) @binding(4) var<storage, read_write> reflectances: array<vec4<f32>>;
// Number of answers that are wrong because loops were cut short.
@group(0) @binding(5) var<storage, read_write> cut_short: atomic<u32>;

// Whether loops end early: Mesa's llvmpipe leaves every loop of an invocation after 65 535 turns in total, and goes on.
// This loop then ends early, too.
fn loops_are_cut_short() -> bool {
    var turns = 0u;
    while turns < range.two {
        turns++;
    }
    return turns != range.two;
}

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= range.count {
        return;
    }
    let index = chosen[range.first + id.x];
    let query = queries[index];
    let pair = pair_of(query.wi, query.wo);
    var reflectance = vec3<f32>(0.0);
    if pair.valid {
        answer_part = range.part;
        answer_parts = range.parts;
        reflectance = optics_factor(optics, pair) * answer_rgb(query.wi, query.wo);
        if loops_are_cut_short() {
            atomicAdd(&cut_short, 1u);
        }
    }
    if range.part != 0u {
        reflectance += reflectances[index].rgb;
    }
    reflectances[index] = vec4<f32>(reflectance, 1.0);
}
