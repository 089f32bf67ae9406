// Resolves what modules of the page import from packages to the bundles that ship with the viewer: for register() of node:module.
// Its data names other bundles. three.js has only what the page calls; three.webgpu.js has all classes but WebGLRenderer.
const WEB = new URL("../../athcodec/viewer/web/", import.meta.url);
const FILES = { three: "three.js", "athcodec-three": "ATHLoader.js", "three/addons/controls/OrbitControls.js": "OrbitControls.js" };

export const initialize = (others) => { Object.assign(FILES, others); };
export const resolve = (name, context, next) => next(name in FILES ? new URL(FILES[name], WEB).href : name, context);
