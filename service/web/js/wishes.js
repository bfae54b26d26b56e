// What is asked of dimensions: the service finds parameters that fulfil it, or says why none do.

import { announce } from "./dom.js";
import { clearProblems, showProblem } from "./problem.js";

const WORDS = { min: "at least ", max: "at most ", set: "" };

export class Wishes {
  /** @param session {shape, source, units, readout, settle()} */
  constructor(session) {
    this.session = session;
    this.control = null;
  }

  /**
   * Ask for a dimension, or forget what was asked (null).
   *
   * @param free whether the parameters that were set by hand may change, too
   */
  async ask(name, wish, free = false) {
    const { shape, source, readout } = this.session;
    this.control?.abort();
    const asked = { ...shape.asked };
    delete asked[name];
    if (!wish) {
      shape.adopt({}, asked);
      shape.commit();
      return;
    }
    asked[name] = wish;
    const byHand = free ? [] : shape.changed.filter((other) => shape.byHand.has(other));
    const fields = {
      keep: shape.notes.keep,
      edits: JSON.stringify(shape.edits(byHand)),
      constraints: JSON.stringify(asked),
    };
    const control = (this.control = new AbortController());
    try {
      const { buffer } = await source.post("edit", fields, { accept: "application/json", signal: control.signal });
      const report = JSON.parse(new TextDecoder().decode(buffer));
      clearProblems();
      if (free) shape.byHand.clear();
      shape.adopt(after(report.parameters), asked);
      this.session.settle();
      shape.commit();
      announce("The parameters were set for it");
    } catch (error) {
      if (control.signal.aborted) return;
      readout.write();
      this.explain(error, byHand.length ? () => this.ask(name, wish, true) : null);
    }
  }

  /** A conflict in the user's own words and units, with the way out where there is one. */
  explain(error, retry) {
    const lines = (error.document?.conflicts ?? []).map((conflict) => this.sentence(conflict));
    const action = lines.length && retry ? { label: "Let the sliders I set move too", run: retry } : undefined;
    showProblem(error, { lines, action });
  }

  sentence({ name, asked, nearest, unit }) {
    const { shape, units } = this.session;
    const label = (shape.derived.get(name) ?? shape.parameters.get(name))?.label ?? name;
    const limits = typeof asked === "object" ? asked : { set: asked };
    const wanted = Object.entries(limits).map(([kind, value]) => `${WORDS[kind] ?? ""}${units.text(value, unit)}`);
    return `${label}: ${wanted.join(" and ")} asked, ${units.text(nearest, unit)} is the nearest.`;
  }

  close() {
    this.control?.abort();
  }
}

function after(changes) {
  return Object.fromEntries(Object.entries(changes).map(([name, change]) => [name, change.after]));
}
