// Extents of the mesh as the sliders have it, along a direction of the file's frame.
//
// The graphics card moves what is seen; this moves the same vertices here, projected on the axis
// once, so that a measurement is a few products a vertex.

import * as THREE from "three";

export class Measure {
  constructor(figure) {
    this.figure = figure;
    this.cache = new Map();
  }

  /** [low, high] in metres along a unit axis. */
  extent(axis, values) {
    const key = axis.map((x) => x.toFixed(6)).join();
    if (!this.cache.has(key)) this.cache.set(key, this.figure.meshes.map((entry) => this.project(entry, axis)));
    let low = Infinity;
    let high = -Infinity;
    for (const part of this.cache.get(key)) {
      const moved = part.skinned ? this.skinned(part, axis, values) : plain(part, values);
      for (let i = 0; i < moved.length; i += 1) {
        if (moved[i] < low) low = moved[i];
        if (moved[i] > high) high = moved[i];
      }
    }
    return low <= high ? [low, high] : null;
  }

  /** A mesh's vertices and displacements along the axis; of a skinned one, as they are. */
  project({ mesh, targets }, axis) {
    const { position } = mesh.geometry.attributes;
    const morphs = mesh.geometry.morphAttributes.position ?? [];
    const ours = new Set(targets.map((target) => target.index));
    const base = points(position);
    // The file's own targets stay at their weights.
    (mesh.morphTargetInfluences ?? []).forEach((weight, index) => {
      if (ours.has(index) || !weight || !morphs[index]) return;
      const delta = points(morphs[index]);
      for (let i = 0; i < base.length; i += 1) base[i] += weight * delta[i];
    });
    const moves = targets
      .map((target) => ({ ...target, delta: points(morphs[target.index]) }))
      .filter(({ delta }) => delta.some((x) => x !== 0));
    if (mesh.isSkinnedMesh) return { skinned: true, mesh, base, moves };
    const matrix = new THREE.Matrix4().copy(this.figure.root.matrixWorld).invert().multiply(mesh.matrixWorld);
    const row = rowAlong(matrix, axis);
    return {
      base: along(base, row, row[3]),
      moves: moves.map((move) => ({ ...move, delta: along(move.delta, row, 0) })),
    };
  }

  /** Positions along the axis once the skeleton has moved them. */
  skinned({ mesh, base, moves }, axis, values) {
    this.pose(values);
    const { skinIndex, skinWeight } = mesh.geometry.attributes;
    const outward = new THREE.Matrix4().copy(this.figure.root.matrixWorld).invert();
    const rows = mesh.skeleton.bones.map((bone, index) => {
      const matrix = new THREE.Matrix4().copy(outward).multiply(bone.matrixWorld);
      matrix.multiply(mesh.skeleton.boneInverses[index]).multiply(mesh.bindMatrix);
      return rowAlong(matrix, axis);
    });
    const weights = moves.map((move) => weightOf(move, values));
    const moved = new Float64Array(base.length / 3);
    for (let i = 0; i < moved.length; i += 1) {
      let [x, y, z] = [base[3 * i], base[3 * i + 1], base[3 * i + 2]];
      for (let m = 0; m < moves.length; m += 1) {
        const { delta } = moves[m];
        x += weights[m] * delta[3 * i];
        y += weights[m] * delta[3 * i + 1];
        z += weights[m] * delta[3 * i + 2];
      }
      for (let k = 0; k < 4; k += 1) {
        const weight = skinWeight.getComponent(i, k);
        if (!weight) continue;
        const row = rows[skinIndex.getComponent(i, k)];
        moved[i] += weight * (row[0] * x + row[1] * y + row[2] * z + row[3]);
      }
    }
    return moved;
  }

  pose(values) {
    this.figure.show(values);
    this.figure.root.updateMatrixWorld(true);
  }
}

const weightOf = ({ parameter, value, change }, values) => ((values[parameter] ?? value) - value) / change;

function plain({ base, moves }, values) {
  const moved = Float64Array.from(base);
  for (const move of moves) {
    const weight = weightOf(move, values);
    if (!weight) continue;
    for (let i = 0; i < moved.length; i += 1) moved[i] += weight * move.delta[i];
  }
  return moved;
}

function points(attribute) {
  const array = new Float32Array(3 * attribute.count);
  for (let i = 0; i < attribute.count; i += 1) {
    array[3 * i] = attribute.getX(i);
    array[3 * i + 1] = attribute.getY(i);
    array[3 * i + 2] = attribute.getZ(i);
  }
  return array;
}

function along(array, row, offset) {
  const out = new Float64Array(array.length / 3);
  for (let i = 0; i < out.length; i += 1) {
    out[i] = row[0] * array[3 * i] + row[1] * array[3 * i + 1] + row[2] * array[3 * i + 2] + offset;
  }
  return out;
}

/** axis^T M, as four numbers that a point's [x, y, z, 1] is multiplied by. */
function rowAlong({ elements: e }, [a, b, c]) {
  return [0, 4, 8, 12].map((i) => a * e[i] + b * e[i + 1] + c * e[i + 2]);
}
