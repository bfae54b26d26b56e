// Undo and redo of whole edits; a drag is one.

export class History extends EventTarget {
  constructor(shape) {
    super();
    this.shape = shape;
    this.steps = [shape.snapshot()];
    this.at = 0;
    shape.addEventListener("commit", () => this.push());
  }

  push() {
    const snapshot = this.shape.snapshot();
    if (JSON.stringify(snapshot) === JSON.stringify(this.steps[this.at])) return;
    this.steps.length = this.at + 1;
    this.steps.push(snapshot);
    // A long session need not keep every step.
    if (this.steps.length > 500) this.steps.shift();
    this.at = this.steps.length - 1;
    this.dispatchEvent(new Event("change"));
  }

  get canUndo() {
    return this.at > 0;
  }

  get canRedo() {
    return this.at < this.steps.length - 1;
  }

  go(by) {
    const target = this.at + by;
    if (target < 0 || target >= this.steps.length) return false;
    this.at = target;
    this.shape.restore(this.steps[target]);
    this.dispatchEvent(new Event("change"));
    return true;
  }
}
