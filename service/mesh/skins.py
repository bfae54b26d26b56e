"""glTF skins: vertices placed by their joints.

A skinned mesh ignores its node's transform.  What a viewer shows before any animation is each
vertex under the weighted sum of its joints' matrices, and that rest pose is the geometry here;
moved vertices go back through the inverse of the same sum, so the skin itself stays as it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.mesh.accessors import Bytes, Values, read_accessor
from service.mesh.document import Document, Object
from service.mesh.faults import unsupported
from service.mesh.placement import Placement
from service.mesh.scene import Scene

# A determinant this far below its matrix's size can't be undone.
SINGULAR = 1e-9
# Sets of four joints that a vertex may have.
MOST_SETS = 4


def place_skinned(
    document: Document, buffers: Bytes, scene: Scene, skin: int, attributes: Object, count: int
) -> Placement:
    """The placement of a skinned primitive's `count` vertices in the rest pose.

    Raises:
        InvalidMesh: joints, weights or matrices are missing or don't fit.
        UnsupportedFormat: ``skinned_mesh``, a vertex's joints flatten it, so it can't be moved.
    """
    matrices = _joint_matrices(document, buffers, scene, skin)
    blended = np.zeros((count, 16))
    total = np.zeros((count, 1))
    sets = sum(name.startswith("JOINTS_") for name in attributes)
    if sets > MOST_SETS:
        raise unsupported(
            "skinned_mesh",
            f"A primitive has {sets} sets of joints",
            f"Limit the joints of a vertex to {4 * MOST_SETS}",
        )
    for number in range(sets):
        joints = _attribute(document, buffers, attributes, f"JOINTS_{number}", count)
        weights = _attribute(document, buffers, attributes, f"WEIGHTS_{number}", count)
        chosen = joints.astype(np.int64)
        if chosen.size and chosen.max() >= len(matrices):
            raise document.wrong(f"a vertex uses a joint that skins[{skin}] doesn't have")
        for column in range(4):
            blended += weights[:, column, None] * matrices[chosen[:, column]]
        total += weights.sum(axis=1, keepdims=True)
    # Viewers scale weights to a sum of one, and give the first joint all where there are none.
    weighted = total > 0
    blended = np.where(weighted, blended / np.where(weighted, total, 1.0), matrices[0])
    return _invertible(blended.reshape(count, 4, 4), skin)


def _joint_matrices(
    document: Document, buffers: Bytes, scene: Scene, index: int
) -> NDArray[np.float64]:
    """``[J, 16]`` what each joint does to a vertex."""
    skin = document.entry("skins", index)
    joints = document.array(skin, "joints")
    worlds = []
    for joint in joints:
        document.entry("nodes", joint)
        if joint not in scene.worlds:
            raise document.wrong(f"skins[{index}] uses nodes[{joint}], which isn't in the scene")
        worlds.append(scene.worlds[joint])
    if not worlds:
        raise document.wrong(f"skins[{index}] has no joints")
    if "inverseBindMatrices" not in skin:
        return np.array(worlds).reshape(-1, 16)
    accessor = read_accessor(document, buffers, skin["inverseBindMatrices"])
    if accessor.width != 16 or accessor.count < len(worlds):
        raise document.wrong(f"skins[{index}] has too few inverse bind matrices")
    binds = accessor.decode(accessor.stored(buffers))[: len(worlds)]
    product: NDArray[np.float64] = np.array(worlds) @ binds.reshape(-1, 4, 4).swapaxes(1, 2)
    return product.reshape(-1, 16)


def _attribute(
    document: Document, buffers: Bytes, attributes: Object, name: str, count: int
) -> Values:
    accessor = read_accessor(document, buffers, attributes.get(name))
    if accessor.count != count or accessor.width != 4:
        raise document.wrong(f"a primitive's {name} doesn't fit its {count} positions")
    return accessor.decode(accessor.stored(buffers))


def _invertible(matrices: NDArray[np.float64], skin: int) -> Placement:
    linear = matrices[:, :3, :3]
    volume = np.abs(np.linalg.det(linear))
    size = np.abs(linear).max(axis=(1, 2), initial=0.0) ** 3
    # Not-a-numbers pass here: the check of positions names them.
    if (volume <= SINGULAR * size).any():
        raise unsupported(
            "skinned_mesh",
            f"The joints of skins[{skin}] collapse vertices in the rest pose",
            "Apply the armature to the mesh and export it without a skin",
        )
    return Placement.of(matrices)
