// One slider: a native range, a number, what was inferred, and a way back.

import { h, icon } from "./dom.js";

const share = (value, [low, high]) => Math.min(1, Math.max(0, (value - low) / (high - low || 1)));

export class Row {
  /**
   * @param entry of the parameter, as the notes have it
   * @param on {input(value), commit(), reset()}
   * @param short a label for where the group says the rest
   */
  constructor(name, entry, units, on, short) {
    Object.assign(this, { name, entry, units, on });
    const [low, high] = entry.range;
    this.range = [Math.min(low, entry.value), Math.max(high, entry.value)];
    const id = `p-${name}`;
    this.slider = h("input", {
      type: "range", id, min: this.range[0], max: this.range[1], step: "any", "aria-describedby": `${id}-meta`,
    });
    // After the limits: a range takes its value within those it has.
    this.slider.value = entry.value;
    this.number = h("input", { type: "text", inputMode: "decimal", autocomplete: "off", id: `${id}-number` });
    this.suffix = h("span", { "aria-hidden": "true" });
    this.back = h("button", {
      type: "button", className: "undo-one", title: "Back to what was inferred", "aria-label": `Reset ${entry.label}`,
      onclick: () => this.on.reset(),
    }, icon("reset"));
    this.meta = h("p", { className: "row-meta", id: `${id}-meta` });
    this.warn = h("p", { className: "row-warn", hidden: true });
    this.track = h("div", { className: "slide" },
      h("span", { className: "rail" }), h("span", { className: "sigma" }), h("span", { className: "fill" }),
      h("span", { className: "origin" }), this.slider);
    const label = h("label", { className: "row-label", for: id },
      short ? h("span", { className: "sr" }, entry.label) : entry.label,
      short ? h("span", { "aria-hidden": "true" }, short) : null);
    const value = h("div", { className: "row-value" }, this.back, h("label", { className: "number" }, this.number, this.suffix));
    this.element = h("div", { className: "row", dataset: { parameter: name } },
      ...(short ? [label, this.track, value, this.meta] : [label, value, this.track, this.meta]), this.warn);
    this.listen();
    this.marks();
  }

  listen() {
    this.slider.addEventListener("input", () => this.on.input(Number(this.slider.value)));
    this.slider.addEventListener("change", () => this.on.commit());
    this.slider.addEventListener("keydown", (event) => this.key(event));
    this.number.addEventListener("change", () => this.typed());
    this.number.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.typed();
      if (event.key === "ArrowUp" || event.key === "ArrowDown") this.key(event);
    });
    this.number.addEventListener("focus", () => this.number.select());
  }

  /** A range of step "any" would move by hundredths of its length: move by the parameter's step. */
  key(event) {
    const ways = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 };
    const way = ways[event.key];
    if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const step = this.entry.step || (this.range[1] - this.range[0]) / 100;
    const moved = this.value + way * step * (event.shiftKey ? 10 : 1);
    this.on.input(Math.min(this.range[1], Math.max(this.range[0], moved)));
    this.on.commit();
  }

  typed() {
    const value = Number(this.number.value.trim().replace(",", "."));
    const shown = this.units.number(this.value, this.entry.unit);
    if (!Number.isFinite(value) || this.number.value.trim() === "" || this.number.value === shown) {
      this.number.value = shown;
      return;
    }
    this.on.input(this.units.fromShown(value, this.entry.unit));
    this.on.commit();
  }

  /** Show a value; one beyond the slider's ends, typed, widens it. */
  update(value, original) {
    this.value = value;
    if (value < this.range[0] || value > this.range[1]) {
      this.range = [Math.min(value, this.range[0]), Math.max(value, this.range[1])];
      [this.slider.min, this.slider.max] = this.range;
      this.marks();
    }
    if (Number(this.slider.value) !== value) this.slider.value = value;
    const { unit } = this.entry;
    const text = this.units.text(value, unit);
    this.slider.setAttribute("aria-valuetext", text);
    this.number.value = this.units.number(value, unit);
    this.back.disabled = value === original;
    const [from, to] = [share(original, this.range), share(value, this.range)].sort((a, b) => a - b);
    this.track.style.setProperty("--f0", from);
    this.track.style.setProperty("--f1", to);
  }

  /** What was inferred, on the rail and in words; again whenever the unit or the ends change. */
  marks() {
    const { value, sigma, unit, range, label } = this.entry;
    this.track.style.setProperty("--o", share(value, this.range));
    this.track.style.setProperty("--s0", share(value - sigma, this.range));
    this.track.style.setProperty("--s1", share(value + sigma, this.range));
    const { units } = this;
    this.suffix.textContent = units.label(unit);
    this.number.setAttribute("aria-label", `${label} in ${units.spoken(unit)}`);
    this.meta.replaceChildren(
      h("span", {}, `found ${units.number(value, unit)} ± ${units.text(sigma, unit)}`),
      h("span", {}, `range ${units.number(range[0], unit)} – ${units.text(range[1], unit)}`));
  }

  caution(text) {
    this.warn.hidden = !text;
    this.warn.textContent = text ?? "";
  }
}
