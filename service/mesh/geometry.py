"""The vertices and faces of a glTF asset in world space, and where each came from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import deadline
from service.mesh import limits
from service.mesh.accessors import Accessor, Bytes, read_accessor
from service.mesh.document import COMPRESSED, Document, Object, compressed
from service.mesh.faults import face_out_of_range, quoted
from service.mesh.meshfile import Faces, Vertices
from service.mesh.morphs import displacement, shown_targets
from service.mesh.placement import Placement
from service.mesh.polygons import Indices, strip
from service.mesh.scene import Instance, Scene, read_scene
from service.mesh.skins import place_skinned

POSITION, NORMAL, TANGENT = "POSITION", "NORMAL", "TANGENT"
COMPONENTS = {POSITION: 3, NORMAL: 3, TANGENT: 4}
POINTS, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 0, 2, 3, 4, 5, 6


@dataclass(frozen=True)
class Block:
    """One position accessor as one node shows it: vertices ``start .. start + count``.

    `morph` ``[count, 3]`` is what morph targets add to the local positions, where they do.
    """

    start: int
    count: int
    placement: Placement
    morph: Vertices | None = None


@dataclass(frozen=True)
class Use:
    """An attribute of a primitive, as one node shows it."""

    node: int
    mesh: int
    primitive: int
    attribute: str
    accessor: int
    block: int


@dataclass
class Geometry:
    """What a glTF asset shows.

    Attributes:
        accessors: those of all positions, normals and tangents, by number.
        blocks: runs of vertices, in order.
        uses: everything that moves with a block.
        vertices, faces, visible: as in `MeshFile`.
    """

    accessors: dict[int, Accessor] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    uses: list[Use] = field(default_factory=list)
    vertices: Vertices = field(default_factory=lambda: np.empty((0, 3)))
    faces: Faces = field(default_factory=lambda: np.empty((0, 3), np.int64))
    visible: Faces = field(default_factory=lambda: np.empty((0, 3), np.int64))


def read_geometry(document: Document, buffers: Bytes) -> Geometry:
    """The geometry of the active scene.

    A vertex comes once for each node that shows its position accessor, in the order of the
    node hierarchy and of the primitives: primitives of a node that share positions share
    vertices.  Morph targets count at the weights that the node or its mesh gives them.
    """
    reading = _Reading(document, buffers, read_scene(document))
    for instance in reading.scene.instances:
        mesh = document.entry("meshes", instance.mesh)
        for number, primitive in enumerate(document.array(mesh, "primitives")):
            if not isinstance(primitive, dict):
                raise document.wrong(f"meshes[{instance.mesh}] has a primitive that is no object")
            reading.add(instance, number, primitive)
    return reading.finish()


class _Reading:
    """Collects the blocks of one asset."""

    def __init__(self, document: Document, buffers: Bytes, scene: Scene) -> None:
        self.scene = scene
        self._document = document
        self._buffers = buffers
        self._geometry = Geometry()
        self._keys: dict[tuple[Any, ...], int] = {}
        self._local: dict[int, Vertices] = {}
        self._triangles: dict[tuple[str, int, int], Faces] = {}
        self._vertices: list[Vertices] = []
        self._faces: list[Faces] = []
        # Which of the faces' parts are not there to be seen.
        self._hidden: set[int] = set()
        self._counts = [0, 0]
        self._shown = 0
        self._listed = 0
        self._stored = 0

    def finish(self) -> Geometry:
        if self._vertices:
            self._geometry.vertices = joined(self._vertices)
            self._geometry.faces = self._geometry.visible = joined(self._faces)
        if self._hidden:
            seen = [part for i, part in enumerate(self._faces) if i not in self._hidden]
            # Where nothing is to be seen, what is hidden must be meant.
            if any(map(len, seen)):
                self._geometry.visible = joined(seen)
        return self._geometry

    def add(self, instance: Instance, number: int, primitive: Object) -> None:
        """Add primitive `number` of the instance's mesh."""
        for name in self._document.object(primitive, "extensions"):
            if name in COMPRESSED:
                raise compressed(name)
        # Each costs time and memory by itself, also where it adds no vertex and no face.
        deadline.check()
        self._shown += 1
        limits.check_parts(self._shown)
        attributes = self._document.object(primitive, "attributes")
        if POSITION not in attributes:
            return
        block = self._block(instance, attributes, primitive)
        count = self._geometry.blocks[block].count
        for name, width in COMPONENTS.items():
            if name in attributes:
                accessor = self._accessor(attributes[name])
                if accessor.count != count or accessor.width != width:
                    raise self._document.wrong(
                        f"{name} of meshes[{instance.mesh}] doesn't fit its {count} positions"
                    )
                use = Use(instance.node, instance.mesh, number, name, accessor.index, block)
                self._geometry.uses.append(use)
        if instance.hidden:
            self._hidden.add(len(self._faces))
        self._add_faces(primitive, self._geometry.blocks[block])

    def _accessor(self, index: Any) -> Accessor:
        self._document.entry("accessors", index)
        if index not in self._geometry.accessors:
            accessor = read_accessor(self._document, self._buffers, index)
            # Positions, normals and tangents, and room for normals on shared positions.
            self._stored += accessor.count
            limits.check_vertices(self._stored // 4)
            self._geometry.accessors[index] = accessor
        return self._geometry.accessors[index]

    def _block(self, instance: Instance, attributes: Object, primitive: Object) -> int:
        accessor = self._accessor(attributes[POSITION])
        if accessor.width != 3:
            raise self._document.wrong(f"positions accessors[{accessor.index}] is no VEC3")
        skinned = instance.skin is not None and "JOINTS_0" in attributes
        names = [n for n in attributes if n.startswith(("JOINTS_", "WEIGHTS_"))] if skinned else []
        targets = shown_targets(self._document, instance.node, instance.mesh, primitive)
        key = (instance.node, accessor.index, targets, *(str(attributes[name]) for name in names))
        if key in self._keys:
            return self._keys[key]
        self._counts[0] += accessor.count
        limits.check_vertices(self._counts[0])
        if skinned and instance.skin is not None:
            placement = place_skinned(
                self._document, self._buffers, self.scene, instance.skin, attributes,
                accessor.count,
            )  # fmt: skip
        else:
            placement = Placement.of(instance.world)
        if accessor.index not in self._local:
            self._local[accessor.index] = accessor.decode(accessor.stored(self._buffers))
        local, morph = self._local[accessor.index], None
        if targets:
            morph = displacement(self._document, self._buffers, targets, accessor.count)
            local = local + morph
        self._vertices.append(placement.to_world(local))
        start = self._counts[0] - accessor.count
        self._geometry.blocks.append(Block(start, accessor.count, placement, morph))
        self._keys[key] = len(self._geometry.blocks) - 1
        return self._keys[key]

    def _add_faces(self, primitive: Object, block: Block) -> None:
        mode = self._document.natural(primitive, "mode", TRIANGLES)
        key = (str(primitive.get("indices")), mode, block.count)
        if key not in self._triangles:
            self._triangles[key] = triangles(self._corners(primitive, block.count), mode)
        faces = self._triangles[key]
        self._counts[1] += len(faces)
        limits.check_faces(self._counts[1])
        if len(faces) and block.placement.mirrors:
            faces = faces[:, ::-1]
        self._faces.append(faces + block.start if block.start else faces)

    def _corners(self, primitive: Object, count: int) -> Indices:
        if "indices" not in primitive:
            return np.arange(count)
        accessor = read_accessor(self._document, self._buffers, primitive["indices"])
        if accessor.width != 1 or accessor.dtype.kind != "u":
            raise self._document.wrong(f"indices {quoted(primitive['indices'])} are no integers")
        # Strips that come to nothing have no faces to be counted by.
        self._listed += accessor.count
        limits.check_faces(self._listed // 3)
        corners = accessor.stored(self._buffers)[:, 0].astype(np.int64)
        # Here, not later: an index past its own positions would land in the next block's.
        if len(corners) and corners.max() >= count:
            raise face_out_of_range(int(corners.max()), count)
        return corners


def joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """All parts, at least one, one after the other; no copy of a single one."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def triangles(corners: Indices, mode: int) -> Faces:
    """``[F, 3]`` triangles of a primitive; none for points and lines."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode == TRIANGLE_STRIP:
        return strip(corners)
    if mode == TRIANGLE_FAN and len(corners) >= 3:
        first = np.full(len(corners) - 2, corners[0])
        return np.stack([first, corners[1:-1], corners[2:]], axis=1)
    return np.empty((0, 3), np.int64)
