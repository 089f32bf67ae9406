// The shadow that a plant casts on the ground, in the viewer's page or, on WebGPU, the forest's: how many of its vertices are over dark pixels, and how many
// pixels change as it moves.
async (mode) => {
  const onNodes = !window.athcodecViewer, { three, loading: { ATHLoader } } = (window.athcodecViewer ?? athcodecForest).modules;
  const renderer = onNodes ? new three.WebGPURenderer() : athcodecViewer.stage.renderer;
  await renderer.init?.();
  const loader = new ATHLoader().setMode(mode), url = new URLSearchParams(location.search).get("file");
  const ath = await loader.loadAsync(url), scene = new three.Scene(), found = {};
  await ath.loaded;
  const size = ath.sphere.radius, [drawn] = ath.object.children;
  drawn.castShadow = true;
  const ground = new three.Mesh(new three.CircleGeometry(6 * size, 64), new three.MeshLambertMaterial({ color: 0xffffff, side: three.DoubleSide }));
  ground.receiveShadow = true;
  ground.position.set(ath.sphere.center.x, ath.sphere.center.y, ath.box.min.z - size);
  const camera = new three.OrthographicCamera(-2 * size, 2 * size, 2 * size, -2 * size, 0.01 * size, 20 * size);
  camera.position.copy(ground.position).z += 0.5 * size; // between the ground and the plant
  const light = new three.DirectionalLight(0xffffff, 3);
  light.position.copy(ath.sphere.center).z += 4 * size;
  light.target.position.copy(ath.sphere.center);
  Object.assign(light.shadow.camera, { left: -2 * size, right: 2 * size, top: 2 * size, bottom: -2 * size, near: 0.1 * size, far: 12 * size });
  light.castShadow = true;
  scene.add(ath.object, ground, light, light.target);
  const target = new (onNodes ? three.RenderTarget : three.WebGLRenderTarget)(256, 256), { enabled } = renderer.shadowMap;
  renderer.shadowMap.enabled = true;
  ground.material.needsUpdate = true;
  const picture = async (seconds) => {
    await ath.motion.show(seconds, ath.motion.levelCount - 1);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    const pixels = onNodes ? await renderer.readRenderTargetPixelsAsync(target, 0, 0, 256, 256) : new Uint8Array(4 * 256 * 256);
    if (!onNodes) renderer.readRenderTargetPixels(target, 0, 0, 256, 256, pixels);
    renderer.setRenderTarget(null);
    return pixels.filter((_, i) => i % 4 === 0);
  };
  const a = await picture(0), b = await picture(0.5), white = a.reduce((x, y) => Math.max(x, y), 0);
  // where the vertices are, seen from the light: along z
  const at = await ath.motion.positions(0.5), dark = b.map((value) => value < 0.5 * white);
  let covered = 0;
  const row = (v) => (onNodes ? 255 - v : v); // of the picture, which WebGPU has the top first of
  for (let i = 0; i < at.length; i += 3) {
    const u = Math.floor((at[i] - ground.position.x + 2 * size) / (4 * size) * 256), v = Math.floor((at[i + 1] - ground.position.y + 2 * size) / (4 * size) * 256);
    let near = false;
    for (let p = u - 2; p <= u + 2; p++) for (let q = v - 2; q <= v + 2; q++) near ||= dark[256 * row(q) + p] === 1;
    covered += near;
  }
  found.covered = covered / (at.length / 3);
  found.dark = dark.reduce((x, y) => x + y, 0);
  found.changed = a.reduce((sum, value, i) => sum + (Math.abs(value - b[i]) > 0.3 * white), 0);
  renderer.shadowMap.enabled = enabled;
  ath.dispose();
  if (onNodes) renderer.dispose();
  loader.dispose();
  return found;
}
