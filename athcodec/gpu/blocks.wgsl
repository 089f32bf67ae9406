// The blocks of a level and of a segment, as core/include/ath_gpu.h lays them out. This text stands in front of time, hierarchy and finish.

@group(0) @binding(0) var<storage, read> level: array<u32>;
@group(0) @binding(1) var<storage, read> segments: array<u32>; // blocks one behind the other

// A place is a blend of its sources. A dispatch computes several, one for each y of its workgroups.
struct Place {
    sources: u32, // word of `places` that they begin at
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
