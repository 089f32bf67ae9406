import{Box3 as Xt,BufferAttribute as ft,DoubleSide as Kt,Group as Zt,IndirectStorageBufferAttribute as Qt,LineBasicNodeMaterial as te,LineSegments as ee,Mesh as se,MeshStandardNodeMaterial as ie,Frustum as re,Matrix4 as dt,StorageBufferAttribute as oe,TSL as P,Vector3 as $,WebGPUCoordinateSystem as ne}from"three/webgpu";var Q=`// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

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
`;var[ot,nt,Ut,Pt,Ft,Wt]=[2,3,4,5,6,10],[Vt,Lt,Gt]=[5,6,19],Ht=64,A=8,H=4,q=12,qt=9,I=c=>Math.ceil(c/Ht),N=class{constructor(t,{blocks:e,time:r,hierarchy:i,finish:s,vertices:n}){let o=(...u)=>t.createShaderModule({code:u.join(`
`)}),a=(u,f="main")=>t.createComputePipeline({layout:"auto",compute:{module:u,entryPoint:f}}),h=o(e,s);this.time=a(o(e,r)),this.hierarchy=a(o(e,i)),this.bodies=a(h,"bodies"),this.corrections=a(h,"corrections"),this.baked=a(h,"baked"),this.vertices=a(o(n))}},D=class{uploaded=0;#e=new Map;#t=0;#r=0;#o=0;constructor(t,e,r,{slots:i=2,shown:s=1,vertices:n=null,across:o=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:r,slots:i,shown:s,across:o}),this.size={positions:3*r[Ut],matrices:12*r[Pt],bodies:12*r[nt],vertices:qt*r[ot]},this.baked=!1;let{positions:a,matrices:h,bodies:u}=this.size;this.buffers={level:this.#s(r),segments:this.#i(1),places:this.#i((A+H)*i),shows:this.#i(q*s),amplitudes:this.#i(1),positions:this.#i(i*a),matrices:this.#i(i*h),modes:this.#i(i*a),bodies:this.#i(i*u),corners:this.#i(1),vertices:n??this.#i(s*this.size.vertices)},this.ownsVertices=!n,this.depths=Array.from({length:r[Ft]},(f,l)=>{let[m,d]=r.subarray(r[Wt]+l);return{count:d-m,uniform:this.#m(l)}}),this.ordinals=[],this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#i(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#s(t,e=140){let r=this.#i(t.length,e);return this.#u(r,t),r}#m(t){return this.#s(new Uint32Array([t,0,0,0]),72)}#u(t,e,r=0,i=e.length){this.uploaded+=4*i,this.device.queue.writeBuffer(t,4*r,e.buffer,e.byteOffset,4*i)}#n(t,e,r=0){let i=this.buffers[t],{device:s}=this;if(4*e<=i.size)return;let n=this.#i(e);if(r>0){let o=s.createCommandEncoder();o.copyBufferToBuffer(i,0,n,0,4*r),s.queue.submit([o.finish()])}i.destroy(),this.buffers[t]=n,this.#e.clear()}segment(t){let e=this.#o;return e+t.length>this.buffers.segments.size/4&&this.#n("segments",2*(e+t.length),e),this.#u(this.buffers.segments,t,e),this.#o+=t.length,this.#t=Math.max(this.#t,t[Vt]),this.#r=Math.max(this.#r,t[Lt]),this.baked||=t[Gt]!==0,e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#s(t),this.hasCorners=!0,this.#e.clear()}#a(t,e,[r,i],s,n=null){if(r===0||i===0)return;let o=n??e;if(!this.#e.has(o)){let h=s.flatMap((f,l)=>f?[{binding:l,resource:{buffer:this.buffers[f]}}]:[]);n&&h.push({binding:s.length,resource:{buffer:n}});let u=this.kernels[e].getBindGroupLayout(0);this.#e.set(o,this.device.createBindGroup({layout:u,entries:h}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#e.get(o));let a=Math.min(r,this.across);t.dispatchWorkgroups(a,i,Math.ceil(r/a))}run(t,e){let r=this.device.createCommandEncoder(),i=r.beginComputePass();t.length>0&&this.#y(i,t),e.length>0&&this.#p(i,e),i.end(),this.device.queue.submit([r.finish()])}#y(t,e){let{positions:r,bodies:i}=this.size,s=e.length;if(this.#f(e),this.baked){this.#a(t,"baked",[I(r),s],["level","segments","places","positions"]);return}this.#a(t,"time",[I(this.#t),s],[null,"segments","places","amplitudes"]);let n=["amplitudes","positions","matrices","modes","bodies"];for(let a of this.depths)this.#a(t,"hierarchy",[a.count,s],["level","segments","places",...n],a.uniform);this.#a(t,"bodies",[this.words[nt],s],["level","segments","places","positions","matrices"]);let o=Math.max(...e.map(({sources:a})=>a.length));for(;this.ordinals.length<o;)this.ordinals.push(this.#m(this.ordinals.length));for(let a of this.ordinals.slice(0,o))this.#a(t,"corrections",[I(this.#r),s],[null,"segments","places","positions",null],a)}#f(t){let{positions:e,matrices:r,bodies:i}=this.size,s=t.reduce((u,{sources:f})=>u+f.length,0),n=new Uint32Array(A*t.length+H*s),o=new Float32Array(n.buffer),a=A*t.length,h=0;t.forEach(({sources:u,slot:f,strength:l=1},m)=>{n.set([a,u.length,f*e,f*r,m*e,m*i],A*m),o[A*m+6]=l;for(let{segment:d,frame:p,weight:g=1}of u)n.set([d,p,3*this.#t*h++],a),o[a+3]=g,a+=H}),this.#n("places",n.length),this.#n("amplitudes",3*this.#t*s),this.#u(this.buffers.places,n)}#p(t,e){let{positions:r,matrices:i,vertices:s}=this.size,n=new Uint32Array(q*e.length),o=new Float32Array(n.buffer);e.forEach(({slots:a,weight:h,previous:u=a,previousWeight:f=h,at:l=null},m)=>{let d=q*m;[...a,...u].forEach((p,g)=>{n[d+g]=p*r,n[d+4+g]=p*i}),o[d+8]=h,o[d+9]=f,n[d+10]=this.hasCorners?1:0,n[d+11]=(l??m)*s}),this.#u(this.buffers.shows,n),this.#a(t,"vertices",[I(this.words[ot]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),r=4*this.size.vertices*t.length,i=this.device.createBuffer({size:r,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,i,0,r),this.device.queue.submit([e.finish()]),await i.mapAsync(1);let s=new Float32Array(i.getMappedRange().slice(0));return i.destroy(),s}dispose(){for(let t of[...this.depths.map(e=>e.uniform),...this.ordinals])t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};import{Box3 as Ae,DataTexture as Re,EventDispatcher as Te,FloatType as Me,MathUtils as Ce,NearestFilter as ke,RGBAFormat as Ie,Sphere as Ne,Vector3 as lt}from"three";function at({transitions:c},t){let e=s=>Array.isArray(s)&&s.length===3&&s.every(Number.isInteger)&&Math.min(...s)>=0&&s[2]>=1&&Math.max(s[0],s[1])+s[2]<t;if(!Array.isArray(c)||!c.length||!c.every(e))return[];let r=[...c].sort((s,n)=>s[0]-n[0]||s[1]-n[1]||s[2]-n[2]),i=r.at(-1)[0];return r.every(([,s,n])=>s+n<=i)?r:[]}var z=class{#e;#t;#r=[{begins:0,leave:0,enter:0,lasts:0,over:0}];#o;constructor(t,e,r){let i=s=>e[s]-e[0];this.#e=t.map(([s,n,o])=>({leave:i(s),enter:i(n),over:i(n+o),lasts:Math.min(i(s+o)-i(s),i(n+o)-i(n))})),this.#t=Math.imul(r,2654435761)+1>>>0||1,this.#o=this.#i(0)}at(t){let e=Math.min(Math.max(t,0),1e7);for(let u;(u=this.#r.at(-1).begins+this.#o.leave-this.#r.at(-1).enter)<=e;)this.#r.push({...this.#o,begins:u}),this.#o=this.#i(this.#o.over);let r=this.#r.findLastIndex(({begins:u})=>u<=e),i=this.#r[r],s=e-i.begins,n=(this.#r[r+1]??this.#o).enter,o=s/i.lasts,a=o*o*(3-2*o);return s>=i.lasts?{places:[{seconds:i.enter+s,weight:1}],ahead:n}:{places:[{seconds:i.leave+s,weight:1-a},{seconds:i.enter+s,weight:a}].filter(u=>u.weight>0),ahead:n}}#i(t){let e=this.#e.at(-1).leave,s=[...new Set(this.#e.map(({leave:o})=>o))].filter(o=>t<=o&&o<e).find(()=>this.#s()<.5)??e,n=this.#e.filter(o=>o.leave===s);return n[Math.floor(this.#s()*n.length)]}#s(){for(let t of[13,-17,5])this.#t=(this.#t^(t>0?this.#t<<t:this.#t>>>-t))>>>0;return this.#t/2**32}};import{BufferAttribute as ut,BufferGeometry as jt,InstancedBufferAttribute as xe,ShapeUtils as ye,Vector2 as _e,Vector3 as Oe}from"three";function ht(c,{up_axis:t}){return t==="z"&&(c.rotation.x=-Math.PI/2),t==="x"&&(c.rotation.z=Math.PI/2),c}function $t(c,t,e,r){for(let i=0;i<e.length;i++)for(let s=0;s<r;s++)c[r*i+s]=Number(t[r*e[i]+s]);return c}function j(c,t,e,r){let{source:i}=c.userData,s=c.index.array,n=!c.getAttribute("normal"),o=new Map,a=n?2:3,h=[],u=new Set,f=l=>{let m=3*i[l],d=g=>Math.floor(t[m+g]/e)&4095,p=((r[i[l]]+1&65535)*4096+d(0))*16777216+d(1)*4096+d(2);return o.has(p)||o.set(p,l),o.get(p)};for(let l=0;l<s.length;l+=a){let m=Array.from(s.subarray(l,l+a),f),[d,p,g]=m;if(d===p||!n&&(p===g||g===d))continue;let[_,O,E]=[...m].sort((y,F)=>y-F),S=n?_*2**26+O:`${_},${O},${E}`;u.has(S)||(u.add(S),h.push(...m))}return h.length===0&&h.push(...s.subarray(0,a)),Yt(c,Uint32Array.from(h))}function Yt(c,t){let e=Uint32Array.from(new Set(t)).sort(),r=new Map(Array.from(e,(s,n)=>[s,n])),i=new jt;for(let[s,{array:n,itemSize:o}]of Object.entries(c.attributes))i.setAttribute(s,new ut($t(new n.constructor(o*e.length),n,e,o),o));return i.setIndex(new ut(t.map(s=>r.get(s)),1)),i.userData.source=e.map(s=>c.userData.source[s]),i}var De=new lt,ze=new lt;function R({duration:c,frameCount:t}){return t>1?c*t/(t-1):0}var T=null,Jt=.001,B=class{#e=new Map([[T,1]]);#t=new Map([[T,1]]);set(t){let e=t?[...t.values()].reduce((r,i)=>r+i,0):0;this.#e=e>0?new Map([...t].map(([r,i])=>[r,i/e])):new Map([[T,1]])}get clips(){return[...this.#e.keys()].filter(t=>t!==T)}advance(t,e){let r=[...this.#e].filter(([h,u])=>u>0&&(h===T||e(h))),i=r.reduce((h,[,u])=>h+u,0),s=new Map(r.map(([h,u])=>[h,u/i]));if(s.size===0)return;let o=[...new Set([...this.#t.keys(),...s.keys()])].map(h=>[h,(this.#t.get(h)??0)*(1-t)+(s.get(h)??0)*t]).filter(([h,u])=>u>Jt||s.has(h)),a=o.reduce((h,[,u])=>h+u,0);this.#t=new Map(o.map(([h,u])=>[h,u/a]))}of(t){let e=new Map;for(let[r,i]of this.#t)e.set(r??t,(e.get(r??t)??0)+i);return e}},U=class{#e;#t=new Map;seed=null;constructor(t){this.#e=t}at(t,e,r){let i=this.seed===null?null:this.#r(t,r);return i?i.at(e).places.flatMap(s=>this.#i(t,s.seconds).map(({frame:n,weight:o})=>({frame:n,weight:o*s.weight}))):this.#o(t,e)}#r(t,e){let r=`${this.seed} ${t.index} ${e}`,{metadata:i}=this.#e.statics,{firstFrame:s,frameCount:n,name:o}=t;if(!this.#t.has(r)){let a=at({...i,...i.clips?.[o]},n);this.#t.set(r,a.length?new z(a,this.#e.times.subarray(s,s+n),this.seed+e):null)}return this.#t.get(r)}#o(t,e){let{firstFrame:r,frameCount:i,duration:s}=t,n=R(t);if(i===1||!(n>0))return[{frame:r,weight:1}];let o=(e%n+n)%n;return o<s?this.#i(t,o):ct(r+i-1,r,Math.min((o-s)/(n-s),1))}#i({firstFrame:t,frameCount:e},r){let{times:i}=this.#e,s=i[t]+r,n=t,o=t+e-1;for(;o-n>1;){let a=n+o>>1;i[a]<=s?n=a:o=a}return o===n?[{frame:n,weight:1}]:ct(n,o,Math.min(Math.max((s-i[n])/(i[o]-i[n]),0),1))}},ct=(c,t,e)=>[{frame:c,weight:1-e},{frame:t,weight:e}];var M=32,C=4,mt=1.5,pt=2,ae=.85,gt=32,vt=9,ue=16777215,he=c=>c?new te({color:7035717}):new ie({color:9083499,roughness:.8,side:Kt}),Y=class extends Zt{pixels=1;measure="p99";phases=8;ease=.2;bytesOfMotion=0;bytesOfParameters=0;levels=[];#e;#t;#r;#o;#i;#s;#m;#u;#n=new Map;#a=[];#y=[];#f=new B;#p;#T=0;#_=null;#c=null;#g=null;#O=null;#h=[];#E=new Xt;#v=1;#l=0;#w=!1;#b=0;#A=new Float32Array(gt);#x=null;#M=null;#C=1;#k=P.uniform(new $(1,0,0));constructor(t,e,{geometry:r=e.geometry??e.lines,material:i=he,shape:s=n=>n}={}){if(super(),this.name="ath forest",this.#s=t.backend.device,!this.#s)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#e=t,this.#t=e,ht(this,e.metadata),this.#p=new U(e.channel),this.#r=r,this.#o=i,this.#i=s,this.#m=new N(this.#s,{blocks:Q,time:it,hierarchy:st,finish:et,vertices:rt}),this.#u=this.#s.createComputePipeline({layout:"auto",compute:{module:this.#s.createShaderModule({code:tt}),entryPoint:"main"}}),this.view=this.#s.createBuffer({size:4*gt,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#s.createBuffer({size:8*M,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#l}get plantCount(){return this.#a.length}get plants(){return this.#a.map(({clip:t,phase:e})=>[t.name,e])}get clips(){return Array.from(this.#n.keys(),({name:t})=>t)}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:r}=this.#t,{limits:i}=this.#s,s=new Float32Array(8*Math.max(1,t.length));this.#P();let n=l=>this.#I(l)??e.clip,o=new Set(t.map(({clip:l})=>n(l))),a=Math.floor(i.maxStorageBufferBindingSize/(12*C*r.info.vertexCount)/Math.max(1,o.size)),h=Math.max(1,Math.min(this.phases,a)),u=new Map,f=(l,m=0)=>{let d=R(l)||1,p=Math.floor((m/d%1+1)%1*h),g=l.index*h+p;return u.has(g)||u.set(g,{index:u.size,clip:l,phase:p/h}),u.get(g).index};t.forEach(({x:l,y:m,z:d,size:p=1,angle:g=0,seconds:_,clip:O,tint:E=ue},S)=>{s.set([l,m,d,p,Math.cos(g),Math.sin(g),f(n(O),_),E],8*S),this.#E.expandByPoint(new $(l,m,d)),this.#v=Math.max(this.#v,p)}),this.#a=[...u.values()],this.#l=t.length;for(let l of[...o,...this.#f.clips])this.#N(l);return this.#_=this.#R(s,4),this.#c=new Qt(new Uint32Array(5*M),5),this.#e.backend.createIndirectStorageAttribute(this.#c),this.#g=this.#R(new Uint32Array(M*Math.max(1,this.#l)),1),this.#x=new Uint32Array(5*M),this.#O=this.#s.createBindGroup({layout:this.#u.getBindGroupLayout(0),entries:[this.#d(this.#_),this.view,this.tolerances,this.#d(this.#c),this.#d(this.#g)].map((l,m)=>({binding:m,resource:{buffer:l}}))}),this}#I(t){return this.#t.motion.clips.find(({index:e,name:r})=>t===e||t===r)}#N(t){this.#n.has(t)||this.#n.set(t,this.#t.motion.clone().play(t.index).setLevel(Math.max(0,this.levels.length-1)).setTime(0))}#R(t,e){let r=new oe(t,e);return this.#e.backend.createStorageAttribute(r),r}#d(t){return this.#e.backend.get(t).buffer}blend(t){let e=Object.entries(t??{}).map(([i,s])=>[this.#I(i),s]);if(e.findIndex(([i,s])=>!i||!(s>=0&&s<1/0))>=0||t&&!e.some(([,i])=>i>0))throw new RangeError(`blend: got ${JSON.stringify(t)}, expected weights of clips, ${this.#t.motion.clips.map(({name:i})=>i).join(", ")}`);for(let[i,s]of e)s>0&&this.#N(i);return this.#f.set(t&&new Map(e)),this}async wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);let r=this.#M={},{weights:i}=await this.#t.channel.windWeights(t,e),{clips:s}=this.#t.motion;return r===this.#M&&this.blend(Object.fromEntries(s.map(({name:n},o)=>[n,i[o]]))),this}endless(t=1){if(t!==null&&!Number.isInteger(t))throw new RangeError(`endless: got the seed ${t}, expected an integer`);return this.#p.seed=t,this}sway(t,e=null){return this.#C=t,this.#k.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#F(t){let e=this.levels.length,{motion:r}=this.#t;if(!this.#w){for(let i of this.levels)for(let[s,{readyLevel:n}]of this.#n)if(!i.clips.has(s)&&n>=i.level)return this.#D(()=>this.#V(i,s));if(!(e>=r.levelCount||e>0&&this.#S(e-1)<=t)){for(let i of this.#n.values())i.target<e&&i.setLevel(e);[...this.#n.values()].every(({readyLevel:i})=>i>=e)&&this.#D(()=>this.#W(e))}}}#D(t){this.#w=!0,t().catch(({message:e,codeName:r})=>this.#t.motion.dispatchEvent({type:"error",message:e,codeName:r}))}#S(t){return Math.max(...Array.from(this.#n.keys(),({errors:e})=>e[t][this.measure]))}async#W(t){let{channel:e}=this.#t,r=this.#b,i=()=>r===this.#b,[s,{words:n}]=[await e.parts(t),await e.gpu(t)];if(!i())return;let o=this.#a.length,a=this.#R(new Float32Array(vt*n[2]*o),1),h=new D(this.#s,this.#m,n,{slots:C*o,shown:o,vertices:this.#d(a)}),u={level:t,passes:h,shared:a,clips:new Set,places:new Map,uploaded:0,bytesOfMotion:0,bytesOfParameters:0,strength:NaN,slots:this.#a.map(()=>new Array(C).fill(-1)),before:this.#a.map(()=>null)};this.#t.hasFaces&&h.setCorners(le(this.#t.geometry,e.vertexSource));for(let f of this.#n.keys())if(!await this.#z(u,f,i)){h.dispose();return}this.levels.push(u),this.#L(u,s),this.#w=!1,this.dispatchEvent({type:"level",level:t})}async#V(t,e){let r=this.#b;await this.#z(t,e,()=>r===this.#b)&&(this.#w=!1)}async#z(t,e,r){let{channel:i}=this.#t,{passes:s,level:n,places:o}=t;for(let a=e.firstSegment;a<e.firstSegment+e.segmentCount;a++){let{words:h,coded:u}=await i.gpu(n,a);if(!r())return!1;let f=s.segment(h);this.#B(t,"bytesOfMotion"),u.forEach((l,m)=>o.set(i.segments[a]+m,{segment:f,frame:l}))}return t.clips.add(e),!0}#B(t,e){this[e]+=t.passes.uploaded-t.uploaded,t[e]+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#L(t,e){let{channel:r,motion:i,rest:s,sphere:n}=this.#t,{level:o}=t,a=this.#S(o),h=o>0?this.#S(o-1):n.radius/4,u=r.nodeNumbers(e);e.vertices.forEach((d,p)=>{d<0&&(u[p]=-1)});let f=o===i.levelCount-1?this.#r:j(this.#r,s,mt*a,u);this.#U(t,f,a);for(let d=Math.max(pt*a,n.radius/2e3);d<h;d*=pt){let p=j(this.#r,s,mt*d,u);p.userData.source.length>ae*f.userData.source.length||(this.#U(t,p,d),f=p)}let l=Float32Array.from({length:2*this.#h.length}),m=new Uint32Array(l.buffer);this.#h.sort((d,p)=>d.tolerance-p.tolerance).forEach((d,p)=>{l[2*p]=d.tolerance,m[2*p+1]=d.list}),this.#s.queue.writeBuffer(this.tolerances,0,l)}#U(t,e,r){let i=this.#h.length;if(i===M)return;let s=this.#i(e,r).clone(),{source:n}=e.userData,o=!s.hasAttribute("normal"),a=wt(this.#t.channel.vertexSource),h=s.userData.vertices??n;s.setAttribute("athVertex",new ft(Uint32Array.from(h,l=>a[l]),1)),s.setAttribute("position",new ft(Float32Array.from({length:3*h.length},(l,m)=>this.#t.rest[3*h[Math.floor(m/3)]+m%3]),3)),s.setIndirect(this.#c,20*i),this.#x[5*i]=s.index.count;let u=this.#o(o,t.level),f=o?new ee(s,u):new se(s,u);this.#G(u,s,t,i),f.frustumCulled=!1,f.castShadow=f.receiveShadow=!o,this.#h.push({level:t.level,tolerance:r,list:i,drawn:f,size:s.index.count}),this.add(f)}#G(t,e,{passes:r,shared:i},s){let{Fn:n,storage:o,uint:a,float:h,vec3:u,attribute:f,instanceIndex:l,positionGeometry:m,positionPrevious:d,normalLocal:p,normalGeometry:g,select:_}=P,{metadata:O,channel:{info:E}}=this.#t,S=O.up_axis==="z",y=this.#k,F=u(...E.origin),bt=a(r.words[2]),xt=o(i,"float",i.count).toReadOnly(),W=o(this.#_,"vec4",2*Math.max(1,this.#l)).toReadOnly(),yt=o(this.#g,"uint",this.#g.count).toReadOnly(),V=(v,w,b)=>S?u(w.mul(v.x).sub(b.mul(v.y)),b.mul(v.x).add(w.mul(v.y)),v.z):u(w.mul(v.x).add(b.mul(v.z)),v.y,w.mul(v.z).sub(b.mul(v.x))),J=()=>yt.element(a(s*Math.max(1,this.#l)).add(l)),_t=e.hasAttribute("athOffset"),Ot=r.hasCorners&&!e.userData.vertices;t.positionNode=n((v,w)=>{let b=J().toVar(),X=W.element(b.mul(2)).toVar(),x=W.element(b.mul(2).add(1)).toVar(),Et=a(x.z).mul(bt).add(f("athVertex","uint")).mul(vt).toVar(),L=G=>u(...[0,1,2].map(k=>xt.element(Et.add(G+k)))),K=G=>{let k=G.add(F).toVar(),At=k.sub(m).toVar(),Rt=y.x.mul(x.x).add(y.y.mul(x.y)),Tt=y.y.mul(x.x).sub(y.x.mul(x.y)),Mt=m.add(V(At,Rt,Tt)),Z=_(y.z.greaterThan(.5),Mt,k).toVar(),Ct=_t?Z.add(f("athOffset","vec3")):Z;return V(Ct,x.x,x.y).mul(X.w).add(X.xyz)};return e.hasAttribute("normal")&&p.assign(V(Ot?L(3):g,x.x,x.y)),w.needsPreviousData?.()&&d.assign(K(L(6))),K(L(0))})();let St=n(()=>{let v=a(W.element(J().mul(2).add(1)).w),w=b=>h(v.shiftRight(a(b)).bitAnd(a(255))).div(255);return u(w(16),w(8),w(0))})();t.colorNode=P.varying(St).mul(t.colorNode??(e.hasAttribute("color")?f("color","vec3"):P.materialColor))}update(t,e,r){if(!this.#O)return;let i=this.#H(t,e);this.#F(i),this.#q(r);for(let s of this.levels)(s.level===0||this.#S(s.level-1)>i)&&this.#j(s);this.#J()}#H(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:r}=this.#t,i=r.center.length()+1.2*r.radius,s=this.#A,n=new $().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new dt().copy(this.matrixWorld).invert());new re().setFromProjectionMatrix(new dt().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??ne).planes.forEach(({normal:u,constant:f},l)=>s.set([u.x,u.y,u.z,f],4*l));let a=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,h=this.#E.distanceToPoint(n);return s.set([n.x,n.y,n.z,a],24),new Uint32Array(s.buffer).set([this.#l,this.#h.length],28),s[30]=i,new Uint32Array(s.buffer)[31]=Math.max(1,this.#l),a*Math.max(h-.5*i*this.#v,1e-6)/this.#v}#q(t){let e=performance.now(),r=this.ease>0?1-Math.exp((this.#T-e)/(1e3*this.ease)):1;this.#T=e,this.#f.advance(r,i=>this.levels.every(s=>s.clips.has(i))),this.#y=this.#a.map(({clip:i,phase:s},n)=>[...this.#f.of(i)].flatMap(([o,a])=>this.#p.at(o,t+s*R(o),n).map(({frame:h,weight:u})=>({frame:h,weight:a*u}))))}#j(t){let e=[],r=[],i=this.#C,s=t.strength!==i;t.strength=i,this.#y.forEach((n,o)=>{let a=t.before[o];s&&t.slots[o].fill(-1);let h=n.length>2?this.#Y(t,o,n,e):this.#$(t,o,n,e);r.push({...h,previous:a?.slots??h.slots,previousWeight:a?.weight??h.weight}),t.before[o]=h}),t.passes.run(e,r),this.#B(t,"bytesOfParameters")}#$(t,e,r,i){let s=t.slots[e],n=C*e,o=r.map(({frame:h})=>h),a=o.map(h=>{let u=s.indexOf(h);return u<0&&(u=s.findIndex((f,l)=>!o.includes(f)&&!t.before[e]?.slots.includes(n+l)),s[u]=h,i.push({sources:[t.places.get(h)],slot:n+u,strength:t.strength})),n+u});return{slots:[a[0],a.at(-1)],weight:r.length>1?r[1].weight:0}}#Y(t,e,r,i){let s=t.slots[e],n=C*e,o=s.findIndex((h,u)=>!t.before[e]?.slots.includes(n+u));s[o]=-1;let a=r.filter(({weight:h})=>h>0).map(({frame:h,weight:u})=>({...t.places.get(h),weight:u}));return i.push({sources:a,slot:n+o,strength:t.strength}),{slots:[n+o,n+o],weight:0}}#J(){let{queue:t}=this.#s,e=this.#s.createCommandEncoder();t.writeBuffer(this.view,0,this.#A),t.writeBuffer(this.#d(this.#c),0,this.#x),this.bytesOfParameters+=this.#A.byteLength+this.#x.byteLength;let r=e.beginComputePass();r.setPipeline(this.#u),r.setBindGroup(0,this.#O),r.dispatchWorkgroups(Math.ceil(Math.max(1,this.#l)/64)),r.end(),t.submit([e.finish()])}async drawn(){let t=this.#x.byteLength,e=this.#s.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),r=this.#s.createCommandEncoder(),i=new Array(this.#t.motion.levelCount).fill(0);r.copyBufferToBuffer(this.#d(this.#c),0,e,0,t),this.#s.queue.submit([r.finish()]),await e.mapAsync(GPUMapMode.READ);let s=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:n,list:o}of this.#h)i[n]+=s[5*o+1];return i}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#e.getArrayBufferAsync(e))}#P(){this.#b++,this.#w=!1;for(let{drawn:t}of this.#h)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#e.backend.destroyAttribute(e);for(let t of[this.#_,this.#c,this.#g].filter(Boolean))this.#e.backend.destroyAttribute(t);for(let t of this.#n.values())t.dispose();this.#n.clear(),this.levels=[],this.#h=[],this.#O=null,this.#E.makeEmpty(),this.#v=1e-9}dispose(){this.#P(),this.view.destroy(),this.tolerances.destroy()}};function wt(c){let t=new Uint32Array(c.length);return c.forEach((e,r)=>{t[e]=r}),t}function le(c,t){let e=wt(t),r=Uint32Array.from(c.index.array,o=>e[c.userData.source[o]]),i=t.length,s=new Uint32Array(i+1),n=new Uint32Array(i+1+2*r.length);for(let o of r)s[o+1]++;for(let o=0;o<i;o++)s[o+1]+=s[o];for(let o=0;o<=i;o++)n[o]=i+1+2*s[o];for(let o=0;o<r.length;o++){let a=o-o%3,h=i+1+2*s[r[o]]++;n[h]=r[a+(o+1)%3],n[h+1]=r[a+(o+2)%3]}return n}export{Y as ATHForest};
