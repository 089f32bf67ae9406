// Chooses what instances are drawn with. `measure` runs first, for each level that is shown: it finds how far from its place a plant
// reaches now, over the vertices that pass 3 has placed, so that no instance is left out that is in view, whatever is blended. Then
// `main` appends each instance in view to the list of the coarsest shape whose error its distance hides, one invocation per instance.

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
