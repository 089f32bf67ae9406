import{Box3 as Vt,BufferAttribute as rt,DoubleSide as Lt,Group as Ht,IndirectStorageBufferAttribute as Gt,LineBasicNodeMaterial as qt,LineSegments as jt,Mesh as Yt,MeshStandardNodeMaterial as $t,Frustum as Xt,Matrix4 as ot,StorageBufferAttribute as Jt,TSL as I,Vector3 as L,WebGPUCoordinateSystem as Kt}from"three/webgpu";var $=`// The blocks of a level and of a segment, as core/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

@group(0) @binding(0) var<storage, read> level: array<u32>;
@group(0) @binding(1) var<storage, read> segments: array<u32>; // blocks one behind the other

// A frame that is placed. A dispatch places several, one for each y of its workgroups.
struct Place {
    segment: u32, // word that the block of its segment begins at
    frame: u32,
    positions: u32, // number before those of this frame; so are the others
    matrices: u32,
    amplitudes: u32,
    modes: u32,
    bodies: u32,
    strength: f32, // that motion is multiplied by
}
@group(0) @binding(2) var<storage, read> places: array<Place>;
var<private> run: Place;

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

fn segment(at: u32) -> u32 {
    return segments[run.segment + at];
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
`;var X=`// What instances are drawn with: each that is in view is appended to the list of the coarsest shape whose error its distance
// hides. One invocation per instance.

struct Instance {
    place: vec4<f32>, // x, y, z, size
    turn: vec4<f32>,  // cosine and sine of its angle, the plant that it shows, tint
}

struct View {
    planes: array<vec4<f32>, 6>, // of what is seen: normal, distance
    eye: vec3<f32>,
    pixel: f32, // the error that is allowed at distance 1
    count: u32,
    shapes: u32,
    reach: f32, // how far from its place an instance of size 1 can be seen
    room: u32,  // of a list
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
`;var J=`// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

@group(0) @binding(3) var<storage, read_write> positions: array<f32>;
@group(0) @binding(4) var<storage, read_write> matrices: array<f32>;

const FOOTPRINTS = array<array<f32, 4>, 3>(
    array<f32, 4>(32.0, 0.0, 0.0, 0.0), array<f32, 4>(32.0, 16.0, 0.0, 0.0), array<f32, 4>(32.0, 27.0, 16.0, 5.0),
);

fn is_joined() -> bool {
    return run.frame < segment(JOIN_FRAMES);
}

// What is left of jumps and of slopes at the frame.
fn curve() -> vec2<f32> {
    let at = segment(JOIN_CURVE) + 2u * run.frame;
    return run.strength * vec2<f32>(segment_float(at), segment_float(at + 1u));
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
    run = places[group.y];
    let b = group.x + groups.x * group.z;
    if (b >= level[BODY_COUNT]) {
        return;
    }
    let body = body_at(b);
    if ((body.flags & NODE) == 0u) {
        if (is_joined() && i < body.count) {
            join_position(b, body.first + i);
        }
    } else if (i == 0u) {
        if (is_joined()) {
            join_matrix(body.first);
        }
        finish_matrix(body.first, body.rest_point);
    }
}

// One invocation per corrected position.
@compute @workgroup_size(64)
fn corrections(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = places[id.y];
    if (i >= segment(CORRECTED_COUNT)) {
        return;
    }
    let own = segment(CORRECTED) + 2u * i;
    var sum = vec3<f32>(0.0);
    for (var c = segment(own + 1u); c < segment(own + 3u); c++) {
        let at = segment(CORRECTIONS) + 2u * c;
        let low = segment(at);
        let high = segment(at + 1u);
        let away = abs(i32(run.frame) - i32((high >> 16u) & 0xffu));
        if (away < 4) {
            let width = high >> 24u;
            let part = FOOTPRINTS[width & 15u][away] * exp2(f32(width >> 4u));
            sum += part * vec3<f32>(f32(half(low, 0u)), f32(half(low, 1u)), f32(half(high, 0u)));
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        positions[run.positions + 3u * segment(own) + axis] += sum[axis] * run.strength * segment_float(CORRECTION_PART);
    }
}

// One invocation per number of a position, in place of all passes before.
@compute @workgroup_size(64)
fn baked(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = places[id.y];
    let count = 3u * level[POSITION_COUNT];
    if (i < count) {
        positions[run.positions + i] = segment_float(segment(BAKED) + run.frame * count + i);
    }
}
`;var K=`// Pass 2: bodies of one depth, each placed from the one that it hangs on. One workgroup per body, one invocation per position.

@group(0) @binding(8) var<uniform> depth: u32; // of the bodies that are placed
@group(0) @binding(3) var<storage, read> amplitudes: array<f32>;
@group(0) @binding(4) var<storage, read_write> positions: array<f32>;
@group(0) @binding(5) var<storage, read_write> matrices: array<f32>;
@group(0) @binding(6) var<storage, read_write> parent_modes: array<f32>; // those of a body from its first position on
@group(0) @binding(7) var<storage, read_write> frames: array<f32>; // of bodies: rotation, point

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
    let at = run.amplitudes + 3u * row;
    return vec3<f32>(amplitudes[at], amplitudes[at + 1u], amplitudes[at + 2u]);
}

fn position_at(index: u32) -> vec3<f32> {
    let at = run.positions + 3u * index;
    return vec3<f32>(positions[at], positions[at + 1u], positions[at + 2u]);
}

// What mode m of its parent adds to the tangent that a body follows.
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

// The rows of a shift and of a rotation, where there are any, are the first of a body.
fn turned(body: Body, own: Move) -> Frame {
    var frame = hung(body);
    for (var r = own.row; r < own.row + min(own.rows, 2u); r++) {
        let slot = row_at(r).slot;
        if (slot == SHIFT) {
            frame.point += amplitude(r);
        } else if (slot == ROTATION) {
            let at = segment(TURNS) + own.turn;
            let q = amplitude(r);
            var omega = vec3<f32>(0.0);
            for (var k = 0u; k < 3u; k++) {
                let turn = vec3<f32>(
                    segment_float(at + 3u * k), segment_float(at + 3u * k + 1u), segment_float(at + 3u * k + 2u),
                );
                omega[k] = dot(turn, q);
            }
            frame.rotation = frame.rotation * squared(0.25 * omega);
        }
    }
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
    let most = max(C[0].x + C[1].y + C[2].z, 1.0) + 1e-6;
    let a = most - C[0].x;
    let b = most - C[1].y;
    let c = most - C[2].z;
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

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) i: u32) {
    run = places[group.y];
    let at = level[level[DEPTHS] + depth] + group.x + groups.x * group.z;
    if (at >= level[level[DEPTHS] + depth + 1u]) {
        return;
    }
    let b = level[level[ORDER] + at];
    let body = body_at(b);
    let own = move_at(b);
    modes[i] = vec3<f32>(0.0);
    placed[i] = way_by_mode(body, i);
    workgroupBarrier();
    let from_shapes = select(0u, body.shape_modes, own.shape_count > 0u);
    for (var r = i; r < own.rows; r += 64u) {
        let slot = row_at(own.row + r).slot;
        if (slot >= from_shapes && slot < SHIFT) {
            modes[slot] = amplitude(own.row + r);
        }
    }
    if (i < from_shapes) {
        modes[i] = unshaped(body, own, i);
    }
    workgroupBarrier();
    var top = from_shapes;
    if (own.rows > 0u) {
        let last = row_at(own.row + own.rows - 1u).slot;
        top = max(top, select(0u, last + 1u, last < SHIFT));
    }
    var frame = turned(body, own);
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
`;var Z=`// Pass 1: what each row is at a frame. One invocation per row.

@group(0) @binding(3) var<storage, read_write> amplitudes: array<f32>;

const WIDE = 128u;

fn value(row: Row, index: u32) -> f32 {
    let at = segment(VALUES) + row.values;
    if ((row.waves & WIDE) != 0u) {
        return f32(bitcast<i32>(segment(at + index)));
    }
    return f32(half(segment(at + index / 2u), index % 2u));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + 64u * groups.x * id.z;
    run = places[id.y];
    if (i >= segment(ROW_COUNT)) {
        return;
    }
    let row = row_at(i);
    let frames = segment(FRAMES);
    let waves = segment(WAVE_SETS + (row.waves & 127u)) + run.frame;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < row.count; k++) {
        let integers = vec3<f32>(value(row, k), value(row, row.count + k), value(row, 2u * row.count + k));
        sum += integers * segment_float(waves + k * frames);
    }
    for (var axis = 0u; axis < 3u; axis++) {
        amplitudes[run.amplitudes + 3u * i + axis] = run.strength * row.step * sum[axis];
    }
}
`;var Q=`// Pass 3: vertices at a time, between two frames that the passes before have placed. \`vertex_at\` is what a vertex stage calls;
// here it writes all of them, for tests and for engines that compute once what several views draw. One invocation per vertex.

struct Run {
    positions: vec4<u32>, // numbers before those of the two frames now, and of the two that the time drawn before lies between
    matrices: vec4<u32>,
    weights: vec2<f32>, // of the second of each two
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
`;var[tt,et,Ct,Mt,kt,It]=[2,3,4,5,6,10],[Nt,Dt,Bt]=[5,6,19],zt=64,R=8,F=12,Ut=9,C=p=>Math.ceil(p/zt),M=class{constructor(t,{blocks:e,time:i,hierarchy:s,finish:r,vertices:n}){let o=(...c)=>t.createShaderModule({code:c.join(`
`)}),u=(c,f="main")=>t.createComputePipeline({layout:"auto",compute:{module:c,entryPoint:f}}),h=o(e,r);this.time=u(o(e,i)),this.hierarchy=u(o(e,s)),this.bodies=u(h,"bodies"),this.corrections=u(h,"corrections"),this.baked=u(h,"baked"),this.vertices=u(o(n))}},k=class{uploaded=0;#r=new Map;#t=0;#o=0;#d=0;constructor(t,e,i,{slots:s=2,shown:r=1,vertices:n=null,across:o=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:i,slots:s,shown:r,across:o}),this.size={positions:3*i[Ct],matrices:12*i[Mt],bodies:12*i[et],vertices:Ut*i[tt]},this.baked=!1;let{positions:u,matrices:h,bodies:c}=this.size;this.buffers={level:this.#e(i),segments:this.#s(1),places:this.#s(R*s),shows:this.#s(F*r),amplitudes:this.#s(1),positions:this.#s(s*u),matrices:this.#s(s*h),modes:this.#s(s*u),bodies:this.#s(s*c),corners:this.#s(1),vertices:n??this.#s(r*this.size.vertices)},this.ownsVertices=!n,this.depths=Array.from({length:i[kt]},(f,a)=>{let[d,l]=i.subarray(i[It]+a);return{count:l-d,uniform:this.#e(new Uint32Array([a,0,0,0]),72)}}),this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#s(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#e(t,e=140){let i=this.#s(t.length,e);return this.#l(i,t),i}#l(t,e,i=0,s=e.length){this.uploaded+=4*s,this.device.queue.writeBuffer(t,4*i,e.buffer,e.byteOffset,4*s)}#c(t,e,i=0){let s=this.buffers[t],{device:r}=this;if(4*e<=s.size)return;let n=this.#s(e);if(i>0){let o=r.createCommandEncoder();o.copyBufferToBuffer(s,0,n,0,4*i),r.queue.submit([o.finish()])}s.destroy(),this.buffers[t]=n,this.#r.clear()}segment(t){let e=this.#d;return e+t.length>this.buffers.segments.size/4&&this.#c("segments",2*(e+t.length),e),this.#l(this.buffers.segments,t,e),this.#d+=t.length,this.#t=Math.max(this.#t,t[Nt]),this.#o=Math.max(this.#o,t[Dt]),this.baked||=t[Bt]!==0,this.#c("amplitudes",3*this.#t*this.slots),e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#e(t),this.hasCorners=!0,this.#r.clear()}#i(t,e,[i,s],r,n=null){if(i===0||s===0)return;let o=n??e;if(!this.#r.has(o)){let h=r.flatMap((f,a)=>f?[{binding:a,resource:{buffer:this.buffers[f]}}]:[]);n&&h.push({binding:r.length,resource:{buffer:n.uniform}});let c=this.kernels[e].getBindGroupLayout(0);this.#r.set(o,this.device.createBindGroup({layout:c,entries:h}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#r.get(o));let u=Math.min(i,this.across);t.dispatchWorkgroups(u,s,Math.ceil(i/u))}run(t,e){let i=this.device.createCommandEncoder(),s=i.beginComputePass();t.length>0&&this.#n(s,t),e.length>0&&this.#v(s,e),s.end(),this.device.queue.submit([i.finish()])}#n(t,e){let{positions:i,matrices:s,bodies:r}=this.size,n=e.length,o=new Uint32Array(R*n),u=new Float32Array(o.buffer);if(e.forEach(({segment:c,frame:f,slot:a,strength:d=1},l)=>{o.set([c,f,a*i,a*s,3*this.#t*l,l*i,l*r],R*l),u[R*l+7]=d}),this.#l(this.buffers.places,o),this.baked){this.#i(t,"baked",[C(i),n],["level","segments","places","positions"]);return}this.#i(t,"time",[C(this.#t),n],[null,"segments","places","amplitudes"]);let h=["amplitudes","positions","matrices","modes","bodies"];for(let c of this.depths)this.#i(t,"hierarchy",[c.count,n],["level","segments","places",...h],c);this.#i(t,"bodies",[this.words[et],n],["level","segments","places","positions","matrices"]),this.#i(t,"corrections",[C(this.#o),n],[null,"segments","places","positions"])}#v(t,e){let{positions:i,matrices:s,vertices:r}=this.size,n=new Uint32Array(F*e.length),o=new Float32Array(n.buffer);e.forEach(({slots:u,weight:h,previous:c=u,previousWeight:f=h,at:a=null},d)=>{let l=F*d;[...u,...c].forEach((m,g)=>{n[l+g]=m*i,n[l+4+g]=m*s}),o[l+8]=h,o[l+9]=f,n[l+10]=this.hasCorners?1:0,n[l+11]=(a??d)*r}),this.#l(this.buffers.shows,n),this.#i(t,"vertices",[C(this.words[tt]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),i=4*this.size.vertices*t.length,s=this.device.createBuffer({size:i,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,s,0,i),this.device.queue.submit([e.finish()]),await s.mapAsync(1);let r=new Float32Array(s.getMappedRange().slice(0));return s.destroy(),r}dispose(){for(let{uniform:t}of this.depths)t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};import{Box3 as pe,BufferAttribute as ge,DataTexture as ve,EventDispatcher as we,FloatType as be,InstancedBufferAttribute as xe,MathUtils as ye,NearestFilter as _e,RGBAFormat as Oe,Sphere as Ee,Vector3 as it}from"three";import{BufferAttribute as st,BufferGeometry as Pt,ShapeUtils as he,Vector2 as ce,Vector3 as fe}from"three";function Ft(p,t,e,i){for(let s=0;s<e.length;s++)for(let r=0;r<i;r++)p[i*s+r]=Number(t[i*e[s]+r]);return p}function W(p,t,e,i){let{source:s}=p.userData,r=p.index.array,n=!p.getAttribute("normal"),o=new Map,u=n?2:3,h=[],c=new Set,f=a=>{let d=3*s[a],l=g=>Math.floor(t[d+g]/e)&4095,m=((i[s[a]]+1&65535)*4096+l(0))*16777216+l(1)*4096+l(2);return o.has(m)||o.set(m,a),o.get(m)};for(let a=0;a<r.length;a+=u){let d=Array.from(r.subarray(a,a+u),f),[l,m,g]=d;if(l===m||!n&&(m===g||g===l))continue;let[y,_,O]=[...d].sort((E,D)=>E-D),S=n?y*2**26+_:`${y},${_},${O}`;c.has(S)||(c.add(S),h.push(...d))}return h.length===0&&h.push(...r.subarray(0,u)),Wt(p,Uint32Array.from(h))}function Wt(p,t){let e=Uint32Array.from(new Set(t)).sort(),i=new Map(Array.from(e,(r,n)=>[r,n])),s=new Pt;for(let[r,{array:n,itemSize:o}]of Object.entries(p.attributes))s.setAttribute(r,new st(Ft(new n.constructor(o*e.length),n,e,o),o));return s.setIndex(new st(t.map(r=>i.get(r)),1)),s.userData.source=e.map(r=>p.userData.source[r]),s}var Se=new it,Ae=new it;function V({duration:p,frameCount:t}){return t>1?p*t/(t-1):0}var A=32,N=4,nt=1.5,at=2,Zt=.85,ut=32,lt=9,Qt=16777215,te=p=>p?new qt({color:7035717}):new $t({color:9083499,roughness:.8,side:Lt}),H=class extends Ht{pixels=1;measure="p99";phases=8;bytesOfMotion=0;bytesOfParameters=0;levels=[];#r;#t;#o;#d;#s;#e;#l;#c;#i=new Map;#n=[];#v=[];#w=null;#h=null;#m=null;#b=null;#a=[];#_=new Vt;#p=1;#u=0;#x=!1;#O=0;#E=new Float32Array(ut);#g=null;#A=1;#T=I.uniform(new L(1,0,0));constructor(t,e,{geometry:i=e.geometry??e.lines,material:s=te,shape:r=n=>n}={}){if(super(),this.name="ath forest",this.#e=t.backend.device,!this.#e)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#r=t,this.#t=e,this.#o=i,this.#d=s,this.#s=r,this.#l=new M(this.#e,{blocks:$,time:Z,hierarchy:K,finish:J,vertices:Q}),this.#c=this.#e.createComputePipeline({layout:"auto",compute:{module:this.#e.createShaderModule({code:X}),entryPoint:"main"}}),this.view=this.#e.createBuffer({size:4*ut,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#e.createBuffer({size:8*A,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#u}get plantCount(){return this.#n.length}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:i}=this.#t,{limits:s}=this.#e,r=new Float32Array(8*Math.max(1,t.length));this.#C();let n=a=>e.clips.find(({index:d,name:l})=>a===d||a===l)??e.clip,o=new Set(t.map(({clip:a})=>n(a))),u=Math.floor(s.maxStorageBufferBindingSize/(12*N*i.info.vertexCount)/Math.max(1,o.size)),h=Math.max(1,Math.min(this.phases,u)),c=new Map,f=(a,d=0)=>{let l=V(a)||1,m=Math.floor((d/l%1+1)%1*h),g=a.index*h+m;return c.has(g)||c.set(g,{index:c.size,clip:a,ahead:m/h*l,kept:new Map}),c.get(g).index};t.forEach(({x:a,y:d,z:l,size:m=1,angle:g=0,seconds:y,clip:_,tint:O=Qt},S)=>{r.set([a,d,l,m,Math.cos(g),Math.sin(g),f(n(_),y),O],8*S),this.#_.expandByPoint(new L(a,d,l)),this.#p=Math.max(this.#p,m)}),this.#n=[...c.values()],this.#u=t.length;for(let a of o)this.#i.set(a,e.clone().play(a.index).setLevel(0).setTime(0));return this.#w=this.#S(r,4),this.#h=new Gt(new Uint32Array(5*A),5),this.#r.backend.createIndirectStorageAttribute(this.#h),this.#m=this.#S(new Uint32Array(A*Math.max(1,this.#u)),1),this.#g=new Uint32Array(5*A),this.#b=this.#e.createBindGroup({layout:this.#c.getBindGroupLayout(0),entries:[this.#f(this.#w),this.view,this.tolerances,this.#f(this.#h),this.#f(this.#m)].map((a,d)=>({binding:d,resource:{buffer:a}}))}),this}#S(t,e){let i=new Jt(t,e);return this.#r.backend.createStorageAttribute(i),i}#f(t){return this.#r.backend.get(t).buffer}wind(t,e=null){return this.#A=t,this.#T.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#M(t){let e=this.levels.length,{motion:i}=this.#t;if(!(this.#x||e>=i.levelCount)&&!(e>0&&this.#y(e-1)<=t)){for(let s of this.#i.values())s.target<e&&s.setLevel(e);[...this.#i.values()].some(({readyLevel:s})=>s<e)||(this.#x=!0,this.#k(e).catch(({message:s,codeName:r})=>this.#t.motion.dispatchEvent({type:"error",message:s,codeName:r})))}}#y(t){return Math.max(...Array.from(this.#i.keys(),({errors:e})=>e[t][this.measure]))}async#k(t){let{channel:e}=this.#t,i=this.#O,s=()=>i===this.#O,[r,{words:n}]=[await e.parts(t),await e.gpu(t)];if(!s())return;let o=this.#n.length,u=this.#S(new Float32Array(lt*n[2]*o),1),h=new k(this.#e,this.#l,n,{slots:N*o,shown:o,vertices:this.#f(u)}),c=new Map;for(let{firstSegment:a,segmentCount:d}of this.#i.keys())for(let l=a;l<a+d;l++){let{words:m,coded:g}=await e.gpu(t,l);if(!s()){h.dispose();return}let y=h.segment(m);g.forEach((_,O)=>c.set(e.segments[l]+O,{segment:y,frame:_}))}this.#t.hasFaces&&h.setCorners(ee(this.#t.geometry,e.vertexSource)),h.bytesOfMotion=h.uploaded,this.bytesOfMotion+=h.uploaded;let f={level:t,passes:h,shared:u,places:c,uploaded:h.uploaded,strength:NaN,slots:this.#n.map(()=>new Array(N).fill(-1)),before:this.#n.map(()=>null)};this.levels.push(f),this.#I(f,r),this.#x=!1,this.dispatchEvent({type:"level",level:t})}#I(t,e){let{channel:i,motion:s,rest:r,sphere:n}=this.#t,{level:o}=t,u=this.#y(o),h=o>0?this.#y(o-1):n.radius/4,c=i.nodeNumbers(e);e.vertices.forEach((l,m)=>{l<0&&(c[m]=-1)});let f=o===s.levelCount-1?this.#o:W(this.#o,r,nt*u,c);this.#R(t,f,u);for(let l=Math.max(at*u,n.radius/2e3);l<h;l*=at){let m=W(this.#o,r,nt*l,c);m.userData.source.length>Zt*f.userData.source.length||(this.#R(t,m,l),f=m)}let a=Float32Array.from({length:2*this.#a.length}),d=new Uint32Array(a.buffer);this.#a.sort((l,m)=>l.tolerance-m.tolerance).forEach((l,m)=>{a[2*m]=l.tolerance,d[2*m+1]=l.list}),this.#e.queue.writeBuffer(this.tolerances,0,a)}#R(t,e,i){let s=this.#a.length;if(s===A)return;let r=this.#s(e,i).clone(),{source:n}=e.userData,o=!r.hasAttribute("normal"),u=ht(this.#t.channel.vertexSource),h=r.userData.vertices??n;r.setAttribute("athVertex",new rt(Uint32Array.from(h,a=>u[a]),1)),r.setAttribute("position",new rt(Float32Array.from({length:3*h.length},(a,d)=>this.#t.rest[3*h[Math.floor(d/3)]+d%3]),3)),r.setIndirect(this.#h,20*s),this.#g[5*s]=r.index.count;let c=this.#d(o,t.level),f=o?new jt(r,c):new Yt(r,c);this.#N(c,r,t,s),f.frustumCulled=!1,f.castShadow=f.receiveShadow=!o,this.#a.push({level:t.level,tolerance:i,list:s,drawn:f,size:r.index.count}),this.add(f)}#N(t,e,{passes:i,shared:s},r){let{Fn:n,storage:o,uint:u,float:h,vec3:c,attribute:f,instanceIndex:a,positionGeometry:d,positionPrevious:l,normalLocal:m,normalGeometry:g,select:y}=I,{metadata:_,channel:{info:O}}=this.#t,S=_.up_axis==="z",E=this.#T,D=c(...O.origin),ct=u(i.words[2]),ft=o(s,"float",s.count).toReadOnly(),B=o(this.#w,"vec4",2*Math.max(1,this.#u)).toReadOnly(),dt=o(this.#m,"uint",this.#m.count).toReadOnly(),z=(v,w,b)=>S?c(w.mul(v.x).sub(b.mul(v.y)),b.mul(v.x).add(w.mul(v.y)),v.z):c(w.mul(v.x).add(b.mul(v.z)),v.y,w.mul(v.z).sub(b.mul(v.x))),G=()=>dt.element(u(r*Math.max(1,this.#u)).add(a)),mt=e.hasAttribute("athOffset"),pt=i.hasCorners&&!e.userData.vertices;t.positionNode=n((v,w)=>{let b=G().toVar(),q=B.element(b.mul(2)).toVar(),x=B.element(b.mul(2).add(1)).toVar(),vt=u(x.z).mul(ct).add(f("athVertex","uint")).mul(lt).toVar(),U=P=>c(...[0,1,2].map(T=>ft.element(vt.add(P+T)))),j=P=>{let T=P.add(D).toVar(),wt=T.sub(d).toVar(),bt=E.x.mul(x.x).add(E.y.mul(x.y)),xt=E.y.mul(x.x).sub(E.x.mul(x.y)),yt=d.add(z(wt,bt,xt)),Y=y(E.z.greaterThan(.5),yt,T).toVar(),_t=mt?Y.add(f("athOffset","vec3")):Y;return z(_t,x.x,x.y).mul(q.w).add(q.xyz)};return e.hasAttribute("normal")&&m.assign(z(pt?U(3):g,x.x,x.y)),w.needsPreviousData?.()&&l.assign(j(U(6))),j(U(0))})();let gt=n(()=>{let v=u(B.element(G().mul(2).add(1)).w),w=b=>h(v.shiftRight(u(b)).bitAnd(u(255))).div(255);return c(w(16),w(8),w(0))})();t.colorNode=I.varying(gt).mul(t.colorNode??(e.hasAttribute("color")?f("color","vec3"):I.materialColor))}update(t,e,i){if(!this.#b)return;let s=this.#D(t,e);this.#M(s),this.#B(i);for(let r of this.levels)(r.level===0||this.#y(r.level-1)>s)&&this.#z(r);this.#U()}#D(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:i}=this.#t,s=i.center.length()+1.2*i.radius,r=this.#E,n=new L().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new ot().copy(this.matrixWorld).invert());new Xt().setFromProjectionMatrix(new ot().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??Kt).planes.forEach(({normal:c,constant:f},a)=>r.set([c.x,c.y,c.z,f],4*a));let u=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,h=this.#_.distanceToPoint(n);return r.set([n.x,n.y,n.z,u],24),new Uint32Array(r.buffer).set([this.#u,this.#a.length],28),r[30]=s,new Uint32Array(r.buffer)[31]=Math.max(1,this.#u),u*Math.max(h-.5*s*this.#p,1e-6)/this.#p}#B(t){let{times:e}=this.#t.channel;this.#v=this.#n.map(({clip:i,ahead:s})=>{let{firstFrame:r,frameCount:n,duration:o}=i,u=V(i);if(n===1||!(u>0))return{frames:[r,r],weight:0};let h=((t+s)%u+u)%u,c=e[r],f=0,a=n-1;if(h>=o)return{frames:[r+a,r],weight:Math.min((h-o)/(u-o),1)};for(;a-f>1;){let m=f+a>>1;e[r+m]-c<=h?f=m:a=m}let[d,l]=[e[r+f],e[r+a]];return{frames:[r+f,r+a],weight:(h+c-d)/(l-d)}})}#z(t){let e=[],i=[],s=this.#A,r=t.strength!==s;t.strength=s,this.#v.forEach(({frames:n,weight:o},u)=>{let h=t.slots[u],c=t.before[u],f=N*u;r&&h.fill(-1);let a=n.map(d=>{let l=h.indexOf(d);return l<0&&(l=h.findIndex((m,g)=>!n.includes(m)&&!c?.slots.includes(f+g)),h[l]=d,e.push({...t.places.get(d),slot:f+l,strength:s})),f+l});i.push({slots:a,weight:o,previous:c?.slots??a,previousWeight:c?.weight??o}),t.before[u]={slots:a,weight:o}}),t.passes.run(e,i),this.bytesOfParameters+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#U(){let{queue:t}=this.#e,e=this.#e.createCommandEncoder();t.writeBuffer(this.view,0,this.#E),t.writeBuffer(this.#f(this.#h),0,this.#g),this.bytesOfParameters+=this.#E.byteLength+this.#g.byteLength;let i=e.beginComputePass();i.setPipeline(this.#c),i.setBindGroup(0,this.#b),i.dispatchWorkgroups(Math.ceil(Math.max(1,this.#u)/64)),i.end(),t.submit([e.finish()])}async drawn(){let t=this.#g.byteLength,e=this.#e.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),i=this.#e.createCommandEncoder(),s=new Array(this.#t.motion.levelCount).fill(0);i.copyBufferToBuffer(this.#f(this.#h),0,e,0,t),this.#e.queue.submit([i.finish()]),await e.mapAsync(GPUMapMode.READ);let r=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:n,list:o}of this.#a)s[n]+=r[5*o+1];return s}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#r.getArrayBufferAsync(e))}#C(){this.#O++,this.#x=!1;for(let{drawn:t}of this.#a)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#r.backend.destroyAttribute(e);for(let t of[this.#w,this.#h,this.#m].filter(Boolean))this.#r.backend.destroyAttribute(t);for(let t of this.#i.values())t.dispose();this.#i.clear(),this.levels=[],this.#a=[],this.#b=null,this.#_.makeEmpty(),this.#p=1e-9}dispose(){this.#C(),this.view.destroy(),this.tolerances.destroy()}};function ht(p){let t=new Uint32Array(p.length);return p.forEach((e,i)=>{t[e]=i}),t}function ee(p,t){let e=ht(t),i=Uint32Array.from(p.index.array,o=>e[p.userData.source[o]]),s=t.length,r=new Uint32Array(s+1),n=new Uint32Array(s+1+2*i.length);for(let o of i)r[o+1]++;for(let o=0;o<s;o++)r[o+1]+=r[o];for(let o=0;o<=s;o++)n[o]=s+1+2*r[o];for(let o=0;o<i.length;o++){let u=o-o%3,h=s+1+2*r[i[o]]++;n[h]=i[u+(o+1)%3],n[h+1]=i[u+(o+2)%3]}return n}export{H as ATHForest};
