// A plant in PlayCanvas, as an ESM script: entity.addComponent("script"); entity.script.create(AthPlant, { properties: { url } }).
import { Entity, Mesh, MeshInstance, Script, StandardMaterial, math } from "playcanvas";
import { openPlant } from "./plant.js";

export class AthPlant extends Script {
  static scriptName = "athPlant";

  /** @attribute */
  url = "";
  /** @attribute @type {Entity} */
  camera = null;
  /** Milliseconds of decoding in a frame.
   * @attribute */
  budget = 2;
  seconds = 0;

  async initialize() {
    this.plant = await openPlant(this.url);
    const { mesh, origin } = this.plant, { app } = this;
    this.mesh = new Mesh(app.graphicsDevice);
    if (mesh.uv) this.mesh.setUvs(0, mesh.uv);
    this.mesh.setIndices(mesh.triangles);
    this.material = Object.assign(new StandardMaterial(), { twoSidedLighting: true, cull: 0 }); // leaves have two sides
    this.object = new Entity("ath");
    this.object.setLocalPosition(...origin);
    this.entity.addChild(this.object);
  }

  update(dt) {
    if (!this.object) return; // The front of the file is still to come.
    this.seconds += dt;
    const { budget } = this, { height } = this.app.graphicsDevice, fov = this.camera.camera.fov * math.DEG_TO_RAD; // horizontalFov: false
    const distance = this.camera.getPosition().distance(this.object.getPosition());
    this.shown = this.plant.update(this.seconds, { distance, fov, height, budget }) ?? this.shown;
    if (!this.shown) return;
    this.mesh.setPositions(this.shown.positions);
    this.mesh.setNormals(this.shown.normals);
    this.mesh.update(); // The box for culling follows from the positions.
    if (!this.object.render) this.object.addComponent("render", { meshInstances: [new MeshInstance(this.mesh, this.material)] });
  }
}
