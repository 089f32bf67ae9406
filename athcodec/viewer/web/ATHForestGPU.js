import{Box3 as Jt,BufferAttribute as ft,DoubleSide as Xt,Group as Kt,IndirectStorageBufferAttribute as Zt,LineBasicNodeMaterial as Qt,LineSegments as te,Mesh as ee,MeshStandardNodeMaterial as se,Frustum as ie,Matrix4 as dt,StorageBufferAttribute as re,TSL as U,Vector3 as $,WebGPUCoordinateSystem as oe}from"three/webgpu";var Q=`// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

@group(0) @binding(0) var<storage, read> level: array<u32>;
@group(0) @binding(1) var<storage, read> segments: array<u32>; // blocks one behind the other

// A place is a blend of its sources. A dispatch computes several, one for each y of its workgroups.
struct Place {
    sources: u32, // word of \`places\` that they begin at
    source_count: u32,
    positions: u32, // number before those of this place; so are the others
    matrices: u32,
    modes: u32,
    bodies: u32,
    strength: f32, // Factor of the motion.
}
// A frame that a place shows, alone or blended with others.
struct Source {
    segment: u32, // word that the block of its segment begins at
    frame: u32,
    amplitudes: u32, // number before its own
    weight: f32,     // The weights of a place add up to 1.
}
@group(0) @binding(2) var<storage, read> places: array<u32>; // all of a dispatch, then all their sources
var<private> run: Place;
var<private> source: Source;
const PLACE_WORDS = 8u;
const SOURCE_WORDS = 4u;

// Words of the header of a level.
const VERTEX_COUNT = 2u;
const BODY_COUNT = 3u;
const POSITION_COUNT = 4u;
const MATRIX_COUNT = 5u;
const VERTICES = 7u;
const BODIES = 8u;
const ORDER = 9u;
const DEPTHS = 10u;
const BASES = 11u;

// Words of the header of a segment.
const FRAMES = 3u;
const JOIN_FRAMES = 4u;
const ROW_COUNT = 5u;
const CORRECTED_COUNT = 6u;
const CORRECTION_PART = 7u;
const MOVES = 8u;
const ROWS = 9u;
const VALUES = 10u;
const SHAPES = 11u;
const TURNS = 12u;
const JOIN_CURVE = 13u;
const JOIN_STEPS = 14u;
const JOINS = 15u;
const MATRIX_JOINS = 16u;
const CORRECTED = 17u;
const CORRECTIONS = 18u;
const BAKED = 19u;
const WAVE_SETS = 20u;

// Flags of bodies.
const NODE = 1u;
const FOLLOWS = 2u;
const FITTED = 4u;

// Words of records.
const BODY_WORDS = 16u;
const ROW_WORDS = 3u;
const MOVE_WORDS = 4u;
const VERTEX_WORDS = 4u;

struct Body {
    flags: u32,
    parent: i32,
    attach: i32,
    way: u32,
    modes: u32,
    first: u32,
    count: u32,
    vertex: u32,
    basis: u32,
    shape_modes: u32,
    rest_point: vec3<f32>,
    tangent: vec3<f32>,
}

struct Row {
    values: u32,
    count: u32,
    slot: u32,
    waves: u32,
    step: f32,
}

struct Move {
    row: u32,
    rows: u32,
    shape_count: u32,
    shapes: u32,
    turn: u32,
}

fn place_at(y: u32) -> Place {
    let at = PLACE_WORDS * y;
    return Place(places[at], places[at + 1u], places[at + 2u], places[at + 3u], places[at + 4u], places[at + 5u],
        bitcast<f32>(places[at + 6u]));
}

// The place that this invocation computes. Functions of segments read the source that is set.
fn source_at(s: u32) -> Source {
    let at = run.sources + SOURCE_WORDS * s;
    return Source(places[at], places[at + 1u], places[at + 2u], bitcast<f32>(places[at + 3u]));
}

fn segment(at: u32) -> u32 {
    return segments[source.segment + at];
}

fn level_float(at: u32) -> f32 {
    return bitcast<f32>(level[at]);
}

fn segment_float(at: u32) -> f32 {
    return bitcast<f32>(segment(at));
}

fn level_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(level_float(at), level_float(at + 1u), level_float(at + 2u));
}

fn body_at(b: u32) -> Body {
    let at = level[BODIES] + BODY_WORDS * b;
    return Body(
        level[at],
        bitcast<i32>(level[at + 1u]),
        bitcast<i32>(level[at + 2u]),
        level[at + 3u],
        level[at + 4u],
        level[at + 5u],
        level[at + 6u],
        level[at + 7u],
        level[at + 8u],
        level[at + 9u],
        level_vector(at + 10u),
        level_vector(at + 13u),
    );
}

fn move_at(b: u32) -> Move {
    let at = segment(MOVES) + MOVE_WORDS * b;
    let counts = segment(at + 1u);
    return Move(segment(at), counts & 0xffffu, counts >> 16u, segment(at + 2u), segment(at + 3u));
}

fn row_at(r: u32) -> Row {
    let at = segment(ROWS) + ROW_WORDS * r;
    let packed = segment(at + 1u);
    return Row(segment(at), packed & 0xffffu, (packed >> 16u) & 0xffu, packed >> 24u, segment_float(at + 2u));
}

fn rest_of(vertex: u32) -> vec3<f32> {
    return level_vector(level[VERTICES] + VERTEX_WORDS * vertex);
}

// One of two 16-bit integers of a word.
fn half(word: u32, index: u32) -> i32 {
    return bitcast<i32>(word << (16u - 16u * index)) >> 16u;
}
`;var tt=`// Chooses what instances are drawn with: each that is in view is appended to the list of the coarsest shape whose error its distance
// hides. One invocation per instance.

struct Instance {
    place: vec4<f32>, // x, y, z, size
    turn: vec4<f32>,  // cosine and sine of its angle, the plant that it shows, tint
}

struct View {
    planes: array<vec4<f32>, 6>, // The planes of the view: normal, distance.
    eye: vec3<f32>,
    pixel: f32, // the error that is allowed at distance 1
    count: u32,
    shapes: u32,
    reach: f32, // how far from its place an instance of size 1 can be seen
    room: u32,  // Instances that a list has room for.
}

struct Shape {
    tolerance: f32,
    list: u32,
}

@group(0) @binding(0) var<storage, read> instances: array<Instance>;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> shapes: array<Shape>; // the finest first
@group(0) @binding(3) var<storage, read_write> draws: array<atomic<u32>>; // five numbers of each list: of an indexed indirect draw
@group(0) @binding(4) var<storage, read_write> lists: array<u32>;

fn is_seen(centre: vec3<f32>, radius: f32) -> bool {
    for (var k = 0u; k < 6u; k++) {
        if (dot(view.planes[k].xyz, centre) + view.planes[k].w < -radius) {
            return false;
        }
    }
    return true;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.count || view.shapes == 0u) {
        return;
    }
    let place = instances[id.x].place;
    let radius = view.reach * place.w;
    if (!is_seen(place.xyz, radius)) {
        return;
    }
    let hidden = view.pixel * max(distance(view.eye, place.xyz) - 0.5 * radius, 1e-6) / place.w;
    var chosen = 0u;
    while (chosen + 1u < view.shapes && shapes[chosen + 1u].tolerance <= hidden) {
        chosen++;
    }
    let list = shapes[chosen].list;
    lists[list * view.room + atomicAdd(&draws[5u * list + 1u], 1u)] = id.x;
}
`;var et=`// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

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
`;var st=`// Pass 2: bodies of one depth, each placed from the one that it hangs on; amplitudes of all sources of a place add up. One
// workgroup per body, one invocation per position.

@group(0) @binding(8) var<uniform> depth: u32; // Depth of the bodies that this pass places.
@group(0) @binding(3) var<storage, read> amplitudes: array<f32>;
@group(0) @binding(4) var<storage, read_write> positions: array<f32>;
@group(0) @binding(5) var<storage, read_write> matrices: array<f32>;
@group(0) @binding(6) var<storage, read_write> parent_modes: array<f32>; // The modes of a body begin at its first position.
@group(0) @binding(7) var<storage, read_write> frames: array<f32>; // For each body: rotation, point.

const SHIFT = 64u;
const ROTATION = 65u;
const POLAR_ITERATIONS = 4;
const IDENTITY = mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

var<workgroup> modes: array<vec3<f32>, 64>;
var<workgroup> placed: array<vec3<f32>, 64>; // before: what modes of the parent add to its tangent

struct Frame {
    point: vec3<f32>,
    rotation: mat3x3<f32>,
}

fn amplitude(row: u32) -> vec3<f32> {
    let at = source.amplitudes + 3u * row;
    return vec3<f32>(amplitudes[at], amplitudes[at + 1u], amplitudes[at + 2u]);
}

fn position_at(index: u32) -> vec3<f32> {
    let at = run.positions + 3u * index;
    return vec3<f32>(positions[at], positions[at + 1u], positions[at + 2u]);
}

// Returns what mode m of its parent adds to the tangent that a body follows.
fn way_by_mode(body: Body, m: u32) -> vec3<f32> {
    let parent = level[BODIES] + BODY_WORDS * u32(max(body.parent, 0));
    if ((body.flags & FOLLOWS) == 0u || m >= level[parent + 4u]) {
        return vec3<f32>(0.0);
    }
    let at = run.modes + 3u * (level[parent + 5u] + m);
    let mode = vec3<f32>(parent_modes[at], parent_modes[at + 1u], parent_modes[at + 2u]);
    return level_float(level[BASES] + body.way + m) * mode;
}

// The rotation of the quaternion normalize(1, q) squared.
fn squared(q: vec3<f32>) -> mat3x3<f32> {
    let n2 = dot(q, q);
    let scale = 1.0 / (1.0 + n2);
    let w = (1.0 - n2) * scale;
    let v = 2.0 * q * scale;
    let x = v.x;
    let y = v.y;
    let z = v.z;
    return mat3x3<f32>( // columns
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y),
    );
}

fn unit(v: vec3<f32>) -> vec3<f32> {
    let n2 = dot(v, v);
    return select(v, v / sqrt(n2), n2 > 1e-30);
}

// The rotation by the least angle from u to v, which have length 1; beyond a right angle by less and less.
fn between(u: vec3<f32>, v: vec3<f32>) -> mat3x3<f32> {
    let axis = cross(u, v);
    let w = 1.0 + max(dot(u, v), 0.0);
    let sine2 = dot(axis, axis);
    let h = 2.0 / (w * w + sine2);
    let g = w * h * axis;
    let c = 1.0 - h * sine2;
    return mat3x3<f32>(
        h * axis * axis.x + vec3<f32>(c, g.z, -g.y),
        h * axis * axis.y + vec3<f32>(-g.z, c, g.x),
        h * axis * axis.z + vec3<f32>(g.y, -g.x, c),
    );
}

fn hung(body: Body) -> Frame {
    if (body.parent < 0) {
        return Frame(body.rest_point, IDENTITY);
    }
    let at = run.bodies + 12u * u32(body.parent);
    var rotation = mat3x3<f32>(
        frames[at], frames[at + 1u], frames[at + 2u],
        frames[at + 3u], frames[at + 4u], frames[at + 5u],
        frames[at + 6u], frames[at + 7u], frames[at + 8u],
    );
    if ((body.flags & FOLLOWS) != 0u) {
        var way = vec3<f32>(0.0);
        for (var m = 0u; m < 64u; m++) {
            way += placed[m];
        }
        rotation = rotation * between(unit(body.tangent), unit(body.tangent + way));
    }
    return Frame(position_at(u32(body.attach)), rotation);
}

// Returns the rotation that a row stands for.
fn turn_of(own: Move, row: u32) -> vec3<f32> {
    let at = segment(TURNS) + own.turn;
    let q = amplitude(row);
    var omega = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let turn = vec3<f32>(segment_float(at + 3u * k), segment_float(at + 3u * k + 1u), segment_float(at + 3u * k + 2u));
        omega[k] = dot(turn, q);
    }
    return omega;
}

// The rows of a shift and of a rotation, where there are any, are the first of a body.
fn turned(b: u32, body: Body) -> Frame {
    var frame = hung(body);
    var omega = vec3<f32>(0.0);
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        let own = move_at(b);
        for (var r = own.row; r < own.row + min(own.rows, 2u); r++) {
            let slot = row_at(r).slot;
            if (slot == SHIFT) {
                frame.point += amplitude(r);
            } else if (slot == ROTATION) {
                omega += turn_of(own, r);
            }
        }
    }
    frame.rotation = frame.rotation * squared(0.25 * omega);
    return frame;
}

// Mode m of a body with shapes: what they add up to.
fn unshaped(body: Body, own: Move, m: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var r = own.row; r < own.row + own.rows; r++) {
        let slot = row_at(r).slot;
        let tracks = amplitude(r);
        for (var axis = 0u; axis < 3u; axis++) {
            let shape = 3u * slot + axis;
            if (slot < body.shape_modes && shape < own.shape_count) {
                let at = segment(SHAPES) + own.shapes + 3u * (shape * body.shape_modes + m);
                sum += tracks[axis] * vec3<f32>(segment_float(at), segment_float(at + 1u), segment_float(at + 2u));
            }
        }
    }
    return sum;
}

// How far modes move position i of a body, or column i of a node's map.
fn moved_by_modes(body: Body, top: u32, i: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var m = 0u; m < top; m++) {
        sum += level_float(level[BASES] + body.basis + m * body.count + i) * modes[m];
    }
    return sum;
}

// A step of Newton's method from R to the rotation nearest to H.
fn turned_towards(H: mat3x3<f32>, R: mat3x3<f32>) -> mat3x3<f32> {
    let C = H * transpose(R);
    let axial = vec3<f32>(C[1].z - C[2].y, C[2].x - C[0].z, C[0].y - C[1].x);
    let spare = max(1.0 - (C[0].x + C[1].y + C[2].z), 0.0) + 1e-6;
    let a = C[1].y + C[2].z + spare; // Differences from the trace would lose precision.
    let b = C[0].x + C[2].z + spare;
    let c = C[0].x + C[1].y + spare;
    let d = -0.5 * (C[1].x + C[0].y);
    let e = -0.5 * (C[2].x + C[0].z);
    let f = -0.5 * (C[2].y + C[1].z);
    let x = vec3<f32>(b * c - f * f, e * f - d * c, d * f - e * b);
    let y = vec3<f32>(e * f - d * c, a * c - e * e, d * e - a * f);
    let z = vec3<f32>(d * f - e * b, d * e - a * f, a * b - d * d);
    let determinant = a * x.x + d * x.y + e * x.z;
    return squared(vec3<f32>(dot(x, axial), dot(y, axial), dot(z, axial)) * (0.25 / determinant)) * R;
}

// How a sheet has turned in its own frame: by the rotation nearest to what took its rest pose to \`placed\`.
fn fitted(body: Body) -> mat3x3<f32> {
    var H = mat3x3<f32>();
    var size2 = 0.0;
    for (var i = 0u; i < body.count; i++) {
        let offset = rest_of(body.vertex + i) - body.rest_point;
        size2 += dot(offset, offset);
        H += mat3x3<f32>(placed[i] * offset.x, placed[i] * offset.y, placed[i] * offset.z);
    }
    H += 0.01 * size2 * IDENTITY;
    let norm2 = dot(H[0], H[0]) + dot(H[1], H[1]) + dot(H[2], H[2]);
    var R = IDENTITY;
    if (norm2 > 1e-30) {
        H = H * (1.0 / sqrt(norm2));
        for (var step = 0; step < POLAR_ITERATIONS; step++) {
            R = turned_towards(H, R);
        }
    }
    return R;
}

fn write_column(node: u32, column: u32, v: vec3<f32>) {
    for (var axis = 0u; axis < 3u; axis++) {
        matrices[run.matrices + 12u * node + 4u * axis + column] = v[axis];
    }
}

fn write_frame(b: u32, frame: Frame) {
    for (var axis = 0u; axis < 3u; axis++) {
        for (var column = 0u; column < 3u; column++) {
            frames[run.bodies + 12u * b + 3u * column + axis] = frame.rotation[column][axis];
        }
        frames[run.bodies + 12u * b + 9u + axis] = frame.point[axis];
    }
}

// Adds the modes of a body in the source that is set, and returns the least that those above are nothing of.
fn add_modes(b: u32, body: Body, i: u32) -> u32 {
    let own = move_at(b);
    let from_shapes = select(0u, body.shape_modes, own.shape_count > 0u);
    for (var r = i; r < own.rows; r += 64u) {
        let slot = row_at(own.row + r).slot;
        if (slot >= from_shapes && slot < SHIFT) {
            modes[slot] += amplitude(own.row + r);
        }
    }
    if (i < from_shapes) {
        modes[i] += unshaped(body, own, i);
    }
    if (own.rows == 0u) {
        return from_shapes;
    }
    let last = row_at(own.row + own.rows - 1u).slot;
    return max(from_shapes, select(0u, last + 1u, last < SHIFT));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) i: u32) {
    run = place_at(group.y);
    let at = level[level[DEPTHS] + depth] + group.x + groups.x * group.z;
    if (at >= level[level[DEPTHS] + depth + 1u]) {
        return;
    }
    let b = level[level[ORDER] + at];
    let body = body_at(b);
    modes[i] = vec3<f32>(0.0);
    placed[i] = way_by_mode(body, i);
    workgroupBarrier();
    var top = 0u;
    for (var s = 0u; s < places[PLACE_WORDS * group.y + 1u]; s++) { // The count is uniform over the workgroup.
        source = source_at(s);
        top = max(top, add_modes(b, body, i));
        workgroupBarrier();
    }
    var frame = turned(b, body);
    workgroupBarrier();
    let is_node = (body.flags & NODE) != 0u;
    if (i < body.count) {
        let by_modes = moved_by_modes(body, top, i);
        if (is_node) {
            write_column(body.first, i, frame.rotation * (IDENTITY[i] + by_modes));
        } else {
            placed[i] = rest_of(body.vertex + i) - body.rest_point + by_modes;
            let x = frame.point + frame.rotation * placed[i];
            for (var axis = 0u; axis < 3u; axis++) {
                positions[run.positions + 3u * (body.first + i) + axis] = x[axis];
                parent_modes[run.modes + 3u * (body.first + i) + axis] = modes[i][axis];
            }
        }
    }
    workgroupBarrier();
    if (i == 0u && is_node) {
        write_column(body.first, 3u, frame.point);
    }
    if (i == 0u && !is_node) {
        if ((body.flags & FITTED) != 0u) {
            frame.rotation = frame.rotation * fitted(body);
        }
        write_frame(b, frame);
    }
}
`;var it=`// Pass 1: what each row is at the frame of each source. One invocation per row.

@group(0) @binding(3) var<storage, read_write> amplitudes: array<f32>;

const WIDE = 128u;

fn value(row: Row, index: u32) -> f32 {
    let at = segment(VALUES) + row.values;
    if ((row.waves & WIDE) != 0u) {
        return f32(bitcast<i32>(segment(at + index)));
    }
    return f32(half(segment(at + index / 2u), index % 2u));
}

fn evaluate(r: u32) {
    let row = row_at(r);
    let frames = segment(FRAMES);
    let waves = segment(WAVE_SETS + (row.waves & 127u)) + source.frame;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < row.count; k++) {
        let integers = vec3<f32>(value(row, k), value(row, row.count + k), value(row, 2u * row.count + k));
        sum += integers * segment_float(waves + k * frames);
    }
    for (var axis = 0u; axis < 3u; axis++) {
        amplitudes[source.amplitudes + 3u * r + axis] = run.strength * source.weight * row.step * sum[axis];
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = place_at(id.y);
    for (var s = 0u; s < run.source_count; s++) {
        source = source_at(s);
        if (i < segment(ROW_COUNT)) {
            evaluate(i);
        }
    }
}
`;var rt=`// Pass 3: vertices at a time, between two frames that the passes before have placed. \`vertex_at\` is what a vertex stage calls;
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

@group(0) @binding(1) var<storage, read> corners: array<u32>; // see \`normal_at\`
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
`;var[ot,nt,Bt,Pt,Ut,Ft]=[2,3,4,5,6,10],[Wt,Vt,Lt]=[5,6,19],Gt=64,R=8,H=4,q=12,Ht=9,I=f=>Math.ceil(f/Gt),N=class{constructor(t,{blocks:e,time:o,hierarchy:i,finish:s,vertices:r}){let n=(...u)=>t.createShaderModule({code:u.join(`
`)}),a=(u,c="main")=>t.createComputePipeline({layout:"auto",compute:{module:u,entryPoint:c}}),h=n(e,s);this.time=a(n(e,o)),this.hierarchy=a(n(e,i)),this.bodies=a(h,"bodies"),this.corrections=a(h,"corrections"),this.baked=a(h,"baked"),this.vertices=a(n(r))}},D=class{uploaded=0;#e=new Map;#t=0;#r=0;#o=0;constructor(t,e,o,{slots:i=2,shown:s=1,vertices:r=null,across:n=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:o,slots:i,shown:s,across:n}),this.size={positions:3*o[Bt],matrices:12*o[Pt],bodies:12*o[nt],vertices:Ht*o[ot]},this.baked=!1;let{positions:a,matrices:h,bodies:u}=this.size;this.buffers={level:this.#s(o),segments:this.#i(1),places:this.#i((R+H)*i),shows:this.#i(q*s),amplitudes:this.#i(1),positions:this.#i(i*a),matrices:this.#i(i*h),modes:this.#i(i*a),bodies:this.#i(i*u),corners:this.#i(1),vertices:r??this.#i(s*this.size.vertices)},this.ownsVertices=!r,this.depths=Array.from({length:o[Ut]},(c,l)=>{let[m,d]=o.subarray(o[Ft]+l);return{count:d-m,uniform:this.#m(l)}}),this.ordinals=[],this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#i(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#s(t,e=140){let o=this.#i(t.length,e);return this.#u(o,t),o}#m(t){return this.#s(new Uint32Array([t,0,0,0]),72)}#u(t,e,o=0,i=e.length){this.uploaded+=4*i,this.device.queue.writeBuffer(t,4*o,e.buffer,e.byteOffset,4*i)}#n(t,e,o=0){let i=this.buffers[t],{device:s}=this;if(4*e<=i.size)return;let r=this.#i(e);if(o>0){let n=s.createCommandEncoder();n.copyBufferToBuffer(i,0,r,0,4*o),s.queue.submit([n.finish()])}i.destroy(),this.buffers[t]=r,this.#e.clear()}segment(t){let e=this.#o;return e+t.length>this.buffers.segments.size/4&&this.#n("segments",2*(e+t.length),e),this.#u(this.buffers.segments,t,e),this.#o+=t.length,this.#t=Math.max(this.#t,t[Wt]),this.#r=Math.max(this.#r,t[Vt]),this.baked||=t[Lt]!==0,e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#s(t),this.hasCorners=!0,this.#e.clear()}#a(t,e,[o,i],s,r=null){if(o===0||i===0)return;let n=r??e;if(!this.#e.has(n)){let h=s.flatMap((c,l)=>c?[{binding:l,resource:{buffer:this.buffers[c]}}]:[]);r&&h.push({binding:s.length,resource:{buffer:r}});let u=this.kernels[e].getBindGroupLayout(0);this.#e.set(n,this.device.createBindGroup({layout:u,entries:h}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#e.get(n));let a=Math.min(o,this.across);t.dispatchWorkgroups(a,i,Math.ceil(o/a))}run(t,e){let o=this.device.createCommandEncoder(),i=o.beginComputePass();t.length>0&&this.#y(i,t),e.length>0&&this.#p(i,e),i.end(),this.device.queue.submit([o.finish()])}#y(t,e){let{positions:o,bodies:i}=this.size,s=e.length;if(this.#f(e),this.baked){this.#a(t,"baked",[I(o),s],["level","segments","places","positions"]);return}this.#a(t,"time",[I(this.#t),s],[null,"segments","places","amplitudes"]);let r=["amplitudes","positions","matrices","modes","bodies"];for(let a of this.depths)this.#a(t,"hierarchy",[a.count,s],["level","segments","places",...r],a.uniform);this.#a(t,"bodies",[this.words[nt],s],["level","segments","places","positions","matrices"]);let n=Math.max(...e.map(({sources:a})=>a.length));for(;this.ordinals.length<n;)this.ordinals.push(this.#m(this.ordinals.length));for(let a of this.ordinals.slice(0,n))this.#a(t,"corrections",[I(this.#r),s],[null,"segments","places","positions",null],a)}#f(t){let{positions:e,matrices:o,bodies:i}=this.size,s=t.reduce((u,{sources:c})=>u+c.length,0),r=new Uint32Array(R*t.length+H*s),n=new Float32Array(r.buffer),a=R*t.length,h=0;t.forEach(({sources:u,slot:c,strength:l=1},m)=>{r.set([a,u.length,c*e,c*o,m*e,m*i],R*m),n[R*m+6]=l;for(let{segment:d,frame:p,weight:g=1}of u)r.set([d,p,3*this.#t*h++],a),n[a+3]=g,a+=H}),this.#n("places",r.length),this.#n("amplitudes",3*this.#t*s),this.#u(this.buffers.places,r)}#p(t,e){let{positions:o,matrices:i,vertices:s}=this.size,r=new Uint32Array(q*e.length),n=new Float32Array(r.buffer);e.forEach(({slots:a,weight:h,previous:u=a,previousWeight:c=h,at:l=null},m)=>{let d=q*m;[...a,...u].forEach((p,g)=>{r[d+g]=p*o,r[d+4+g]=p*i}),n[d+8]=h,n[d+9]=c,r[d+10]=this.hasCorners?1:0,r[d+11]=(l??m)*s}),this.#u(this.buffers.shows,r),this.#a(t,"vertices",[I(this.words[ot]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),o=4*this.size.vertices*t.length,i=this.device.createBuffer({size:o,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,i,0,o),this.device.queue.submit([e.finish()]),await i.mapAsync(1);let s=new Float32Array(i.getMappedRange().slice(0));return i.destroy(),s}dispose(){for(let t of[...this.depths.map(e=>e.uniform),...this.ordinals])t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};import{Box3 as Ee,DataTexture as Re,EventDispatcher as Ae,FloatType as Te,MathUtils as Me,NearestFilter as Ce,RGBAFormat as ke,Sphere as Ie,Vector3 as lt}from"three";function at({transitions:f},t){let e=s=>Array.isArray(s)&&s.length===3&&s.every(Number.isInteger)&&Math.min(...s)>=0&&s[2]>=1&&Math.max(s[0],s[1])+s[2]<t;if(!Array.isArray(f)||!f.length||!f.every(e))return[];let o=[...f].sort((s,r)=>s[0]-r[0]||s[1]-r[1]||s[2]-r[2]),i=o.at(-1)[0];return o.every(([,s,r])=>s+r<=i)?o:[]}var z=class{#e;#t;#r=[{begins:0,leave:0,enter:0,lasts:0,over:0}];#o;constructor(t,e,o){let i=s=>e[s]-e[0];this.#e=t.map(([s,r,n])=>({leave:i(s),enter:i(r),over:i(r+n),lasts:Math.min(i(s+n)-i(s),i(r+n)-i(r))})),this.#t=Math.imul(o,2654435761)+1>>>0||1,this.#o=this.#i(0)}at(t){let e=Math.min(Math.max(t,0),1e7);for(let u;(u=this.#r.at(-1).begins+this.#o.leave-this.#r.at(-1).enter)<=e;)this.#r.push({...this.#o,begins:u}),this.#o=this.#i(this.#o.over);let o=this.#r.findLastIndex(({begins:u})=>u<=e),i=this.#r[o],s=e-i.begins,r=(this.#r[o+1]??this.#o).enter,n=s/i.lasts,a=n*n*(3-2*n);return s>=i.lasts?{places:[{seconds:i.enter+s,weight:1}],ahead:r}:{places:[{seconds:i.leave+s,weight:1-a},{seconds:i.enter+s,weight:a}].filter(u=>u.weight>0),ahead:r}}#i(t){let e=this.#e.at(-1).leave,s=[...new Set(this.#e.map(({leave:n})=>n))].filter(n=>t<=n&&n<e).find(()=>this.#s()<.5)??e,r=this.#e.filter(n=>n.leave===s);return r[Math.floor(this.#s()*r.length)]}#s(){for(let t of[13,-17,5])this.#t=(this.#t^(t>0?this.#t<<t:this.#t>>>-t))>>>0;return this.#t/2**32}};import{BufferAttribute as ut,BufferGeometry as qt,InstancedBufferAttribute as be,ShapeUtils as xe,Vector2 as ye,Vector3 as _e}from"three";function ht(f,{up_axis:t}){return t==="z"&&(f.rotation.x=-Math.PI/2),t==="x"&&(f.rotation.z=Math.PI/2),f}function jt(f,t,e,o){for(let i=0;i<e.length;i++)for(let s=0;s<o;s++)f[o*i+s]=Number(t[o*e[i]+s]);return f}function j(f,t,e,o){let{source:i}=f.userData,s=f.index.array,r=!f.getAttribute("normal"),n=new Map,a=r?2:3,h=[],u=new Set,c=l=>{let m=3*i[l],d=g=>Math.floor(t[m+g]/e)&4095,p=((o[i[l]]+1&65535)*4096+d(0))*16777216+d(1)*4096+d(2);return n.has(p)||n.set(p,l),n.get(p)};for(let l=0;l<s.length;l+=a){let m=Array.from(s.subarray(l,l+a),c),[d,p,g]=m;if(d===p||!r&&(p===g||g===d))continue;let[_,O,E]=[...m].sort((y,F)=>y-F),S=r?_*2**26+O:`${_},${O},${E}`;u.has(S)||(u.add(S),h.push(...m))}return h.length===0&&h.push(...s.subarray(0,a)),$t(f,Uint32Array.from(h))}function $t(f,t){let e=Uint32Array.from(new Set(t)).sort(),o=new Map(Array.from(e,(s,r)=>[s,r])),i=new qt;for(let[s,{array:r,itemSize:n}]of Object.entries(f.attributes))i.setAttribute(s,new ut(jt(new r.constructor(n*e.length),r,e,n),n));return i.setIndex(new ut(t.map(s=>o.get(s)),1)),i.userData.source=e.map(s=>f.userData.source[s]),i}var Ne=new lt,De=new lt;function A({duration:f,frameCount:t}){return t>1?f*t/(t-1):0}var T=null,Yt=.001,B=class{#e=new Map([[T,1]]);#t=new Map([[T,1]]);set(t){let e=t?[...t.values()].reduce((o,i)=>o+i,0):0;this.#e=e>0?new Map([...t].map(([o,i])=>[o,i/e])):new Map([[T,1]])}get clips(){return[...this.#e.keys()].filter(t=>t!==T)}advance(t,e){let o=[...this.#e].filter(([h,u])=>u>0&&(h===T||e(h))),i=o.reduce((h,[,u])=>h+u,0),s=new Map(o.map(([h,u])=>[h,u/i]));if(s.size===0)return;let n=[...new Set([...this.#t.keys(),...s.keys()])].map(h=>[h,(this.#t.get(h)??0)*(1-t)+(s.get(h)??0)*t]).filter(([h,u])=>u>Yt||s.has(h)),a=n.reduce((h,[,u])=>h+u,0);this.#t=new Map(n.map(([h,u])=>[h,u/a]))}of(t){let e=new Map;for(let[o,i]of this.#t)e.set(o??t,(e.get(o??t)??0)+i);return e}},P=class{#e;#t=new Map;seed=null;constructor(t){this.#e=t}at(t,e,o){let i=this.seed===null?null:this.#r(t,o);return i?i.at(e).places.flatMap(s=>this.#i(t,s.seconds).map(({frame:r,weight:n})=>({frame:r,weight:n*s.weight}))):this.#o(t,e)}#r(t,e){let o=`${this.seed} ${t.index} ${e}`,{metadata:i}=this.#e.statics,{firstFrame:s,frameCount:r,name:n}=t;if(!this.#t.has(o)){let a=at({...i,...i.clips?.[n]},r);this.#t.set(o,a.length?new z(a,this.#e.times.subarray(s,s+r),this.seed+e):null)}return this.#t.get(o)}#o(t,e){let{firstFrame:o,frameCount:i,duration:s}=t,r=A(t);if(i===1||!(r>0))return[{frame:o,weight:1}];let n=(e%r+r)%r;return n<s?this.#i(t,n):ct(o+i-1,o,Math.min((n-s)/(r-s),1))}#i({firstFrame:t,frameCount:e},o){let{times:i}=this.#e,s=i[t]+o,r=t,n=t+e-1;for(;n-r>1;){let a=r+n>>1;i[a]<=s?r=a:n=a}return n===r?[{frame:r,weight:1}]:ct(r,n,Math.min(Math.max((s-i[r])/(i[n]-i[r]),0),1))}},ct=(f,t,e)=>[{frame:f,weight:1-e},{frame:t,weight:e}];var M=32,C=4,mt=1.5,pt=2,ne=.85,gt=32,vt=9,ae=16777215,ue=f=>f?new Qt({color:7035717}):new se({color:9083499,roughness:.8,side:Xt}),Y=class extends Kt{pixels=1;measure="p99";phases=8;ease=.2;bytesOfMotion=0;bytesOfParameters=0;levels=[];#e;#t;#r;#o;#i;#s;#m;#u;#n=new Map;#a=[];#y=[];#f=new B;#p;#T=0;#_=null;#c=null;#g=null;#O=null;#h=[];#E=new Jt;#v=1;#l=0;#w=!1;#b=0;#R=new Float32Array(gt);#x=null;#M=null;#C=1;#k=U.uniform(new $(1,0,0));constructor(t,e,{geometry:o=e.geometry??e.lines,material:i=ue,shape:s=r=>r}={}){if(super(),this.name="ath forest",this.#s=t.backend.device,!this.#s)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#e=t,this.#t=e,ht(this,e.metadata),this.#p=new P(e.channel),this.#r=o,this.#o=i,this.#i=s,this.#m=new N(this.#s,{blocks:Q,time:it,hierarchy:st,finish:et,vertices:rt}),this.#u=this.#s.createComputePipeline({layout:"auto",compute:{module:this.#s.createShaderModule({code:tt}),entryPoint:"main"}}),this.view=this.#s.createBuffer({size:4*gt,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#s.createBuffer({size:8*M,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#l}get plantCount(){return this.#a.length}get plants(){return this.#a.map(({clip:t,phase:e})=>[t.name,e])}get clips(){return Array.from(this.#n.keys(),({name:t})=>t)}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:o}=this.#t,{limits:i}=this.#s,s=new Float32Array(8*Math.max(1,t.length));this.#U();let r=l=>this.#I(l)??e.clip,n=new Set(t.map(({clip:l})=>r(l))),a=Math.floor(i.maxStorageBufferBindingSize/(12*C*o.info.placeCount)/Math.max(1,n.size)),h=Math.max(1,Math.min(this.phases,a)),u=new Map,c=(l,m=0)=>{let d=A(l)||1,p=Math.floor((m/d%1+1)%1*h),g=l.index*h+p;return u.has(g)||u.set(g,{index:u.size,clip:l,phase:p/h}),u.get(g).index};t.forEach(({x:l,y:m,z:d,size:p=1,angle:g=0,seconds:_,clip:O,tint:E=ae},S)=>{s.set([l,m,d,p,Math.cos(g),Math.sin(g),c(r(O),_),E],8*S),this.#E.expandByPoint(new $(l,m,d)),this.#v=Math.max(this.#v,p)}),this.#a=[...u.values()],this.#l=t.length;for(let l of[...n,...this.#f.clips])this.#N(l);return this.#_=this.#A(s,4),this.#c=new Zt(new Uint32Array(5*M),5),this.#e.backend.createIndirectStorageAttribute(this.#c),this.#g=this.#A(new Uint32Array(M*Math.max(1,this.#l)),1),this.#x=new Uint32Array(5*M),this.#O=this.#s.createBindGroup({layout:this.#u.getBindGroupLayout(0),entries:[this.#d(this.#_),this.view,this.tolerances,this.#d(this.#c),this.#d(this.#g)].map((l,m)=>({binding:m,resource:{buffer:l}}))}),this}#I(t){return this.#t.motion.clips.find(({index:e,name:o})=>t===e||t===o)}#N(t){this.#n.has(t)||this.#n.set(t,this.#t.motion.clone().play(t.index).setLevel(Math.max(0,this.levels.length-1)).setTime(0))}#A(t,e){let o=new re(t,e);return this.#e.backend.createStorageAttribute(o),o}#d(t){return this.#e.backend.get(t).buffer}blend(t){let e=Object.entries(t??{}).map(([i,s])=>[this.#I(i),s]);if(e.findIndex(([i,s])=>!i||!(s>=0&&s<1/0))>=0||t&&!e.some(([,i])=>i>0))throw new RangeError(`blend: got ${JSON.stringify(t)}, expected weights of clips, ${this.#t.motion.clips.map(({name:i})=>i).join(", ")}`);for(let[i,s]of e)s>0&&this.#N(i);return this.#f.set(t&&new Map(e)),this}async wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);let o=this.#M={},{weights:i}=await this.#t.channel.windWeights(t,e),{clips:s}=this.#t.motion;return o===this.#M&&this.blend(Object.fromEntries(s.map(({name:r},n)=>[r,i[n]]))),this}endless(t=1){if(t!==null&&!Number.isInteger(t))throw new RangeError(`endless: got the seed ${t}, expected an integer`);return this.#p.seed=t,this}sway(t,e=null){return this.#C=t,this.#k.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#F(t){let e=this.levels.length,{motion:o}=this.#t;if(!this.#w){for(let i of this.levels)for(let[s,{readyLevel:r}]of this.#n)if(!i.clips.has(s)&&r>=i.level)return this.#D(()=>this.#V(i,s));if(!(e>=o.levelCount||e>0&&this.#S(e-1)<=t)){for(let i of this.#n.values())i.target<e&&i.setLevel(e);[...this.#n.values()].every(({readyLevel:i})=>i>=e)&&this.#D(()=>this.#W(e))}}}#D(t){this.#w=!0,t().catch(({message:e,codeName:o})=>this.#t.motion.dispatchEvent({type:"error",message:e,codeName:o}))}#S(t){return Math.max(...Array.from(this.#n.keys(),({errors:e})=>e[t][this.measure]))}async#W(t){let{channel:e}=this.#t,o=this.#b,i=()=>o===this.#b,[s,{words:r}]=[await e.parts(t),await e.gpu(t)];if(!i())return;let n=this.#a.length,a=this.#A(new Float32Array(vt*r[2]*n),1),h=new D(this.#s,this.#m,r,{slots:C*n,shown:n,vertices:this.#d(a)}),u={level:t,passes:h,shared:a,clips:new Set,places:new Map,uploaded:0,bytesOfMotion:0,bytesOfParameters:0,strength:NaN,slots:this.#a.map(()=>new Array(C).fill(-1)),before:this.#a.map(()=>null)};this.#t.hasFaces&&h.setCorners(he(this.#t.geometry,e));for(let c of this.#n.keys())if(!await this.#z(u,c,i)){h.dispose();return}this.levels.push(u),this.#L(u,s),this.#w=!1,this.dispatchEvent({type:"level",level:t})}async#V(t,e){let o=this.#b;await this.#z(t,e,()=>o===this.#b)&&(this.#w=!1)}async#z(t,e,o){let{channel:i}=this.#t,{passes:s,level:r,places:n}=t;for(let a=e.firstSegment;a<e.firstSegment+e.segmentCount;a++){let{words:h,coded:u}=await i.gpu(r,a);if(!o())return!1;let c=s.segment(h);this.#B(t,"bytesOfMotion"),u.forEach((l,m)=>n.set(i.segments[a]+m,{segment:c,frame:l}))}return t.clips.add(e),!0}#B(t,e){this[e]+=t.passes.uploaded-t.uploaded,t[e]+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#L(t,e){let{channel:o,motion:i,rest:s,sphere:r}=this.#t,{level:n}=t,a=this.#S(n),h=n>0?this.#S(n-1):r.radius/4,u=o.nodeNumbers(e);e.vertices.forEach((d,p)=>{d<0&&(u[p]=-1)});let c=n===i.levelCount-1?this.#r:j(this.#r,s,mt*a,u);this.#P(t,c,a);for(let d=Math.max(pt*a,r.radius/2e3);d<h;d*=pt){let p=j(this.#r,s,mt*d,u);p.userData.source.length>ne*c.userData.source.length||(this.#P(t,p,d),c=p)}let l=Float32Array.from({length:2*this.#h.length}),m=new Uint32Array(l.buffer);this.#h.sort((d,p)=>d.tolerance-p.tolerance).forEach((d,p)=>{l[2*p]=d.tolerance,m[2*p+1]=d.list}),this.#s.queue.writeBuffer(this.tolerances,0,l)}#P(t,e,o){let i=this.#h.length;if(i===M)return;let s=this.#i(e,o).clone(),{source:r}=e.userData,n=!s.hasAttribute("normal"),a=this.#t.channel.vertexPlaces,h=s.userData.vertices??r;s.setAttribute("athVertex",new ft(Uint32Array.from(h,l=>a[l]),1)),s.setAttribute("position",new ft(Float32Array.from({length:3*h.length},(l,m)=>this.#t.rest[3*h[Math.floor(m/3)]+m%3]),3)),s.setIndirect(this.#c,20*i),this.#x[5*i]=s.index.count;let u=this.#o(n,t.level),c=n?new te(s,u):new ee(s,u);this.#G(u,s,t,i),c.frustumCulled=!1,c.castShadow=c.receiveShadow=!n,this.#h.push({level:t.level,tolerance:o,list:i,drawn:c,size:s.index.count}),this.add(c)}#G(t,e,{passes:o,shared:i},s){let{Fn:r,storage:n,uint:a,float:h,vec3:u,attribute:c,instanceIndex:l,positionGeometry:m,positionPrevious:d,normalLocal:p,normalGeometry:g,select:_}=U,{metadata:O,channel:{info:E}}=this.#t,S=O.up_axis==="z",y=this.#k,F=u(...E.origin),wt=a(o.words[2]),bt=n(i,"float",i.count).toReadOnly(),W=n(this.#_,"vec4",2*Math.max(1,this.#l)).toReadOnly(),xt=n(this.#g,"uint",this.#g.count).toReadOnly(),V=(v,w,b)=>S?u(w.mul(v.x).sub(b.mul(v.y)),b.mul(v.x).add(w.mul(v.y)),v.z):u(w.mul(v.x).add(b.mul(v.z)),v.y,w.mul(v.z).sub(b.mul(v.x))),J=()=>xt.element(a(s*Math.max(1,this.#l)).add(l)),yt=e.hasAttribute("athOffset"),_t=o.hasCorners&&!e.userData.vertices;t.positionNode=r((v,w)=>{let b=J().toVar(),X=W.element(b.mul(2)).toVar(),x=W.element(b.mul(2).add(1)).toVar(),St=a(x.z).mul(wt).add(c("athVertex","uint")).mul(vt).toVar(),L=G=>u(...[0,1,2].map(k=>bt.element(St.add(G+k)))),K=G=>{let k=G.add(F).toVar(),Et=k.sub(m).toVar(),Rt=y.x.mul(x.x).add(y.y.mul(x.y)),At=y.y.mul(x.x).sub(y.x.mul(x.y)),Tt=m.add(V(Et,Rt,At)),Z=_(y.z.greaterThan(.5),Tt,k).toVar(),Mt=yt?Z.add(c("athOffset","vec3")):Z;return V(Mt,x.x,x.y).mul(X.w).add(X.xyz)};return e.hasAttribute("normal")&&p.assign(V(_t?L(3):g,x.x,x.y)),w.needsPreviousData?.()&&d.assign(K(L(6))),K(L(0))})();let Ot=r(()=>{let v=a(W.element(J().mul(2).add(1)).w),w=b=>h(v.shiftRight(a(b)).bitAnd(a(255))).div(255);return u(w(16),w(8),w(0))})();t.colorNode=U.varying(Ot).mul(t.colorNode??(e.hasAttribute("color")?c("color","vec3"):U.materialColor))}update(t,e,o){if(!this.#O)return;let i=this.#H(t,e);this.#F(i),this.#q(o);for(let s of this.levels)(s.level===0||this.#S(s.level-1)>i)&&this.#j(s);this.#J()}#H(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:o}=this.#t,i=o.center.length()+1.2*o.radius,s=this.#R,r=new $().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new dt().copy(this.matrixWorld).invert());new ie().setFromProjectionMatrix(new dt().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??oe).planes.forEach(({normal:u,constant:c},l)=>s.set([u.x,u.y,u.z,c],4*l));let a=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,h=this.#E.distanceToPoint(r);return s.set([r.x,r.y,r.z,a],24),new Uint32Array(s.buffer).set([this.#l,this.#h.length],28),s[30]=i,new Uint32Array(s.buffer)[31]=Math.max(1,this.#l),a*Math.max(h-.5*i*this.#v,1e-6)/this.#v}#q(t){let e=performance.now(),o=this.ease>0?1-Math.exp((this.#T-e)/(1e3*this.ease)):1;this.#T=e,this.#f.advance(o,i=>this.levels.every(s=>s.clips.has(i))),this.#y=this.#a.map(({clip:i,phase:s},r)=>[...this.#f.of(i)].flatMap(([n,a])=>this.#p.at(n,t+s*A(n),r).map(({frame:h,weight:u})=>({frame:h,weight:a*u}))))}#j(t){let e=[],o=[],i=this.#C,s=t.strength!==i;t.strength=i,this.#y.forEach((r,n)=>{let a=t.before[n];s&&t.slots[n].fill(-1);let h=r.length>2?this.#Y(t,n,r,e):this.#$(t,n,r,e);o.push({...h,previous:a?.slots??h.slots,previousWeight:a?.weight??h.weight}),t.before[n]=h}),t.passes.run(e,o),this.#B(t,"bytesOfParameters")}#$(t,e,o,i){let s=t.slots[e],r=C*e,n=o.map(({frame:h})=>h),a=n.map(h=>{let u=s.indexOf(h);return u<0&&(u=s.findIndex((c,l)=>!n.includes(c)&&!t.before[e]?.slots.includes(r+l)),s[u]=h,i.push({sources:[t.places.get(h)],slot:r+u,strength:t.strength})),r+u});return{slots:[a[0],a.at(-1)],weight:o.length>1?o[1].weight:0}}#Y(t,e,o,i){let s=t.slots[e],r=C*e,n=s.findIndex((h,u)=>!t.before[e]?.slots.includes(r+u));s[n]=-1;let a=o.filter(({weight:h})=>h>0).map(({frame:h,weight:u})=>({...t.places.get(h),weight:u}));return i.push({sources:a,slot:r+n,strength:t.strength}),{slots:[r+n,r+n],weight:0}}#J(){let{queue:t}=this.#s,e=this.#s.createCommandEncoder();t.writeBuffer(this.view,0,this.#R),t.writeBuffer(this.#d(this.#c),0,this.#x),this.bytesOfParameters+=this.#R.byteLength+this.#x.byteLength;let o=e.beginComputePass();o.setPipeline(this.#u),o.setBindGroup(0,this.#O),o.dispatchWorkgroups(Math.ceil(Math.max(1,this.#l)/64)),o.end(),t.submit([e.finish()])}async drawn(){let t=this.#x.byteLength,e=this.#s.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),o=this.#s.createCommandEncoder(),i=new Array(this.#t.motion.levelCount).fill(0);o.copyBufferToBuffer(this.#d(this.#c),0,e,0,t),this.#s.queue.submit([o.finish()]),await e.mapAsync(GPUMapMode.READ);let s=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:r,list:n}of this.#h)i[r]+=s[5*n+1];return i}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#e.getArrayBufferAsync(e))}#U(){this.#b++,this.#w=!1;for(let{drawn:t}of this.#h)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#e.backend.destroyAttribute(e);for(let t of[this.#_,this.#c,this.#g].filter(Boolean))this.#e.backend.destroyAttribute(t);for(let t of this.#n.values())t.dispose();this.#n.clear(),this.levels=[],this.#h=[],this.#O=null,this.#E.makeEmpty(),this.#v=1e-9}dispose(){this.#U(),this.view.destroy(),this.tolerances.destroy()}};function he(f,{vertexPlaces:t,info:{placeCount:e}}){let o=Uint32Array.from(f.index.array,r=>t[f.userData.source[r]]),i=new Uint32Array(e+1),s=new Uint32Array(e+1+2*o.length);for(let r of o)i[r+1]++;for(let r=0;r<e;r++)i[r+1]+=i[r];for(let r=0;r<=e;r++)s[r]=e+1+2*i[r];for(let r=0;r<o.length;r++){let n=r-r%3,a=e+1+2*i[o[r]]++;s[a]=o[n+(r+1)%3],s[a+1]=o[n+(r+2)%3]}return s}export{Y as ATHForest};
