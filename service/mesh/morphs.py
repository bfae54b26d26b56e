"""glTF morph targets at the weights that a node shows its mesh with before any animation."""

from __future__ import annotations

import numpy as np

from service.mesh import limits
from service.mesh.accessors import Bytes, Values, read_accessor
from service.mesh.document import Document, Object

# Targets that a mesh of as many vertices as are allowed may show.
MOST_TARGETS = 16


def shown_targets(
    document: Document, node: int, mesh: int, primitive: Object
) -> tuple[tuple[int, float], ...]:
    """Position accessors of the targets that a primitive shows, each with its weight.

    A node's weights count before its mesh's; what has weight zero is left out.
    """
    owner = document.entry("nodes", node)
    if "weights" not in owner:
        owner = document.entry("meshes", mesh)
    given = document.array(owner, "weights")
    if not given:
        return ()
    weights = document.numbers(owner, "weights", [0.0] * len(given))
    shown: list[tuple[int, float]] = []
    targets = document.array(primitive, "targets")
    for target, weight in zip(targets, weights, strict=False):
        if not isinstance(target, dict):
            raise document.wrong(f"meshes[{mesh}] has a morph target that is no object")
        if weight and "POSITION" in target:
            document.entry("accessors", target["POSITION"])
            shown.append((target["POSITION"], weight))
    return tuple(shown)


def displacement(
    document: Document, buffers: Bytes, shown: tuple[tuple[int, float], ...], count: int
) -> Values:
    """``[count, 3]`` what shown targets add to local positions."""
    limits.check_vertices(count * len(shown) // MOST_TARGETS)
    total = np.zeros((count, 3))
    for index, weight in shown:
        accessor = read_accessor(document, buffers, index)
        if accessor.count != count or accessor.width != 3:
            raise document.wrong(f"a morph target's accessors[{index}] doesn't fit its positions")
        total += weight * accessor.decode(accessor.stored(buffers))
    return total
