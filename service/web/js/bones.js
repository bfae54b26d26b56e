// Joints that move apart as the shape of a body changes.
//
// glTF's morph targets change what hangs on a skeleton, not the skeleton; so each joint says by how
// much it moves for a unit of each coefficient, and the mesh is bound anew to joints moved so.

import * as THREE from "three";

export class Bones {
  /**
   * @param root of the scene, as it was loaded
   * @param parameters what was inferred, by name
   */
  constructor(root, parameters) {
    this.root = root;
    this.parameters = parameters;
    this.nodes = [];
    this.skeletons = new Map();
    const names = new Set();
    root.traverse((node) => {
      const { shape } = node.userData;
      if (node.userData.joint && shape) {
        Object.keys(shape).forEach((name) => names.add(name));
        this.nodes.push({ node, shape, offset: node.position.clone(), turn: node.quaternion.clone() });
      }
      if (node.isSkinnedMesh && !this.skeletons.has(node.skeleton)) {
        // Where the joints, as they were bound, take the mesh's own space.
        const bound = node.skeleton.bones.map((bone, i) => bone.matrixWorld.clone().multiply(node.skeleton.boneInverses[i]));
        this.skeletons.set(node.skeleton, bound);
      }
    });
    this.names = [...names];
    this.shown = this.names.map(() => 0);
  }

  /** Move the joints to where a shape has them; how they are turned is left as bound. */
  show(values) {
    const steps = this.names.map((name) => (values[name] ?? this.parameters[name].value) - this.parameters[name].value);
    if (steps.every((step, i) => step === this.shown[i])) return;
    this.shown = steps;
    for (const { node, shape, offset, turn } of this.nodes) {
      node.position.copy(offset);
      this.names.forEach((name, i) => node.position.addScaledVector(new THREE.Vector3(...shape[name]), steps[i]));
      node.quaternion.copy(turn);
    }
    this.root.updateMatrixWorld(true);
    const inward = this.root.matrixWorld.clone().invert();
    for (const [skeleton, bound] of this.skeletons) {
      skeleton.bones.forEach((bone, i) => {
        skeleton.boneInverses[i].multiplyMatrices(inward, bone.matrixWorld).invert().multiply(bound[i]);
      });
    }
  }
}
