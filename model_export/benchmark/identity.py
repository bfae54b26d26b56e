"""Whether a file stays what it is but for the edit (B7)."""

from __future__ import annotations

import hashlib
import json
import struct

import numpy as np
from numpy.typing import NDArray

from service.mesh.formats import read_mesh

Array = NDArray[np.float64]

EDITED = ("POSITION", "NORMAL", "TANGENT")
"""What an edit may change of a GLB."""
SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def chunks(data: bytes) -> tuple[dict, bytes]:
    """The document and the binary chunk of a GLB."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def digests(data: bytes) -> dict[str, str]:
    """SHA-256 of what each accessor of a GLB that an edit must not change holds, by its place.

    Accessors are read from tightly packed views.
    """
    document, binary = chunks(data)
    found = {}
    for m, mesh in enumerate(document.get("meshes", [])):
        for p, primitive in enumerate(mesh["primitives"]):
            kept = {k: v for k, v in primitive["attributes"].items() if k not in EDITED}
            if "indices" in primitive:
                kept["indices"] = primitive["indices"]
            for name, index in kept.items():
                found[f"{m}.{p}.{name}"] = _digest(document, binary, index)
    return found


def _digest(document: dict, binary: bytes, index: int) -> str:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    size = accessor["count"] * WIDTHS[accessor["type"]] * SIZES[accessor["componentType"]]
    return hashlib.sha256(binary[start : start + size]).hexdigest()


def same_but_shape(before: bytes, after: bytes) -> bool:
    """Whether two GLBs differ in positions, normals and tangents alone, vertices in one order."""
    if digests(before) != digests(after):
        return False
    a, b = (read_mesh(data, "mesh.glb") for data in (before, after))
    return a.vertices.shape == b.vertices.shape and bool(np.array_equal(a.faces, b.faces))


def there_and_back(x: Array, returned: Array) -> float:
    """The largest distance of a vertex from where it began after an edit and its inverse, over the
    diagonal."""
    size = np.linalg.norm(np.ptp(x, axis=0))
    return float(np.linalg.norm(returned - x, axis=1).max() / size)
