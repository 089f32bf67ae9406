// Runs the three passes over WebGPU: a host to read beside docs/gpu.md, and what the tests run.
//
//     const passes = new Passes(device, {blocks, time, hierarchy, finish, vertices}, level, slots)
//     const segment = passes.segment(words)
//     passes.place(segment, frame, slot)                   passes 1 and 2: a frame of the segment, once for all instances
//     await passes.show([slot, slot], weight, ...)         pass 3, read back
//
// `level` and `words` are the blocks of core/ath_gpu.h, as Uint32Array.

const STORAGE = 0x80 | 4 | 8; // GPUBufferUsage.STORAGE | COPY_SRC | COPY_DST
const UNIFORM = 0x40 | 8;
const READ = 1 | 8;
const [VERTEX_COUNT, BODY_COUNT, POSITION_COUNT, MATRIX_COUNT, DEPTH_COUNT, DEPTHS] = [2, 3, 4, 5, 6, 10];
const [ROW_COUNT, CORRECTED_COUNT, BAKED] = [5, 6, 19];
const WORKGROUP = 64;

export class Passes {
  constructor(device, shaders, level, slots = 2) {
    this.device = device;
    this.words = level;
    const module = (name, ...texts) => device.createShaderModule({ label: name, code: texts.join("\n") });
    const kernel = (of, entryPoint) =>
      device.createComputePipeline({ layout: "auto", compute: { module: of, entryPoint } });
    const finish = module("finish", shaders.blocks, shaders.finish);
    this.kernels = {
      time: kernel(module("time", shaders.blocks, shaders.time), "main"),
      hierarchy: kernel(module("hierarchy", shaders.blocks, shaders.hierarchy), "main"),
      bodies: kernel(finish, "bodies"),
      corrections: kernel(finish, "corrections"),
      baked: kernel(finish, "baked"),
      vertices: kernel(module("vertices", shaders.vertices), "main"),
    };
    this.level = this.upload(level);
    this.size = { positions: 3 * level[POSITION_COUNT], matrices: 12 * level[MATRIX_COUNT] };
    this.positions = this.buffer(slots * this.size.positions);
    this.matrices = this.buffer(slots * this.size.matrices);
    this.modes = this.buffer(this.size.positions);
    this.frames = this.buffer(12 * level[BODY_COUNT]);
    this.vertices = this.buffer(9 * level[VERTEX_COUNT]);
    this.corners = this.buffer(1);
    this.hasCorners = false;
  }

  buffer(words, usage = STORAGE) {
    return this.device.createBuffer({ size: Math.max(16, 4 * words), usage });
  }

  upload(words, usage = STORAGE) {
    const buffer = this.buffer(words.length, usage);
    this.device.queue.writeBuffer(buffer, 0, words.buffer, words.byteOffset, words.byteLength);
    return buffer;
  }

  segment(words) {
    return { words, buffer: this.upload(words), amplitudes: this.buffer(3 * words[ROW_COUNT]) };
  }

  // Triangles at each vertex, for normals: see normal_at in vertices.wgsl.
  setCorners(words) {
    this.corners = this.upload(words);
    this.hasCorners = true;
  }

  dispatch(pass, name, count, ...buffers) {
    if (count === 0) return;
    const pipeline = this.kernels[name];
    const entries = buffers.flatMap((buffer, binding) => (buffer ? [{ binding, resource: { buffer } }] : []));
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, this.device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
    pass.dispatchWorkgroups(count);
  }

  // Passes 1 and 2 of a frame of a segment.
  place(segment, frame, slot) {
    const encoder = this.device.createCommandEncoder(), pass = encoder.beginComputePass();
    const at = [slot * this.size.positions, slot * this.size.matrices];
    const run = (...numbers) => this.upload(new Uint32Array([...numbers, 0, 0, 0].slice(0, 4)), UNIFORM);
    const { words, buffer, amplitudes } = segment, { level, positions, matrices } = this;
    if (words[BAKED]) {
      const count = Math.ceil(this.size.positions / WORKGROUP);
      this.dispatch(pass, "baked", count, level, buffer, run(frame, ...at), positions);
    } else {
      this.dispatch(pass, "time", Math.ceil(words[ROW_COUNT] / WORKGROUP), null, buffer, run(frame), amplitudes);
      for (let depth = 0; depth < this.words[DEPTH_COUNT]; depth++) {
        const [first, end] = this.words.subarray(this.words[DEPTHS] + depth);
        const outputs = [amplitudes, positions, matrices, this.modes, this.frames];
        this.dispatch(pass, "hierarchy", end - first, level, buffer, run(first, ...at), ...outputs);
      }
      const finish = [buffer, run(frame, ...at), positions];
      this.dispatch(pass, "bodies", this.words[BODY_COUNT], level, ...finish, matrices);
      this.dispatch(pass, "corrections", Math.ceil(words[CORRECTED_COUNT] / WORKGROUP), null, ...finish);
    }
    pass.end();
    this.device.queue.submit([encoder.finish()]);
  }

  // Pass 3: 9 floats of each vertex between two frames; previous: those of the time drawn before.
  async show(slots, weight, previous = slots, previousWeight = weight) {
    const all = [...slots, ...previous];
    const run = new Uint32Array([
      ...all.map((slot) => slot * this.size.positions),
      ...all.map((slot) => slot * this.size.matrices),
      ...new Uint32Array(new Float32Array([weight, previousWeight]).buffer),
      this.hasCorners ? 1 : 0,
      0,
    ]);
    const encoder = this.device.createCommandEncoder(), pass = encoder.beginComputePass();
    const count = Math.ceil(this.words[VERTEX_COUNT] / WORKGROUP), uniform = this.upload(run, UNIFORM);
    this.dispatch(pass, "vertices", count, this.level, this.corners, uniform, this.positions, this.matrices, this.vertices);
    pass.end();
    const read = this.buffer(9 * this.words[VERTEX_COUNT], READ);
    encoder.copyBufferToBuffer(this.vertices, 0, read, 0, this.vertices.size);
    this.device.queue.submit([encoder.finish()]);
    await read.mapAsync(1);
    const floats = new Float32Array(read.getMappedRange().slice(0));
    read.destroy();
    return floats;
  }
}
