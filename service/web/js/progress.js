// How far an upload is: sending, inferring, receiving.

import { $ } from "./dom.js";

export class Progress {
  constructor() {
    this.stages = {
      uploading: (share) => this.tell(share === null || share === 1 ? "Uploading" : `Uploading ${Math.round(100 * share)}\u202f%`, share),
      waiting: () => this.tell("Finding its parameters", null),
      receiving: () => this.tell("Almost there", null),
    };
  }

  start(name, cancel) {
    this.name = name;
    $("progress").hidden = false;
    document.body.setAttribute("aria-busy", "true");
    $("cancel").onclick = cancel;
    this.tell("Opening", null);
  }

  /** A share of 0 to 1, or null where there is no telling. */
  tell(text, share) {
    const bar = $("progress-bar");
    $("progress-text").textContent = text === "Opening" ? `Opening ${this.name}` : text;
    if (share === null) bar.removeAttribute("value");
    else bar.value = share;
  }

  stop() {
    $("progress").hidden = true;
    document.body.removeAttribute("aria-busy");
  }
}
