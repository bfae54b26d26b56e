// The sliders of a shape, by group; of bodies by joint, both sides together if so wished.

import { calm, h } from "./dom.js";
import { Row } from "./row.js";

const MANY = 12;
const AXIS = /^(.*)_([xyz])$/;

export class Sliders {
  constructor(shape, units) {
    this.shape = shape;
    this.units = units;
    this.symmetric = false;
    this.rows = new Map();
    this.groups = new Map();
    const many = shape.parameters.size > MANY;
    // A body's shape before its many joints.
    const sorted = [...shape.parameters].sort(([, a], [, b]) => (a.unit === "rad") - (b.unit === "rad"));
    for (const [name, entry] of sorted) this.add(name, entry, many);
    this.element = h("div", {}, ...[...this.groups.values()].map((group) => group.element));
    shape.addEventListener("input", () => this.update());
    units.addEventListener("change", () => {
      for (const row of this.rows.values()) row.marks();
      this.update();
    });
    this.update();
  }

  add(name, entry, many) {
    const title = entry.group || "other";
    if (!this.groups.has(title)) {
      const changes = h("span", { className: "changes" });
      const summary = h("summary", {}, title[0].toUpperCase() + title.slice(1), changes);
      // Of many groups the first ones with a shape's size are open.
      const open = !many || title === "shape" || title === "left arm";
      const element = h("details", { className: "group", open, dataset: { group: title } }, summary);
      this.groups.set(title, { element, changes, names: [], joints: new Map() });
    }
    const group = this.groups.get(title);
    group.names.push(name);
    const joint = entry.unit === "rad" ? AXIS.exec(name) : null;
    const on = {
      input: (value) => this.move(name, value),
      commit: () => this.shape.commit(),
      reset: () => {
        this.move(name, this.shape.originals[name]);
        this.shape.commit();
        this.rows.get(name).slider.focus();
      },
    };
    const row = new Row(name, entry, this.units, on, joint?.[2]);
    this.rows.set(name, row);
    if (joint) this.jointOf(group, joint[1], entry.label).append(row.element);
    else group.element.append(row.element);
  }

  /** The fieldset of a joint: "Left elbow" over its three axes. */
  jointOf(group, joint, label) {
    if (!group.joints.has(joint)) {
      const title = joint.replaceAll("_", " ");
      const fieldset = h("fieldset", { className: "joint" },
        h("legend", {}, title[0].toUpperCase() + title.slice(1)));
      group.joints.set(joint, fieldset);
      group.element.append(fieldset);
    }
    return group.joints.get(joint);
  }

  /** Bring a joint's sliders into view, and the first under the fingers. */
  reveal(joint) {
    for (const { element, joints } of this.groups.values()) {
      if (!joints.has(joint)) continue;
      element.open = true;
      const fieldset = joints.get(joint);
      fieldset.scrollIntoView({ block: "center", behavior: calm() ? "auto" : "smooth" });
      fieldset.querySelector("input").focus({ preventScroll: true });
    }
  }

  move(name, value) {
    this.moving = name;
    const changes = { [name]: value };
    if (this.symmetric) Object.assign(changes, this.mirrored(name, value));
    this.shape.set(changes);
  }

  /** The other side's joint as the mirror image of this one's. */
  mirrored(name, value) {
    const [, joint] = AXIS.exec(name) ?? [];
    const other = joint?.startsWith("left_") ? joint.replace("left_", "right_")
      : joint?.startsWith("right_") ? joint.replace("right_", "left_") : null;
    if (!other || !this.shape.parameters.has(`${other}_x`)) return {};
    const now = (axis) => (name === `${joint}_${axis}` ? value : this.shape.values[`${joint}_${axis}`]);
    // A rotation vector (x, y, z) mirrored in the middle plane is (x, -y, -z).
    return { [`${other}_x`]: now("x"), [`${other}_y`]: -now("y"), [`${other}_z`]: -now("z") };
  }

  update() {
    const { values, originals } = this.shape;
    for (const [name, row] of this.rows) row.update(values[name], originals[name]);
    for (const { changes, names } of this.groups.values()) {
      const count = names.filter((name) => values[name] !== originals[name]).length;
      changes.textContent = count ? `${count} changed` : "";
    }
    this.warn();
  }

  /** Say at the slider that moves, or at the first concerned, which limits are broken. */
  warn() {
    const texts = new Map();
    const { values, originals } = this.shape;
    for (const { text, names } of this.shape.broken()) {
      const at = names.includes(this.moving) ? this.moving
        : names.find((name) => values[name] !== originals[name]) ?? names[0];
      texts.set(at, `Beyond what the shape allows (${text}): an edit becomes the nearest that it does.`);
    }
    for (const [name, row] of this.rows) row.caution(texts.get(name));
  }
}
