"""Which glTF primitives use which accessor after a change, and meshes copied where nodes differ."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

from service.mesh.document import Document, Object
from service.mesh.geometry import COMPONENTS, Use
from service.mesh.jsontext import Path

# The accessor of each primitive's attribute that is not the one it had.
Assignment = dict[tuple[int, str], int]


class Repointing:
    """New accessors for some uses of the old ones."""

    def __init__(self, document: Document, uses: list[Use]) -> None:
        self._document = document
        # Nodes whose mesh keeps all its accessors are here too, with nothing assigned.
        self._meshes: dict[int, dict[int, Assignment]] = defaultdict(dict)
        for use in uses:
            self._meshes[use.mesh].setdefault(use.node, {})

    def assign(self, uses: list[Use], accessor: int) -> None:
        """Let `uses` take their values from `accessor`."""
        for use in uses:
            self._meshes[use.mesh][use.node][use.primitive, use.attribute] = accessor

    def edits(self, add_mesh: Callable[[Object], int]) -> dict[Path, Any]:
        """JSON values to set.

        Nodes that differ from the others of their mesh get a copy of it, which `add_mesh` adds
        to the document and numbers.
        """
        edits: dict[Path, Any] = {}
        for mesh, nodes in self._meshes.items():
            groups: dict[tuple[Any, ...], list[int]] = defaultdict(list)
            for node, assignment in nodes.items():
                groups[tuple(sorted(assignment.items()))].append(node)
            first, *others = sorted(groups, key=len)
            for (primitive, attribute), accessor in first:
                path = ("meshes", mesh, "primitives", primitive, "attributes", attribute)
                edits[path] = accessor
            for changes in others:
                number, members = add_mesh(self._copy(mesh, dict(changes))), groups[changes]
                edits |= {("nodes", node, "mesh"): number for node in members}
        return edits

    def _copy(self, mesh: int, assignment: Assignment) -> Object:
        result = dict(self._document.entry("meshes", mesh))
        primitives = [dict(item) for item in result["primitives"]]
        for (primitive, attribute), accessor in assignment.items():
            own = primitives[primitive]
            own["attributes"] = own["attributes"] | {attribute: accessor}
        return result | {"primitives": primitives}


def replaced(
    mesh: int, variants: Sequence[tuple[list[int], Object]], add_mesh: Callable[[Object], int]
) -> dict[Path, Any]:
    """JSON values that give nodes of one mesh what is theirs: the first its place, others copies.

    Args:
        mesh: its number.
        variants: the nodes that show each, and its JSON.
        add_mesh: adds one to the document and numbers it.
    """
    (_, first), *others = variants
    edits: dict[Path, Any] = {("meshes", mesh): first}
    for nodes, entry in others:
        number = add_mesh(entry)
        edits |= {("nodes", node, "mesh"): number for node in nodes}
    return edits


def pinned_accessors(document: Document) -> set[int]:
    """Accessors that something other than a position, normal or tangent uses.

    Their values must stay: morph targets, custom attributes, indices, skins and animations.
    """
    root = document.root
    found: list[Any] = []
    for mesh in objects(document, root, "meshes"):
        for primitive in objects(document, mesh, "primitives"):
            attributes = document.object(primitive, "attributes")
            found += [value for name, value in attributes.items() if name not in COMPONENTS]
            found.append(primitive.get("indices"))
            for target in objects(document, primitive, "targets"):
                found += target.values()
    found += [skin.get("inverseBindMatrices") for skin in objects(document, root, "skins")]
    for animation in objects(document, root, "animations"):
        for sampler in objects(document, animation, "samplers"):
            found += [sampler.get("input"), sampler.get("output")]
    return {index for index in found if isinstance(index, int)}


def objects(document: Document, parent: Object, key: str) -> list[Object]:
    """The objects among the items of array `key` of `parent`."""
    return [item for item in document.array(parent, key) if isinstance(item, dict)]
