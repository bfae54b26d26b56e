// Dimension lines: the mesh's extents, drawn beside it with their values.

import * as THREE from "three";
import { h } from "./dom.js";

const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => new THREE.Vector3(...axis));

export class DimensionLines {
  constructor(scene, labels, units) {
    this.scene = scene;
    this.labels = labels;
    this.units = units;
    this.visible = true;
    this.lines = new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({ color: 0x3a4fd8, depthTest: true, transparent: true, opacity: 0.9 }),
    );
    this.lines.frustumCulled = false;
    scene.world.add(this.lines);
    scene.onDraw(() => this.project());
    this.marks = [];
  }

  /** Which dimensions a shape has along which axis of the stage. */
  use(shape) {
    const rows = shape.notes.frame?.rotation ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    this.labels.replaceChildren();
    this.marks = [...shape.derived]
      .filter(([, entry]) => entry.axis)
      .map(([name, entry]) => {
        const dots = rows.map((row) => Math.abs(row[0] * entry.axis[0] + row[1] * entry.axis[1] + row[2] * entry.axis[2]));
        const label = h("span");
        this.labels.append(label);
        return { name, entry, axis: dots.indexOf(Math.max(...dots)), label, at: new THREE.Vector3() };
      });
    this.shape = shape;
  }

  /** Draw them about a box, in the stage's frame; `values` are by dimension. */
  update(box, values) {
    const reach = 0.07 * box.getSize(new THREE.Vector3()).length();
    const points = [];
    for (const mark of this.marks) {
      const { start, end, outward } = ends(box, mark.axis, reach);
      const tick = outward.clone().multiplyScalar(0.28 * reach);
      points.push(start, end);
      for (const point of [start, end]) points.push(point.clone().sub(tick), point.clone().add(tick));
      mark.at.lerpVectors(start, end, 0.5);
      const value = values[mark.name];
      mark.label.textContent = value === null ? "" : this.units.text(value, mark.entry.unit);
    }
    this.lines.geometry.dispose();
    this.lines.geometry = new THREE.BufferGeometry().setFromPoints(points);
    this.scene.invalidate();
  }

  show(visible) {
    this.visible = visible;
    this.scene.invalidate();
  }

  paint(dark) {
    this.lines.material.color.set(dark ? 0x8fa2ff : 0x3a4fd8);
  }

  /** Labels stand where their lines are seen. */
  project() {
    this.lines.visible = this.visible;
    const { clientWidth: width, clientHeight: height } = this.labels;
    for (const mark of this.marks) {
      const place = mark.at.clone().project(this.scene.camera);
      const hidden = !this.visible || place.z > 1;
      mark.label.style.visibility = hidden ? "hidden" : "visible";
      const [x, y] = [((place.x + 1) / 2) * width, ((1 - place.y) / 2) * height];
      mark.label.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}

/** Where a dimension along an axis is drawn: on the floor in front and at the right, or upright. */
function ends({ min, max }, axis, reach) {
  const start = new THREE.Vector3(max.x + reach, min.y, max.z + reach);
  if (axis === 1) start.z = min.z;
  const end = start.clone();
  start.setComponent(axis, min.getComponent(axis));
  end.setComponent(axis, max.getComponent(axis));
  return { start, end, outward: AXES[axis === 0 ? 2 : 0] };
}
