// The panel: what the mesh was read as, its sliders and dimensions, and the way home.

import { h, icon } from "./dom.js";
import { grip } from "./sheet.js";
import { Units } from "./units.js";

const FORMATS = { "": "Original format", glb: "GLB", obj: "OBJ", stl: "STL", ply: "PLY" };

/**
 * Fill the panel.
 *
 * @param parts {shape, units, sliders, readout, snippet}
 * @param on {download(format), format(format)}
 */
export function fillPanel(panel, { shape, units, sliders, readout, snippet, file }, on) {
  const format = h("select", { "aria-label": "Format of the download", onchange: () => on.format(format.value) },
    ...Object.entries(FORMATS)
      .filter(([value]) => value === "" || !file.name.toLowerCase().endsWith(`.${value}`))
      .map(([value, text]) => h("option", { value }, text)));
  const download = h("button", {
    type: "button", className: "button primary", id: "download", onclick: () => on.download(format.value),
  }, icon("download"), "Download");
  const body = h("div", { className: "panel-body" });
  const { warnings = [] } = shape.notes;
  if (warnings.length) body.append(h("ul", { className: "warnings", "aria-label": "Warnings" }, ...warnings.map((text) => h("li", {}, capital(text) + "."))));
  body.append(sliders.element);
  if (shape.derived.size) body.append(readout.element);
  panel.replaceChildren(
    grip(panel),
    head(shape, units, sliders),
    body,
    h("div", { className: "panel-foot" }, h("div", { className: "take" }, download, format), snippet.element));
  panel.hidden = false;
}

function head(shape, units, sliders) {
  const { category, fit } = shape.notes;
  const score = fit?.score === undefined ? null : h("span", {
    className: "fit", title: `How much it looks and fits like one: ${fit.score.toFixed(2)} of 1`,
  }, `fits ${Math.round(100 * fit.score)}\u202f%`);
  const choices = h("div", { className: "switch", role: "radiogroup", "aria-label": "Unit of length" },
    ...Units.choices.map((unit) => h("label", {}, h("input", {
      type: "radio", name: "unit", value: unit, checked: units.unit === unit, "aria-label": unit, onchange: () => units.choose(unit),
    }), unit)));
  const tools = h("div", { className: "panel-tools" }, choices);
  if (shape.isBody) {
    tools.append(h("label", { className: "check" }, h("input", {
      type: "checkbox", id: "symmetric", onchange: (event) => { sliders.symmetric = event.target.checked; },
    }), "Both sides"));
  }
  return h("div", { className: "panel-head" },
    h("div", { className: "panel-title" }, h("h2", {}, capital({ human: "person" }[category] ?? category.replaceAll("_", " "))), score), tools);
}

const capital = (text) => text[0].toUpperCase() + text.slice(1);
