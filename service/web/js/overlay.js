// The fitted template, drawn over the mesh; fetched when it is first asked for.

import * as THREE from "three";
import { Figure } from "./figure.js";

const COLOR = 0xe07a1f;

export class Overlay {
  constructor(scene, source, fields) {
    Object.assign(this, { scene, source, fields });
    this.figure = null;
    this.visible = false;
    this.closed = false;
  }

  /** Throws the service's Problem; a 404 means that it offers no templates. */
  async load() {
    const { buffer } = await this.source.post("template", this.fields);
    const figure = await Figure.parse(buffer);
    // Another mesh may have been opened meanwhile.
    if (this.closed) return;
    this.figure = figure;
    const skin = new THREE.MeshBasicMaterial({ color: COLOR, transparent: true, opacity: 0.13, depthTest: false, depthWrite: false, side: THREE.DoubleSide });
    for (const { mesh } of this.figure.meshes) {
      mesh.material = skin;
      mesh.castShadow = mesh.receiveShadow = false;
      mesh.renderOrder = 2;
    }
    const wires = new THREE.MeshBasicMaterial({ color: COLOR, wireframe: true, transparent: true, opacity: 0.5, depthWrite: false });
    for (const twin of this.figure.echo(wires)) twin.renderOrder = 3;
    this.scene.stand.add(this.figure.root);
  }

  async toggle(visible, values) {
    if (visible && !this.figure) await this.load();
    this.visible = visible;
    if (this.figure) this.figure.root.visible = visible;
    this.show(values);
  }

  show(values) {
    if (!this.figure || !this.visible) return;
    this.figure.show(values);
    this.scene.invalidate();
  }

  dispose() {
    this.closed = true;
    this.figure?.root.removeFromParent();
    this.figure?.dispose();
  }
}
