// Chooses what instances are drawn with: each that is in view is appended to the list of the coarsest shape whose error its distance
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
