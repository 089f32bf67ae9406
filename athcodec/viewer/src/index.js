// The npm package athcodec-three: see index.d.ts.

export { ATH, ATHLoader } from "./ATHLoader.js";
export { ATHLimbs } from "./ATHLimbs.js";
export { ATHMotion, dataTexture } from "./ATHMotion.js";
export { ATHForest } from "./ATHForest.js";
export { injectMotion, MOTION_PARS, motionUniforms } from "./shader.js";
export { upright } from "./geometry.js";
export { limbDepth, limbGeometry, limbMaterial, setRadii } from "./limbs.js";
export { radii } from "./radii.js";
export { ATHPlantMaterial } from "../page/surfaces.js";
