// GLB files with ATH_motion, read by GLTFLoader of three.js: the page fetches this only where such a file is opened.

import "whole-shaders"; // of three.js; made by build.mjs
import { TextureLoader } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

import { athMotion } from "../gltf/three.js";

// Pictures as elements: the page's policy lets nothing fetch what the file carries.
const asElements = (parser) => {
  parser.textureLoader = new TextureLoader(parser.options.manager);
  return { name: "pictures" };
};

/** Returns the ATH of the first motion that plays, with `model`, all that the file shows, and `others`, the motions behind it. */
export async function openModel(bytes, loader) {
  const gltf = await new GLTFLoader().register(asElements).register(athMotion(loader)).parseAsync(bytes, "");
  const { scene, userData: { ATH_motion: motions = [] } } = gltf, [ath, ...others] = motions.filter(Boolean);
  if (!ath) throw Object.assign(new Error("ATH_motion: got none that plays in the GLB, expected one"), { codeName: "NO_MOTION" });
  for (const clock of scene.children.filter(({ apply }) => apply)) clock.removeFromParent(); // the page has its own
  return Object.assign(ath, { model: scene, others, number: motions.indexOf(ath) });
}
