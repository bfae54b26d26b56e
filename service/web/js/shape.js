// The state of an edit: what was inferred, what the sliders say, and what is asked of dimensions.

/** Numbers that go over the wire: short, and the same in every place that sends them. */
const rounded = (value) => Number(value.toPrecision(7));

export class Shape extends EventTarget {
  /** @param notes `asset.extras.shape_parameters` of an answer to POST /sliders */
  constructor(notes) {
    super();
    this.notes = notes;
    this.parameters = new Map(Object.entries(notes.parameters));
    this.derived = new Map(Object.entries(notes.derived ?? {}));
    this.originals = Object.fromEntries([...this.parameters].map(([name, p]) => [name, p.value]));
    this.values = { ...this.originals };
    // What was set by hand stays when a dimension is asked for; the rest may give way.
    this.byHand = new Set();
    this.asked = {};
    this.measure = null;
  }

  get isBody() {
    return [...this.parameters.values()].some((p) => p.unit === "rad");
  }

  get changed() {
    return Object.keys(this.values).filter((name) => this.values[name] !== this.originals[name]);
  }

  /** Change values while a slider moves: `input` is told, history is not. */
  set(changes) {
    for (const [name, value] of Object.entries(changes)) {
      this.values[name] = value === this.originals[name] ? value : rounded(value);
      if (value === this.originals[name]) this.byHand.delete(name);
      else this.byHand.add(name);
    }
    this.dispatchEvent(new Event("input"));
  }

  /** The change is complete. */
  commit() {
    this.dispatchEvent(new Event("commit"));
  }

  /** Values that the service chose for what was asked of dimensions. */
  adopt(values, asked) {
    for (const [name, value] of Object.entries(values)) {
      const original = this.originals[name];
      const same = Math.abs(value - original) <= 1e-9 * Math.max(1, Math.abs(original));
      if (name in this.values) this.values[name] = same ? original : rounded(value);
    }
    this.asked = asked;
    this.dispatchEvent(new Event("input"));
  }

  reset() {
    this.values = { ...this.originals };
    this.byHand.clear();
    this.asked = {};
    this.dispatchEvent(new Event("input"));
  }

  snapshot() {
    return { values: { ...this.values }, byHand: [...this.byHand], asked: structuredClone(this.asked) };
  }

  restore(snapshot) {
    this.values = { ...snapshot.values };
    this.byHand = new Set(snapshot.byHand);
    this.asked = structuredClone(snapshot.asked);
    this.dispatchEvent(new Event("input"));
  }

  /** The edit as POST /edit takes it. */
  edits(names = this.changed) {
    return Object.fromEntries(names.map((name) => [name, { set: this.values[name] }]));
  }

  /** A derived dimension now; null where nothing is there to be measured. */
  dimension(name, values = this.values) {
    const entry = this.derived.get(name);
    if (entry.coefficients) return affine(entry, values);
    const extent = this.measure?.extent(entry.axis, values);
    if (!extent) return null;
    return (extent[1] - extent[0]) / (this.notes.metres_per_unit ?? 1);
  }

  /** The limits that the values break: {text, names}. */
  broken() {
    return (this.notes.limits ?? [])
      .filter((row) => affine(row, this.values) < -1e-9)
      // What the mesh itself breaks is not the edit's doing.
      .filter((row) => Object.keys(row.coefficients).some((name) => this.values[name] !== this.originals[name]))
      .map((row) => ({ text: this.inWords(row.text), names: Object.keys(row.coefficients) }));
  }

  /** A limit's text with labels in place of names. */
  inWords(text) {
    return text.replace(/[a-z]\w+/g, (name) => this.parameters.get(name)?.label.toLowerCase() ?? name.replaceAll("_", " "));
  }
}

function affine(row, values) {
  let sum = row.constant;
  for (const [name, factor] of Object.entries(row.coefficients)) sum += factor * (values[name] ?? 0);
  return sum;
}
