// A renderer, on a canvas of its own or, without one, for all elements of a page: a browser has few contexts of WebGL. Then each
// picture is copied to the element's canvas, and a context that the browser takes away is replaced with the next picture.

import { PCFShadowMap, Vector2, WebGLRenderer } from "three";

import { Sky } from "./sky.js";

const size = new Vector2();

export class Easel {
  stages = new Set();
  sky = new Sky();
  #canvas;
  #renderer = null;

  constructor(canvas = null) {
    this.#canvas = canvas;
  }

  get renderer() {
    if (this.#renderer) return this.#renderer;
    const pageCanvas = this.#canvas, options = { alpha: !pageCanvas, antialias: true, powerPreference: "high-performance" };
    const renderer = new WebGLRenderer(pageCanvas ? { canvas: pageCanvas, context: pageCanvas.getContext("webgl2", options) ?? undefined } : options);
    Object.assign(renderer.shadowMap, { enabled: true, type: PCFShadowMap });
    renderer.domElement.addEventListener(pageCanvas ? "webglcontextrestored" : "webglcontextlost", () => {
      if (renderer !== this.#renderer) return;
      if (!pageCanvas) this.#drop();
      for (const stage of this.stages) stage.restore();
    });
    return this.#renderer = renderer;
  }

  /** Draws by paint(renderer) onto a canvas. tone: properties of the renderer. */
  draw(canvas, opaque, tone, paint) {
    const { renderer } = this, { width, height } = canvas, { x, y } = renderer.getSize(size), isOurs = canvas === this.#canvas;
    if (width === 0 || height === 0) return;
    if (isOurs ? x !== width || y !== height : x < width || y < height)
      renderer.setSize(isOurs ? width : Math.max(x, width), isOurs ? height : Math.max(y, height), false);
    renderer.setViewport(0, 0, width, height);
    paint(Object.assign(renderer, tone));
    if (isOurs) return;
    const pen = canvas.getContext("2d", { alpha: !opaque }), { domElement } = renderer;
    pen.clearRect(0, 0, width, height);
    pen.drawImage(domElement, 0, domElement.height - height, width, height, 0, 0, width, height);
  }

  #drop() {
    this.#renderer?.dispose();
    this.#renderer = null;
  }

  /** The last stage gives the context back. */
  leave(stage) {
    this.stages.delete(stage);
    if (this.stages.size > 0) return;
    const renderer = this.#renderer;
    this.#drop();
    renderer?.forceContextLoss();
  }
}
