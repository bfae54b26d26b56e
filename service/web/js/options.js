// How a file is to be read, where the user knows better.

import { $, h } from "./dom.js";
import { keyring } from "./key.js";
import { categories } from "./service.js";

const FIELDS = ["category", "up", "front", "units"];

export class Options {
  constructor() {
    for (const name of ["up", "front"]) {
      for (const way of ["+x", "-x", "+y", "-y", "+z", "-z"]) {
        $(`option-${name}`).append(h("option", { value: way }, way.toUpperCase().replace("-", "\u2212")));
      }
    }
    this.list();
    keyring.addEventListener("change", () => this.list());
  }

  async list() {
    try {
      const found = await categories();
      const select = $("option-category");
      const old = new Set([...select.options].map((option) => option.value));
      for (const { name, label } of found) {
        if (!old.has(name)) select.append(h("option", { value: name }, label));
      }
    } catch {
      // The list is a convenience: "find out" works without it.
    }
  }

  /** The fields that differ from the defaults. */
  fields() {
    const chosen = Object.fromEntries(FIELDS.map((name) => [name, $(`option-${name}`).value]));
    if (chosen.units === "m") delete chosen.units;
    return Object.fromEntries(Object.entries(chosen).filter(([, value]) => value !== "auto"));
  }
}
