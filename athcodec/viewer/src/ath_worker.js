// The worker of ATHLoader: one or more files, each a Session. Messages carry the number of their file. The first message of a file
// is "open"; its Session takes all others.

import { ready } from "../ath_decoder.mjs";
import { describe, Session } from "./session.js";
import { HttpSource, MemorySource, PacedSource } from "./source.js";

const sessions = new Map();

function open({ file, url, options, bytes, clip, hostMesh, bandwidth }) {
  const post = (message, arrays = []) => self.postMessage({ ...message, file, sent: performance.timeOrigin + performance.now() },
    arrays.filter(Boolean).map((array) => array.buffer));
  const source = bytes ? new MemorySource(new Uint8Array(bytes)) : new HttpSource(url, options);
  const session = new Session(bandwidth ? new PacedSource(source, bandwidth / 8) : source, post, clip, hostMesh);
  sessions.set(file, session);
  ready.then(() => session.run(), (error) => post({ type: "failed", ...describe(error) }));
}

function take(data) {
  const session = sessions.get(data.file);
  if (data.type === "open") open(data);
  else session?.take(data);
  if (data.type === "close") sessions.delete(data.file);
}

self.onmessage = ({ data }) => {
  try {
    take(data);
  } catch (error) {
    self.postMessage({ type: "failed", file: data.file, ...describe(error) });
  }
};
