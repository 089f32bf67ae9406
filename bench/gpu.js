// Measures the forest of forest.html, in its page: see gpu.py.
({
  // Stops the page and loads all levels.
  opened: async () => {
    const { forest, camera, ath, renderer: { backend: { device } } } = athcodecForest;
    athcodecForest.playing = false;
    forest.pixels = 1e-6; // so that all levels are wanted
    camera.position.set(0, ath.sphere.radius, 0);
    while (forest.levels.length < ath.motion.levelCount) {
      forest.update(camera, 720, 0);
      await device.queue.onSubmittedWorkDone();
      await new Promise((done) => setTimeout(done, 50));
    }
  },

  measured: async (updates) => {
    const { forest, camera, scene, renderer } = athcodecForest, { device } = renderer.backend;
    const median = (all) => all.sort((a, b) => a - b)[all.length >> 1];
    const timed = async (count, work) => {
      const found = [];
      for (let i = 0; i < count; i++) {
        const start = performance.now();
        work(i);
        found.push(performance.now() - start);
        await device.queue.onSubmittedWorkDone();
      }
      return median(found);
    };
    forest.update(camera, 720, 0);
    const before = forest.bytesOfParameters, motion = forest.bytesOfMotion;
    const update = await timed(updates, (i) => forest.update(camera, 720, i / 60));
    const parameters = (forest.bytesOfParameters - before) / updates;
    renderer.render(scene, camera);
    const render = await timed(5, () => renderer.render(scene, camera));
    return { update, render, parameters, motion, again: forest.bytesOfMotion - motion, plants: forest.plantCount,
      gpu: forest.levels.map(({ passes }) => passes.bytes), uploads: forest.levels.map(({ bytesOfMotion }) => bytesOfMotion) };
  },

  // The passes, and skinning by the shader `code`.
  besideSkinning: async (code) => {
    const { forest, ath, renderer: { backend: { device } } } = athcodecForest, { queue } = device, frames = 8;
    const timed = async (work) => {
      const found = [];
      for (let i = 0; i < 8; i++) {
        const start = performance.now();
        work(i);
        await queue.onSubmittedWorkDone();
        if (i > 0) found.push(performance.now() - start);
      }
      return found.sort((a, b) => a - b)[3];
    };
    const count = ath.channel.vertexSource.length, plants = forest.plantCount, bones = ath.branches.first.length;
    const rest = new Float32Array(8 * count), bone = new Uint32Array(rest.buffer), rows = new Float32Array(12 * frames * bones);
    ath.vertexBranch.forEach((branch, v) => {
      rest.set([...ath.rest.subarray(3 * v, 3 * v + 3), 0, 0, 0, 1], 8 * v);
      bone[8 * v + 3] = branch;
    });
    for (let m = 0; m < frames * bones; m++) rows.set([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0], 12 * m);
    const shows = new Uint32Array(6 * plants), first = (frame) => 3 * bones * (frame % frames);
    for (let i = 0; i < plants; i++) {
      shows.set([first(i), first(i + 1), first(i), first(i + 1)], 6 * i);
      new Float32Array(shows.buffer).set([0.3, 0.2], 6 * i + 4);
    }
    const buffer = (size) => device.createBuffer({ size, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
    const buffers = [rest, rows, shows].map((words) => {
      const made = buffer(words.byteLength);
      queue.writeBuffer(made, 0, words);
      return made;
    });
    buffers.push(buffer(36 * count * plants));
    const pipeline = device.createComputePipeline({ layout: "auto", compute: { module: device.createShaderModule({ code }) } });
    const set = device.createBindGroup({ layout: pipeline.getBindGroupLayout(0),
      entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })) });
    const skinning = await timed(() => {
      const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, set);
      pass.dispatchWorkgroups(Math.ceil(count / 64), plants);
      pass.end();
      queue.submit([encoder.finish()]);
    });
    for (const made of buffers) made.destroy();
    const found = [];
    for (const { level, passes, places } of forest.levels) {
      const each = Array.from({ length: plants }, (_, plant) => plant), known = [...places.values()];
      const slots = (plant, k) => [4 * plant + k % 4, 4 * plant + (k + 1) % 4];
      const show = (i) => each.map((plant) => ({ slots: slots(plant, i), weight: 0.3, previous: slots(plant, i + 3), previousWeight: 0.2 }));
      const place = (i) => each.map((plant) => ({ sources: [known[(plant + i) % known.length]], slot: slots(plant, i)[1] }));
      const shown = await timed((i) => passes.run([], show(i)));
      found.push({ level, bones, skinning, shown, placed: await timed((i) => passes.run(place(i), show(i))) });
    }
    return found;
  },
})
