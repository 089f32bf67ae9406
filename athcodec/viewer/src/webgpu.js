// The package's entry for WebGPURenderer, athcodec-three/webgpu: see webgpu.d.ts.

export { ATHForest } from "./gpu_forest.js";
