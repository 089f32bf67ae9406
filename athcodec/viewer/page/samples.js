// What a page without a file begins with: samples that move, and a field for the address of a file.

import { ATHViewerElement } from "../src/element.js";

import { app } from "./app.js";
import { $ } from "./ui.js";

const FOLDER = "../../sample/"; // beside the viewer in the package and on the documentation's site
const CLIP = "gale";
const ALONE = "Open an .ath file, or a GLB that holds one. A file of yours stays on this device.";

const buttons = () => [...$("samples").querySelectorAll("button")];

function beginStart() {
  $("samples").hidden = $("where").hidden = false;
  for (const button of buttons()) {
    const element = button.querySelector(ATHViewerElement.tag);
    element.addEventListener("error", () => dropSample(button), { once: true });
    element.setAttribute("clip", CLIP);
    const still = element.querySelector("img");
    still.src = FOLDER + still.dataset.still;
    element.src = FOLDER + button.dataset.file;
  }
}

// A host of the viewer's folder alone has no samples.
function dropSample(button) {
  button.parentElement.remove();
  if (buttons().length > 0) return;
  $("samples").hidden = true;
  $("message").querySelector("p").textContent = ALONE;
}

function endStart() {
  $("samples").hidden = $("where").hidden = true;
  for (const button of buttons()) button.querySelector(ATHViewerElement.tag).removeAttribute("src");
}

// The address then names what is shown, as a link does.
function openNamed(url) {
  try {
    history.pushState(null, "", `?file=${encodeURIComponent(url)}`);
  } catch {
    // A frame may not change its address.
  }
  app.open(url, app.nameOf(url));
}

export default function begin() {
  Object.assign(app, { beginStart, endStart });
  $("samples").addEventListener("click", ({ target }) => {
    const button = target.closest("button");
    if (button) openNamed(FOLDER + button.dataset.file);
  });
  $("where").addEventListener("submit", (event) => {
    event.preventDefault();
    openNamed($("where").querySelector("input").value);
  });
}
