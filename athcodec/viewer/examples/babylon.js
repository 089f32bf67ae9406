// A plant in Babylon.js, drawn at several places by thin instances; use it in a scene with useRightHandedSystem.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Matrix, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import "@babylonjs/core/Meshes/thinInstanceMesh.js";
import { openPlant } from "./plant.js";

export async function addPlant(scene, url, { places = [Vector3.Zero()], budget = 2 } = {}) {
  const plant = await openPlant(url), mesh = new Mesh("ath", scene), { triangles, uv, colors } = plant.mesh;
  mesh.position.fromArray(plant.origin);
  mesh.isVisible = false;
  mesh.thinInstanceAdd(places.map((place) => Matrix.Translation(place.x, place.y, place.z)));

  let shown = null;
  function show(seconds, camera = scene.activeCamera) {
    const distance = Math.min(...places.map((place) => Vector3.Distance(place.add(mesh.position), camera.globalPosition)));
    const now = plant.update(seconds, { distance, fov: camera.fov, height: scene.getEngine().getRenderHeight(), budget });
    if (!now) return shown; // Nothing is decoded yet, or the next segment is late.
    if (shown) {
      mesh.updateVerticesData(VertexBuffer.PositionKind, now.positions);
      mesh.updateVerticesData(VertexBuffer.NormalKind, now.normals);
    } else {
      Object.assign(new VertexData(), { ...now, indices: triangles, uvs: uv, colors }).applyToMesh(mesh, true);
      mesh.isVisible = true;
    }
    shown = now;
    mesh.refreshBoundingInfo(); // so that instances are culled by where the plant is now
    mesh.thinInstanceRefreshBoundingInfo(true);
    return shown;
  }
  return { plant, mesh, show };
}
