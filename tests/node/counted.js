// Before a page begins: `contexts` gets its contexts of WebGL, `living` how many objects of each kind are in them.
globalThis.contexts = [];
globalThis.living = {};
const { getContext } = HTMLCanvasElement.prototype, { prototype } = WebGL2RenderingContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  const context = getContext.call(this, kind, ...more);
  if (/webgl/.test(kind) && context && !contexts.includes(context)) contexts.push(context);
  return context;
};
for (const what of ["Buffer", "Texture", "Framebuffer", "Program", "VertexArray"])
  for (const [verb, by] of [["create", 1], ["delete", -1]]) {
    const call = prototype[verb + what];
    prototype[verb + what] = function (object) {
      if (verb === "create" || object) living[what] = (living[what] ?? 0) + by;
      return call.call(this, object);
    };
  }
