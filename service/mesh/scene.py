"""The node hierarchy of a glTF asset: which meshes stand where."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.mesh import limits
from service.mesh.document import Document, Object
from service.mesh.faults import unsupported

Matrix = NDArray[np.float64]

# Shapes for collisions, by the names that game engines know them by, numbered by some tools.
HELPER = re.compile(
    r"(UCX|UBX|UCP|USP)_.*|.*(_collider|_collision|-colonly|-convcolonly)([._]?\d+)?",
    re.IGNORECASE | re.DOTALL,
)


@dataclass(frozen=True)
class Instance:
    """A node that shows a mesh.

    Attributes:
        node, mesh, skin: their numbers in the document.
        world: ``[4, 4]`` transform of the node.
        hidden: it is not there to be seen.
    """

    node: int
    mesh: int
    skin: int | None
    world: Matrix
    hidden: bool


@dataclass(frozen=True)
class Scene:
    """The meshes of the active scene, in the hierarchy's order, and every node's transform."""

    instances: list[Instance]
    worlds: dict[int, Matrix]


def read_scene(document: Document) -> Scene:
    """Walk the active scene, else the first, else all nodes."""
    instances: list[Instance] = []
    worlds: dict[int, Matrix] = {}
    pending = [(node, np.eye(4), False) for node in reversed(_roots(document))]
    while pending:
        index, parent, hidden = pending.pop()
        node = document.entry("nodes", index)
        if index in worlds:
            raise document.wrong(f"nodes[{index}] has two parents, or is its own ancestor")
        worlds[index] = parent @ _local(document, node)
        limits.check_parts(len(worlds))
        hidden = hidden or _hides(document, node)
        if "mesh" in node:
            instances.append(_instance(document, index, node, worlds[index], hidden))
        children = reversed(document.array(node, "children"))
        pending += [(child, worlds[index], hidden) for child in children]
    return Scene(instances, worlds)


def _roots(document: Document) -> list[int]:
    if document.array(document.root, "scenes"):
        scene = document.entry("scenes", document.root.get("scene", 0))
        return document.array(scene, "nodes")
    nodes = document.array(document.root, "nodes")
    children: set[object] = set()
    for index in range(len(nodes)):
        listed = document.array(document.entry("nodes", index), "children")
        children.update(child for child in listed if isinstance(child, int))
    return [index for index in range(len(nodes)) if index not in children]


def _hides(document: Document, node: Object) -> bool:
    """Whether a node keeps itself and what is below it from being seen."""
    visibility = document.object(document.object(node, "extensions"), "KHR_node_visibility")
    return visibility.get("visible") is False or bool(HELPER.fullmatch(str(node.get("name", ""))))


def _instance(
    document: Document, index: int, node: Object, world: Matrix, hidden: bool
) -> Instance:
    if "EXT_mesh_gpu_instancing" in document.object(node, "extensions"):
        raise unsupported(
            "gpu_instancing",
            f"nodes[{index}] repeats its mesh with EXT_mesh_gpu_instancing",
            "Export every instance as a node of its own",
        )
    skin = document.natural(node, "skin") if "skin" in node else None
    return Instance(index, document.natural(node, "mesh"), skin, world, hidden)


def _local(document: Document, node: Object) -> Matrix:
    """``[4, 4]`` transform of a node in its parent."""
    if "matrix" in node:
        columns = document.numbers(node, "matrix", [0.0] * 16)
        return np.array(columns).reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        matrix[:3, :3] = _rotation(document.numbers(node, "rotation", [0.0] * 4))
    matrix[:3, :3] *= document.numbers(node, "scale", [1.0] * 3)
    matrix[:3, 3] = document.numbers(node, "translation", [0.0] * 3)
    return matrix


def _rotation(quaternion: list[float]) -> Matrix:
    """``[3, 3]`` rotation of a quaternion x, y, z, w of any length; identity for length 0."""
    x, y, z, w = quaternion
    norm = x * x + y * y + z * z + w * w
    s = 2.0 / norm if norm > 0 else 0.0
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
