"""Morph targets added to a glTF asset: what its vertices do for a unit of each weight.

Everything that the asset has stays, existing targets and skins too: new targets come behind the
old, with weight zero.  Displacements are given in world space; a target holds them in its
primitive's own space, ahead of its skin.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.mesh.accessors import Accessor
from service.mesh.additions import Additions
from service.mesh.bounds import bounds
from service.mesh.buffers import Draft
from service.mesh.deltas import Deltas
from service.mesh.document import Document, Object
from service.mesh.faults import unsupported
from service.mesh.geometry import NORMAL, POSITION, Block, Use
from service.mesh.gltf import GltfFile
from service.mesh.jsontext import Path
from service.mesh.meshcopies import objects, replaced
from service.mesh.placement import Placement, times
from service.mesh.stretch import Stretch

Displacements = NDArray[np.floating]


@dataclass(frozen=True)
class Target:
    """What a weight of 1 does.

    Attributes:
        name: of the target.
        extras: said of it beside the mesh's ``targetNames``.
        shift: ``[V, 3]`` world-space displacements.
        stretch: ``[V]`` what it adds to each vertex's local linear map, the identity.
    """

    name: str
    extras: Object
    shift: Displacements
    stretch: Stretch


def add_targets(
    file: GltfFile, targets: Iterable[Target], asset: Object, quantize: bool = False
) -> bytes:
    """The asset with morph targets; all that move anything of a mesh's, all of them.

    Args:
        file: its buffers all in its binary chunk, or in its JSON.
        targets: one after the other, since each is as large as the mesh.
        asset: to be said of the whole in ``asset.extras``.
        quantize: store displacements as 16-bit fractions where those are fine enough.

    Raises:
        UnsupportedFormat: ``animated_weights``, an animation of the targets that are there already
            has no room for more.
    """
    adding = _Adding(file, Deltas(Additions(file.document, Draft(file.buffers)), quantize))
    for target in targets:
        deadline.check()
        adding.add(target)
    return adding.finish(asset)


@dataclass
class _Primitive:
    """A primitive as one node shows it: its attributes, and the accessors of each target."""

    block: Block
    uses: dict[str, Use]
    targets: list[dict[str, int]] = field(default_factory=list)


class _Adding:
    def __init__(self, file: GltfFile, deltas: Deltas) -> None:
        self._file = file
        self._deltas = deltas
        self._document: Document = file.document
        self._names: list[str] = []
        self._extras: list[Object] = []
        self._moving: set[int] = set()
        self._sizes: dict[int, float] = {}
        # By mesh, node and primitive.
        self._primitives: dict[int, dict[int, dict[int, _Primitive]]] = defaultdict(
            lambda: defaultdict(dict)
        )
        blocks = file.geometry.blocks
        for use in file.geometry.uses:
            members = self._primitives[use.mesh][use.node]
            known = members.setdefault(use.primitive, _Primitive(blocks[use.block], {}))
            known.uses[use.attribute] = use

    def add(self, target: Target) -> None:
        self._names.append(target.name)
        self._extras.append(target.extras)
        stored: dict[tuple[int, str, int], int] = {}
        for mesh, nodes in self._primitives.items():
            for primitives in nodes.values():
                for primitive in primitives.values():
                    if self._add(primitive, target, stored):
                        self._moving.add(mesh)

    def _add(
        self, primitive: _Primitive, target: Target, stored: dict[tuple[int, str, int], int]
    ) -> bool:
        """Add a target to a primitive; returns whether it moves it."""
        block, found = primitive.block, {}
        part = slice(block.start, block.start + block.count)
        for attribute, use in primitive.uses.items():
            key = (block.start, attribute, use.accessor)
            if key not in stored:
                stored[key] = self._store(use, block, target, part)
            found[attribute] = stored[key]
        primitive.targets.append(found)
        return bool(target.shift[part].any())

    def _store(self, use: Use, block: Block, target: Target, part: slice) -> int:
        """The accessor of what the target adds to an attribute."""
        accessor = self._file.geometry.accessors[use.accessor]
        placement = block.placement
        if use.attribute != POSITION:
            values = self._turns(use.attribute, accessor, placement, target, part)
            return self._deltas.directions(values)
        values = target.shift[part]
        if not placement.is_identity:
            values = times(placement.inverse, np.asarray(values, np.float64))
        return self._deltas.positions(values, self._size(block))

    def _size(self, block: Block) -> float:
        """The diagonal of a block's box, in its own space."""
        if block.start not in self._sizes:
            vertices = self._file.geometry.vertices[block.start : block.start + block.count]
            low, high = bounds(vertices)
            grown = np.abs(np.linalg.det(block.placement.linear)).mean() ** (1 / 3)
            self._sizes[block.start] = float(np.linalg.norm(high - low) / grown)
        return self._sizes[block.start]

    def _turns(
        self, attribute: str, accessor: Accessor, placement: Placement, target: Target, part: slice
    ) -> Displacements:
        """``[count, 3]`` what the target adds to normals or tangents."""
        stretch = target.stretch.at(part)
        values = np.zeros((part.stop - part.start, 3), np.float32)
        touched = stretch.touched()
        if len(touched):
            stored = accessor.stored(self._file.buffers)[touched]
            own = accessor.decode(stored)[:, :3].astype(np.float32)
            local = _local(stretch.at(touched), placement.at(touched))
            turn = local.turn_normals if attribute == NORMAL else local.carry_tangents
            values[touched] = turn(own)
        return values

    def finish(self, asset: Object) -> bytes:
        edits: dict[Path, Any] = _with_asset(self._document, asset)
        for mesh in sorted(self._moving):
            edits |= self._mesh(mesh)
        additions = self._deltas.additions
        edits |= additions.edits() | self._deltas.extensions(self._document)
        return self._file.assemble(edits, additions.draft)[""]

    def _mesh(self, mesh: int) -> dict[Path, Any]:
        """The JSON of a mesh with its targets, and copies for nodes that need others."""
        nodes = self._primitives[mesh]
        _require_still_weights(self._document, nodes)
        groups: dict[str, list[int]] = defaultdict(list)
        for node, primitives in nodes.items():
            groups[repr([(p, primitives[p].targets) for p in sorted(primitives)])].append(node)
        old = self._document.entry("meshes", mesh)
        variants = [
            (members, *self._with_targets(mesh, old, nodes[members[0]]))
            for members in groups.values()
        ]
        edits = replaced(
            mesh,
            [(members, entry) for members, entry, _ in variants],
            lambda entry: self._deltas.additions.add("meshes", entry),
        )
        for members, _, count in variants:
            for node in members:
                if weights := self._document.array(self._document.entry("nodes", node), "weights"):
                    edits["nodes", node, "weights"] = self._weights(weights, count)
        return edits

    def _with_targets(
        self, number: int, mesh: Object, primitives: dict[int, _Primitive]
    ) -> tuple[Object, int]:
        """A mesh's JSON with the targets, and how many it had before."""
        entries = [dict(entry) for entry in self._document.array(mesh, "primitives")]
        before = {len(self._document.array(entry, "targets")) for entry in entries}
        if len(before) != 1:
            raise self._document.wrong(
                f"the primitives of meshes[{number}] have different numbers of morph targets"
            )
        for index, primitive in primitives.items():
            had = self._document.array(entries[index], "targets")
            entries[index]["targets"] = [*had, *primitive.targets]
        count = before.pop()
        extras = mesh.get("extras")
        extras = (
            dict(extras) if isinstance(extras, dict) else {} if extras is None else {"": extras}
        )
        names = extras.get("targetNames")
        if not isinstance(names, list) or len(names) != count:
            names = [f"target_{index}" for index in range(count)]
        extras["targetNames"] = [*names, *self._names]
        extras["targets"] = [*({} for _ in range(count)), *self._extras]
        weights = self._weights(self._document.array(mesh, "weights"), count)
        return {**mesh, "primitives": entries, "weights": weights, "extras": extras}, count

    def _weights(self, had: list[Any], count: int) -> list[Any]:
        """Weights of the targets that were there, however many are given, and of the new ones."""
        kept = had[:count]
        return [*kept, *([0.0] * (count - len(kept) + len(self._names)))]


def _local(stretch: Stretch, placement: Placement) -> Stretch:
    """World-space additions to linear maps, in a primitive's own space."""
    if placement.is_identity:
        return stretch
    return stretch.between(placement.inverse, placement.linear)


def _with_asset(document: Document, asset: Object) -> dict[Path, Any]:
    had = _extras(document.object(document.root, "asset"))
    return {("asset", "extras"): {**had, **asset}}


def _extras(entry: Object) -> Object:
    """An object's extras, to be added to; what is no object, as a member without a name."""
    extras = entry.get("extras", {})
    return dict(extras) if isinstance(extras, dict) else {"": extras}


def _require_still_weights(document: Document, nodes: Iterable[int]) -> None:
    shown = set(nodes)
    for number, animation in enumerate(objects(document, document.root, "animations")):
        for channel in objects(document, animation, "channels"):
            target = document.object(channel, "target")
            if target.get("path") == "weights" and target.get("node") in shown:
                raise unsupported(
                    "animated_weights",
                    f"animations[{number}] moves the morph targets of nodes[{target['node']}], "
                    "which leaves no room for more",
                    "Remove that animation, or bake it",
                )
