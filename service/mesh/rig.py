"""A skeleton added to a glTF asset, and its meshes bound to it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.mesh.additions import VERTEX_DATA, Additions
from service.mesh.buffers import Draft
from service.mesh.document import Document, Object
from service.mesh.geometry import Block, Use
from service.mesh.glb import GlbFile
from service.mesh.jsontext import END, Path
from service.mesh.meshcopies import replaced

Array = NDArray[np.float64]

ARMATURE = "Armature"


@dataclass(frozen=True)
class Joint:
    """A joint's node.

    Attributes:
        name: of the node.
        parent: index of its parent, -1 for the root.
        rotation: ``[3, 3]`` in its parent.
        offset: ``[3]`` from its parent, metres; the root's from the armature.
        extras: said of it.
    """

    name: str
    parent: int
    rotation: Array
    offset: Array
    extras: Object


@dataclass(frozen=True)
class Rig:
    """A skeleton and how vertices hang on it.

    Attributes:
        joints: parents ahead of their children.
        frame: ``[3, 3]`` rotation of the armature, the root's parent.
        inverse_bind: ``[J, 4, 4]`` from world space.
        indices, weights: ``[V, 4]`` the joints that move each vertex; the weights are one in sum.
    """

    joints: Sequence[Joint]
    frame: Array
    inverse_bind: Array
    indices: NDArray[np.int64]
    weights: Array


def add_rig(file: GlbFile, rig: Rig) -> bytes:
    """The asset with a skeleton; every mesh that is shown is bound to it.

    Args:
        file: without skinned meshes (see `unskinned`), its buffers all in its binary chunk, or in
            its JSON.
        rig: for its vertices, in metres.
    """
    return _Rigging(file, rig).finish()


class _Rigging:
    def __init__(self, file: GlbFile, rig: Rig) -> None:
        self._file = file
        self._rig = rig
        self._document: Document = file.document
        self._additions = Additions(file.document, Draft(file.buffers))
        self._edits: dict[Path, Any] = {}

    def finish(self) -> bytes:
        joints = self._add_nodes()
        nodes: dict[int, dict[int, dict[int, Use]]] = defaultdict(lambda: defaultdict(dict))
        for use in self._file.geometry.uses:
            nodes[use.mesh][use.node][use.primitive] = use
        for mesh, shown in nodes.items():
            self._bind(mesh, shown, joints)
        edits = self._edits | self._additions.edits()
        return self._file.assemble(edits, self._additions.draft)[""]

    def _add_nodes(self) -> list[int]:
        """Add the joints under an armature at the scene's top; returns their numbers."""
        first = len(self._document.array(self._document.root, "nodes"))
        joints = self._rig.joints
        children: dict[int, list[int]] = defaultdict(list)
        for index, joint in enumerate(joints):
            children[joint.parent].append(first + index)
        for index, joint in enumerate(joints):
            entry: Object = {
                "name": joint.name,
                "rotation": quaternion(joint.rotation),
                "translation": joint.offset.tolist(),
                "extras": joint.extras,
            }
            if children[index]:
                entry["children"] = children[index]
            self._additions.add("nodes", entry)
        armature = {
            "name": ARMATURE,
            "rotation": quaternion(self._rig.frame),
            "children": children[-1],
        }
        top = self._additions.add("nodes", armature)
        if self._document.array(self._document.root, "scenes"):
            number = self._document.root.get("scene", 0)
            self._edits["scenes", number, "nodes", END] = [top]
        return list(range(first, first + len(joints)))

    def _bind(self, mesh: int, shown: dict[int, dict[int, Use]], joints: list[int]) -> None:
        """Bind a mesh, with a copy for each node that needs other weights."""
        groups: dict[str, list[int]] = defaultdict(list)
        weights: dict[int, dict[int, Object]] = {}
        for node, primitives in shown.items():
            weights[node] = {p: self._weights(self._block(use)) for p, use in primitives.items()}
            groups[repr(sorted(weights[node].items()))].append(node)
        variants = [
            (members, self._with_weights(mesh, weights[members[0]])) for members in groups.values()
        ]
        self._edits |= replaced(mesh, variants, lambda entry: self._additions.add("meshes", entry))
        for node, primitives in shown.items():
            block = self._block(next(iter(primitives.values())))
            self._edits["nodes", node, "skin"] = self._skin(block, joints)

    def _with_weights(self, mesh: int, weights: dict[int, Object]) -> Object:
        old = self._document.entry("meshes", mesh)
        entries = [dict(entry) for entry in self._document.array(old, "primitives")]
        for index, added in weights.items():
            had = self._document.object(entries[index], "attributes")
            entries[index]["attributes"] = {**had, **added}
        return {**old, "primitives": entries}

    def _block(self, use: Use) -> Block:
        return self._file.geometry.blocks[use.block]

    def _skin(self, block: Block, joints: list[int]) -> int:
        """A skin for vertices stored in the block's own space; the same for the same space."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = block.placement.linear, block.placement.offset
        binds = (self._rig.inverse_bind @ matrix).swapaxes(1, 2).reshape(-1, 16)
        accessor = self._additions.accessor(binds.astype("<f4"))
        return self._additions.once(
            "skins", {"inverseBindMatrices": accessor, "skeleton": joints[0], "joints": joints}
        )

    def _weights(self, block: Block) -> Object:
        """The accessors of a block's joints and weights."""
        part = slice(block.start, block.start + block.count)
        weights = self._rig.weights[part].astype("<f4")
        # Validators mind a joint named for nothing.
        indices = np.where(weights > 0.0, self._rig.indices[part], 0).astype("u1")
        return {
            "JOINTS_0": self._additions.accessor(indices, VERTEX_DATA),
            "WEIGHTS_0": self._additions.accessor(weights, VERTEX_DATA),
        }


def quaternion(rotation: Array) -> list[float]:
    """glTF's x, y, z, w of a rotation ``[3, 3]``."""
    return [float(value) for value in Rotation.from_matrix(rotation).as_quat(canonical=True)]
