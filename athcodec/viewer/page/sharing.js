// Sharing: pictures, videos, links; and the page over the whole screen.

import { app, state } from "./app.js";
import { $, note } from "./ui.js";

const MOST_SECONDS = 10, FRAMES = 30, BITS = 12e6;
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

function save(blob, ending) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${app.opened[0].fileName.replace(/\.(ath|glb)$/, "")}_${state.time.toFixed(2)}s.${ending}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function picture() {
  app.stage.render();
  $("canvas").toBlob((blob) => save(blob, "png"));
}

let recorder = null;

/** One round of what plays, ten seconds of it at most; ends earlier where it is asked for again. */
function video() {
  if (recorder) {
    recorder.stop();
    return;
  }
  const type = TYPES.find((each) => globalThis.MediaRecorder?.isTypeSupported(each));
  if (!type || !$("canvas").captureStream) {
    note("This browser cannot record videos");
    return;
  }
  record(type, Math.min(MOST_SECONDS, app.limit() / state.speed || MOST_SECONDS));
}

function record(type, seconds) {
  const pieces = [], stream = $("canvas").captureStream(FRAMES);
  recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: BITS });
  recorder.ondataavailable = ({ data }) => pieces.push(data);
  const timer = setTimeout(() => recorder?.stop(), 1000 * seconds);
  recorder.onstop = () => {
    clearTimeout(timer);
    recorder = null;
    for (const track of stream.getTracks()) track.stop();
    $("video").textContent = "Save video";
    save(new Blob(pieces, { type }), type.slice(6, 10));
  };
  app.setPlaying(true);
  recorder.start();
  $("video").textContent = "Stop recording";
  note(`Recording ${seconds.toFixed(1)} seconds`);
}

// Only what lies on a web host can be reached by others.
const shared = () => location.protocol.startsWith("http") && !["127.0.0.1", "localhost", "[::1]"].includes(location.hostname);
const where = () => (shared() ? "" : ". It leads to this computer: put the page on a web host for others");

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    note(`${what} copied${where()}`);
  } catch {
    prompt(`${what}:`, text);
  }
}

function copyLink() {
  app.write();
  copy(location.href, "Link");
}

function copyEmbed() {
  app.write();
  const address = location.href.replaceAll("&", "&amp;").replaceAll('"', "&quot;");
  copy(`<iframe src="${address}" width="800" height="600" allow="fullscreen" title="${document.title.replaceAll('"', "&quot;")}"></iframe>`, "Embed code");
}

function fullscreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen().catch(() => note("This browser does not let the page fill the screen"));
}

export default function begin() {
  Object.assign(app, { picture, video, fullscreen });
  $("picture").addEventListener("click", picture);
  $("video").addEventListener("click", video);
  $("link").addEventListener("click", copyLink);
  $("embed").addEventListener("click", copyEmbed);
  $("fullscreen").addEventListener("click", fullscreen);
  $("fullscreen").hidden = !document.fullscreenEnabled;
  addEventListener("fullscreenchange", () => $("fullscreen").setAttribute("aria-pressed", String(Boolean(document.fullscreenElement))));
}
