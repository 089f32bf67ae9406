import{Box3 as Zt,BufferAttribute as mt,DoubleSide as Qt,Group as te,IndirectStorageBufferAttribute as ee,LineBasicNodeMaterial as se,LineSegments as re,Mesh as ie,MeshStandardNodeMaterial as oe,Frustum as ne,Matrix4 as pt,StorageBufferAttribute as ae,TSL as F,Vector3 as j,WebGPUCoordinateSystem as ue}from"three/webgpu";var et=`// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

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
`;var st=`// Chooses what instances are drawn with. \`measure\` runs first, for each level that is shown: it finds how far from its place a plant
// reaches now, over the vertices that pass 3 has placed, so that no instance is left out that is in view, whatever is blended. Then
// \`main\` appends each instance in view to the list of the coarsest shape whose error its distance hides, one invocation per instance.

const FLOATS = 9u; // numbers of a vertex, of which the first are its position

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
    near: f32,  // how much nearer than its place an instance of size 1 begins, for its level
    room: u32,  // Instances that a list has room for.
    offset: vec3<f32>, // from the positions of vertices to those from the place
    beyond: f32,       // how far a shape's own vertices are from the plant's
    rest: f32,         // how far from its place the rest pose reaches
    headed: u32,       // 1: what moves is turned about the rest pose
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
@group(0) @binding(5) var<storage, read_write> reach: array<atomic<u32>>; // a distance, whose bits grow with it as it is not negative
@group(0) @binding(6) var<storage, read> vertices: array<f32>;

var<workgroup> furthest: atomic<u32>;

@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) local: u32,
           @builtin(num_workgroups) groups: vec3<u32>) {
    var most = 0.0;
    for (var at = FLOATS * id.x; at + 2u < arrayLength(&vertices); at += FLOATS * 64u * groups.x) {
        most = max(most, length(vec3(vertices[at], vertices[at + 1u], vertices[at + 2u]) + view.offset));
    }
    atomicMax(&furthest, bitcast<u32>(most + view.beyond));
    workgroupBarrier();
    if (local == 0u) {
        atomicMax(&reach[0], atomicLoad(&furthest));
    }
}

// Returns how far from its place an instance of size 1 is seen. Its vertices are on the lines from the rest pose through where they
// are at amplitude 1, as many times as far along.
fn reach_of(amplitude: f32) -> f32 {
    let moved = max(view.rest, bitcast<f32>(atomicLoad(&reach[0])));
    if (view.headed == 1u) {
        return view.rest + abs(amplitude) * (view.rest + moved);
    }
    return moved * max(1.0, 2.0 * abs(amplitude - 0.5));
}

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
    if (!is_seen(place.xyz, place.w * reach_of(instances[id.x].look.x))) {
        return;
    }
    let hidden = view.pixel * max(distance(view.eye, place.xyz) - 0.5 * view.near * place.w, 1e-6) / place.w;
    var chosen = 0u;
    while (chosen + 1u < view.shapes && shapes[chosen + 1u].tolerance <= hidden) {
        chosen++;
    }
    let list = shapes[chosen].list;
    lists[list * view.room + atomicAdd(&draws[5u * list + 1u], 1u)] = id.x;
}
`;var rt=`// The end of pass 2, when all depths have been placed: joins, matrices, corrections, and motion that is baked.

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
`;var it=`// Pass 2: bodies of one depth, each placed from the one that it hangs on; amplitudes of all sources of a place add up. One
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
`;var ot=`// Pass 1: what each row is at the frame of each source. One invocation per row.

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
`;var nt=`// Pass 3: vertices at a time, between two frames that the passes before have placed. \`vertex_at\` is what a vertex stage calls;
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
`;var[at,ut,Pt,Ft,Wt,Vt]=[2,3,4,5,6,10],[Lt,Gt,Ht]=[5,6,19],qt=64,R=8,G=4,H=12,jt=9,z=m=>Math.ceil(m/qt),B=class{constructor(t,{blocks:e,time:o,hierarchy:s,finish:i,vertices:r}){let n=(...h)=>t.createShaderModule({code:h.join(`
`)}),u=(h,d="main")=>t.createComputePipeline({layout:"auto",compute:{module:h,entryPoint:d}}),a=n(e,i);this.time=u(n(e,o)),this.hierarchy=u(n(e,s)),this.bodies=u(a,"bodies"),this.corrections=u(a,"corrections"),this.baked=u(a,"baked"),this.vertices=u(n(r))}},U=class{uploaded=0;#s=new Map;#t=0;#n=0;#m=0;constructor(t,e,o,{slots:s=2,shown:i=1,vertices:r=null,across:n=t.limits.maxComputeWorkgroupsPerDimension}={}){Object.assign(this,{device:t,kernels:e,words:o,slots:s,shown:i,across:n}),this.size={positions:3*o[Pt],matrices:12*o[Ft],bodies:12*o[ut],vertices:jt*o[at]},this.baked=!1;let{positions:u,matrices:a,bodies:h}=this.size;this.buffers={level:this.#e(o),segments:this.#i(1),places:this.#i((R+G)*s),shows:this.#i(H*i),amplitudes:this.#i(1),positions:this.#i(s*u),matrices:this.#i(s*a),modes:this.#i(s*u),bodies:this.#i(s*h),corners:this.#i(1),vertices:r??this.#i(i*this.size.vertices)},this.ownsVertices=!r,this.depths=Array.from({length:o[Wt]},(d,c)=>{let[l,f]=o.subarray(o[Vt]+c);return{count:f-l,uniform:this.#p(c)}}),this.ordinals=[],this.hasCorners=!1}get bytes(){return Object.values(this.buffers).reduce((t,{size:e})=>t+e,0)}#i(t,e=140){return this.device.createBuffer({size:Math.max(16,4*t),usage:e})}#e(t,e=140){let o=this.#i(t.length,e);return this.#a(o,t),o}#p(t){return this.#e(new Uint32Array([t,0,0,0]),72)}#a(t,e,o=0,s=e.length){this.uploaded+=4*s,this.device.queue.writeBuffer(t,4*o,e.buffer,e.byteOffset,4*s)}#c(t,e,o=0){let s=this.buffers[t],{device:i}=this;if(4*e<=s.size)return;let r=this.#i(e);if(o>0){let n=i.createCommandEncoder();n.copyBufferToBuffer(s,0,r,0,4*o),i.queue.submit([n.finish()])}s.destroy(),this.buffers[t]=r,this.#s.clear()}segment(t){let e=this.#m;return e+t.length>this.buffers.segments.size/4&&this.#c("segments",2*(e+t.length),e),this.#a(this.buffers.segments,t,e),this.#m+=t.length,this.#t=Math.max(this.#t,t[Lt]),this.#n=Math.max(this.#n,t[Gt]),this.baked||=t[Ht]!==0,e}setCorners(t){this.buffers.corners.destroy(),this.buffers.corners=this.#e(t),this.hasCorners=!0,this.#s.clear()}#r(t,e,[o,s],i,r=null){if(o===0||s===0)return;let n=r??e;if(!this.#s.has(n)){let a=i.flatMap((d,c)=>d?[{binding:c,resource:{buffer:this.buffers[d]}}]:[]);r&&a.push({binding:i.length,resource:{buffer:r}});let h=this.kernels[e].getBindGroupLayout(0);this.#s.set(n,this.device.createBindGroup({layout:h,entries:a}))}t.setPipeline(this.kernels[e]),t.setBindGroup(0,this.#s.get(n));let u=Math.min(o,this.across);t.dispatchWorkgroups(u,s,Math.ceil(o/u))}run(t,e){let o=this.device.createCommandEncoder(),s=o.beginComputePass();t.length>0&&this.#o(s,t),e.length>0&&this.#d(s,e),s.end(),this.device.queue.submit([o.finish()])}#o(t,e){let{positions:o,bodies:s}=this.size,i=e.length;if(this.#y(e),this.baked){this.#r(t,"baked",[z(o),i],["level","segments","places","positions"]);return}this.#r(t,"time",[z(this.#t),i],[null,"segments","places","amplitudes"]);let r=["amplitudes","positions","matrices","modes","bodies"];for(let u of this.depths)this.#r(t,"hierarchy",[u.count,i],["level","segments","places",...r],u.uniform);this.#r(t,"bodies",[this.words[ut],i],["level","segments","places","positions","matrices"]);let n=Math.max(...e.map(({sources:u})=>u.length));for(;this.ordinals.length<n;)this.ordinals.push(this.#p(this.ordinals.length));for(let u of this.ordinals.slice(0,n))this.#r(t,"corrections",[z(this.#n),i],[null,"segments","places","positions",null],u)}#y(t){let{positions:e,matrices:o,bodies:s}=this.size,i=t.reduce((h,{sources:d})=>h+d.length,0),r=new Uint32Array(R*t.length+G*i),n=new Float32Array(r.buffer),u=R*t.length,a=0;t.forEach(({sources:h,slot:d,strength:c=1},l)=>{r.set([u,h.length,d*e,d*o,l*e,l*s],R*l),n[R*l+6]=c;for(let{segment:f,frame:p,weight:g=1}of h)r.set([f,p,3*this.#t*a++],u),n[u+3]=g,u+=G}),this.#c("places",r.length),this.#c("amplitudes",3*this.#t*i),this.#a(this.buffers.places,r)}#d(t,e){let{positions:o,matrices:s,vertices:i}=this.size,r=new Uint32Array(H*e.length),n=new Float32Array(r.buffer);e.forEach(({slots:u,weight:a,previous:h=u,previousWeight:d=a,at:c=null},l)=>{let f=H*l;[...u,...h].forEach((p,g)=>{r[f+g]=p*o,r[f+4+g]=p*s}),n[f+8]=a,n[f+9]=d,r[f+10]=this.hasCorners?1:0,r[f+11]=(c??l)*i}),this.#a(this.buffers.shows,r),this.#r(t,"vertices",[z(this.words[at]),e.length],["level","corners","shows","positions","matrices","vertices"])}async read(t){this.run([],t);let e=this.device.createCommandEncoder(),o=4*this.size.vertices*t.length,s=this.device.createBuffer({size:o,usage:9});e.copyBufferToBuffer(this.buffers.vertices,0,s,0,o),this.device.queue.submit([e.finish()]),await s.mapAsync(1);let i=new Float32Array(s.getMappedRange().slice(0));return s.destroy(),i}dispose(){for(let t of[...this.depths.map(e=>e.uniform),...this.ordinals])t.destroy();for(let[t,e]of Object.entries(this.buffers))(t!=="vertices"||this.ownsVertices)&&e.destroy()}};import{Box3 as Me,DataTexture as Ce,EventDispatcher as ke,FloatType as De,MathUtils as Ie,NearestFilter as Ne,RGBAFormat as ze,Sphere as Be,Vector3 as lt}from"three";import{BufferAttribute as ht,BufferGeometry as Yt,InstancedBufferAttribute as Oe,ShapeUtils as Ee,Vector2 as Ae,Vector3 as Se}from"three";function ct(m,{up_axis:t}){return t==="z"&&(m.rotation.x=-Math.PI/2),t==="x"&&(m.rotation.z=Math.PI/2),m}function $t(m,t,e,o){for(let s=0;s<e.length;s++)for(let i=0;i<o;i++)m[o*s+i]=Number(t[o*e[s]+i]);return m}function q(m,t,e,o){let{source:s}=m.userData,i=m.index.array,r=!m.getAttribute("normal"),n=new Map,u=r?2:3,a=[],h=new Set,d=c=>{let l=3*s[c],f=g=>Math.floor(t[l+g]/e)&4095,p=((o[s[c]]+1&65535)*4096+f(0))*16777216+f(1)*4096+f(2);return n.has(p)||n.set(p,c),n.get(p)};for(let c=0;c<i.length;c+=u){let l=Array.from(i.subarray(c,c+u),d),[f,p,g]=l;if(f===p||!r&&(p===g||g===f))continue;let[_,O,A]=[...l].sort((S,y)=>S-y),E=r?_*2**26+O:`${_},${O},${A}`;h.has(E)||(h.add(E),a.push(...l))}return a.length===0&&a.push(...i.subarray(0,u)),Xt(m,Uint32Array.from(a))}function Xt(m,t){let e=Uint32Array.from(new Set(t)).sort(),o=new Map(Array.from(e,(i,r)=>[i,r])),s=new Yt;for(let[i,{array:r,itemSize:n}]of Object.entries(m.attributes))s.setAttribute(i,new ht($t(new r.constructor(n*e.length),r,e,n),n));return s.setIndex(new ht(t.map(i=>o.get(i)),1)),s.userData.source=e.map(i=>m.userData.source[i]),s}var Ue=new lt,Pe=new lt;function M({lastTime:m,frameCount:t}){return t>1?m+m/(t-1):0}var C=null,Jt=.001,P=class{#s=new Map([[C,1]]);#t=new Map([[C,1]]);set(t){let e=t?[...t.values()].reduce((o,s)=>o+s,0):0;this.#s=e>0?new Map([...t].map(([o,s])=>[o,s/e])):new Map([[C,1]])}get clips(){return[...this.#s.keys()].filter(t=>t!==C)}advance(t,e){let o=[...this.#s].filter(([a,h])=>h>0&&(a===C||e(a))),s=o.reduce((a,[,h])=>a+h,0),i=new Map(o.map(([a,h])=>[a,h/s]));if(i.size===0)return;let n=[...new Set([...this.#t.keys(),...i.keys()])].map(a=>[a,(this.#t.get(a)??0)*(1-t)+(i.get(a)??0)*t]).filter(([a,h])=>h>Jt||i.has(a)),u=n.reduce((a,[,h])=>a+h,0);this.#t=new Map(n.map(([a,h])=>[a,h/u]))}of(t){let e=new Map;for(let[o,s]of this.#t)e.set(o??t,(e.get(o??t)??0)+s);return e}};function ft(m,t,e){let{firstFrame:o,frameCount:s,lastTime:i}=t,r=M(t);if(s===1||!(r>0))return[{frame:o,weight:1}];let n=(e%r+r)%r;return n<i?Kt(m,t,n):dt(o+s-1,o,Math.min((n-i)/(r-i),1))}function Kt(m,{firstFrame:t,frameCount:e},o){let s=m[t]+o,i=t,r=t+e-1;for(;r-i>1;){let n=i+r>>1;m[n]<=s?i=n:r=n}return r===i?[{frame:i,weight:1}]:dt(i,r,Math.min(Math.max((s-m[i])/(m[r]-m[i]),0),1))}var dt=(m,t,e)=>[{frame:m,weight:1-e},{frame:t,weight:e}];var k=32,D=12,I=4,gt=1.5,wt=2,he=.85,vt=40,Y=9,ce=65536,le=64,fe=16777215,de=m=>m?new se({color:7035717}):new oe({color:9083499,roughness:.8,side:Qt}),$=class extends te{pixels=1;measure="p99";phases=8;ease=.2;bytesOfMotion=0;bytesOfParameters=0;levels=[];#s;#t;#n;#m;#i;#e;#p;#a;#c;#r=new Map;#o=[];#y=[];#d=new P;#C=0;#_=null;#l=null;#g=null;#O=null;#u=[];#S=new Zt;#w=1;#h=0;#v=!1;#b=0;#T=new Float32Array(vt);#E=0;#x=null;#k=null;#D=1;#R=F.uniform(new j(1,0,0));constructor(t,e,{geometry:o=e.geometry??e.lines,material:s=de,shape:i=r=>r}={}){if(super(),this.name="ath forest",this.#e=t.backend.device,!this.#e)throw new Error("ATHForest: got a renderer without WebGPU, expected one after init(); ATHForest of athcodec-three is for WebGL");this.#s=t,this.#t=e,ct(this,e.metadata),this.#n=o,this.#m=s,this.#i=i,this.#p=new B(this.#e,{blocks:et,time:ot,hierarchy:it,finish:rt,vertices:nt});let r=this.#e.createShaderModule({code:st});[this.#a,this.#c]=["main","measure"].map(n=>this.#e.createComputePipeline({layout:"auto",compute:{module:r,entryPoint:n}})),this.reach=this.#e.createBuffer({size:4,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST}),this.view=this.#e.createBuffer({size:4*vt,usage:GPUBufferUsage.UNIFORM|GPUBufferUsage.COPY_DST}),this.tolerances=this.#e.createBuffer({size:8*k,usage:GPUBufferUsage.STORAGE|GPUBufferUsage.COPY_DST})}get count(){return this.#h}get plantCount(){return this.#o.length}get plants(){return this.#o.map(({clip:t,phase:e})=>[t.name,e])}get clips(){return Array.from(this.#r.keys(),({name:t})=>t)}get bytes(){return this.levels.reduce((t,{passes:e})=>t+e.bytes,0)}setInstances(t){let{motion:e,channel:o}=this.#t,{limits:s}=this.#e,i=new Float32Array(D*Math.max(1,t.length));this.#W();let r=c=>this.#N(c)??e.clip,n=new Set(t.map(({clip:c})=>r(c))),u=Math.floor(s.maxStorageBufferBindingSize/(12*I*o.info.placeCount)/Math.max(1,n.size)),a=Math.max(1,Math.min(this.phases,u)),h=new Map,d=(c,l=0)=>{let f=M(c)||1,p=Math.floor((l/f%1+1)%1*a),g=c.index*a+p;return h.has(g)||h.set(g,{index:h.size,clip:c,phase:p/a}),h.get(g).index};t.forEach(({x:c,y:l,z:f,size:p=1,angle:g=0,seconds:_,clip:O,tint:A=fe,amplitude:E=1},S)=>{i.set([c,l,f,p,Math.cos(g),Math.sin(g),d(r(O),_),A,E],D*S),this.#S.expandByPoint(new j(c,l,f)),this.#w=Math.max(this.#w,p)}),this.#o=[...h.values()],this.#h=t.length;for(let c of[...n,...this.#d.clips])this.#z(c);return this.#_=this.#M(i,4),this.#l=new ee(new Uint32Array(5*k),5),this.#s.backend.createIndirectStorageAttribute(this.#l),this.#g=this.#M(new Uint32Array(k*Math.max(1,this.#h)),1),this.#x=new Uint32Array(5*k),this.#O=this.#I(this.#a,{0:this.#f(this.#_),1:this.view,2:this.tolerances,3:this.#f(this.#l),4:this.#f(this.#g),5:this.reach}),this}#I(t,e){let o=Object.entries(e).map(([s,i])=>({binding:Number(s),resource:{buffer:i}}));return this.#e.createBindGroup({layout:t.getBindGroupLayout(0),entries:o})}#N(t){return this.#t.motion.clips.find(({index:e,name:o})=>t===e||t===o)}#z(t){this.#r.has(t)||this.#r.set(t,this.#t.motion.clone().play(t.index).setLevel(Math.max(0,this.levels.length-1)).setTime(0))}#M(t,e){let o=new ae(t,e);return this.#s.backend.createStorageAttribute(o),o}#f(t){return this.#s.backend.get(t).buffer}blend(t){let e=Object.entries(t??{}).map(([s,i])=>[this.#N(s),i]);if(e.findIndex(([s,i])=>!s||!(i>=0&&i<1/0))>=0||t&&!e.some(([,s])=>s>0))throw new RangeError(`blend: got ${JSON.stringify(t)}, expected weights of clips, ${this.#t.motion.clips.map(({name:s})=>s).join(", ")}`);for(let[s,i]of e)i>0&&this.#z(s);return this.#d.set(t&&new Map(e)),this}async wind(t,e=0){if(![t,e].every(Number.isFinite))throw new RangeError(`wind: got ${t} and ${e}, expected two finite numbers`);let o=this.#k={},{weights:s}=await this.#t.channel.windWeights(t,e),{clips:i}=this.#t.motion;return o===this.#k&&this.blend(Object.fromEntries(i.map(({name:r},n)=>[r,s[n]]))),this}sway(t,e=null){return this.#D=t,this.#R.value.set(Math.cos(e??0),Math.sin(e??0),e===null?0:1),this}#V(t){let e=this.levels.length,{motion:o}=this.#t;if(!this.#v){for(let s of this.levels)for(let[i,{readyLevel:r}]of this.#r)if(!s.clips.has(i)&&r>=s.level)return this.#B(()=>this.#G(s,i));if(!(e>=o.levelCount||e>0&&this.#A(e-1)<=t)){for(let s of this.#r.values())s.target<e&&s.setLevel(e);[...this.#r.values()].every(({readyLevel:s})=>s>=e)&&this.#B(()=>this.#L(e))}}}#B(t){this.#v=!0,t().catch(({message:e,codeName:o})=>this.#t.motion.dispatchEvent({type:"error",message:e,codeName:o}))}#A(t){return Math.max(...Array.from(this.#r.keys(),({errors:e})=>e[t][this.measure]))}async#L(t){let{channel:e}=this.#t,o=this.#b,s=()=>o===this.#b,[i,{words:r}]=[await e.parts(t),await e.gpu(t)];if(!s())return;let n=this.#o.length,u=this.#M(new Float32Array(Y*r[2]*n),1),a=new U(this.#e,this.#p,r,{slots:I*n,shown:n,vertices:this.#f(u)}),h=this.#I(this.#c,{1:this.view,5:this.reach,6:this.#f(u)}),d={level:t,passes:a,shared:u,measured:h,clips:new Set,places:new Map,uploaded:0,bytesOfMotion:0,bytesOfParameters:0,strength:NaN,slots:this.#o.map(()=>new Array(I).fill(-1)),before:this.#o.map(()=>null)};this.#t.hasFaces&&a.setCorners(me(this.#t.geometry,e));for(let c of this.#r.keys())if(!await this.#U(d,c,s)){a.dispose();return}this.levels.push(d),this.#H(d,i),this.#v=!1,this.dispatchEvent({type:"level",level:t})}async#G(t,e){let o=this.#b;await this.#U(t,e,()=>o===this.#b)&&(this.#v=!1)}async#U(t,e,o){let{channel:s}=this.#t,{passes:i,level:r,places:n}=t;for(let u=e.firstSegment;u<e.firstSegment+e.segmentCount;u++){let{words:a,coded:h}=await s.gpu(r,u);if(!o())return!1;let d=i.segment(a);this.#P(t,"bytesOfMotion"),h.forEach((c,l)=>n.set(s.segments[u]+l,{segment:d,frame:c}))}return t.clips.add(e),!0}#P(t,e){this[e]+=t.passes.uploaded-t.uploaded,t[e]+=t.passes.uploaded-t.uploaded,t.uploaded=t.passes.uploaded}#H(t,e){let{channel:o,motion:s,rest:i,sphere:r}=this.#t,{level:n}=t,u=this.#A(n),a=n>0?this.#A(n-1):r.radius/4,h=o.nodeNumbers(e);e.vertices.forEach((f,p)=>{f<0&&(h[p]=-1)});let d=n===s.levelCount-1?this.#n:q(this.#n,i,gt*u,h);this.#F(t,d,u);for(let f=Math.max(wt*u,r.radius/2e3);f<a;f*=wt){let p=q(this.#n,i,gt*f,h);p.userData.source.length>he*d.userData.source.length||(this.#F(t,p,f),d=p)}let c=Float32Array.from({length:2*this.#u.length}),l=new Uint32Array(c.buffer);this.#u.sort((f,p)=>f.tolerance-p.tolerance).forEach((f,p)=>{c[2*p]=f.tolerance,l[2*p+1]=f.list}),this.#e.queue.writeBuffer(this.tolerances,0,c)}#F(t,e,o){let s=this.#u.length;if(s===k)return;let i=this.#i(e,o).clone(),{source:r}=e.userData,n=!i.hasAttribute("normal"),u=this.#t.channel.vertexPlaces,a=i.userData.vertices??r,h=i.getAttribute("athOffset");for(let l=0;l<(h?.count??0);l++)this.#E=Math.max(this.#E,Math.hypot(h.getX(l),h.getY(l),h.getZ(l)));i.setAttribute("athVertex",new mt(Uint32Array.from(a,l=>u[l]),1)),i.setAttribute("position",new mt(Float32Array.from({length:3*a.length},(l,f)=>this.#t.rest[3*a[Math.floor(f/3)]+f%3]),3)),i.setIndirect(this.#l,20*s),this.#x[5*s]=i.index.count;let d=this.#m(n,t.level),c=n?new re(i,d):new ie(i,d);this.#q(d,i,t,s),c.frustumCulled=!1,c.castShadow=c.receiveShadow=!n,this.#u.push({level:t.level,tolerance:o,list:s,drawn:c,size:i.index.count}),this.add(c)}#q(t,e,{passes:o,shared:s},i){let{Fn:r,storage:n,uint:u,float:a,vec3:h,attribute:d,instanceIndex:c,positionGeometry:l,positionPrevious:f,normalLocal:p,normalGeometry:g,select:_}=F,{metadata:O,channel:{info:A},origin:E}=this.#t,S=O.up_axis==="z",y=this.#R,bt=h(...A.origin.map((w,v)=>w-E[v])),xt=u(o.words[2]),yt=n(s,"float",s.count).toReadOnly(),X=n(this.#_,"vec4",D/4*Math.max(1,this.#h)).toReadOnly(),_t=n(this.#g,"uint",this.#g.count).toReadOnly(),W=(w,v,x)=>S?h(v.mul(w.x).sub(x.mul(w.y)),x.mul(w.x).add(v.mul(w.y)),w.z):h(v.mul(w.x).add(x.mul(w.z)),w.y,v.mul(w.z).sub(x.mul(w.x))),J=()=>_t.element(u(i*Math.max(1,this.#h)).add(c)),Ot=e.hasAttribute("athOffset"),Et=o.hasCorners&&!e.userData.vertices;t.positionNode=r((w,v)=>{let x=J().toVar(),V=T=>X.element(x.mul(D/4).add(T)).toVar(),K=V(0),b=V(1),Z=V(2).x,St=u(b.z).mul(xt).add(d("athVertex","uint")).mul(Y).toVar(),L=T=>h(...[0,1,2].map(N=>yt.element(St.add(T+N)))),Q=T=>{let N=T.add(bt).sub(l).mul(Z).toVar(),Rt=y.x.mul(b.x).add(y.y.mul(b.y)),Mt=y.y.mul(b.x).sub(y.x.mul(b.y)),Ct=l.add(W(N,Rt,Mt)),tt=_(y.z.greaterThan(.5),Ct,l.add(N)).toVar(),kt=Ot?tt.add(d("athOffset","vec3")):tt;return W(kt,b.x,b.y).mul(K.w).add(K.xyz)},Tt=()=>Et?g.add(L(3).sub(g).mul(Z)):g;return e.hasAttribute("normal")&&p.assign(W(Tt(),b.x,b.y)),v.needsPreviousData?.()&&f.assign(Q(L(6))),Q(L(0))})();let At=r(()=>{let w=u(X.element(J().mul(D/4).add(1)).w),v=x=>a(w.shiftRight(u(x)).bitAnd(u(255))).div(255);return h(v(16),v(8),v(0))})();t.colorNode=F.varying(At).mul(t.colorNode??(e.hasAttribute("color")?d("color","vec3"):F.materialColor))}update(t,e,o){if(!this.#O)return;let s=this.#j(t,e);this.#V(s),this.#Y(o);let i=this.levels.filter(({level:r})=>r===0||this.#A(r-1)>s);for(let r of this.levels)i.includes(r)?this.#$(r):r.before.fill(null);this.#K(i)}#j(t,e){this.updateWorldMatrix(!0,!1),t.updateMatrixWorld();let{sphere:o,origin:s,channel:{info:i}}=this.#t,r=this.#T,n=o.center.length()+o.radius+this.#E,u=o.center.length()+1.2*o.radius,a=new j().setFromMatrixPosition(t.matrixWorld).applyMatrix4(new pt().copy(this.matrixWorld).invert());new ne().setFromProjectionMatrix(new pt().multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse).multiply(this.matrixWorld),t.coordinateSystem??ue).planes.forEach(({normal:l,constant:f},p)=>r.set([l.x,l.y,l.z,f],4*p));let d=this.pixels*2*Math.tan(t.fov*Math.PI/360)/e,c=this.#S.distanceToPoint(a);return r.set([a.x,a.y,a.z,d],24),new Uint32Array(r.buffer).set([this.#h,this.#u.length],28),r[30]=u,new Uint32Array(r.buffer)[31]=Math.max(1,this.#h),r.set([...i.origin.map((l,f)=>l-s[f]),this.#E,n],32),new Uint32Array(r.buffer)[37]=this.#R.value.z,d*Math.max(c-.5*u*this.#w,1e-6)/this.#w}#Y(t){let e=performance.now(),o=this.ease>0?1-Math.exp((this.#C-e)/(1e3*this.ease)):1;this.#C=e,this.#d.advance(o,i=>this.levels.every(r=>r.clips.has(i)));let{times:s}=this.#t.channel;this.#y=this.#o.map(({clip:i,phase:r})=>[...this.#d.of(i)].flatMap(([n,u])=>ft(s,n,t+r*M(n)).map(({frame:a,weight:h})=>({frame:a,weight:u*h}))))}#$(t){let e=[],o=[],s=this.#D,i=t.strength!==s;t.strength=s,this.#y.forEach((r,n)=>{let u=t.before[n];i&&t.slots[n].fill(-1);let a=r.length>2?this.#J(t,n,r,e):this.#X(t,n,r,e);o.push({...a,previous:u?.slots??a.slots,previousWeight:u?.weight??a.weight}),t.before[n]=a}),t.passes.run(e,o),this.#P(t,"bytesOfParameters")}#X(t,e,o,s){let i=t.slots[e],r=I*e,n=o.map(({frame:a})=>a),u=n.map(a=>{let h=i.indexOf(a);return h<0&&(h=i.findIndex((d,c)=>!n.includes(d)&&!t.before[e]?.slots.includes(r+c)),i[h]=a,s.push({sources:[t.places.get(a)],slot:r+h,strength:t.strength})),r+h});return{slots:[u[0],u.at(-1)],weight:o.length>1?o[1].weight:0}}#J(t,e,o,s){let i=t.slots[e],r=I*e,n=i.findIndex((a,h)=>!t.before[e]?.slots.includes(r+h));i[n]=-1;let u=o.filter(({weight:a})=>a>0).map(({frame:a,weight:h})=>({...t.places.get(a),weight:h}));return s.push({sources:u,slot:r+n,strength:t.strength}),{slots:[r+n,r+n],weight:0}}#K(t){let{queue:e}=this.#e,o=this.#e.createCommandEncoder();e.writeBuffer(this.view,0,this.#T),e.writeBuffer(this.#f(this.#l),0,this.#x),e.writeBuffer(this.reach,0,new Uint32Array(1)),this.bytesOfParameters+=this.#T.byteLength+this.#x.byteLength+4;let s=o.beginComputePass();s.setPipeline(this.#c);for(let{measured:i,shared:r}of t)s.setBindGroup(0,i),s.dispatchWorkgroups(Math.ceil(Math.min(ce,r.count/Y)/le));s.setPipeline(this.#a),s.setBindGroup(0,this.#O),s.dispatchWorkgroups(Math.ceil(Math.max(1,this.#h)/64)),s.end(),e.submit([o.finish()])}async drawn(){let t=this.#x.byteLength,e=this.#e.createBuffer({size:t,usage:GPUBufferUsage.COPY_DST|GPUBufferUsage.MAP_READ}),o=this.#e.createCommandEncoder(),s=new Array(this.#t.motion.levelCount).fill(0);o.copyBufferToBuffer(this.#f(this.#l),0,e,0,t),this.#e.queue.submit([o.finish()]),await e.mapAsync(GPUMapMode.READ);let i=new Uint32Array(e.getMappedRange().slice(0));e.destroy();for(let{level:r,list:n}of this.#u)s[r]+=i[5*n+1];return s}async vertices(t){let{shared:e}=this.levels[t];return new Float32Array(await this.#s.getArrayBufferAsync(e))}#W(){this.#b++,this.#v=!1;for(let{drawn:t}of this.#u)t.removeFromParent(),t.geometry.dispose(),t.material.dispose();for(let{passes:t,shared:e}of this.levels)t.dispose(),this.#s.backend.destroyAttribute(e);for(let t of[this.#_,this.#l,this.#g].filter(Boolean))this.#s.backend.destroyAttribute(t);for(let t of this.#r.values())t.dispose();this.#r.clear(),this.levels=[],this.#u=[],this.#O=null,this.#S.makeEmpty(),this.#w=1e-9}dispose(){this.#W(),this.view.destroy(),this.reach.destroy(),this.tolerances.destroy()}};function me(m,{vertexPlaces:t,info:{placeCount:e}}){let o=Uint32Array.from(m.index.array,r=>t[m.userData.source[r]]),s=new Uint32Array(e+1),i=new Uint32Array(e+1+2*o.length);for(let r of o)s[r+1]++;for(let r=0;r<e;r++)s[r+1]+=s[r];for(let r=0;r<=e;r++)i[r]=e+1+2*s[r];for(let r=0;r<o.length;r++){let n=r-r%3,u=e+1+2*s[o[r]]++;i[u]=o[n+(r+1)%3],i[u+1]=o[n+(r+2)%3]}return i}export{$ as ATHForest};
