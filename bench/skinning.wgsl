// Plants by one matrix per bone, of two frames: what the passes of athcodec/gpu are measured beside.
struct Show { now: vec2<u32>, before: vec2<u32>, weights: vec2<f32> }
@group(0) @binding(0) var<storage, read> rest: array<vec4<f32>>; // point and bone, normal
@group(0) @binding(1) var<storage, read> rows: array<vec4<f32>>; // Rows of matrices, three each.
@group(0) @binding(2) var<storage, read> shows: array<Show>;
@group(0) @binding(3) var<storage, read_write> vertices: array<f32>;
fn moved(x: vec4<f32>, frames: vec2<u32>, weight: f32, bone: u32) -> vec3<f32> {
  let a = frames.x + 3u * bone;
  let b = frames.y + 3u * bone;
  return vec3<f32>(dot(mix(rows[a], rows[b], weight), x), dot(mix(rows[a + 1u], rows[b + 1u], weight), x),
    dot(mix(rows[a + 2u], rows[b + 2u], weight), x));
}
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  let count = arrayLength(&rest) / 2u;
  if (id.x >= count) { return; }
  let show = shows[id.y];
  let bone = bitcast<u32>(rest[2u * id.x].w);
  let x = vec4<f32>(rest[2u * id.x].xyz, 1.0);
  let at = 9u * (id.y * count + id.x);
  let p = moved(x, show.now, show.weights.x, bone);
  let n = normalize(moved(vec4<f32>(rest[2u * id.x + 1u].xyz, 0.0), show.now, show.weights.x, bone));
  let q = moved(x, show.before, show.weights.y, bone);
  for (var k = 0u; k < 3u; k++) {
    vertices[at + k] = p[k];
    vertices[at + 3u + k] = n[k];
    vertices[at + 6u + k] = q[k];
  }
}
