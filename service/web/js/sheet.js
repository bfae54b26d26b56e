// On a phone the panel is a sheet: its grip is pulled, or pressed to go on to the next height.

import { h } from "./dom.js";

const STOPS = ["peek", "half", "full"];

export function grip(panel) {
  panel.dataset.sheet ??= "half";
  let start = null;
  const to = (stop) => {
    panel.dataset.sheet = stop;
    handle.setAttribute("aria-expanded", String(stop !== "peek"));
  };
  const handle = h("button", {
    type: "button", className: "grip", "aria-label": "Height of the parameters", "aria-controls": "panel", "aria-expanded": "true",
    onpointerdown: (event) => {
      start = event.clientY;
      handle.setPointerCapture(event.pointerId);
    },
    onpointerup: (event) => {
      const moved = event.clientY - (start ?? event.clientY);
      start = null;
      if (Math.abs(moved) < 12) return;
      const at = STOPS.indexOf(panel.dataset.sheet) + (moved < 0 ? 1 : -1);
      to(STOPS[Math.min(STOPS.length - 1, Math.max(0, at))]);
      handle.dataset.pulled = "yes";
    },
    onclick: () => {
      // The click that ends a pull is none.
      if (handle.dataset.pulled) delete handle.dataset.pulled;
      else to(STOPS[(STOPS.indexOf(panel.dataset.sheet) + 1) % STOPS.length]);
    },
  });
  return handle;
}
