// Pass 3: vertices at a time, between two frames that the passes before have placed. `vertex_at` is what a vertex stage calls;
// here it writes all of them, for tests and for engines that compute once what several views draw. One invocation per vertex.

struct Run {
    positions: vec4<u32>, // numbers before those of the two frames now, and of the two that the time drawn before lies between
    matrices: vec4<u32>,
    weights: vec2<f32>, // Weights of the second of each pair.
    with_normals: u32,
    vertices: u32, // number before those that are written
}

struct Vertex {
    position: vec3<f32>,
    normal: vec3<f32>,
    previous: vec3<f32>,
}

@group(0) @binding(1) var<storage, read> corners: array<u32>; // see `normal_at`
@group(0) @binding(2) var<storage, read> shows: array<Run>; // one for each y of the workgroups
var<private> run: Run;
@group(0) @binding(3) var<storage, read> positions: array<f32>;
@group(0) @binding(4) var<storage, read> matrices: array<f32>;
@group(0) @binding(5) var<storage, read_write> vertices: array<f32>; // position, normal, previous position of each

const MOVED = 0x80000000u;
const VERTEX_COUNT = 2u;
const VERTICES = 7u;

@group(0) @binding(0) var<storage, read> level: array<u32>;

fn mixed_position(index: u32, now: u32) -> vec3<f32> {
    let a = run.positions[2u * now] + 3u * index;
    let b = run.positions[2u * now + 1u] + 3u * index;
    return mix(
        vec3<f32>(positions[a], positions[a + 1u], positions[a + 2u]),
        vec3<f32>(positions[b], positions[b + 1u], positions[b + 2u]),
        run.weights[now],
    );
}

// The row of a matrix at the time.
fn mixed_row(index: u32, row: u32, now: u32) -> vec4<f32> {
    let a = run.matrices[2u * now] + 12u * index + 4u * row;
    let b = run.matrices[2u * now + 1u] + 12u * index + 4u * row;
    return mix(
        vec4<f32>(matrices[a], matrices[a + 1u], matrices[a + 2u], matrices[a + 3u]),
        vec4<f32>(matrices[b], matrices[b + 1u], matrices[b + 2u], matrices[b + 3u]),
        run.weights[now],
    );
}

// now: 0; 1: at the time drawn before.
fn position_at(v: u32, now: u32) -> vec3<f32> {
    let at = level[VERTICES] + 4u * v;
    let binding = level[at + 3u];
    let index = binding & ~MOVED;
    if ((binding & MOVED) == 0u) {
        return mixed_position(index, now);
    }
    let rest = vec4<f32>(bitcast<f32>(level[at]), bitcast<f32>(level[at + 1u]), bitcast<f32>(level[at + 2u]), 1.0);
    return vec3<f32>(
        dot(mixed_row(index, 0u, now), rest), dot(mixed_row(index, 1u, now), rest), dot(mixed_row(index, 2u, now), rest),
    );
}

// The mean normal of the triangles at a vertex, by their area. corners: where those of each vertex begin, and one behind the last;
// then of each triangle at a vertex its two other corners.
fn normal_at(v: u32, x: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var c = corners[v]; c < corners[v + 1u]; c += 2u) {
        sum += cross(position_at(corners[c], 0u) - x, position_at(corners[c + 1u], 0u) - x);
    }
    let n2 = dot(sum, sum);
    return select(vec3<f32>(0.0), sum / sqrt(n2), n2 > 0.0);
}

fn vertex_at(v: u32) -> Vertex {
    let x = position_at(v, 0u);
    var normal = vec3<f32>(0.0);
    if (run.with_normals != 0u) {
        normal = normal_at(v, x);
    }
    return Vertex(x, normal, position_at(v, 1u));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = shows[id.y];
    if (i >= level[VERTEX_COUNT]) {
        return;
    }
    let vertex = vertex_at(i);
    for (var axis = 0u; axis < 3u; axis++) {
        vertices[run.vertices + 9u * i + axis] = vertex.position[axis];
        vertices[run.vertices + 9u * i + 3u + axis] = vertex.normal[axis];
        vertices[run.vertices + 9u * i + 6u + axis] = vertex.previous[axis];
    }
}
