// Dark or light: the system's choice until the user has another, which is kept.

import { h, icon } from "./dom.js";

const KEY = "shape-parameters-theme";
const ORDER = ["auto", "light", "dark"];
const LOOK = { auto: ["auto", "as the system"], light: ["sun", "light"], dark: ["moon", "dark"] };
const system = matchMedia("(prefers-color-scheme: dark)");

export class Theme extends EventTarget {
  constructor(button) {
    super();
    this.button = button;
    this.choice = ORDER.includes(stored()) ? stored() : "auto";
    button.addEventListener("click", () => {
      this.choice = ORDER[(ORDER.indexOf(this.choice) + 1) % ORDER.length];
      try {
        localStorage.setItem(KEY, this.choice);
      } catch {
        // Without storage the choice holds for this visit.
      }
      this.apply();
    });
    system.addEventListener("change", () => this.apply());
    this.apply();
  }

  apply() {
    const dark = this.choice === "dark" || (this.choice === "auto" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    const [picture, words] = LOOK[this.choice];
    this.button.replaceChildren(icon(picture), h("span", { className: "sr" }, `Colour theme: ${words}`));
    this.button.setAttribute("aria-label", `Colour theme: ${words}`);
    this.button.title = `Colour theme: ${words}`;
    this.dispatchEvent(new Event("change"));
  }
}

function stored() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}
