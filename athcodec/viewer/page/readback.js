// Where the vertex shader puts the vertices, read back from the graphics processor: one pixel per vertex.

import { BufferAttribute, BufferGeometry, FloatType, NearestFilter, OrthographicCamera, Points, RGBAFormat, Scene, ShaderMaterial,
  WebGLRenderTarget } from "three";
import { MOTION_PARS } from "athcodec-three";

const WIDTH = 256;

/** 3 numbers per vertex in source order, of the picture that `motion` shows: positions, or where `normals` (of the rest
 * pose, likewise) are given, what becomes of those. */
export function readback(renderer, ath, motion, normals = null) {
  const count = ath.rest.length / 3, height = Math.ceil(count / WIDTH), geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(ath.rest, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals ?? ath.rest, 3));
  geometry.setAttribute("pixel", new BufferAttribute(Float32Array.from({ length: 2 * count }, (_, i) =>
    (i % 2 ? (Math.floor(i / 2 / WIDTH) + 0.5) / height : ((i / 2) % WIDTH + 0.5) / WIDTH) * 2 - 1), 2));
  geometry.userData.source = Uint32Array.from({ length: count }, (_, i) => i);
  motion.attach(geometry);
  const material = new ShaderMaterial({
    uniforms: motion.uniforms, depthTest: false,
    vertexShader: `attribute vec2 pixel; varying vec3 moved; ${MOTION_PARS}
      void main() { moved = ${normals ? "normalize(athTurned(normal, athPart))" : "athMoved(position, athPart)"}; gl_Position = vec4(pixel, 0.0, 1.0); gl_PointSize = 1.0; }`,
    fragmentShader: "varying vec3 moved; void main() { gl_FragColor = vec4(moved, 1.0); }",
  });
  const points = new Points(geometry, material), scene = new Scene();
  points.frustumCulled = false;
  scene.add(points);
  const target = new WebGLRenderTarget(WIDTH, height, { type: FloatType, format: RGBAFormat, minFilter: NearestFilter, magFilter: NearestFilter,
    depthBuffer: false });
  renderer.setRenderTarget(target);
  renderer.render(scene, new OrthographicCamera());
  const pixels = new Float32Array(4 * WIDTH * height), out = new Float32Array(3 * count);
  renderer.readRenderTargetPixels(target, 0, 0, WIDTH, height, pixels);
  renderer.setRenderTarget(null);
  for (let i = 0; i < count; i++) out.set(pixels.subarray(4 * i, 4 * i + 3), 3 * i);
  motion.detach(geometry);
  for (const each of [geometry, material, target]) each.dispose();
  return out;
}
