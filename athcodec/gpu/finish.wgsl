// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

@group(0) @binding(3) var<storage, read_write> positions: array<f32>;
@group(0) @binding(4) var<storage, read_write> matrices: array<f32>;
@group(0) @binding(5) var<uniform> which: u32; // The source of each place whose corrections are added.

const FOOTPRINTS = array<array<f32, 4>, 3>(
    array<f32, 4>(32.0, 0.0, 0.0, 0.0), array<f32, 4>(32.0, 16.0, 0.0, 0.0), array<f32, 4>(32.0, 27.0, 16.0, 5.0),
);

fn is_joined() -> bool {
    return source.frame < segment(JOIN_FRAMES);
}

// The shares of jumps and of slopes that remain at the frame.
fn curve() -> vec2<f32> {
    let at = segment(JOIN_CURVE) + 2u * source.frame;
    return run.strength * source.weight * vec2<f32>(segment_float(at), segment_float(at + 1u));
}

fn join_position(b: u32, index: u32) {
    let steps = segment(JOIN_STEPS) + 2u * b;
    let step = curve() * vec2<f32>(segment_float(steps), segment_float(steps + 1u));
    for (var axis = 0u; axis < 3u; axis++) {
        let word = segment(segment(JOINS) + 3u * index + axis);
        positions[run.positions + 3u * index + axis] += f32(half(word, 0u)) * step.x + f32(half(word, 1u)) * step.y;
    }
}

// Numbers of R, row by row, then of c, as a matrix has them: R and c side by side.
fn join_matrix(index: u32) {
    for (var k = 0u; k < 12u; k++) {
        let at = segment(MATRIX_JOINS) + 2u * (12u * index + k);
        let place = select(4u * (k - 9u) + 3u, 4u * (k / 3u) + k % 3u, k < 9u);
        matrices[run.matrices + 12u * index + place] += segment_float(at) * curve().x + segment_float(at + 1u) * curve().y;
    }
}

// From c + R (x0 - a) to R x0 and a sum.
fn finish_matrix(index: u32, a: vec3<f32>) {
    for (var axis = 0u; axis < 3u; axis++) {
        let at = run.matrices + 12u * index + 4u * axis;
        matrices[at + 3u] -= dot(vec3<f32>(matrices[at], matrices[at + 1u], matrices[at + 2u]), a);
    }
}

// One workgroup per body.
@compute @workgroup_size(64)
fn bodies(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
          @builtin(local_invocation_index) i: u32) {
    run = place_at(group.y);
    let b = group.x + groups.x * group.z;
    if (b >= level[BODY_COUNT]) {
        return;
    }
    let body = body_at(b);
    let is_node = (body.flags & NODE) != 0u;
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        if (is_joined() && !is_node && i < body.count) {
            join_position(b, body.first + i);
        } else if (is_joined() && is_node && i == 0u) {
            join_matrix(body.first);
        }
    }
    if (is_node && i == 0u) {
        finish_matrix(body.first, body.rest_point);
    }
}

// One invocation per corrected position of a source.
@compute @workgroup_size(64)
fn corrections(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    if (which >= run.source_count) {
        return;
    }
    source = source_at(which);
    if (i >= segment(CORRECTED_COUNT)) {
        return;
    }
    let own = segment(CORRECTED) + 2u * i;
    var sum = vec3<f32>(0.0);
    for (var c = segment(own + 1u); c < segment(own + 3u); c++) {
        let at = segment(CORRECTIONS) + 2u * c;
        let low = segment(at);
        let high = segment(at + 1u);
        let away = abs(i32(source.frame) - i32((high >> 16u) & 0xffu));
        if (away < 4) {
            let width = high >> 24u;
            let part = FOOTPRINTS[width & 15u][away] * exp2(f32(width >> 4u));
            sum += part * vec3<f32>(f32(half(low, 0u)), f32(half(low, 1u)), f32(half(high, 0u)));
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        positions[run.positions + 3u * segment(own) + axis] +=
            sum[axis] * run.strength * source.weight * segment_float(CORRECTION_PART);
    }
}

// One invocation per number of a position, in place of all passes before.
@compute @workgroup_size(64)
fn baked(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    let count = 3u * level[POSITION_COUNT];
    if (i >= count) {
        return;
    }
    var sum = 0.0;
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        sum += source.weight * segment_float(segment(BAKED) + source.frame * count + i);
    }
    positions[run.positions + i] = sum;
}
