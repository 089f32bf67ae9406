// The settings, and on small screens what is told of the file: shown or not; whether there is a plant for them.

import { app } from "./app.js";
import { $ } from "./ui.js";

const NEED_A_PLANT = "footer, #clip, #levels, #panel section:not(.grid), #picture, #video, #link, #embed";

function togglePanel() {
  const hidden = document.body.classList.toggle("no-panel");
  $("toggle-panel").setAttribute("aria-expanded", String(!hidden));
  app.stage?.fit();
}

/** Whether the controls of a plant can be used: while there is none on the stage, they would reach into nothing. */
function enableControls(enabled) {
  for (const each of document.querySelectorAll(NEED_A_PLANT)) each.inert = !enabled;
}

export default function begin() {
  Object.assign(app, { togglePanel, enableControls });
  enableControls(false);
  if (matchMedia("(max-width: 42.5em), (max-height: 30em)").matches) togglePanel();
  $("toggle-panel").addEventListener("click", togglePanel);
  $("more").addEventListener("click", () => {
    $("more").setAttribute("aria-expanded", String(document.body.classList.toggle("told")));
    app.stage?.fit();
  });
}
