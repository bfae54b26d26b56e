// The toolbar under the view: history, and ways of looking.

import { h, icon } from "./dom.js";

const MODIFIER = /Mac|iPhone|iPad/.test(navigator.platform) ? "⌘" : "Ctrl+";
/** A press longer than this shows the other picture only while it lasts. */
const HOLD = 350;

export class Tools {
  /** @param on {undo, redo, reset, compare(on), wires(on), lines(on), joints(on), template(on), frame} */
  constructor(element, on) {
    this.on = on;
    this.element = element;
    const button = (name, text, title, run) => h("button", {
      type: "button", className: "button", title, dataset: { tool: name }, onclick: run,
    }, icon(name), h("span", { className: "text" }, text));
    const toggle = (name, text, title, run) => {
      const made = button(name, text, title, () => this.press(name, !this.pressed(name)));
      made.setAttribute("aria-pressed", "false");
      made.run = run;
      return made;
    };
    const rule = () => h("span", { className: "rule", "aria-hidden": "true" });
    this.buttons = {
      undo: button("undo", "", `Undo (${MODIFIER}Z)`, on.undo),
      redo: button("redo", "", `Redo (${MODIFIER}Shift+Z)`, on.redo),
      reset: button("reset", "Reset", "Reset all: back to the mesh as it came", on.reset),
      compare: toggle("compare", "Before", "Show the mesh as it came: press or hold", on.compare),
      wire: toggle("wire", "Wires", "Show the edges of the mesh", on.wires),
      ruler: toggle("ruler", "Sizes", "Show dimension lines", on.lines),
      joints: toggle("joints", "Joints", "Show the joints: press one for its sliders", on.joints),
      template: toggle("template", "Template", "Show the fitted template over the mesh", on.template),
      frame: button("frame", "", "Look at all of it (0 in the view)", on.frame),
    };
    for (const [name, made] of Object.entries(this.buttons)) {
      if (!made.textContent) made.append(h("span", { className: "sr" }, made.title));
      made.setAttribute("aria-label", { undo: "Undo", redo: "Redo", reset: "Reset all", compare: "Before the edit", wire: "Wireframe", ruler: "Dimension lines", joints: "Joints", template: "Fitted template", frame: "Frame the mesh" }[name]);
    }
    const { undo, redo, reset, compare, wire, ruler, joints, template, frame } = this.buttons;
    element.replaceChildren(undo, redo, reset, rule(), compare, wire, ruler, joints, template, rule(), frame);
    this.hold(compare);
    this.roving();
  }

  pressed(name) {
    return this.buttons[name].getAttribute("aria-pressed") === "true";
  }

  press(name, pressed, quiet = false) {
    this.buttons[name].setAttribute("aria-pressed", String(pressed));
    if (!quiet) this.buttons[name].run(pressed);
  }

  /** A long press ends what it began. */
  hold(compare) {
    let began = 0;
    compare.addEventListener("pointerdown", () => {
      began = performance.now();
      if (!this.pressed("compare")) this.press("compare", true);
      else began = -1;
    });
    const end = (event) => {
      if (began > 0 && performance.now() - began > HOLD) this.press("compare", false);
      if (event.type !== "click") return;
    };
    compare.addEventListener("pointerup", end);
    compare.addEventListener("pointercancel", end);
    // The click that follows a pointer would toggle again; one of the keyboard has no pointer.
    compare.addEventListener("click", (event) => {
      if (event.detail > 0 && began > 0) event.stopImmediatePropagation();
      began = 0;
    }, { capture: true });
  }

  /** One stop for Tab, arrows in between. */
  roving() {
    const all = () => Object.values(this.buttons).filter((button) => !button.hidden && !button.disabled);
    this.element.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!way) return;
      const list = all();
      const next = list[(list.indexOf(document.activeElement) + way + list.length) % list.length];
      next.focus();
      event.preventDefault();
    });
  }

  update({ canUndo, canRedo, changed }) {
    this.buttons.undo.disabled = !canUndo;
    this.buttons.redo.disabled = !canRedo;
    this.buttons.reset.disabled = !changed;
    this.buttons.compare.disabled = !changed && !this.pressed("compare");
  }
}
