import{Box3 as Zt,BufferAttribute as dt,DoubleSide as Qt,Group as te,IndirectStorageBufferAttribute as ee,LineBasicNodeMaterial as se,LineSegments as re,Mesh as ie,MeshStandardNodeMaterial as oe,Frustum as ne,Matrix4 as mt,StorageBufferAttribute as ae,TSL as F,Vector3 as j,WebGPUCoordinateSystem as ue}from"three/webgpu";var tt=`// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

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
`;var et=`// Chooses what instances are drawn with: each that is in view is appended to the list of the coarsest shape whose error its distance
// hides. One invocation per instance.

struct Instance {
    place: vec4<f32>, // x, y, z, size
    turn: vec4<f32>,  // cosine and sine of its angle, the plant that it shows, tint
    look: vec4<f32>,  // Amplitude: how many times as far from the rest pose everything is.
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
    if (!is_seen(place.xyz, radius * max(1.0, 2.0 * abs(instances[id.x].look.x - 0.5)))) {
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
`;var st=`// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

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
`;var rt=`// Pass 2: bodies of one depth, each placed from the one that it hangs on; amplitudes of all sources of a place add up. One
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
`;var ot=`// Pass 3: vertices at a time, between two frames that the passes before have placed. \`vertex_at\` is what a vertex stage calls;
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
`;var[nt,at,Pt,Ft,Wt,Vt]=[2,3,4,5,6,10],[Lt,Ht,Gt]=[5,6,19],qt=64,T=8,H=4,G=12,jt=9,z=l=>Math.ceil(l/qt),B=class{constructor(t,{blocks:e,time:i,hierarchy:r,finish:s,vertices:o}){let n=(...h)=>t.createShaderModule({code:h.join(`
`)}),u=(h,f="main")=>t.createComputePipeline({layout:"auto",compute:{module:h,entryPoint:f}}),a=n(e,s);this.time=u(n(e,i)),this.hierarchy=u(n(e,r)),this.bodies=u(a,"bodies"),this.corrections=u(a,"corrections"),this.baked=u(a,"baked"),this.vertices=u(n(o))}},U=class{uploaded=0;#s=new Map;#t=0;#n=0;#d=0;constructor(t,e,i,{slots:r=2,shown:s=1,vertices:o=null,across:n=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:i,slots:r,shown:s,across:n}),this.size={positions:3*i[Pt],matrices:12*i[Ft],bodies:12*i[at],vertices:jt*i[nt]},this.baked=!1;let{positions:u,matrices:a,bodies:h}=this.size;this.buffers={level:this.#e(i),segments:this.#r(1),places:this.#r((T+H)*r),shows:this.#r(G*s),amplitudes:this.#r(1),positions:this.#r(r*u),matrices:this.#r(r*a),modes:this.#r(r*u),bodies:this.#r(r*h),corners:this.#r(1),vertices:o??this.#r(s*this.size.vertices)},this.ownsVertices=!o,this.depths=Array.from({length:i[Wt]},(f,c)=>{let[m,d]=i.subarray(i[Vt]+c);return{count:d-m,uniform:this.#m(c)}}),this.ordinals=[],this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#r(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#e(t,e=140){let i=this.#r(t.length,e);return this.#a(i,t),i}#m(t){return this.#e(new Uint32Array([t,0,0,0]),72)}#a(t,e,i=0,r=e.length){this.uploaded+=4*r,this.device.queue.writeBuffer(t,4*i,e.buffer,e.byteOffset,4*r)}#i(t,e,i=0){let r=this.buffers[t],{device:s}=this;if(4*e<=r.size)return;let o=this.#r(e);if(i>0){let n=s.createCommandEncoder();n.copyBufferToBuffer(r,0,o,0,4*i),s.queue.submit([n.finish()])}r.destroy(),this.buffers[t]=o,this.#s.clear()}segment(t){let e=this.#d;return e+t.length>this.buffers.segments.size/4&&this.#i("segments",2*(e+t.length),e),this.#a(this.buffers.segments,t,e),this.#d+=t.length,this.#t=Math.max(this.#t,t[Lt]),this.#n=Math.max(this.#n,t[Ht]),this.baked||=t[Gt]!==0,e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#e(t),this.hasCorners=!0,this.#s.clear()}#o(t,e,[i,r],s,o=null){if(i===0||r===0)return;let n=o??e;if(!this.#s.has(n)){let a=s.flatMap((f,c)=>f?[{binding:c,resource:{buffer:this.buffers[f]}}]:[]);o&&a.push({binding:s.length,resource:{buffer:o}});let h=this.kernels[e].getBindGroupLayout(0);this.#s.set(n,this.device.createBindGroup({layout:h,entries:a}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#s.get(n));let u=Math.min(i,this.across);t.dispatchWorkgroups(u,r,Math.ceil(i/u))}run(t,e){let i=this.device.createCommandEncoder(),r=i.beginComputePass();t.length>0&&this.#x(r,t),e.length>0&&this.#y(r,e),r.end(),this.device.queue.submit([i.finish()])}#x(t,e){let{positions:i,bodies:r}=this.size,s=e.length;if(this.#l(e),this.baked){this.#o(t,"baked",[z(i),s],["level","segments","places","positions"]);return}this.#o(t,"time",[z(this.#t),s],[null,"segments","places","amplitudes"]);let o=["amplitudes","positions","matrices","modes","bodies"];for(let u of this.depths)this.#o(t,"hierarchy",[u.count,s],["level","segments","places",...o],u.uniform);this.#o(t,"bodies",[this.words[at],s],["level","segments","places","positions","matrices"]);let n=Math.max(...e.map(({sources:u})=>u.length));for(;this.ordinals.length<n;)this.ordinals.push(this.#m(this.ordinals.length));for(let u of this.ordinals.slice(0,n))this.#o(t,"corrections",[z(this.#n),s],[null,"segments","places","positions",null],u)}#l(t){let{positions:e,matrices:i,bodies:r}=this.size,s=t.reduce((h,{sources:f})=>h+f.length,0),o=new Uint32Array(T*t.length+H*s),n=new Float32Array(o.buffer),u=T*t.length,a=0;t.forEach(({sources:h,slot:f,strength:c=1},m)=>{o.set([u,h.length,f*e,f*i,m*e,m*r],T*m),n[T*m+6]=c;for(let{segment:d,frame:p,weight:g=1}of h)o.set([d,p,3*this.#t*a++],u),n[u+3]=g,u+=H}),this.#i("places",o.length),this.#i("amplitudes",3*this.#t*s),this.#a(this.buffers.places,o)}#y(t,e){let{positions:i,matrices:r,vertices:s}=this.size,o=new Uint32Array(G*e.length),n=new Float32Array(o.buffer);e.forEach(({slots:u,weight:a,previous:h=u,previousWeight:f=a,at:c=null},m)=>{let d=G*m;[...u,...h].forEach((p,g)=>{o[d+g]=p*i,o[d+4+g]=p*r}),n[d+8]=a,n[d+9]=f,o[d+10]=this.hasCorners?1:0,o[d+11]=(c??m)*s}),this.#a(this.buffers.shows,o),this.#o(t,"vertices",[z(this.words[nt]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),i=4*this.size.vertices*t.length,r=this.device.createBuffer({size:i,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,r,0,i),this.device.queue.submit([e.finish()]),await r.mapAsync(1);let s=new Float32Array(r.getMappedRange().slice(0));return r.destroy(),s}dispose(){for(let t of[...this.depths.map(e=>e.uniform),...this.ordinals])t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};import{Box3 as Se,DataTexture as Te,EventDispatcher as Ce,FloatType as Me,MathUtils as ke,NearestFilter as De,RGBAFormat as Ie,Sphere as Ne,Vector3 as ct}from"three";import{BufferAttribute as ut,BufferGeometry as $t,InstancedBufferAttribute as ye,ShapeUtils as _e,Vector2 as Oe,Vector3 as Ee}from"three";function ht(l,{up_axis:t}){return t==="z"&&(l.rotation.x=-Math.PI/2),t==="x"&&(l.rotation.z=Math.PI/2),l}function Yt(l,t,e,i){for(let r=0;r<e.length;r++)for(let s=0;s<i;s++)l[i*r+s]=Number(t[i*e[r]+s]);return l}function q(l,t,e,i){let{source:r}=l.userData,s=l.index.array,o=!l.getAttribute("normal"),n=new Map,u=o?2:3,a=[],h=new Set,f=c=>{let m=3*r[c],d=g=>Math.floor(t[m+g]/e)&4095,p=((i[r[c]]+1&65535)*4096+d(0))*16777216+d(1)*4096+d(2);return n.has(p)||n.set(p,c),n.get(p)};for(let c=0;c<s.length;c+=u){let m=Array.from(s.subarray(c,c+u),f),[d,p,g]=m;if(d===p||!o&&(p===g||g===d))continue;let[_,O,A]=[...m].sort((R,y)=>R-y),E=o?_*2**26+O:`${_},${O},${A}`;h.has(E)||(h.add(E),a.push(...m))}return a.length===0&&a.push(...s.subarray(0,u)),Jt(l,Uint32Array.from(a))}function Jt(l,t){let e=Uint32Array.from(new Set(t)).sort(),i=new Map(Array.from(e,(s,o)=>[s,o])),r=new $t;for(let[s,{array:o,itemSize:n}]of Object.entries(l.attributes))r.setAttribute(s,new ut(Yt(new o.constructor(n*e.length),o,e,n),n));return r.setIndex(new ut(t.map(s=>i.get(s)),1)),r.userData.source=e.map(s=>l.userData.source[s]),r}var ze=new ct,Be=new ct;function C({lastTime:l,frameCount:t}){return t>1?l+l/(t-1):0}var M=null,Xt=.001,P=class{#s=new Map([[M,1]]);#t=new Map([[M,1]]);set(t){let e=t?[...t.values()].reduce((i,r)=>i+r,0):0;this.#s=e>0?new Map([...t].map(([i,r])=>[i,r/e])):new Map([[M,1]])}get clips(){return[...this.#s.keys()].filter(t=>t!==M)}advance(t,e){let i=[...this.#s].filter(([a,h])=>h>0&&(a===M||e(a))),r=i.reduce((a,[,h])=>a+h,0),s=new Map(i.map(([a,h])=>[a,h/r]));if(s.size===0)return;let n=[...new Set([...this.#t.keys(),...s.keys()])].map(a=>[a,(this.#t.get(a)??0)*(1-t)+(s.get(a)??0)*t]).filter(([a,h])=>h>Xt||s.has(a)),u=n.reduce((a,[,h])=>a+h,0);this.#t=new Map(n.map(([a,h])=>[a,h/u]))}of(t){let e=new Map;for(let[i,r]of this.#t)e.set(i??t,(e.get(i??t)??0)+r);return e}};function lt(l,t,e){let{firstFrame:i,frameCount:r,lastTime:s}=t,o=C(t);if(r===1||!(o>0))return[{frame:i,weight:1}];let n=(e%o+o)%o;return n<s?Kt(l,t,n):ft(i+r-1,i,Math.min((n-s)/(o-s),1))}function Kt(l,{firstFrame:t,frameCount:e},i){let r=l[t]+i,s=t,o=t+e-1;for(;o-s>1;){let n=s+o>>1;l[n]<=r?s=n:o=n}return o===s?[{frame:s,weight:1}]:ft(s,o,Math.min(Math.max((r-l[s])/(l[o]-l[s]),0),1))}var ft=(l,t,e)=>[{frame:l,weight:1-e},{frame:t,weight:e}];var k=32,D=12,I=4,pt=1.5,gt=2,he=.85,wt=32,vt=9,ce=16777215,le=l=>l?new se({color:7035717}):new oe({color:9083499,roughness:.8,side:Qt}),$=class extends te{pixels=1;measure="p99";phases=8;ease=.2;bytesOfMotion=0;bytesOfParameters=0;levels=[];#s;#t;#n;#d;#r;#e;#m;#a;#i=new Map;#o=[];#x=[];#l=new P;#y=0;#_=null;#c=null;#p=null;#O=null;#u=[];#A=new Zt;#g=1;#h=0;#w=!1;#v=0;#R=new Float32Array(wt);#b=null;#T=null;#C=1;#M=F.uniform(new j(1,0,0));constructor(t,e,{geometry:i=e.geometry??e.lines,material:r=le,shape:s=o=>o}={}){if(super(),this.name="ath forest",this.#e=t.backend.device,!this.#e)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#s=t,this.#t=e,ht(this,e.metadata),this.#n=i,this.#d=r,this.#r=s,this.#m=new B(this.#e,{blocks:tt,time:it,hierarchy:rt,finish:st,vertices:ot}),this.#a=this.#e.createComputePipeline({layout:"auto",compute:{module:this.#e.createShaderModule({code:et}),entryPoint:"main"}}),this.view=this.#e.createBuffer({size:4*wt,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#e.createBuffer({size:8*k,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#h}get plantCount(){return this.#o.length}get plants(){return this.#o.map(({clip:t,phase:e})=>[t.name,e])}get clips(){return Array.from(this.#i.keys(),({name:t})=>t)}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:i}=this.#t,{limits:r}=this.#e,s=new Float32Array(D*Math.max(1,t.length));this.#U();let o=c=>this.#k(c)??e.clip,n=new Set(t.map(({clip:c})=>o(c))),u=Math.floor(r.maxStorageBufferBindingSize/(12*I*i.info.placeCount)/Math.max(1,n.size)),a=Math.max(1,Math.min(this.phases,u)),h=new Map,f=(c,m=0)=>{let d=C(c)||1,p=Math.floor((m/d%1+1)%1*a),g=c.index*a+p;return h.has(g)||h.set(g,{index:h.size,clip:c,phase:p/a}),h.get(g).index};t.forEach(({x:c,y:m,z:d,size:p=1,angle:g=0,seconds:_,clip:O,tint:A=ce,amplitude:E=1},R)=>{s.set([c,m,d,p,Math.cos(g),Math.sin(g),f(o(O),_),A,E],D*R),this.#A.expandByPoint(new j(c,m,d)),this.#g=Math.max(this.#g,p)}),this.#o=[...h.values()],this.#h=t.length;for(let c of[...n,...this.#l.clips])this.#D(c);return this.#_=this.#S(s,4),this.#c=new ee(new Uint32Array(5*k),5),this.#s.backend.createIndirectStorageAttribute(this.#c),this.#p=this.#S(new Uint32Array(k*Math.max(1,this.#h)),1),this.#b=new Uint32Array(5*k),this.#O=this.#e.createBindGroup({layout:this.#a.getBindGroupLayout(0),entries:[this.#f(this.#_),this.view,this.tolerances,this.#f(this.#c),this.#f(this.#p)].map((c,m)=>({binding:m,resource:{buffer:c}}))}),this}#k(t){return this.#t.motion.clips.find(({index:e,name:i})=>t===e||t===i)}#D(t){this.#i.has(t)||this.#i.set(t,this.#t.motion.clone().play(t.index).setLevel(Math.max(0,this.levels.length-1)).setTime(0))}#S(t,e){let i=new ae(t,e);return this.#s.backend.createStorageAttribute(i),i}#f(t){return this.#s.backend.get(t).buffer}blend(t){let e=Object.entries(t??{}).map(([r,s])=>[this.#k(r),s]);if(e.findIndex(([r,s])=>!r||!(s>=0&&s<1/0))>=0||t&&!e.some(([,r])=>r>0))throw new RangeError(`blend: got ${JSON.stringify(t)}, expected weights of clips, ${this.#t.motion.clips.map(({name:r})=>r).join(", ")}`);for(let[r,s]of e)s>0&&this.#D(r);return this.#l.set(t&&new Map(e)),this}async wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);let i=this.#T={},{weights:r}=await this.#t.channel.windWeights(t,e),{clips:s}=this.#t.motion;return i===this.#T&&this.blend(Object.fromEntries(s.map(({name:o},n)=>[o,r[n]]))),this}sway(t,e=null){return this.#C=t,this.#M.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#P(t){let e=this.levels.length,{motion:i}=this.#t;if(!this.#w){for(let r of this.levels)for(let[s,{readyLevel:o}]of this.#i)if(!r.clips.has(s)&&o>=r.level)return this.#I(()=>this.#W(r,s));if(!(e>=i.levelCount||e>0&&this.#E(e-1)<=t)){for(let r of this.#i.values())r.target<e&&r.setLevel(e);[...this.#i.values()].every(({readyLevel:r})=>r>=e)&&this.#I(()=>this.#F(e))}}}#I(t){this.#w=!0,t().catch(({message:e,codeName:i})=>this.#t.motion.dispatchEvent({type:"error",message:e,codeName:i}))}#E(t){return Math.max(...Array.from(this.#i.keys(),({errors:e})=>e[t][this.measure]))}async#F(t){let{channel:e}=this.#t,i=this.#v,r=()=>i===this.#v,[s,{words:o}]=[await e.parts(t),await e.gpu(t)];if(!r())return;let n=this.#o.length,u=this.#S(new Float32Array(vt*o[2]*n),1),a=new U(this.#e,this.#m,o,{slots:I*n,shown:n,vertices:this.#f(u)}),h={level:t,passes:a,shared:u,clips:new Set,places:new Map,uploaded:0,bytesOfMotion:0,bytesOfParameters:0,strength:NaN,slots:this.#o.map(()=>new Array(I).fill(-1)),before:this.#o.map(()=>null)};this.#t.hasFaces&&a.setCorners(fe(this.#t.geometry,e));for(let f of this.#i.keys())if(!await this.#N(h,f,r)){a.dispose();return}this.levels.push(h),this.#V(h,s),this.#w=!1,this.dispatchEvent({type:"level",level:t})}async#W(t,e){let i=this.#v;await this.#N(t,e,()=>i===this.#v)&&(this.#w=!1)}async#N(t,e,i){let{channel:r}=this.#t,{passes:s,level:o,places:n}=t;for(let u=e.firstSegment;u<e.firstSegment+e.segmentCount;u++){let{words:a,coded:h}=await r.gpu(o,u);if(!i())return!1;let f=s.segment(a);this.#z(t,"bytesOfMotion"),h.forEach((c,m)=>n.set(r.segments[u]+m,{segment:f,frame:c}))}return t.clips.add(e),!0}#z(t,e){this[e]+=t.passes.uploaded-t.uploaded,t[e]+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#V(t,e){let{channel:i,motion:r,rest:s,sphere:o}=this.#t,{level:n}=t,u=this.#E(n),a=n>0?this.#E(n-1):o.radius/4,h=i.nodeNumbers(e);e.vertices.forEach((d,p)=>{d<0&&(h[p]=-1)});let f=n===r.levelCount-1?this.#n:q(this.#n,s,pt*u,h);this.#B(t,f,u);for(let d=Math.max(gt*u,o.radius/2e3);d<a;d*=gt){let p=q(this.#n,s,pt*d,h);p.userData.source.length>he*f.userData.source.length||(this.#B(t,p,d),f=p)}let c=Float32Array.from({length:2*this.#u.length}),m=new Uint32Array(c.buffer);this.#u.sort((d,p)=>d.tolerance-p.tolerance).forEach((d,p)=>{c[2*p]=d.tolerance,m[2*p+1]=d.list}),this.#e.queue.writeBuffer(this.tolerances,0,c)}#B(t,e,i){let r=this.#u.length;if(r===k)return;let s=this.#r(e,i).clone(),{source:o}=e.userData,n=!s.hasAttribute("normal"),u=this.#t.channel.vertexPlaces,a=s.userData.vertices??o;s.setAttribute("athVertex",new dt(Uint32Array.from(a,c=>u[c]),1)),s.setAttribute("position",new dt(Float32Array.from({length:3*a.length},(c,m)=>this.#t.rest[3*a[Math.floor(m/3)]+m%3]),3)),s.setIndirect(this.#c,20*r),this.#b[5*r]=s.index.count;let h=this.#d(n,t.level),f=n?new re(s,h):new ie(s,h);this.#L(h,s,t,r),f.frustumCulled=!1,f.castShadow=f.receiveShadow=!n,this.#u.push({level:t.level,tolerance:i,list:r,drawn:f,size:s.index.count}),this.add(f)}#L(t,e,{passes:i,shared:r},s){let{Fn:o,storage:n,uint:u,float:a,vec3:h,attribute:f,instanceIndex:c,positionGeometry:m,positionPrevious:d,normalLocal:p,normalGeometry:g,select:_}=F,{metadata:O,channel:{info:A},origin:E}=this.#t,R=O.up_axis==="z",y=this.#M,bt=h(...A.origin.map((w,v)=>w-E[v])),xt=u(i.words[2]),yt=n(r,"float",r.count).toReadOnly(),Y=n(this.#_,"vec4",D/4*Math.max(1,this.#h)).toReadOnly(),_t=n(this.#p,"uint",this.#p.count).toReadOnly(),W=(w,v,x)=>R?h(v.mul(w.x).sub(x.mul(w.y)),x.mul(w.x).add(v.mul(w.y)),w.z):h(v.mul(w.x).add(x.mul(w.z)),w.y,v.mul(w.z).sub(x.mul(w.x))),J=()=>_t.element(u(s*Math.max(1,this.#h)).add(c)),Ot=e.hasAttribute("athOffset"),Et=i.hasCorners&&!e.userData.vertices;t.positionNode=o((w,v)=>{let x=J().toVar(),V=S=>Y.element(x.mul(D/4).add(S)).toVar(),X=V(0),b=V(1),K=V(2).x,Rt=u(b.z).mul(xt).add(f("athVertex","uint")).mul(vt).toVar(),L=S=>h(...[0,1,2].map(N=>yt.element(Rt.add(S+N)))),Z=S=>{let N=S.add(bt).sub(m).mul(K).toVar(),Tt=y.x.mul(b.x).add(y.y.mul(b.y)),Ct=y.y.mul(b.x).sub(y.x.mul(b.y)),Mt=m.add(W(N,Tt,Ct)),Q=_(y.z.greaterThan(.5),Mt,m.add(N)).toVar(),kt=Ot?Q.add(f("athOffset","vec3")):Q;return W(kt,b.x,b.y).mul(X.w).add(X.xyz)},St=()=>Et?g.add(L(3).sub(g).mul(K)):g;return e.hasAttribute("normal")&&p.assign(W(St(),b.x,b.y)),v.needsPreviousData?.()&&d.assign(Z(L(6))),Z(L(0))})();let At=o(()=>{let w=u(Y.element(J().mul(D/4).add(1)).w),v=x=>a(w.shiftRight(u(x)).bitAnd(u(255))).div(255);return h(v(16),v(8),v(0))})();t.colorNode=F.varying(At).mul(t.colorNode??(e.hasAttribute("color")?f("color","vec3"):F.materialColor))}update(t,e,i){if(!this.#O)return;let r=this.#H(t,e);this.#P(r),this.#G(i);for(let s of this.levels)s.level===0||this.#E(s.level-1)>r?this.#q(s):s.before.fill(null);this.#Y()}#H(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:i}=this.#t,r=i.center.length()+1.2*i.radius,s=this.#R,o=new j().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new mt().copy(this.matrixWorld).invert());new ne().setFromProjectionMatrix(new mt().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??ue).planes.forEach(({normal:h,constant:f},c)=>s.set([h.x,h.y,h.z,f],4*c));let u=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,a=this.#A.distanceToPoint(o);return s.set([o.x,o.y,o.z,u],24),new Uint32Array(s.buffer).set([this.#h,this.#u.length],28),s[30]=r,new Uint32Array(s.buffer)[31]=Math.max(1,this.#h),u*Math.max(a-.5*r*this.#g,1e-6)/this.#g}#G(t){let e=performance.now(),i=this.ease>0?1-Math.exp((this.#y-e)/(1e3*this.ease)):1;this.#y=e,this.#l.advance(i,s=>this.levels.every(o=>o.clips.has(s)));let{times:r}=this.#t.channel;this.#x=this.#o.map(({clip:s,phase:o})=>[...this.#l.of(s)].flatMap(([n,u])=>lt(r,n,t+o*C(n)).map(({frame:a,weight:h})=>({frame:a,weight:u*h}))))}#q(t){let e=[],i=[],r=this.#C,s=t.strength!==r;t.strength=r,this.#x.forEach((o,n)=>{let u=t.before[n];s&&t.slots[n].fill(-1);let a=o.length>2?this.#$(t,n,o,e):this.#j(t,n,o,e);i.push({...a,previous:u?.slots??a.slots,previousWeight:u?.weight??a.weight}),t.before[n]=a}),t.passes.run(e,i),this.#z(t,"bytesOfParameters")}#j(t,e,i,r){let s=t.slots[e],o=I*e,n=i.map(({frame:a})=>a),u=n.map(a=>{let h=s.indexOf(a);return h<0&&(h=s.findIndex((f,c)=>!n.includes(f)&&!t.before[e]?.slots.includes(o+c)),s[h]=a,r.push({sources:[t.places.get(a)],slot:o+h,strength:t.strength})),o+h});return{slots:[u[0],u.at(-1)],weight:i.length>1?i[1].weight:0}}#$(t,e,i,r){let s=t.slots[e],o=I*e,n=s.findIndex((a,h)=>!t.before[e]?.slots.includes(o+h));s[n]=-1;let u=i.filter(({weight:a})=>a>0).map(({frame:a,weight:h})=>({...t.places.get(a),weight:h}));return r.push({sources:u,slot:o+n,strength:t.strength}),{slots:[o+n,o+n],weight:0}}#Y(){let{queue:t}=this.#e,e=this.#e.createCommandEncoder();t.writeBuffer(this.view,0,this.#R),t.writeBuffer(this.#f(this.#c),0,this.#b),this.bytesOfParameters+=this.#R.byteLength+this.#b.byteLength;let i=e.beginComputePass();i.setPipeline(this.#a),i.setBindGroup(0,this.#O),i.dispatchWorkgroups(Math.ceil(Math.max(1,this.#h)/64)),i.end(),t.submit([e.finish()])}async drawn(){let t=this.#b.byteLength,e=this.#e.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),i=this.#e.createCommandEncoder(),r=new Array(this.#t.motion.levelCount).fill(0);i.copyBufferToBuffer(this.#f(this.#c),0,e,0,t),this.#e.queue.submit([i.finish()]),await e.mapAsync(GPUMapMode.READ);let s=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:o,list:n}of this.#u)r[o]+=s[5*n+1];return r}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#s.getArrayBufferAsync(e))}#U(){this.#v++,this.#w=!1;for(let{drawn:t}of this.#u)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#s.backend.destroyAttribute(e);for(let t of[this.#_,this.#c,this.#p].filter(Boolean))this.#s.backend.destroyAttribute(t);for(let t of this.#i.values())t.dispose();this.#i.clear(),this.levels=[],this.#u=[],this.#O=null,this.#A.makeEmpty(),this.#g=1e-9}dispose(){this.#U(),this.view.destroy(),this.tolerances.destroy()}};function fe(l,{vertexPlaces:t,info:{placeCount:e}}){let i=Uint32Array.from(l.index.array,o=>t[l.userData.source[o]]),r=new Uint32Array(e+1),s=new Uint32Array(e+1+2*i.length);for(let o of i)r[o+1]++;for(let o=0;o<e;o++)r[o+1]+=r[o];for(let o=0;o<=e;o++)s[o]=e+1+2*r[o];for(let o=0;o<i.length;o++){let n=o-o%3,u=e+1+2*r[i[o]]++;s[u]=i[n+(o+1)%3],s[u+1]=i[n+(o+2)%3]}return s}export{$ as ATHForest};
