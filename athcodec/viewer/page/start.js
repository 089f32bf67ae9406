// What the page begins before its modules are here: the worker, and the file's front. A classic script without imports, so that
// the decoder and the file come while three.js does.

const FIRST_BYTES = 12 << 10; // as the download's first request

// The answer in parts that a worker can be sent; null where the loader has to ask for itself.
async function frontOf(url) {
  const stop = new AbortController(), headers = { Range: `bytes=0-${FIRST_BYTES - 1}` };
  try {
    const answer = await fetch(url, { headers, cache: "no-store", signal: stop.signal });
    if (answer.status === 206) return { status: 206, headers: [...answer.headers], bytes: await answer.arrayBuffer() };
    stop.abort(); // A whole file would have to come before the worker had any of it.
  } catch {
    // The loader tries it several times.
  }
  return null;
}

const file = new URLSearchParams(location.search).get("file"), isModel = /\.glb([?#]|$)/i.test(file);
try {
  globalThis.athcodecBegun = {
    worker: new Worker(new URL("ath_worker.js", location.href), { type: "module" }),
    url: file && !isModel ? new URL(file, location.href).href : null, front: file && !isModel ? frontOf(file) : null,
  };
} catch {
  // The loader says why there can be no worker.
}
