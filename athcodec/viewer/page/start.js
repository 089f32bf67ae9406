// What the page begins before its modules are here: the worker, and the file's front. A classic script without imports, so that
// the decoder and the file come while three.js does.

const FIRST_BYTES = 12 << 10; // as the download's first request

// Hands the pieces of an answer to whoever gets the port, as they come: null is the end, and false a connection that was cut
// off. Any answer ends the download.
function piecesOf(body, stop) {
  const { port1, port2 } = new MessageChannel(), reader = body.getReader();
  const next = () => reader.read().then(({ done, value }) => {
    port1.postMessage(done ? null : value, done ? [] : [value.buffer]);
    if (!done) next();
  }, () => port1.postMessage(false));
  port1.onmessage = () => stop.abort();
  next();
  return port2;
}

// The answer in parts that a worker can be sent; null where the loader has to ask for itself.
async function frontOf(url) {
  const stop = new AbortController();
  try {
    const answer = await fetch(url, { headers: { Range: `bytes=0-${FIRST_BYTES - 1}` }, cache: "no-store", signal: stop.signal });
    const { status } = answer, headers = [...answer.headers];
    // A server without ranges answers with the whole file, and status 200.
    if (status === 206 || status === 200) return { status, headers, port: piecesOf(answer.body, stop) };
    stop.abort();
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
