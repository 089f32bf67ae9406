// The disc of shadow under a plant, at every quality: light from all sides does not come below it.

import { CircleGeometry, Color, Mesh, ShaderMaterial } from "three";

const DARKEST = { alone: 0.55, cast: 0.35 }; // without and with the sun's own shadow

const VERTEX = "varying vec2 at; void main() { at = position.xy; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = /* glsl */`
uniform float darkest;
uniform vec3 colour;
varying vec2 at;
void main() {
  float far = length(at), soft = 0.55 * exp(-7.0 * far * far) + 0.45 * exp(-60.0 * far * far);
  gl_FragColor = vec4(colour, darkest * soft * smoothstep(1.0, 0.8, far));
  #include <colorspace_fragment>
}`;

export function shadowDisc() {
  const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthWrite: false,
    uniforms: { darkest: { value: DARKEST.alone }, colour: { value: new Color(0x0b1208) } }, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 });
  const mesh = new Mesh(new CircleGeometry(1, 48), material);
  mesh.name = "under";
  mesh.rotation.x = -Math.PI / 2;
  mesh.renderOrder = -1;
  return mesh;
}

/** Puts it around a foot, a Vector3 of the world; null: none, as in forests. cast: whether the sun casts a shadow, too. */
export function layShadow(mesh, foot, size, cast) {
  mesh.visible = foot !== null;
  if (foot) mesh.position.copy(foot);
  mesh.scale.setScalar(0.55 * size);
  mesh.material.uniforms.darkest.value = cast ? DARKEST.cast : DARKEST.alone;
}
