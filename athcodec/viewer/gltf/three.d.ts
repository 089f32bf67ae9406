/**
 * ATH_motion for GLTFLoader of three.js.
 *
 *     import { ATHLoader } from "athcodec-three";
 *     import { athMotion } from "athcodec-three/gltf/three";
 *
 *     const loader = new GLTFLoader().register(athMotion(new ATHLoader()));
 *     const gltf = await loader.loadAsync("tree_motion.glb");
 *     scene.add(gltf.scene);
 *     mixer = new AnimationMixer(gltf.scene); // or gltf.userData.ATH_motion[0].motion.setTime(seconds)
 *     mixer.clipAction(AnimationClip.findByName(gltf.animations, "storm")).play();
 *
 * gltf.animations has an AnimationClip for each clip, or the tracks in the animation of its name. Of several actions that run,
 * the strongest one's clip is shown, and clips fade into each other. Levels are chosen for the camera that renders, unless
 * `motion.setLevel()` says otherwise. gltf.userData.ATH_motion holds an ATH for each motion of the file, null for one that cannot
 * be played, of which a warning tells: its meshes are as they were without the extension. Free them by `ath.dispose()`.
 */
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";
import type { ATHLoader } from "../web/ATHLoader.js";

/** For GLTFLoader.register(). The loader's settings (workers, mode, manager) hold; it may serve any number of files. */
export function athMotion(loader: ATHLoader): (parser: GLTFParser) => GLTFLoaderPlugin;
