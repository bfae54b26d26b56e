"""GLB files read as far as rigs need them: accessors, meshopt compression and nodes."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_DTYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True)
class RigFile:
    """A glTF document and its binary chunk."""

    document: dict[str, Any]
    chunk: bytes

    @classmethod
    def of(cls, data: bytes) -> RigFile:
        """Split a GLB file.

        Raises:
            ValueError: it is none.
        """
        if data[:4] != b"glTF":
            raise ValueError("not a GLB file")
        length = struct.unpack_from("<I", data, 12)[0]
        return cls(json.loads(data[20 : 20 + length]), data[28 + length :])

    def read(self, index: int, scaled: bool = True) -> NDArray[Any]:
        """An accessor's ``[count, width]`` values, normalised integers as what they mean."""
        accessor = self.document["accessors"][index]
        dtype = np.dtype(f"<{_DTYPES[accessor['componentType']]}")
        width, count = _WIDTHS[accessor["type"]], accessor["count"]
        data, stride = self._view(accessor["bufferView"])
        start = accessor.get("byteOffset", 0)
        step = stride or width * dtype.itemsize
        array = np.ndarray((count, width), dtype, data, start, (step, dtype.itemsize))
        if accessor.get("normalized") and scaled:
            most = np.iinfo(dtype).max
            return np.maximum(array / most, -1.0)
        return array.astype(np.float64)

    def _view(self, index: int) -> tuple[bytes, int]:
        """A buffer view's bytes and stride, 0 where elements are packed."""
        view = self.document["bufferViews"][index]
        packed = view.get("extensions", {}).get("EXT_meshopt_compression")
        stored = packed or view
        start = stored.get("byteOffset", 0)
        data = self.chunk[start : start + stored["byteLength"]]
        return (unpacked(packed, data) if packed else data), view.get("byteStride", 0)


def unpacked(how: dict[str, Any], data: bytes) -> bytes:
    """The elements of a buffer view under ``EXT_meshopt_compression``; filters are left."""
    from meshoptimizer import (  # type: ignore[import-not-found, unused-ignore]
        decode_index_buffer,
        decode_vertex_buffer,
    )

    count, size = how["count"], how["byteStride"]
    if how["mode"] == "TRIANGLES":
        # The decoder fills an array of four-byte integers, with two-byte ones where asked to.
        return np.asarray(decode_index_buffer(count, size, data)).tobytes()[: count * size]
    return np.asarray(decode_vertex_buffer(count, size, data)).tobytes()


def node_worlds(nodes: list[dict[str, Any]], parents: Index) -> Array:
    """``[N, 4, 4]`` transforms of the nodes, from the index of each one's parent, -1 for a root."""
    worlds = np.tile(np.eye(4), (len(nodes), 1, 1))
    done = np.zeros(len(nodes), bool)

    def visit(index: int) -> None:
        parent = int(parents[index])
        if parent >= 0 and not done[parent]:
            visit(parent)
        above = worlds[parent] if parent >= 0 else np.eye(4)
        worlds[index] = above @ _local(nodes[index])
        done[index] = True

    for index in range(len(nodes)):
        if not done[index]:
            visit(index)
    return worlds


def _local(node: dict[str, Any]) -> Array:
    if "matrix" in node:
        return np.reshape(node["matrix"], (4, 4)).T.astype(np.float64)
    local = np.eye(4)
    local[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
    local[:3, :3] *= node.get("scale", (1, 1, 1))
    local[:3, 3] = node.get("translation", (0, 0, 0))
    return local
