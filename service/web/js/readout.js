// Derived dimensions: live while sliders move, and settable themselves.

import { h } from "./dom.js";

const WAYS = { set: "exactly", min: "at least", max: "at most" };

export class Readout {
  /** @param ask (name, {set|min|max: value} or null) carries a wish out */
  constructor(shape, units, ask) {
    Object.assign(this, { shape, units, ask });
    this.values = {};
    this.rows = new Map();
    const summary = h("summary", {}, "Dimensions");
    this.element = h("details", { className: "group", open: true, dataset: { group: "dimensions" } }, summary);
    for (const [name, entry] of shape.derived) this.add(name, entry);
    this.element.append(h("p", { className: "hint" },
      "Type a value to ask for it: what you set by hand stays, the rest changes as little as it can."));
    units.addEventListener("change", () => this.write());
  }

  add(name, entry) {
    const number = h("input", { type: "text", inputMode: "decimal", autocomplete: "off", id: `d-${name}` });
    const suffix = h("span", { "aria-hidden": "true" });
    const way = h("select", { "aria-label": `${entry.label}: exactly, at least or at most` },
      ...Object.entries(WAYS).map(([value, text]) => h("option", { value }, text)));
    const asked = h("p", { className: "asked", hidden: true });
    const row = { entry, number, suffix, way, asked };
    const wish = () => {
      const value = Number(number.value.trim().replace(",", "."));
      const now = this.values[name];
      const shown = now === null || now === undefined ? "" : this.units.number(now, entry.unit);
      if (!Number.isFinite(value) || number.value.trim() === "" || (number.value === shown && way.value === "set")) {
        this.write();
        return;
      }
      this.ask(name, { [way.value]: this.units.fromShown(value, entry.unit) });
    };
    number.addEventListener("change", wish);
    number.addEventListener("focus", () => number.select());
    this.rows.set(name, row);
    this.element.append(h("div", { className: "dimension", dataset: { dimension: name } },
      h("label", { className: "row-label", for: `d-${name}` }, entry.label), way,
      h("span", { className: "number" }, number, suffix), asked));
  }

  /** Measure all; null where there is no telling. */
  measure(values = this.shape.values) {
    this.values = Object.fromEntries([...this.rows.keys()].map((name) => [name, this.shape.dimension(name, values)]));
    this.write();
    return this.values;
  }

  write() {
    for (const [name, row] of this.rows) {
      const { entry, number, suffix } = row;
      const value = this.values[name];
      suffix.textContent = this.units.label(entry.unit);
      number.value = value === null || value === undefined ? "…" : this.units.number(value, entry.unit);
      number.setAttribute("aria-label", `${entry.label} in ${this.units.spoken(entry.unit)}`);
      this.writeAsked(name, row, value);
    }
  }

  writeAsked(name, { entry, asked, way }, value) {
    const wish = this.shape.asked[name];
    asked.hidden = !wish;
    if (!wish) return;
    const [kind, target] = Object.entries(wish)[0];
    way.value = kind;
    const slack = 10 ** -this.units.digits(entry.unit);
    const off = this.units.toShown(value - target, entry.unit);
    const met = value === null || (kind === "min" ? off > -slack : kind === "max" ? off < slack : Math.abs(off) < slack);
    asked.classList.toggle("unmet", !met);
    const text = `asked for ${WAYS[kind]} ${this.units.text(target, entry.unit)}${met ? "" : ", moved away since"}`;
    asked.replaceChildren(h("span", {}, text));
    if (!met) asked.append(h("button", { type: "button", className: "button", onclick: () => this.ask(name, wish) }, "Ask again"));
    asked.append(h("button", {
      type: "button", className: "button", "aria-label": `Forget what was asked of ${entry.label}`, onclick: () => this.ask(name, null),
    }, "Forget"));
  }
}
