// The settings, and on small screens what is told of the file: shown or not.

import { app } from "./app.js";
import { $ } from "./ui.js";

export function togglePanel() {
  const hidden = document.body.classList.toggle("no-panel");
  $("toggle-panel").setAttribute("aria-expanded", String(!hidden));
  app.stage?.fit();
}

$("toggle-panel").addEventListener("click", togglePanel);

$("more").addEventListener("click", () => {
  $("more").setAttribute("aria-expanded", String(document.body.classList.toggle("told")));
});
