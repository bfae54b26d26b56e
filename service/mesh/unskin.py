"""Skinned meshes stored as they are shown, without their skins."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.accessors import Values
from service.mesh.additions import VERTEX_DATA, Additions, box
from service.mesh.buffers import Draft
from service.mesh.document import Object
from service.mesh.geometry import NORMAL, POSITION, Block, Use
from service.mesh.glb import GlbFile
from service.mesh.jsontext import Path
from service.mesh.moves import tolerant, unit
from service.mesh.placement import Placement, times
from service.mesh.scene import read_scene

SKINNING = ("JOINTS_", "WEIGHTS_")


@tolerant
def unskinned(file: GlbFile) -> GlbFile:
    """The asset with the same vertices in the same places, and no mesh on a skin.

    The skins themselves and their joints stay, as nodes that nothing hangs on.  A mesh that several
    nodes show becomes one each.
    """
    worlds = read_scene(file.document).worlds
    additions = Additions(file.document, Draft(file.buffers))
    edits: dict[Path, Any] = {}
    skinned: dict[tuple[int, int], list[Use]] = defaultdict(list)
    for use in file.geometry.uses:
        if file.geometry.blocks[use.block].placement.linear.ndim == 3:
            skinned[use.mesh, use.node].append(use)
    for (mesh, node), uses in skinned.items():
        placed = Placement.of(worlds[node])
        entries = [dict(entry) for entry in file.document.entry("meshes", mesh)["primitives"]]
        for use in uses:
            entry = entries[use.primitive]
            attributes = {
                n: v for n, v in entry["attributes"].items() if not n.startswith(SKINNING)
            }
            entry["attributes"] = attributes | {
                use.attribute: _stored(file, use, placed, additions)
            }
        whole = {**file.document.entry("meshes", mesh), "primitives": entries}
        shown = {k: v for k, v in file.document.entry("nodes", node).items() if k != "skin"}
        edits["nodes", node] = {**shown, "mesh": additions.add("meshes", whole)}
    if not edits:
        return file
    return GlbFile(file.assemble(edits | additions.edits(), additions.draft)[""])


def _stored(file: GlbFile, use: Use, placed: Placement, additions: Additions) -> int:
    """An accessor of an attribute as its skin shows it, in the node's own space."""
    block = file.geometry.blocks[use.block]
    accessor = file.geometry.accessors[use.accessor]
    values = accessor.decode(accessor.stored(file.buffers))
    vertices = file.vertices[block.start : block.start + block.count]
    elements = _as_shown(use.attribute, values, block, placed, vertices)
    members: Object = box(elements) if use.attribute == POSITION else {}
    return additions.accessor(elements, VERTEX_DATA, **members)


def _as_shown(
    attribute: str, values: Values, block: Block, placed: Placement, vertices: Values
) -> NDArray[np.float32]:
    """Positions, normals or tangents of a skinned block, for a node at a place."""
    skin = block.placement
    if attribute == POSITION:
        local = times(placed.inverse, vertices - placed.offset)
        # Shown targets go on adding to what is stored.
        return np.asarray(local if block.morph is None else local - block.morph, "<f4")
    if attribute == NORMAL:
        world = times(np.swapaxes(skin.inverse, -1, -2), values)
        return np.asarray(unit(times(placed.linear.T, world), values), "<f4")
    world = times(skin.linear, values[:, :3])
    turned = unit(times(placed.inverse, world), values[:, :3])
    return np.asarray(np.column_stack([turned, values[:, 3]]), "<f4")
