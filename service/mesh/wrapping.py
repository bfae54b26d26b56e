"""A GLB made of a mesh's vertices and its looks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.mesh.additions import VERTEX_DATA, Additions, box
from service.mesh.buffers import Draft
from service.mesh.document import Object
from service.mesh.folder import Folder
from service.mesh.glb import GlbFile, glb
from service.mesh.jsontext import Path
from service.mesh.looks import Looks, Part, Values
from service.mesh.materials import Materials
from service.mesh.meshfile import Faces, Vertices
from service.mesh.moves import tolerant, unit

INDEX_DATA = 34963
# An index of only ones restarts a primitive, so that there can't be a vertex of that number.
SHORT = 65_535
# Of a vertex whose faces have no area.
UP = (0.0, 1.0, 0.0)


def wrap(vertices: Vertices, looks: Looks, folder: Folder | None) -> bytes:
    """The mesh as a GLB of one node, with a primitive for each part of the looks.

    Args:
        vertices: ``[V, 3]`` of the file, in metres.
        looks: of them.
        folder: where the looks' pictures are.
    """
    blank = GlbFile(_blank())
    additions = Additions(blank.document, Draft(blank.buffers))
    materials = Materials(additions, folder)
    primitives = [_primitive(vertices, looks, part, additions, materials) for part in looks.parts]
    additions.add("meshes", {"primitives": primitives})
    edits: dict[Path, Any] = {**additions.edits(), ("scenes", 0, "nodes"): [0]}
    if materials.extensions:
        edits[("extensionsUsed",)] = sorted(materials.extensions)
    return blank.assemble(edits, additions.draft)[""]


def _blank() -> bytes:
    """A GLB with a node, not shown yet, for a mesh to come, and an empty buffer."""
    root: Object = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 0}],
        "scene": 0,
        "scenes": [{"nodes": []}],
        "nodes": [{"mesh": 0}],
    }
    return glb(root, b"")


def _primitive(
    vertices: Vertices, looks: Looks, part: Part, additions: Additions, materials: Materials
) -> Object:
    chosen, faces = slice(part.start, part.stop), part.faces - part.start
    positions = vertices[looks.of[chosen]].astype("<f4")
    # By its name an accessor for each part, also where two have the same positions.
    members = {"name": f"positions from {part.start}", **box(positions)}
    attributes = {"POSITION": additions.accessor(positions, VERTEX_DATA, **members)}
    if looks.normals is not None and not np.isnan(looks.normals[chosen, 0]).all():
        normals = mended(looks.normals[chosen], positions, faces)
        attributes["NORMAL"] = additions.accessor(normals.astype("<f4"), VERTEX_DATA)
    textured = looks.coordinates is not None and not np.isnan(looks.coordinates[chosen, 0]).all()
    if textured and looks.coordinates is not None:
        coordinates = np.nan_to_num(looks.coordinates[chosen]).astype("<f4")
        attributes["TEXCOORD_0"] = additions.accessor(coordinates, VERTEX_DATA)
    if looks.colours is not None:
        # In 8 bits the dark ones would be all the same.
        colours = np.rint(looks.colours[chosen] * 65_535).astype("<u2")
        attributes["COLOR_0"] = additions.accessor(colours, VERTEX_DATA, normalized=True)
    kind = "<u2" if len(positions) <= SHORT else "<u4"
    indices = additions.accessor(faces.reshape(-1, 1).astype(kind), INDEX_DATA)
    entry: Object = {"attributes": attributes, "indices": indices}
    material = part.material
    if material is None and looks.colours is not None:
        # glTF's own default is metal, which darkens colours.
        material = ("colours", {})
    if material is not None:
        blended = looks.colours is not None and looks.colours.shape[1] == 4
        entry["material"] = materials.add(material, textured, blended)
    return entry


@tolerant
def mended(given: Values, positions: NDArray[Any], faces: Faces) -> NDArray[np.float64]:
    """Normals ``[N, 3]`` of length one; a vertex without has the mean of its faces'."""
    normals = unit(np.asarray(given, np.float64), np.full(given.shape, np.nan))
    sound = ~np.isnan(normals[:, 0])
    if not sound.all():
        a, b, c = (positions[faces[:, corner]].astype(np.float64) for corner in range(3))
        across = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        corners = faces.reshape(-1)
        sums = [np.bincount(corners, across[:, axis], len(normals)) for axis in range(3)]
        means = np.stack(sums, axis=1)[~sound].astype(np.float64)
        normals[~sound] = unit(means, np.full(means.shape, UP, np.float64))
    return normals
