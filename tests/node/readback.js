// In the viewer's page, where the vertex shader puts vertices, read back from the graphics processor: one pixel per vertex.
(() => {
  const WIDTH = 256;

  /** 3 numbers for each vertex of these attributes; `moved` is what the shader works out, `defines` what it is for. */
  globalThis.readback = async (attributes, uniforms, { moved = "athMoved(position, athPart)", defines = {} } = {}) => {
    const { three, loading: { MOTION_PARS } } = athcodecViewer.modules, { renderer } = athcodecViewer.stage;
    const { count } = attributes.position, height = Math.ceil(count / WIDTH), geometry = new three.BufferGeometry();
    for (const [name, attribute] of Object.entries(attributes)) geometry.setAttribute(name, attribute);
    geometry.setAttribute("pixel", new three.BufferAttribute(Float32Array.from({ length: 2 * count }, (_, i) =>
      (i % 2 ? (Math.floor(i / 2 / WIDTH) + 0.5) / height : ((i / 2) % WIDTH + 0.5) / WIDTH) * 2 - 1), 2));
    const material = new three.ShaderMaterial({
      uniforms, defines, depthTest: false,
      vertexShader: `attribute vec2 pixel; varying vec3 moved; ${MOTION_PARS}
        void main() { moved = ${moved}; gl_Position = vec4(pixel, 0.0, 1.0); gl_PointSize = 1.0; }`,
      fragmentShader: "varying vec3 moved; void main() { gl_FragColor = vec4(moved, 1.0); }",
    });
    const points = new three.Points(geometry, material), scene = new three.Scene().add(points);
    points.frustumCulled = false;
    const target = new three.WebGLRenderTarget(WIDTH, height, { type: three.FloatType, format: three.RGBAFormat,
      minFilter: three.NearestFilter, magFilter: three.NearestFilter, depthBuffer: false });
    const pixels = new Float32Array(4 * WIDTH * height);
    renderer.setRenderTarget(target);
    renderer.render(scene, new three.OrthographicCamera());
    renderer.readRenderTargetPixels(target, 0, 0, WIDTH, height, pixels);
    renderer.setRenderTarget(null);
    for (const each of [geometry, material, target]) each.dispose();
    return Array.from({ length: 3 * count }, (_, i) => pixels[4 * Math.floor(i / 3) + (i % 3)]);
  };

  /** Of the picture that is shown, in source order: positions, or what becomes of the normals of the rest pose. */
  globalThis.onGraphics = async (what = "positions") => {
    const { BufferAttribute, BufferGeometry } = athcodecViewer.modules.three, { ath, motion } = athcodecViewer.plants.at(-1), geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(ath.rest, 3));
    if (what === "normals") geometry.setAttribute("normal", ath.geometry.getAttribute("normal"));
    geometry.userData.source = Uint32Array.from({ length: ath.rest.length / 3 }, (_, i) => i);
    motion.attach(geometry);
    const found = await readback(geometry.attributes, motion.uniforms, what === "normals" ? { moved: "normalize(athTurned(normal, athPart))" } : {});
    motion.detach(geometry);
    return found;
  };
})();
