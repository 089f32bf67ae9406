// Resolves what modules of the page import from packages to the bundles that ship with the viewer: for register() of node:module.
const WEB = new URL("../../athcodec/viewer/web/", import.meta.url);
const FILES = { three: "three.js", "athcodec-three": "ATHLoader.js", "three/addons/controls/OrbitControls.js": "OrbitControls.js" };

export const resolve = (name, context, next) => next(name in FILES ? new URL(FILES[name], WEB).href : name, context);
