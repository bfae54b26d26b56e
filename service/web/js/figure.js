// A mesh with its editing inside: morph targets and joints that follow the parameters.

import * as THREE from "three";
import { GLTFLoader } from "three/GLTFLoader";
import { Bones } from "./bones.js";

const CLAY = { color: 0xb9bcc4, roughness: 0.75, metalness: 0, side: THREE.DoubleSide };

export class Figure {
  /** Read a GLB from POST /sliders or /template. */
  static async parse(buffer) {
    return new Figure(await new GLTFLoader().parseAsync(buffer, ""));
  }

  constructor(gltf) {
    this.root = gltf.scene;
    this.notes = gltf.asset.extras?.shape_parameters ?? null;
    this.meshes = [];
    this.joints = [];
    this.root.traverse((node) => {
      if (node.isMesh) this.meshes.push(meshOf(node, gltf.parser));
      const names = node.userData.parameters;
      if (node.userData.joint && names?.length === 3) this.joints.push({ node, names, rest: node.quaternion.clone() });
    });
    this.root.updateMatrixWorld(true);
    this.bones = new Bones(this.root, this.notes?.parameters ?? {});
  }

  /** Move to these values; a parameter that none are given for stays as it was inferred. */
  show(values) {
    for (const { mesh, targets } of this.meshes) {
      for (const { index, parameter, value, change } of targets) {
        mesh.morphTargetInfluences[index] = ((values[parameter] ?? value) - value) / change;
      }
    }
    this.bones.show(values);
    for (const { node, names, rest } of this.joints) {
      const vector = names.map((name) => values[name]);
      if (vector.includes(undefined)) node.quaternion.copy(rest);
      else rotate(node.quaternion, new THREE.Vector3(...vector));
    }
  }

  get vertexCount() {
    return this.meshes.reduce((sum, { mesh }) => sum + mesh.geometry.attributes.position.count, 0);
  }

  /** A second look at the same geometry, such as its wires; it moves along. */
  echo(material) {
    return this.meshes.map(({ mesh }) => {
      const twin = mesh.isSkinnedMesh
        ? new THREE.SkinnedMesh(mesh.geometry, material)
        : new THREE.Mesh(mesh.geometry, material);
      if (mesh.isSkinnedMesh) twin.bind(mesh.skeleton, mesh.bindMatrix);
      twin.morphTargetInfluences = mesh.morphTargetInfluences;
      twin.frustumCulled = false;
      mesh.add(twin);
      return twin;
    });
  }

  dispose() {
    for (const { mesh } of this.meshes) {
      mesh.geometry.dispose();
      for (const material of [mesh.material].flat()) {
        for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
        material.dispose();
      }
      mesh.skeleton?.dispose();
    }
  }
}

function meshOf(mesh, parser) {
  // Bounds are those of the mesh as it came; sliders move it out of them.
  mesh.frustumCulled = false;
  mesh.castShadow = mesh.receiveShadow = true;
  const place = parser.associations.get(mesh);
  const primitive = parser.json.meshes?.[place?.meshes]?.primitives?.[place?.primitives ?? 0];
  if (primitive && primitive.material === undefined) {
    const flatShading = !mesh.geometry.attributes.normal;
    const vertexColors = Boolean(mesh.geometry.attributes.color);
    mesh.material = new THREE.MeshStandardMaterial({ ...CLAY, flatShading, vertexColors });
  }
  const targets = (mesh.userData.targets ?? [])
    .map((target, index) => ({ ...target, index }))
    .filter((target) => target.parameter && target.change);
  return { mesh, targets };
}

/** The rotation of an axis-angle vector in radians. */
export function rotate(quaternion, vector) {
  const angle = vector.length();
  if (angle < 1e-12) return quaternion.identity();
  return quaternion.setFromAxisAngle(vector.clone().divideScalar(angle), angle);
}
