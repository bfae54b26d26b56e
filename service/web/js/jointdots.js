// Dots on a body's joints: a press leads to the joint's sliders. For pointers only; the sliders are
// in the panel for every other means.

import * as THREE from "three";
import { h } from "./dom.js";

export class JointDots {
  constructor(scene, labels) {
    this.scene = scene;
    this.labels = labels;
    this.dots = [];
    this.visible = true;
    scene.onDraw(() => this.project());
  }

  /** @param choose (joint) */
  use(figure, choose) {
    this.dots = figure.joints.map(({ node }) => {
      const { joint } = node.userData;
      const element = h("button", {
        type: "button", className: "joint-dot", tabIndex: -1, title: joint.replaceAll("_", " "), dataset: { joint },
        "aria-label": joint.replaceAll("_", " "), onclick: () => choose(joint),
      });
      this.labels.append(element);
      return { node, element };
    });
  }

  show(visible) {
    this.visible = visible;
    this.scene.invalidate();
  }

  project() {
    const { clientWidth: width, clientHeight: height } = this.labels;
    const place = new THREE.Vector3();
    for (const { node, element } of this.dots) {
      node.getWorldPosition(place).project(this.scene.camera);
      element.style.visibility = this.visible && place.z < 1 ? "visible" : "hidden";
      const [x, y] = [((place.x + 1) / 2) * width, ((1 - place.y) / 2) * height];
      element.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
